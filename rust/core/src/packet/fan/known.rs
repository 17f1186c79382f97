//! Fans that come again and again, each worked out once.

use super::Fan;

/// Rotors keep within a few hundredths of a degree, so that few steps come again and again.
const MOST: usize = 32;

/// The last fans, each with what it depends on.
#[derive(Debug, Clone, Default)]
pub struct Known<K> {
    fans: Vec<(K, Fan)>,
    /// Which of them is given up next.
    oldest: usize,
}

impl<K: PartialEq> Known<K> {
    /// The fan that depends on `key`, made by `make` where it is not known.
    pub fn get(&mut self, key: K, make: impl FnOnce() -> Fan) -> &Fan {
        let known = self.fans.iter().position(|(other, _)| *other == key);
        let place = known.unwrap_or_else(|| self.add((key, make())));
        &self.fans[place].1
    }

    fn add(&mut self, fan: (K, Fan)) -> usize {
        if self.fans.len() < MOST {
            self.fans.push(fan);
            return self.fans.len() - 1;
        }
        let place = self.oldest;
        self.oldest = (self.oldest + 1) % MOST;
        self.fans[place] = fan;
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::fan::Beam;

    #[test]
    fn a_fan_is_made_once_until_too_many_others_were() {
        let mut known = Known::default();
        let mut made = Vec::new();
        let keys = [0, 1, 0].into_iter().chain(1..=MOST).chain([0]);
        for key in keys {
            let make = || {
                made.push(key);
                (0..key).map(|_| Beam::default()).collect()
            };
            assert_eq!(known.get(key, make).len(), key);
        }
        let expected: Vec<usize> = (0..=MOST).chain([0]).collect();
        assert_eq!(made, expected);
    }
}
