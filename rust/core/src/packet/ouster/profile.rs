//! What stands where in one pixel, by profile.
//!
//! Source: the maker's development kit, packet formats.

/// A field of a pixel: first bit, bits, and by how many bits the value is shifted up to its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    bit: usize,
    bits: u32,
    shift: u32,
}

/// One return of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Echo {
    /// Millimetres; 0 = none.
    pub range: Field,
    /// Calibrated brightness.
    pub reflectivity: Field,
}

/// Layout of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Name as in the metadata.
    pub name: &'static str,
    /// Bytes of a pixel.
    pub pixel_len: usize,
    /// Returns of a pixel.
    pub echoes: &'static [Echo],
}

const fn field(bit: usize, bits: u32) -> Field {
    Field {
        bit,
        bits,
        shift: 0,
    }
}

/// Low data rate: ranges in steps of 8 mm.
const fn coarse(bit: usize) -> Field {
    Field {
        bit,
        bits: 15,
        shift: 3,
    }
}

const fn echo(range: Field, reflectivity_bit: usize) -> Echo {
    Echo {
        range,
        reflectivity: field(reflectivity_bit, 8),
    }
}

const RNG20: &[Echo] = &[echo(field(0, 20), 32)];
const RNG19: &[Echo] = &[echo(field(0, 19), 32)];
/// Reflectivity packed behind the flags.
const RNG19_PACKED: &[Echo] = &[echo(field(0, 19), 24)];
const RNG19_DUAL: &[Echo] = &[echo(field(0, 19), 24), echo(field(32, 19), 56)];
const RNG15: &[Echo] = &[echo(coarse(0), 16)];
const RNG15_DUAL: &[Echo] = &[echo(coarse(0), 16), echo(coarse(32), 48)];

const fn profile(name: &'static str, pixel_len: usize, echoes: &'static [Echo]) -> Profile {
    Profile {
        name,
        pixel_len,
        echoes,
    }
}

/// All profiles; the first one is the only one without a packet header.
pub const PROFILES: &[Profile] = &[
    profile("LEGACY", 12, RNG20),
    profile("RNG19_RFL8_SIG16_NIR16", 12, RNG19),
    profile("RNG19_RFL8_SIG16_NIR16_DUAL", 16, RNG19_DUAL),
    profile("RNG15_RFL8_NIR8", 4, RNG15),
    profile("RNG15_RFL8_NIR8_DUAL", 8, RNG15_DUAL),
    profile("FUSA_RNG15_RFL8_NIR8_DUAL", 8, RNG15_DUAL),
    profile("FIVE_WORD_PIXEL", 20, RNG19_DUAL),
    profile("RNG15_RFL8_NIR8_ZONE16", 8, RNG15),
    profile("RNG19_RFL8_SIG16_NIR16_ZONE16", 12, RNG19),
    profile("RNG15_RFL8_WIN8", 4, RNG15),
    profile("RNG19_RFL8_SIG16_ZONE16_DUAL", 16, RNG19_DUAL),
    profile("RNG19_RFL8_SIG16_NIR16_RGB16", 16, RNG19_PACKED),
    profile("RNG19_RFL8_SIG16_NIR16_RGB16_DUAL", 20, RNG19_DUAL),
];

impl Profile {
    /// The profile with this name.
    pub fn named(name: &str) -> Option<&'static Profile> {
        PROFILES.iter().find(|profile| profile.name == name)
    }

    /// Whether packets have no header of their own.
    pub fn is_legacy(&self) -> bool {
        self.name == PROFILES[0].name
    }
}

impl Field {
    /// Its value in a pixel; bytes that are not there count as zero.
    #[inline]
    pub fn read(self, pixel: &[u8]) -> u32 {
        let first = self.bit / 8;
        let byte = |place: usize| u32::from(pixel.get(first + place).copied().unwrap_or(0));
        let word = byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
        (word >> (self.bit % 8) & ((1 << self.bits) - 1)) << self.shift
    }

