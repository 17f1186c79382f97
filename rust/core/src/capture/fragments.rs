//! The pool in which IP fragments wait for one another, bounded in age and bytes.

use std::collections::{HashMap, VecDeque};
use std::net::IpAddr;

use super::assembly::{Added, Assembly};
use super::facts::FragmentFacts;
use super::ip::Fragment;
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Longest wait in capture time. An identification of 16 bits comes again after 51 s at the fastest
/// sensor's 1280 datagrams per second.
const MAX_AGE_NS: i64 = 2 * NANOS_PER_SECOND;
/// Bytes that may wait: over a thousand of the largest lidar packets.
const MAX_WAITING_BYTES: usize = 32 * 1024 * 1024;
/// What an assembly costs beside its bytes.
const OVERHEAD: usize = 512;
/// Completed datagrams that are remembered, to know their late duplicates.
const REMEMBERED: usize = 32;

/// What the fragments of one datagram have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Key {
    pub source: IpAddr,
    pub destination: IpAddr,
    /// Protocol of IPv4; 0 for IPv6, where only the first fragment knows it.
    pub protocol: u8,
    pub identification: u32,
    pub vlan: u32,
}

/// Datagrams on their way back from fragments.
#[derive(Debug, Default)]
pub(crate) struct FragmentPool {
    waiting: HashMap<Key, Assembly>,
    /// Keys and serials by age; those that have completed stay until they reach the front.
    by_age: VecDeque<(Key, u64, Timestamp)>,
    done: VecDeque<(Key, Assembly)>,
    spare: Vec<Assembly>,
    waiting_bytes: usize,
    next_serial: u64,
    facts: FragmentFacts,
}

impl FragmentPool {
    /// Adds one fragment that came at `time`; on [`Added::Complete`] the whole stands in
    /// [`FragmentPool::completed`].
    pub(crate) fn push(
        &mut self,
        key: Key,
        protocol: u8,
        part: Fragment,
        body: &[u8],
        time: Timestamp,
    ) -> Added {
        self.facts.fragments += 1;
        self.expire(time);
        if !self.waiting.contains_key(&key) {
            if self.is_late_duplicate(&key, part, body, time) {
                self.facts.duplicates += 1;
                return Added::Duplicate;
            }
            self.begin(key, time);
        }
        let mut added = self.add(&key, protocol, part, body);
        if added == Added::Duplicate && !self.holds(&key, part, body) {
            // Other bytes at the same place: the identification came again, before its time.
            self.abandon(&key);
            self.begin(key, time);
            added = self.add(&key, protocol, part, body);
        }
        match added {
            Added::Complete => self.finish(key),
            Added::Duplicate => self.facts.duplicates += 1,
            Added::Waiting | Added::Contradiction => {}
        }
        self.shrink();
        added
    }

    /// Bytes and protocol of the datagram that completed last.
    pub(crate) fn completed(&self) -> (&[u8], u8) {
        self.done
            .back()
            .map_or((&[], 0), |(_, whole)| (whole.bytes(), whole.protocol))
    }

    /// Gives up all that wait, as at the end of a capture.
    pub(crate) fn give_up(&mut self) {
        while self.evict_oldest() {}
    }

    /// Counts so far.
    pub(crate) fn facts(&self) -> FragmentFacts {
        self.facts
    }

    fn begin(&mut self, key: Key, time: Timestamp) {
        let mut assembly = self.spare.pop().unwrap_or_default();
        assembly.restart(time, self.next_serial);
        self.by_age.push_back((key, self.next_serial, time));
        self.next_serial += 1;
        self.waiting_bytes += OVERHEAD;
        self.waiting.insert(key, assembly);
    }

    fn add(&mut self, key: &Key, protocol: u8, part: Fragment, body: &[u8]) -> Added {
        let Some(assembly) = self.waiting.get_mut(key) else {
            return Added::Contradiction; // not reached: push made it
        };
        let before = assembly.bytes().len();
        let added = assembly.add(part.offset, body, part.more);
        if part.offset == 0 && added != Added::Contradiction {
            assembly.protocol = protocol;
        }
        self.waiting_bytes += assembly.bytes().len() - before;
        added
    }

