//! What the echoes of one shot mean: nearer and farther by distance, brighter by intensity.
//!
//! The order in which sensors write the echoes of a shot differs from model to model, and even
//! between captures with the same mode; so order decides only where nothing else can.

use super::ReturnMode;
use crate::cloud::ReturnKind;

/// Most echoes of one shot.
pub const MOST: usize = 3;

/// One echo as the sensor wrote it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RawEcho {
    /// Range in the model's unit; 0 = no return.
    pub range: u16,
    /// Brightness.
    pub intensity: u8,
}

/// Meaning of each echo of a shot; `None` for no return and for one that repeats another.
pub type Meanings = [Option<ReturnKind>; MOST];

/// Meaning of the only echo of a setting for single returns.
pub fn single_kind(mode: ReturnMode) -> ReturnKind {
    only_kind(mode, 0)
}

/// Judges the echoes of one shot; gives their meanings and how many were merged into others.
#[inline]
pub fn judge(mode: ReturnMode, echoes: &[RawEcho]) -> (Meanings, u32) {
    match echoes {
        [only] if only.range == 0 => ([None; MOST], 0),
        [_] => ([Some(only_kind(mode, 0)), None, None], 0),
        [first, second] => judge_pair(mode, [*first, *second]),
        _ => judge_several(mode, echoes),
    }
}

/// The same for the two echoes that most sensors give, without loops.
#[inline]
fn judge_pair(mode: ReturnMode, pair: [RawEcho; 2]) -> (Meanings, u32) {
    match pair.map(|echo| echo.range) {
        [0, 0] => ([None; MOST], 0),
        [_, 0] => ([Some(only_kind(mode, 0)), None, None], 0),
        [0, _] => ([None, Some(only_kind(mode, 1)), None], 0),
        [first, second] if first == second => ([Some(ReturnKind::Merged), None, None], 1),
        [first, second] => {
            let (near, far) = if first < second { (0, 1) } else { (1, 0) };
            let kind = |place| Some(place_kind(mode, &pair, near, far, place));
            ([kind(0), kind(1), None], 0)
        }
    }
}

fn judge_several(mode: ReturnMode, echoes: &[RawEcho]) -> (Meanings, u32) {
    let mut meanings: Meanings = [None; MOST];
    let mut merged = 0;
    let mut distinct = [0_usize; MOST];
    let mut count = 0;
    for (place, echo) in echoes.iter().enumerate().take(MOST) {
        if echo.range == 0 {
            continue;
        }
        let same = distinct[..count]
            .iter()
            .find(|k| echoes[**k].range == echo.range);
        match same {
            Some(first) => {
                merged += 1;
                meanings[*first] = Some(ReturnKind::Merged);
            }
            None => {
                distinct[count] = place;
                count += 1;
            }
        }
    }
    label(mode, echoes, &distinct[..count], &mut meanings);
    (meanings, merged)
}

/// Labels the echoes at `distinct`, of which no two have the same range.
fn label(mode: ReturnMode, echoes: &[RawEcho], distinct: &[usize], meanings: &mut Meanings) {
    if let [only] = distinct {
        meanings[*only].get_or_insert(only_kind(mode, *only));
        return;
    }
    let range = |place: &usize| echoes[*place].range;
    let (Some(near), Some(far)) = (
        distinct.iter().copied().min_by_key(range),
        distinct.iter().copied().max_by_key(range),
    ) else {
        return;
    };
    for place in distinct {
        let kind = place_kind(mode, echoes, near, far, *place);
        meanings[*place].get_or_insert(kind);
    }
}

/// Meaning of the echo at `place` among those of which the ones at `near` and `far` are outermost.
fn place_kind(
    mode: ReturnMode,
    echoes: &[RawEcho],
    near: usize,
    far: usize,
    place: usize,
) -> ReturnKind {
    if mode == ReturnMode::StrongestSecond {
        by_brightness(echoes, near, far, place)
    } else if place == far {
        far_kind(mode)
    } else if place == near {
        near_kind(mode)
    } else {
        ReturnKind::Strongest
    }
}

fn by_brightness(echoes: &[RawEcho], near: usize, far: usize, place: usize) -> ReturnKind {
    let (first, second) = (near.min(far), near.max(far));
    let is_second_brighter = echoes[second].intensity > echoes[first].intensity;
    if (place == second) == is_second_brighter {
        ReturnKind::Strongest
    } else {
        ReturnKind::Second
    }
}

