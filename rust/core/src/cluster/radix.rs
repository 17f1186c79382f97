//! Sorting by key, digit by digit.

/// Bits of the largest digit sorted in one pass.
const DIGIT_BITS: u32 = 11;
/// Entries up to which sorting by comparison is faster.
const FEW: usize = 256;

/// Sorts by the lowest `bits` of a key, equal keys staying in order; the natural order of entries is that of
/// their keys, then of their places before.
pub fn sort_by_key<E: Copy + Default + Ord>(
    entries: &mut Vec<E>,
    bits: u32,
    key: impl Fn(&E) -> u64,
) {
    if entries.len() < FEW {
        entries.sort_unstable();
        return;
    }
    let passes = bits.div_ceil(DIGIT_BITS).max(1);
    let width = bits.div_ceil(passes).max(1);
    let mut sorted = vec![E::default(); entries.len()];
    for shift in (0..passes).map(|pass| pass * width) {
        let digit = |entry: &E| (key(entry) >> shift) as usize & ((1 << width) - 1);
        sort_by_digit(entries, &mut sorted, 1 << width, digit);
        std::mem::swap(entries, &mut sorted);
    }
}

fn sort_by_digit<E: Copy>(from: &[E], to: &mut [E], digits: usize, digit: impl Fn(&E) -> usize) {
    let mut places = [0_u32; 1 << DIGIT_BITS];
    for entry in from {
        places[digit(entry)] += 1;
    }
    let mut next = 0;
    for place in &mut places[..digits] {
        next += std::mem::replace(place, next);
    }
    for entry in from {
        let place = &mut places[digit(entry)];
        to[*place as usize] = *entry;
        *place += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_give_the_order_of_comparing() {
        for (count, bits) in [(100, 40), (5_000, 1), (5_000, 11), (5_000, 25), (5_000, 63)] {
            let key = |i: u32| u64::from(i).wrapping_mul(0x9E37_79B9_7F4A_7C15) & ((1 << bits) - 1);
            let mut entries: Vec<(u64, u32)> = (0..count).map(|i| (key(i), i)).collect();
            let mut expected = entries.clone();
            expected.sort_unstable();
            sort_by_key(&mut entries, bits, |entry| entry.0);
            assert_eq!(entries, expected, "{count} entries of {bits} bits");
        }
    }
}