    fn finish(&mut self, key: Key) {
        let Some(assembly) = self.waiting.remove(&key) else {
            return;
        };
        self.waiting_bytes -= assembly.bytes().len() + OVERHEAD;
        self.facts.datagrams += 1;
        self.done.push_back((key, assembly));
        if self.done.len() > REMEMBERED
            && let Some((_, old)) = self.done.pop_front()
        {
            self.spare.push(old);
        }
    }

    /// Whether the fragment belongs to a datagram that is complete already. Its bytes are compared,
    /// because some senders use one identification for all.
    fn is_late_duplicate(&self, key: &Key, part: Fragment, body: &[u8], time: Timestamp) -> bool {
        self.done.iter().rev().any(|(done, whole)| {
            done == key && !is_old(whole.started, time) && whole.holds(part.offset, body)
        })
    }

    fn holds(&self, key: &Key, part: Fragment, body: &[u8]) -> bool {
        let assembly = self.waiting.get(key);
        assembly.is_some_and(|assembly| assembly.holds(part.offset, body))
    }

    fn expire(&mut self, now: Timestamp) {
        while self
            .by_age
            .front()
            .is_some_and(|&(_, _, started)| is_old(started, now))
        {
            self.evict_oldest();
        }
    }

    fn shrink(&mut self) {
        while self.waiting_bytes > MAX_WAITING_BYTES && self.evict_oldest() {}
        // Completed keys at the front would pile up where nothing ever expires: stamps of zero.
        while self.by_age.len() > 2 * self.waiting.len() + REMEMBERED {
            let waiting = &self.waiting;
            self.by_age
                .retain(|(key, serial, _)| waiting.get(key).is_some_and(|a| a.serial == *serial));
        }
    }

    /// Takes the front of the queue; counts it where it was still waiting. `false`: empty.
    fn evict_oldest(&mut self) -> bool {
        let Some((key, serial, _)) = self.by_age.pop_front() else {
            return false;
        };
        if self
            .waiting
            .get(&key)
            .is_some_and(|assembly| assembly.serial == serial)
        {
            self.abandon(&key);
        }
        true
    }

    /// Gives up a datagram that waits.
    fn abandon(&mut self, key: &Key) {
        let Some(assembly) = self.waiting.remove(key) else {
            return;
        };
        self.waiting_bytes -= assembly.bytes().len() + OVERHEAD;
        self.facts.incomplete += 1;
        if self.spare.len() < REMEMBERED {
            self.spare.push(assembly);
        }
    }
}

