//! The byte of the return mode.

use crate::packet::ReturnMode;

const MODES: [(u8, ReturnMode); 11] = [
    (0x33, ReturnMode::First),
    (0x34, ReturnMode::Second),
    (0x37, ReturnMode::Strongest),
    (0x38, ReturnMode::Last),
    (0x39, ReturnMode::Dual),
    (0x3A, ReturnMode::FirstSecond),
    (0x3B, ReturnMode::FirstLast),
    (0x3C, ReturnMode::FirstStrongest),
    (0x3D, ReturnMode::Triple),
    (0x3E, ReturnMode::StrongestSecond),
    // Third and fourth return: some single one.
    (0x35, ReturnMode::Strongest),
];

static BY_BYTE: [ReturnMode; 256] = {
    let mut modes = [ReturnMode::Strongest; 256];
    let mut place = 0;
    while place < MODES.len() {
        let (byte, mode) = MODES[place];
        modes[byte as usize] = mode;
        place += 1;
    }
    modes
};

/// The mode of a byte. The header of some models counts returns wrongly; this byte does not.
#[inline]
pub fn mode(byte: u8) -> ReturnMode {
    BY_BYTE[usize::from(byte)]
}

/// The byte of a mode.
pub fn byte(mode: ReturnMode) -> u8 {
    let known = MODES.iter().find(|(_, known)| *known == mode);
    known.map_or(0x37, |(value, _)| *value)
}
