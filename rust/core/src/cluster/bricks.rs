//! Bricks of 4 x 4 x 4 cells: one word tells which cells of a brick hold points, so that the neighbourhood of a
//! cell is found by a few masks instead of 125 look-ups.

/// Cells along one edge of a brick.
pub const SIDE: u64 = 4;
/// Cells of a brick; the place of a cell in it is (4 x + y) 4 + z.
pub const PLACES: u64 = SIDE * SIDE * SIDE;
/// Bricks that a neighbourhood may touch: that of the cell, and of each pair of sides the nearer one.
const TOUCHES: usize = 8;
/// Place of a brick itself among the 27 around it.
pub const OWN: usize = 13;

/// Of every place, what its neighbourhood touches: its own brick first.
pub static TOUCHED: [[Touched; TOUCHES]; PLACES as usize] = all_touched();

/// A brick that a neighbourhood touches.
#[derive(Debug, Clone, Copy)]
pub struct Touched {
    /// Its place among the 27 around, [`OWN`] for the brick of the cell.
    pub brick: usize,
    /// Cells that touch the cell, itself left out.
    pub touching: u64,
    /// All other cells that may hold neighbours: the radius is sqrt(3) edges.
    pub farther: u64,
}

/// The same without the places before: of the own brick those behind the place, of the others those of later bricks.
pub static AFTER: [[Touched; TOUCHES]; PLACES as usize] = all_after();

const fn all_after() -> [[Touched; TOUCHES]; PLACES as usize] {
    let mut all = all_touched();
    let mut place = 0;
    while place < all.len() {
        let mut number = 0;
        while number < TOUCHES {
            let touched = &mut all[place][number];
            let after = match touched.brick {
                0..OWN => 0,
                OWN => u64::MAX << place << 1,
                _ => u64::MAX,
            };
            touched.touching &= after;
            touched.farther &= after;
            number += 1;
        }
        place += 1;
    }
    all
}

const fn all_touched() -> [[Touched; TOUCHES]; PLACES as usize] {
    let nothing = Touched {
        brick: OWN,
        touching: 0,
        farther: 0,
    };
    let mut all = [[nothing; TOUCHES]; PLACES as usize];
    let mut place = 0;
    while place < all.len() {
        let mut number = 0;
        while number < TOUCHES {
            all[place][number] = touched(place as u64, number as u64);
            number += 1;
        }
        place += 1;
    }
    all
}

/// The brick beside that of the cell along the axes whose bits are set in `number`, towards the nearer sides.
const fn touched(place: u64, number: u64) -> Touched {
    let own = along_axes(place);
    let (mut brick, mut shift) = (OWN as i64, [0; 3]);
    let mut axis = 0;
    while axis < 3 {
        let beside = (number >> (2 - axis) & 1) as i64;
        shift[axis] = beside * side_of(own[axis]);
        brick += shift[axis] * [9, 3, 1][axis];
        axis += 1;
    }
    let (mut touching, mut farther, mut other) = (0, 0, 0);
    while other < PLACES {
        match steps_between(own, along_axes(other), shift) {
            0 => {}
            1 => touching |= 1 << other,
            2 => farther |= 1 << other,
            _ => {}
        }
        other += 1;
    }
    Touched {
        brick: brick as usize,
        touching,
        farther,
    }
}

const fn along_axes(place: u64) -> [i64; 3] {
    [
        (place >> 4) as i64,
        (place >> 2 & 3) as i64,
        (place & 3) as i64,
    ]
}

/// The nearer side of a brick, by place along an axis: -1 before, 1 behind. Two steps never lead beyond the other.
const fn side_of(along: i64) -> i64 {
    if along < SIDE as i64 / 2 { -1 } else { 1 }
}

/// Steps between two cells along the axis in which they are farthest apart.
const fn steps_between(own: [i64; 3], other: [i64; 3], shift: [i64; 3]) -> i64 {
    let (mut most, mut axis) = (0, 0);
    while axis < 3 {
        let steps = (other[axis] + SIDE as i64 * shift[axis] - own[axis]).abs();
        most = if steps > most { steps } else { most };
        axis += 1;
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cells within reach of the cell at `place`, by looking at every cell of all 27 bricks.
    fn looked_up(place: u32, reach: i64) -> [u64; 27] {
        let at = |place: u64| [place >> 4, place >> 2 & 3, place & 3].map(|c| c as i64);
        let own = at(u64::from(place));
        std::array::from_fn(|brick| {
            let brick = brick as i64;
            let shift = [brick / 9 - 1, brick / 3 % 3 - 1, brick % 3 - 1];
            let is_near = |cell: &u64| {
                let cell = at(*cell);
                (0..3).all(|k| (cell[k] + 4 * shift[k] - own[k]).abs() <= reach)
            };
            let cells = (0..PLACES)
                .filter(is_near)
                .fold(0, |mask, cell| mask | 1 << cell);
            cells & !(u64::from(brick as usize == OWN) << place)
        })
    }

    #[test]
    fn masks_hold_the_cells_within_one_and_two_steps() {
        for place in 0..PLACES as u32 {
            let (mut touching, mut reached) = ([0; 27], [0; 27]);
            for brick in TOUCHED[place as usize] {
                touching[brick.brick] |= brick.touching;
                reached[brick.brick] |= brick.touching | brick.farther;
            }
            assert_eq!(touching, looked_up(place, 1), "place {place}");
            assert_eq!(reached, looked_up(place, 2), "place {place}");
        }
    }

    #[test]
    fn of_two_cells_each_comes_after_the_other_or_the_other_way_round() {
        for place in 0..PLACES as usize {
            for (all, after) in TOUCHED[place].iter().zip(&AFTER[place]) {
                let reached = after.touching | after.farther;
                assert_eq!(reached & !(all.touching | all.farther), 0);
                match all.brick {
                    OWN => assert_eq!(reached >> place, (all.touching | all.farther) >> place),
                    brick if brick > OWN => assert_eq!(reached, all.touching | all.farther),
                    _ => assert_eq!(reached, 0),
                }
                assert!(all.brick != OWN || reached & ((1 << place) - 1) == 0);
            }
        }
    }
}
