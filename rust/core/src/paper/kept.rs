//! Frames that the first pass keeps for the second, as far as memory may be spent on them.

use std::collections::VecDeque;

use super::frames::{Frame, Share};
use crate::time::Timestamp;

/// Frames from the first on, and where the second pass has to read on.
#[derive(Debug)]
pub struct KeptFrames {
    frames: VecDeque<Frame>,
    room_bytes: usize,
    next: Option<Timestamp>,
}

impl KeptFrames {
    /// Keeps frames until they fill so many bytes.
    pub fn new(room_bytes: usize) -> Self {
        Self {
            frames: VecDeque::new(),
            room_bytes,
            next: None,
        }
    }

    /// Keeps the next frames, or remembers the first one for which there is no room.
    pub fn extend(&mut self, frames: Vec<Frame>) {
        for frame in frames {
            let bytes: usize = frame.shares.iter().map(bytes_of).sum();
            if self.next.is_none() && bytes <= self.room_bytes {
                self.room_bytes -= bytes;
                self.frames.push_back(frame);
            } else {
                self.next.get_or_insert(frame.time);
            }
        }
    }

    /// The next `count` frames, fewer at the end.
    pub fn take(&mut self, count: usize) -> Vec<Frame> {
        let count = count.min(self.frames.len());
        self.frames.drain(..count).collect()
    }

    /// The first frame that was not kept; `None` where all were.
    pub fn next(&self) -> Option<Timestamp> {
        self.next
    }
}

fn bytes_of(share: &Share) -> usize {
    size_of::<Share>() + size_of_val(&*share.points_m) + size_of_val(&*share.rings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: i64, points: usize) -> Frame {
        let share = Share {
            points_m: vec![[0.0; 3]; points],
            rings: vec![0; points],
            ..Share::default()
        };
        Frame {
            time: Timestamp(time),
            shares: vec![share],
        }
    }

    #[test]
    fn frames_are_kept_in_order_until_the_first_that_has_no_room() {
        let mut kept = KeptFrames::new(2 * (100 * 14 + size_of::<Share>()));
        kept.extend(vec![frame(1, 100), frame(2, 100), frame(3, 100)]);
        kept.extend(vec![frame(4, 0)]);
        assert_eq!(kept.next(), Some(Timestamp(3)));
        assert_eq!(kept.take(1)[0].time, Timestamp(1));
        assert_eq!(kept.take(5).len(), 1);
        assert!(kept.take(5).is_empty());
    }
}
