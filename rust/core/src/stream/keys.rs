//! A quick hash for the few addresses and ports that every datagram is looked up by.

use std::hash::Hasher;

/// Odd and without a pattern: the golden ratio.
const FACTOR: u64 = 0x9E37_79B9_7F4A_7C15;
/// Bits that the upper half is turned by between two words.
const TURN: u32 = 26;

/// Mixes words by multiplication. A capture made to collide gains little: scans follow a bounded number of streams.
#[derive(Debug, Default)]
pub struct KeyHasher(u64);

impl KeyHasher {
    fn add(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(TURN) ^ word).wrapping_mul(FACTOR);
    }
}

impl Hasher for KeyHasher {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let word = chunk
                .iter()
                .fold(0, |word, byte| word << 8 | u64::from(*byte));
            self.add(word);
        }
    }

    fn write_u8(&mut self, word: u8) {
        self.add(word.into());
    }

    fn write_u16(&mut self, word: u16) {
        self.add(word.into());
    }

    fn write_u32(&mut self, word: u32) {
        self.add(word.into());
    }

    fn write_u64(&mut self, word: u64) {
        self.add(word);
    }

    fn write_isize(&mut self, word: isize) {
        self.add(word as u64);
    }

    fn write_usize(&mut self, word: usize) {
        self.add(word as u64);
    }

    fn finish(&self) -> u64 {
        self.0.rotate_left(TURN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::StreamKey;
    use std::collections::HashSet;
    use std::hash::{BuildHasher, BuildHasherDefault};

    #[test]
    fn neighbouring_addresses_and_ports_fall_apart() {
        let build = BuildHasherDefault::<KeyHasher>::default();
        let key = |host: u8, port: u16| StreamKey {
            address: [192, 168, 1, host].into(),
            port,
            source_port: None,
        };
        let keys = (0..64).flat_map(|host| (2368..2432).map(move |port| key(host, port)));
        let hashes: Vec<u64> = keys.map(|key| build.hash_one(key)).collect();
        let different = |of: fn(u64) -> u64| hashes.iter().map(|h| of(*h)).collect::<HashSet<_>>();
        assert_eq!(different(|hash| hash).len(), 4096);
        // A table takes the lowest bits for the place and the highest for a first look: 4096 keys over 4096 places
        // fill 63 % of them where nothing is alike.
        assert!(different(|hash| hash & 4095).len() > 2300);
        assert!(different(|hash| hash >> 57).len() == 128);
    }
}
