//! Which cells or points hang together: union-find that many threads may feed at once.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A forest over 0..n; every tree is one component and its root its smallest member, so the result
/// does not depend on the order of the unions.
pub struct Components(Vec<AtomicU32>);

impl Components {
    /// `count` components of one member each.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).map(AtomicU32::new).collect())
    }

    /// Smallest member of the component of `member` as far as the unions have come.
    #[inline]
    pub fn root(&self, mut member: u32) -> u32 {
        loop {
            let parent = self.0[member as usize].load(Relaxed);
            if parent == member {
                return member;
            }
            let above = self.0[parent as usize].load(Relaxed);
            if above != parent {
                // Shortens the path. Parents only ever get smaller, so a lost race does no harm.
                self.0[member as usize].fetch_min(above, Relaxed);
            }
            member = parent;
        }
    }

    /// Whether `member` is known to be in the component of `root`; mostly one look.
    #[inline]
    pub fn is_under(&self, root: u32, member: u32) -> bool {
        self.0[member as usize].load(Relaxed) == root || self.root(member) == root
    }

    /// Makes one component of two.
    pub fn join(&self, mut a: u32, mut b: u32) {
        loop {
            (a, b) = (self.root(a), self.root(b));
            if a == b {
                return;
            }
            let (low, high) = (a.min(b), a.max(b));
            let hung = self.0[high as usize].compare_exchange(high, low, Relaxed, Relaxed);
            if hung.is_ok() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn roots_are_the_smallest_members() {
        let components = Components::new(6);
        components.join(5, 3);
        components.join(3, 1);
        components.join(4, 2);
        let roots: Vec<u32> = (0..6).map(|i| components.root(i)).collect();
        assert_eq!(roots, [0, 1, 2, 1, 2, 1]);
        assert!(components.is_under(1, 5) && !components.is_under(2, 5));
    }

    #[test]
    fn unions_from_many_threads_end_in_one_chain() {
        let count = 50_000;
        let components = Components::new(count as usize);
        (1..count)
            .into_par_iter()
            .for_each(|i| components.join(i, i - 1));
        assert!((0..count).all(|i| components.root(i) == 0));
    }
}
