//! Sequence numbers that start again with every frame of a sensor, counted on over the whole stream.
//!
//! Where a number falls while time goes on by one packet, the frame before had as many packets as the
//! number before says: so frames that are shorter or longer than the maker states are learned. Over lost
//! packets the number tells the place in the frame, and time how many frames have passed.

/// How sequence numbers start again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restarts {
    /// Every frame has the same numbers.
    EveryFrame,
    /// They run through 16 bits, or start again with frames that differ in length by a packet.
    Perhaps,
}

/// A number falls by at least so much where frames end.
const LEAST_PACKETS: i64 = 8;

/// The state of one stream.
#[derive(Debug, Clone)]
pub struct Cycle {
    restarts: Restarts,
    /// Packets of a frame.
    len: i64,
    /// Number of its first packet.
    first: i64,
    is_learned: bool,
    last: Option<(i64, i64)>,
}

impl Cycle {
    /// Frames of `len` packets, the first of them numbered `first`.
    pub fn new(restarts: Restarts, first: u32, len: i64) -> Self {
        Self {
            restarts,
            len: len.max(LEAST_PACKETS),
            first: first.into(),
            is_learned: false,
            last: None,
        }
    }

    /// Number of a packet among all of the stream; `elapsed` is the time since the packet before in
    /// periods of packets.
    pub fn key(&mut self, number: u32, elapsed: f64) -> i64 {
        let number = i64::from(number);
        let Some((before, key)) = self.last else {
            self.widen(number);
            self.last = Some((number, number));
            return number;
        };
        let is_next = (0.5..1.5).contains(&elapsed);
        if is_next && before - number >= LEAST_PACKETS {
            self.first = number;
            self.len = before - number + 1;
            self.is_learned = true;
        } else {
            self.widen(number);
        }
        let passed = elapsed.clamp(-1e15, 1e15);
        let is_restart = number < before && passed > 0.5;
        let ahead = if is_restart && self.restarts == Restarts::Perhaps {
            passed.round() as i64
        } else {
            let within = (number - before).rem_euclid(self.len);
            let frames = ((passed - within as f64) / self.len as f64).round();
            within + frames as i64 * self.len
        };
        let key = key.saturating_add(ahead);
        self.last = Some((number, key));
        key
    }

    /// Place of a number in its frame, and packets of a frame, where those were learned.
    pub fn place(&self, number: u32) -> Option<(i64, i64)> {
        let is_known = self.is_learned && self.restarts == Restarts::EveryFrame;
        let place = (i64::from(number) - self.first).rem_euclid(self.len);
        is_known.then_some((place, self.len))
    }

    fn widen(&mut self, number: i64) {
        self.len = self.len.max(number - self.first + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of packets that are sent one period apart.
    fn keys(cycle: &mut Cycle, sent: impl Iterator<Item = (i64, u32)>) -> Vec<i64> {
        let mut before = None;
        let mut key = |(time, number): (i64, u32)| {
            let elapsed = time - before.unwrap_or(time);
            before = Some(time);
            cycle.key(number, elapsed as f64)
        };
        sent.map(&mut key).collect()
    }

    #[test]
    fn frames_of_another_length_than_stated_are_learned() {
        for (len, first) in [(315, 1), (630, 0), (700, 1)] {
            let mut cycle = Cycle::new(Restarts::EveryFrame, 1, 630);
            let sent = (0..3000).map(|time| (time, (time % len) as u32 + first));
            let found = keys(&mut cycle, sent);
            assert!(found.windows(2).all(|pair| pair[1] - pair[0] == 1), "{len}");
            assert_eq!(cycle.place(first + 5), Some((5, len)));
        }
    }

    fn assert_one_offset(found: &[i64], times: &[i64]) {
        let offset = found[0] - times[0];
        let mut pairs = found.iter().zip(times);
        assert!(pairs.all(|(key, time)| key - time == offset));
    }

    #[test]
    fn losses_over_the_ends_of_frames_and_over_many_frames_are_exact() {
        let lost = [629..632, 1000..1001, 1259..1261, 2000..5000];
        let times: Vec<i64> = (0..7000)
            .filter(|time| lost.iter().all(|range| !range.contains(time)))
            .collect();
        let mut cycle = Cycle::new(Restarts::EveryFrame, 1, 630);
        let found = keys(&mut cycle, times.iter().map(|t| (*t, (t % 630) as u32 + 1)));
        assert_one_offset(&found, &times);
    }

    #[test]
    fn late_and_repeated_packets_keep_their_numbers() {
        let times = [
            624, 625, 625, 627, 626, 631, 629, 630, 632, 1261, 1260, 1262,
        ];
        let mut cycle = Cycle::new(Restarts::EveryFrame, 1, 630);
        let found = keys(&mut cycle, times.iter().map(|t| (*t, (t % 630) as u32 + 1)));
        assert_one_offset(&found, &times);
    }

    #[test]
    fn sixteen_bits_wrap_and_frames_may_differ_by_a_packet() {
        let mut cycle = Cycle::new(Restarts::Perhaps, 0, 1 << 16);
        let sent = (0..200_000).filter(|time| time % 999 != 7);
        let found = keys(&mut cycle, sent.clone().map(|t| (t, (t % 65_536) as u32)));
        assert!(found.into_iter().eq(sent));
        // Frames of 208 and 209 packets in turn, with a loss over one of their ends.
        let number = |time: i64| match time % 417 {
            early @ 0..208 => early as u32,
            late => (late - 208) as u32,
        };
        let mut cycle = Cycle::new(Restarts::Perhaps, 0, 1 << 16);
        let sent = (0..5000).filter(|time| !(1250..1255).contains(time));
        let found = keys(&mut cycle, sent.clone().map(|t| (t, number(t))));
        assert!(found.into_iter().eq(sent));
    }

    #[test]
    fn no_number_and_no_time_overflow() {
        let mut cycle = Cycle::new(Restarts::EveryFrame, 1, 630);
        for (number, elapsed) in [(0, 0.0), (u32::MAX, 1e300), (3, -1e300), (9, f64::NAN)] {
            cycle.key(number, elapsed);
            let _ = cycle.place(number);
        }
    }
}
