//! Where a lidar stands over time: once for the whole test, or elsewhere after its tripod was moved.

use crate::error::InvalidValue;
use crate::frame::WorldFromSensor;

/// A tripod that left its place.
#[derive(Debug, Clone, Copy)]
pub struct Move {
    /// The lidar, by its place among those that are read.
    pub lidar: usize,
    /// Until then, in nanoseconds, it stood where it was.
    pub left_ns: i64,
    /// From then on it stands in the new place; nothing is known of where it was between.
    pub from_ns: i64,
    /// Its new pose.
    pub pose: WorldFromSensor,
}

/// A stretch of time in which a lidar stood still.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// Number of the stand: that of the lidar at first, then counting on over the moves.
    pub number: usize,
    /// Pose.
    pub pose: WorldFromSensor,
    from_ns: i64,
    until_ns: i64,
}

impl Stand {
    /// Whether the lidar stands there at an instant.
    pub fn holds(&self, time_ns: i64) -> bool {
        self.from_ns <= time_ns && time_ns < self.until_ns
    }

    /// Whether it stands there at any instant of a span, both ends included.
    pub fn meets(&self, from_ns: i64, to_ns: i64) -> bool {
        self.from_ns <= to_ns && from_ns < self.until_ns
    }
}

/// All stretches of one lidar, in order of time.
#[derive(Debug, Clone)]
pub struct Stands(Vec<Stand>);

impl Stands {
    /// A lidar that stands still for ever.
    pub fn still(number: usize, pose: WorldFromSensor) -> Self {
        Self(vec![Stand {
            number,
            pose,
            from_ns: i64::MIN,
            until_ns: i64::MAX,
        }])
    }

    /// Stands of all lidars: their first poses, and all moves in order of time.
    ///
    /// # Errors
    /// [`InvalidValue`] where a move is of no lidar, ends before it begins, or is out of order.
    pub fn of(poses: &[WorldFromSensor], moves: &[Move]) -> Result<Vec<Self>, InvalidValue> {
        let still = |(number, pose): (usize, &WorldFromSensor)| Self::still(number, *pose);
        let mut stands: Vec<Self> = poses.iter().enumerate().map(still).collect();
        for (place, next) in moves.iter().enumerate() {
            let own = stands.get_mut(next.lidar).ok_or_else(|| refuse(next))?;
            own.leave(poses.len() + place, next)?;
        }
        Ok(stands)
    }

    fn leave(&mut self, number: usize, next: &Move) -> Result<(), InvalidValue> {
        match self.0.last_mut() {
            Some(last) if last.from_ns < next.left_ns && next.left_ns <= next.from_ns => {
                last.until_ns = next.left_ns;
            }
            _ => return Err(refuse(next)),
        }
        self.0.push(Stand {
            number,
            pose: next.pose,
            from_ns: next.from_ns,
            until_ns: i64::MAX,
        });
        Ok(())
    }

    /// Where the lidar stands at an instant; `None` while it is on the move.
    pub fn at(&self, time_ns: i64) -> Option<&Stand> {
        self.0.iter().find(|stand| stand.holds(time_ns))
    }

    /// Where the lidar stood at first.
    pub fn first(&self) -> &Stand {
        &self.0[0] // made with one, never emptied
    }

    /// The one stand of a lidar that never moved.
    pub fn only(&self) -> Option<&Stand> {
        match self.0.as_slice() {
            [stand] => Some(stand),
            _ => None,
        }
    }

    /// Whether the lidar moved within a span of time, both ends included.
    pub fn moves_within(&self, from_ns: i64, to_ns: i64) -> bool {
        let pairs = self.0.windows(2);
        pairs
            .into_iter()
            .any(|pair| from_ns < pair[1].from_ns && pair[0].until_ns <= to_ns)
    }

    /// Stretches in which the lidar stood still, by number and pose.
    pub fn iter(&self) -> impl Iterator<Item = &Stand> {
        self.0.iter()
    }
}

fn refuse(found: &Move) -> InvalidValue {
    InvalidValue {
        name: "moves",
        expected: "moves of the given lidars in order of time".into(),
        found: format!(
            "lidar {} from {} ns to {} ns",
            found.lidar, found.left_ns, found.from_ns
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    fn pose(x: f64) -> WorldFromSensor {
        WorldFromSensor::new(Rotation3::identity(), Vector3::new(x, 0.0, 0.0))
    }

    fn moved(lidar: usize, left_ns: i64, from_ns: i64) -> Move {
        Move {
            lidar,
            left_ns,
            from_ns,
            pose: pose(from_ns as f64),
        }
    }

    #[test]
    fn a_lidar_stands_in_one_place_until_it_leaves_it() {
        let moves = [moved(1, 10, 12), moved(0, 15, 15), moved(1, 20, 23)];
        let stands = Stands::of(&[pose(0.0), pose(1.0)], &moves).unwrap();
        let number = |lidar: usize, time| stands[lidar].at(time).map(|stand| stand.number);
        assert_eq!([number(0, i64::MIN), number(0, 14)], [Some(0), Some(0)]);
        assert_eq!([number(0, 15), number(0, i64::MAX - 1)], [Some(3), Some(3)]);
        let seen = [9, 10, 11, 12, 19, 20, 22, 23].map(|time| number(1, time));
        let expected = [1, 0, 0, 2, 2, 0, 0, 4].map(|n| (n > 0).then_some(n));
        assert_eq!(seen, expected);
        assert_eq!(stands[1].at(30).unwrap().pose.translation_m().x, 23.0);
    }

    #[test]
    fn spans_over_a_move_are_told() {
        let stands = Stands::of(&[pose(0.0)], &[moved(0, 10, 12)]).unwrap();
        let over = |from, to| stands[0].moves_within(from, to);
        assert!(over(5, 10) && over(11, 11) && over(11, 20) && over(0, 30));
        assert!(!over(0, 9) && !over(12, 20));
    }

    #[test]
    fn moves_that_make_no_sense_are_refused() {
        let of = |moves: &[Move]| Stands::of(&[pose(0.0)], moves).is_err();
        assert!(of(&[moved(1, 10, 12)])); // no such lidar
        assert!(of(&[moved(0, 12, 10)])); // arrives before it leaves
        assert!(of(&[moved(0, 10, 12), moved(0, 11, 14)])); // leaves before it arrives
    }
}