    /// Its values in pixels of so many bytes that follow each other, as `make` has them. No field
    /// reaches over the end of a word.
    pub fn read_each<T>(
        self,
        pixels: &[u8],
        pixel_len: usize,
        room: &mut [T],
        make: impl Fn(u32) -> T,
    ) {
        // Where the compiler knows the size, it reads several pixels at once.
        match pixel_len {
            4 => self.words(pixels.as_chunks::<4>().0, room, make),
            8 => self.words(pixels.as_chunks::<8>().0, room, make),
            12 => self.words(pixels.as_chunks::<12>().0, room, make),
            16 => self.words(pixels.as_chunks::<16>().0, room, make),
            len => self.words(pixels.chunks_exact(len.max(1)), room, make),
        }
    }

    #[inline(always)]
    fn words<'a, P: AsRef<[u8]> + ?Sized + 'a, T>(
        self,
        pixels: impl IntoIterator<Item = &'a P>,
        room: &mut [T],
        make: impl Fn(u32) -> T,
    ) {
        let (first, down, mask) = (self.bit / 32 * 4, self.bit % 32, (1 << self.bits) - 1);
        for (slot, pixel) in room.iter_mut().zip(pixels) {
            let word = pixel.as_ref().get(first..).and_then(<[u8]>::first_chunk);
            let word = word.map_or(0, |bytes| u32::from_le_bytes(*bytes));
            *slot = make((word >> down & mask) << self.shift);
        }
    }

    /// Writes a value into a pixel; what does not fit is cut off.
    pub fn write(self, pixel: &mut [u8], value: u32) {
        let mask = ((1_u64 << self.bits) - 1) << (self.bit % 8);
        let bits = u64::from(value >> self.shift) << (self.bit % 8) & mask;
        let bytes = pixel.iter_mut().skip(self.bit / 8).take(4);
        for (place, byte) in bytes.enumerate() {
            *byte = *byte & !((mask >> (8 * place)) as u8) | (bits >> (8 * place)) as u8;
        }
    }

    /// Largest value.
    pub fn most(self) -> u32 {
        ((1 << self.bits) - 1) << self.shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_back_and_do_not_touch_each_other() {
        for profile in PROFILES {
            let mut pixel = vec![0xA5; profile.pixel_len];
            for echo in profile.echoes {
                echo.range.write(&mut pixel, echo.range.most());
                echo.reflectivity.write(&mut pixel, 0x5C);
            }
            for echo in profile.echoes {
                assert_eq!(echo.range.read(&pixel), echo.range.most(), "{profile:?}");
                assert_eq!(echo.reflectivity.read(&pixel), 0x5C, "{profile:?}");
            }
        }
    }

    #[test]
    fn pixels_read_at_once_are_those_read_one_by_one() {
        for profile in PROFILES {
            let length = 5 * profile.pixel_len;
            let bytes: Vec<u8> = (0..length).map(|place| (place * 37 % 251) as u8).collect();
            let fields = profile.echoes.iter();
            for field in fields.flat_map(|echo| [echo.range, echo.reflectivity]) {
                let mut each = [0; 5];
                field.read_each(&bytes, profile.pixel_len, &mut each, |value| value);
                let single = bytes.chunks_exact(profile.pixel_len);
                assert!(
                    single.map(|pixel| field.read(pixel)).eq(each),
                    "{profile:?}"
                );
            }
        }
    }

    #[test]
    fn low_data_ranges_are_in_steps_of_eight_millimetres() {
        let [echo] = RNG15 else { unreachable!() };
        assert_eq!(echo.range.read(&[0x05, 0x80, 200, 0]), 40); // 5 x 8 mm; the top bit is a flag
        assert_eq!(echo.reflectivity.read(&[0x05, 0x80, 200, 0]), 200);
    }
}