/// Meaning of the only echo.
fn only_kind(mode: ReturnMode, place: usize) -> ReturnKind {
    match mode {
        // Both last and strongest; the first place is the last return's on most models.
        ReturnMode::Dual if place == 0 => ReturnKind::Last,
        ReturnMode::Last => ReturnKind::Last,
        ReturnMode::First => ReturnKind::First,
        ReturnMode::Second => ReturnKind::Second,
        // The only echo of a shot is its strongest, whatever else it is.
        _ => ReturnKind::Strongest,
    }
}

fn near_kind(mode: ReturnMode) -> ReturnKind {
    match mode {
        ReturnMode::Dual => ReturnKind::Strongest,
        _ => ReturnKind::First,
    }
}

fn far_kind(mode: ReturnMode) -> ReturnKind {
    match mode {
        ReturnMode::FirstStrongest => ReturnKind::Strongest,
        ReturnMode::FirstSecond => ReturnKind::Second,
        _ => ReturnKind::Last,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ReturnKind::{First, Last, Merged, Second, Strongest};

    fn kinds(mode: ReturnMode, echoes: &[(u16, u8)]) -> (Meanings, u32) {
        let raw = |(range, intensity): &(u16, u8)| RawEcho {
            range: *range,
            intensity: *intensity,
        };
        judge(mode, &echoes.iter().map(raw).collect::<Vec<_>>())
    }

    #[test]
    fn distance_tells_last_and_first_in_either_order() {
        let dual = |echoes: &[_]| kinds(ReturnMode::Dual, echoes).0;
        assert_eq!(
            dual(&[(900, 1), (400, 9)]),
            [Some(Last), Some(Strongest), None]
        );
        assert_eq!(
            dual(&[(400, 9), (900, 1)]),
            [Some(Strongest), Some(Last), None]
        );
        let first_last = kinds(ReturnMode::FirstLast, &[(900, 1), (400, 9)]).0;
        assert_eq!(first_last, [Some(Last), Some(First), None]);
        let first_strongest = kinds(ReturnMode::FirstStrongest, &[(4, 1), (9, 9)]).0;
        assert_eq!(first_strongest, [Some(First), Some(Strongest), None]);
    }

    #[test]
    fn a_repeated_echo_is_one_point_and_a_missing_one_none() {
        let repeated = kinds(ReturnMode::Dual, &[(400, 9), (400, 9)]);
        assert_eq!(repeated, ([Some(Merged), None, None], 1));
        let lonely = kinds(ReturnMode::Dual, &[(0, 0), (400, 9)]);
        assert_eq!(lonely, ([None, Some(Strongest), None], 0));
        assert_eq!(kinds(ReturnMode::Dual, &[(0, 3), (0, 0)]), ([None; 3], 0));
    }

    #[test]
    fn brightness_tells_the_strongest_of_two_and_the_rest_of_three_is_the_strongest() {
        let pair = |a, b| kinds(ReturnMode::StrongestSecond, &[(7, a), (3, b)]).0;
        assert_eq!(pair(5, 6), [Some(Second), Some(Strongest), None]);
        assert_eq!(pair(6, 6), [Some(Strongest), Some(Second), None]);
        let triple = kinds(ReturnMode::Triple, &[(5, 9), (2, 1), (8, 1)]);
        assert_eq!(triple, ([Some(Strongest), Some(First), Some(Last)], 0));
        let two = kinds(ReturnMode::Triple, &[(5, 9), (5, 9), (8, 1)]);
        assert_eq!(two, ([Some(Merged), None, Some(Last)], 1));
    }

    #[test]
    fn one_echo_is_judged_as_any_number_is() {
        let modes = [
            ReturnMode::Last,
            ReturnMode::First,
            ReturnMode::Second,
            ReturnMode::Dual,
        ];
        for (mode, range) in modes.iter().flat_map(|mode| [(*mode, 0), (*mode, 5)]) {
            let echo = [RawEcho {
                range,
                intensity: 7,
            }];
            assert_eq!(judge(mode, &echo), judge_several(mode, &echo));
        }
    }

    #[test]
    fn two_echoes_are_judged_as_any_number_is() {
        let modes = [
            ReturnMode::Dual,
            ReturnMode::FirstLast,
            ReturnMode::FirstStrongest,
            ReturnMode::StrongestSecond,
            ReturnMode::Last,
        ];
        for (mode, code) in modes.iter().flat_map(|m| (0..256).map(move |c| (*m, c))) {
            let echo = |bits: u16| RawEcho {
                range: bits % 4,
                intensity: (bits / 4 % 4) as u8,
            };
            let pair = [echo(code), echo(code / 16)];
            assert_eq!(judge_pair(mode, pair), judge_several(mode, &pair));
        }
    }
}
