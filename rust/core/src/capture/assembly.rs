//! One datagram on its way back from fragments.

use crate::time::Timestamp;

/// Largest body of an IP packet.
const MAX_LEN: usize = 65_535;

/// What one more fragment did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Added {
    /// New bytes; others are missing still.
    Waiting,
    /// New bytes, and the last that were missing.
    Complete,
    /// Nothing new.
    Duplicate,
    /// It contradicts those before it.
    Contradiction,
}

/// Bytes of one datagram and which of them have come. Where fragments overlap the first one stays.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    /// Arrival of the first fragment.
    pub started: Timestamp,
    /// Which of several assemblies of one key this is.
    pub serial: u64,
    /// Protocol as the fragment at offset 0 names it.
    pub protocol: u8,
    buffer: Vec<u8>,
    /// Half-open intervals that have come: sorted, apart from one another.
    covered: Vec<(usize, usize)>,
    total: Option<usize>,
}

impl Assembly {
    /// Makes it ready for another datagram, keeping its memory.
    pub(crate) fn restart(&mut self, started: Timestamp, serial: u64) {
        self.started = started;
        self.serial = serial;
        self.protocol = 0;
        self.buffer.clear();
        self.covered.clear();
        self.total = None;
    }

    /// The bytes, whole once [`Added::Complete`] was returned.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.buffer
    }

    /// Whether these bytes have come already, the same at the same place.
    pub(crate) fn holds(&self, offset: usize, body: &[u8]) -> bool {
        self.buffer.get(offset..offset + body.len()) == Some(body)
    }

    /// Adds `body` at byte `offset`; `more` says whether others follow behind it.
    pub(crate) fn add(&mut self, offset: usize, body: &[u8], more: bool) -> Added {
        let stop = offset + body.len();
        if self.contradicts(stop, body.len(), more) {
            return Added::Contradiction;
        }
        if !more {
            self.total = Some(stop);
        }
        if self.buffer.len() < stop {
            self.buffer.resize(stop, 0);
        }
        let fresh = self.fill(offset, body);
        match self.total {
            Some(total) if fresh && self.covered == [(0, total)] => Added::Complete,
            _ if fresh => Added::Waiting,
            _ => Added::Duplicate,
        }
    }

    fn contradicts(&self, stop: usize, len: usize, more: bool) -> bool {
        let known_end = match self.total {
            Some(total) => stop > total || (!more && stop != total),
            None => !more && stop < self.buffer.len(),
        };
        // Only the last fragment may end off a multiple of 8: no other could follow it.
        known_end || stop > MAX_LEN || len == 0 || (more && !len.is_multiple_of(8))
    }

    /// Copies those parts of `body` that have not come yet. `false`: all had.
    fn fill(&mut self, offset: usize, body: &[u8]) -> bool {
        let stop = offset + body.len();
        let first = self.covered.partition_point(|&(_, end)| end < offset);
        let mut last = first;
        let (mut merged_start, mut merged_stop) = (offset, stop);
        let mut at = offset;
        let mut fresh = false;
        while let Some(&(start, end)) = self.covered.get(last).filter(|(start, _)| *start <= stop) {
            if at < start {
                self.buffer[at..start].copy_from_slice(&body[at - offset..start - offset]);
                fresh = true;
            }
            at = at.max(end);
            merged_start = merged_start.min(start);
            merged_stop = merged_stop.max(end);
            last += 1;
        }
        if at < stop {
            self.buffer[at..stop].copy_from_slice(&body[at - offset..]);
            fresh = true;
        }
        self.covered
            .splice(first..last, [(merged_start, merged_stop)]);
        fresh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn whole(len: usize) -> Vec<u8> {
        (0..len).map(|i| (i * 7 % 251) as u8).collect()
    }

    #[test]
    fn the_first_of_two_overlapping_fragments_stays() {
        let mut assembly = Assembly::default();
        assert_eq!(assembly.add(8, &[1; 16], true), Added::Waiting);
        assert_eq!(assembly.add(0, &[2; 16], true), Added::Waiting);
        assert_eq!(assembly.add(16, &[3; 12], false), Added::Complete);
        assert_eq!(
            assembly.bytes(),
            [[2; 8].as_slice(), &[1; 16], &[3; 4]].concat()
        );
    }

    #[test]
    fn contradictions_change_nothing() {
        let mut assembly = Assembly::default();
        assert_eq!(assembly.add(16, &[1; 4], false), Added::Waiting);
        assert_eq!(
            assembly.add(16, &[1; 8], true),
            Added::Contradiction,
            "beyond the end"
        );
        assert_eq!(
            assembly.add(8, &[1; 4], false),
            Added::Contradiction,
            "another end"
        );
        assert_eq!(
            assembly.add(0, &[1; 7], true),
            Added::Contradiction,
            "off the grid of 8"
        );
        assert_eq!(
            assembly.add(65_528, &[1; 8], false),
            Added::Contradiction,
            "too long"
        );
        assert_eq!(assembly.add(0, &[], true), Added::Contradiction, "empty");
        assert_eq!(assembly.add(0, &[2; 16], true), Added::Complete);
    }

    proptest! {
        /// Whatever is cut, doubled, made to overlap and shuffled comes back whole, once.
        #[test]
        fn any_order_any_overlap(
            len in 1usize..4000,
            cuts in prop::collection::vec((0usize..500, 1usize..500), 0..40),
            seed in any::<u64>(),
        ) {
            let whole = whole(len);
            let mut parts: Vec<(usize, usize)> = (0..len).step_by(800).map(|at| (at, (at + 800).min(len))).collect();
            // Further parts at any place on the grid of 8, over what is there already.
            parts.extend(cuts.iter().map(|(start, units)| (start * 8, (start + units) * 8))
                .map(|(start, stop)| (start, stop.min(len))).filter(|(start, stop)| start < stop));
            shuffle(&mut parts, seed);
            let mut assembly = Assembly::default();
            let mut completed = 0;
            for (start, stop) in parts {
                let added = assembly.add(start, &whole[start..stop], stop < len);
                prop_assert!(added != Added::Contradiction);
                completed += usize::from(added == Added::Complete);
            }
            prop_assert_eq!(completed, 1);
            prop_assert_eq!(assembly.bytes(), &whole[..]);
        }

        /// Nothing that a wire may say panics or makes the buffer exceed a packet.
        #[test]
        fn hostile_fragments_are_bounded(
            parts in prop::collection::vec((0usize..8192, 0usize..9000, any::<bool>()), 0..60),
        ) {
            let mut assembly = Assembly::default();
            for (units, len, more) in parts {
                assembly.add(units * 8, &vec![0; len], more);
                prop_assert!(assembly.bytes().len() <= MAX_LEN);
            }
        }
    }

    fn shuffle<T>(items: &mut [T], mut seed: u64) {
        for i in (1..items.len()).rev() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            items.swap(i, (seed >> 33) as usize % (i + 1));
        }
    }
}
