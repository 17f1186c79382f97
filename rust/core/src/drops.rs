//! What was left out, by reason: nothing is dropped silently.

use std::collections::BTreeMap;

/// Counts of dropped records, packets or points by reason.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Drops(BTreeMap<&'static str, u64>);

impl Drops {
    /// Counts `count` more drops for `reason`, a short `snake_case` word.
    pub fn add(&mut self, reason: &'static str, count: u64) {
        if count > 0 {
            *self.0.entry(reason).or_default() += count;
        }
    }

    /// Takes over the counts of another part of the chain.
    pub fn merge(&mut self, other: &Drops) {
        for (reason, count) in &other.0 {
            self.add(reason, *count);
        }
    }

    /// How many were dropped for `reason`.
    pub fn count(&self, reason: &str) -> u64 {
        self.0.get(reason).copied().unwrap_or(0)
    }

    /// Reasons in alphabetical order with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        self.0.iter().map(|(reason, count)| (*reason, *count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_over_parts() {
        let mut all = Drops::default();
        all.add("foreign", 2);
        let mut part = Drops::default();
        part.add("foreign", 3);
        part.add("truncated", 0);
        all.merge(&part);
        assert_eq!(all.iter().collect::<Vec<_>>(), [("foreign", 5)]);
        assert_eq!(all.count("truncated"), 0);
    }
}
