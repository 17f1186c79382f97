//! Shots whose returns lie in two packets: where a packet has an odd number of blocks, the last block of
//! one and the first block of the next are the two returns of one firing.

use super::Tally;

/// Ranges of the blocks at the ends of a packet that are one return of a firing each, in the model's unit,
/// by laser.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Split {
    /// The first block, where its firing began in the packet before.
    pub lead: Option<Half>,
    /// The last block, where its firing goes on in the next packet.
    pub tail: Option<Half>,
}

/// One return of a firing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Half {
    /// Azimuth as the packet states it; both halves have the same.
    pub azimuth: u16,
    /// Ranges; 0 = no return.
    pub ranges: Vec<u16>,
}

impl Split {
    /// Corrects the tally of a packet that follows one with this split: echoes that repeat those of the
    /// packet before are no points.
    pub fn correct(&self, following: &Self, tally: &mut Tally) {
        let halves = self.tail.as_ref().zip(following.lead.as_ref());
        let Some((tail, lead)) = halves.filter(|(tail, lead)| tail.azimuth == lead.azimuth) else {
            return;
        };
        let pairs = tail.ranges.iter().zip(&lead.ranges);
        let repeats = pairs
            .filter(|(one, other)| **one != 0 && one == other)
            .count() as u32;
        tally.points = tally.points.saturating_sub(repeats);
        tally.merged += repeats;
    }
}

/// The packet that follows a packet without a gap.
#[derive(Debug, Clone, Copy)]
pub struct Following<'a> {
    /// Its bytes.
    pub payload: &'a [u8],
    /// Its number among the data packets of its stream.
    pub packet: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_echoes_of_one_firing_that_are_the_same_are_merged() {
        let half = |azimuth, ranges: [u16; 4]| Half {
            azimuth,
            ranges: ranges.into(),
        };
        let before = Split {
            lead: None,
            tail: Some(half(700, [0, 5, 6, 7])),
        };
        let tally_of = |azimuth| {
            let mut tally = Tally {
                points: 10,
                merged: 2,
            };
            let after = Split {
                lead: Some(half(azimuth, [0, 5, 9, 7])),
                tail: None,
            };
            before.correct(&after, &mut tally);
            (tally.points, tally.merged)
        };
        assert_eq!(tally_of(700), (8, 4));
        assert_eq!(tally_of(720), (10, 2));
    }
}
