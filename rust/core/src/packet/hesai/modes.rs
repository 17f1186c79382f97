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

/// The mode of a byte. The header of some models counts returns wrongly; this byte does not.
pub fn mode(byte: u8) -> ReturnMode {
    let known = MODES.iter().find(|(value, _)| *value == byte);
    known.map_or(ReturnMode::Strongest, |(_, mode)| *mode)
}

/// The byte of a mode.
pub fn byte(mode: ReturnMode) -> u8 {
    let known = MODES.iter().find(|(_, known)| *known == mode);
    known.map_or(0x37, |(value, _)| *value)
}