/// Stamps of a capture may jump back: both directions count.
fn is_old(started: Timestamp, now: Timestamp) -> bool {
    (now - started).saturating_abs() > MAX_AGE_NS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(identification: u32) -> Key {
        Key {
            source: IpAddr::from([10, 0, 0, 1]),
            destination: IpAddr::from([10, 0, 0, 2]),
            protocol: 17,
            identification,
            vlan: 0,
        }
    }

    fn push(
        pool: &mut FragmentPool,
        id: u32,
        offset: usize,
        more: bool,
        fill: u8,
        ns: i64,
    ) -> Added {
        let part = Fragment {
            identification: id,
            offset,
            more,
        };
        pool.push(key(id), 17, part, &[fill; 8], Timestamp(ns))
    }

    #[test]
    fn interleaved_datagrams_come_back() {
        let mut pool = FragmentPool::default();
        assert_eq!(push(&mut pool, 1, 8, false, 1, 0), Added::Waiting);
        assert_eq!(push(&mut pool, 2, 0, true, 2, 1), Added::Waiting);
        assert_eq!(push(&mut pool, 1, 0, true, 3, 2), Added::Complete);
        assert_eq!(pool.completed().0, [[3; 8], [1; 8]].concat());
        assert_eq!(push(&mut pool, 2, 8, false, 4, 3), Added::Complete);
        assert_eq!(pool.completed(), (&[[2; 8], [4; 8]].concat()[..], 17));
        pool.give_up();
        assert_eq!((pool.facts().datagrams, pool.facts().incomplete), (2, 0));
    }

    #[test]
    fn duplicates_behind_the_last_fragment_begin_nothing() {
        let mut pool = FragmentPool::default();
        for _ in 0..2 {
            push(&mut pool, 1, 0, true, 1, 0);
        }
        for _ in 0..2 {
            push(&mut pool, 1, 8, false, 2, 0);
        }
        pool.give_up();
        let facts = pool.facts();
        assert_eq!(
            (facts.datagrams, facts.duplicates, facts.incomplete),
            (1, 2, 0)
        );
    }

    #[test]
    fn one_identification_for_all_is_survived() {
        let mut pool = FragmentPool::default();
        for n in 0..100 {
            assert_eq!(push(&mut pool, 0, 0, true, 2 * n, 0), Added::Waiting);
            assert_eq!(push(&mut pool, 0, 8, false, 2 * n + 1, 0), Added::Complete);
        }
        assert_eq!(pool.facts().datagrams, 100);
    }

    #[test]
    fn an_identification_that_comes_again_mixes_nothing() {
        let mut pool = FragmentPool::default();
        push(&mut pool, 0, 0, true, 1, 0);
        push(&mut pool, 0, 8, true, 2, 0);
        // The last fragment is lost; the next datagram has the same identification.
        assert_eq!(push(&mut pool, 0, 0, true, 5, 1), Added::Waiting);
        assert_eq!(push(&mut pool, 0, 8, true, 6, 1), Added::Waiting);
        assert_eq!(push(&mut pool, 0, 16, false, 7, 1), Added::Complete);
        assert_eq!(pool.completed().0, [[5; 8], [6; 8], [7; 8]].concat());
        pool.give_up();
        let facts = pool.facts();
        assert_eq!(
            (facts.datagrams, facts.duplicates, facts.incomplete),
            (1, 0, 1)
        );
        assert_eq!(pool.waiting_bytes, 0);
    }

    #[test]
    fn waiting_ends_after_two_seconds_of_capture_time() {
        let mut pool = FragmentPool::default();
        push(&mut pool, 1, 0, true, 1, 0);
        push(&mut pool, 2, 0, true, 1, MAX_AGE_NS);
        assert_eq!(pool.facts().incomplete, 0);
        push(&mut pool, 2, 8, true, 1, MAX_AGE_NS + 1);
        assert_eq!(pool.facts().incomplete, 1);
        assert_eq!(
            push(&mut pool, 1, 8, false, 1, MAX_AGE_NS + 2),
            Added::Waiting
        );
        // The clock of the recording machine was set back by an hour.
        push(&mut pool, 3, 0, true, 1, -3600 * NANOS_PER_SECOND);
        assert_eq!(pool.facts().incomplete, 3);
    }

    #[test]
    fn bytes_are_bounded() {
        let mut pool = FragmentPool::default();
        for id in 0..5000 {
            let part = Fragment {
                identification: id,
                offset: 60_000,
                more: true,
            };
            pool.push(key(id), 17, part, &[0; 800], Timestamp(0));
            assert!(pool.waiting_bytes <= MAX_WAITING_BYTES);
        }
        let most = MAX_WAITING_BYTES / (60_800 + OVERHEAD);
        assert_eq!(pool.waiting.len(), most);
        assert_eq!(pool.facts().incomplete, 5000 - most as u64);
        pool.give_up();
        assert_eq!(pool.waiting_bytes, 0);
    }

    #[test]
    fn the_queue_of_ages_is_bounded_without_time() {
        let mut pool = FragmentPool::default();
        for id in 0..10_000 {
            push(&mut pool, id, 0, true, 1, 0);
            push(&mut pool, id, 8, false, 2, 0);
        }
        assert!(pool.by_age.len() <= REMEMBERED + 2, "{}", pool.by_age.len());
        assert_eq!(pool.facts().datagrams, 10_000);
    }
}
