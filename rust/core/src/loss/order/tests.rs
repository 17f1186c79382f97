//! Packets by number and period: what passes, and what is said of the rest.

use super::*;

const STEP: i64 = 1_327_104;

/// Offers packets `(number, arrival in periods)` and gives back what passes, with losses.
struct Run {
    order: Order<i64>,
    passed: Vec<(i64, u64)>,
    late: u64,
    jumps: u64,
    verdicts: Vec<Verdict>,
}

impl Run {
    fn new() -> Self {
        Self {
            order: Order::new(STEP, STEP),
            passed: vec![],
            late: 0,
            jumps: 0,
            verdicts: vec![],
        }
    }

    fn offer_key(&mut self, number: i64, key: i64, arrival_ns: i64) {
        let stamp = Stamp {
            key,
            span: STEP,
            mark: number as u64,
        };
        let verdict = self.order.offer(Timestamp(arrival_ns), stamp, || number);
        if let Verdict::Next { is_late } = verdict {
            self.passed.push((number, 0));
            self.late += u64::from(is_late);
        }
        self.verdicts.push(verdict);
        self.drain();
    }

    fn offer(&mut self, number: i64, arrival: i64) {
        self.offer_key(number, number * STEP + number % 3 * 500, arrival * STEP);
    }

    fn drain(&mut self) {
        while let Some(passed) = self.order.pop() {
            self.passed.push((passed.item, passed.lost));
            self.late += u64::from(passed.is_late);
            self.jumps += u64::from(passed.is_jump);
        }
    }

    fn finish(mut self) -> Self {
        self.order.flush();
        self.drain();
        self
    }

    fn numbers(&self) -> Vec<i64> {
        self.passed.iter().map(|passed| passed.0).collect()
    }

    fn lost(&self) -> u64 {
        self.passed.iter().map(|passed| passed.1).sum()
    }
}

#[test]
fn gaps_are_counted_once_the_wait_is_over() {
    let mut run = Run::new();
    for number in (0..400).filter(|n| ![100, 200, 201, 202].contains(n)) {
        run.offer(number, number);
    }
    let run = run.finish();
    assert_eq!(run.lost(), 4);
    assert!(run.passed.contains(&(101, 1)) && run.passed.contains(&(203, 3)));
    assert_eq!(run.late, 0);
}

#[test]
fn packets_out_of_order_by_less_than_the_wait_come_back() {
    let mut run = Run::new();
    for place in 0..300 {
        let number = match place {
            0 => 1,
            1 => 0,
            100..130 => place + 1, // number 100 is 30 periods, 40 ms, late
            130 => 100,
            _ => place,
        };
        run.offer(number, place);
    }
    let run = run.finish();
    assert_eq!(run.numbers(), (0..300).collect::<Vec<_>>());
    assert_eq!((run.lost(), run.late), (0, 2));
}

#[test]
fn later_packets_are_named_and_taken_off_the_loss() {
    let mut run = Run::new();
    for place in 0..300 {
        match place {
            100 => continue,
            160 => run.offer(100, place),
            _ => {}
        }
        run.offer(place, place);
    }
    let run = run.finish();
    assert_eq!(run.lost(), 1);
    assert!(run.verdicts.contains(&Verdict::TooLate { was_lost: true }));
    assert!(!run.numbers().contains(&100));
}

#[test]
fn repeated_packets_are_told_from_another_sensors() {
    let mut run = Run::new();
    for number in 0..200 {
        run.offer(number, number);
        run.offer(number, number);
        if number % 10 == 9 {
            run.offer(number - 7, number);
        }
    }
    let run = run.finish();
    let duplicates = run.verdicts.iter().filter(|v| **v == Verdict::Duplicate);
    assert_eq!(duplicates.count(), 220);
    assert_eq!((run.numbers().len(), run.lost()), (200, 0));

    let mut two = Run::new();
    for number in 0..200 {
        two.offer(number, number);
        two.offer_key(
            1000 + number,
            number * STEP + STEP * 6 / 10,
            number * STEP + 9,
        );
    }
    let clashes = two.verdicts.iter().filter(|v| **v == Verdict::Clash);
    assert!(clashes.count() > 50);
}

#[test]
fn a_jump_of_the_clock_loses_nothing() {
    for jump_s in [-1000, -1, 1, 1000] {
        let mut run = Run::new();
        for number in 0..300 {
            let jump_ns = if number < 150 {
                0
            } else {
                jump_s * 1_000_000_000
            };
            run.offer_key(number, number * STEP + jump_ns, number * STEP);
        }
        let run = run.finish();
        assert_eq!(run.numbers(), (0..300).collect::<Vec<_>>());
        assert_eq!((run.lost(), run.jumps), (0, 1), "{jump_s} s");
    }
}

#[test]
fn an_outage_is_loss_and_not_a_jump() {
    let mut run = Run::new();
    for number in (0..100).chain(100_000..100_100) {
        run.offer(number, number);
    }
    let run = run.finish();
    assert_eq!((run.lost(), run.jumps), (99_900, 0));
}

#[test]
fn single_packets_of_another_time_are_dropped() {
    let mut run = Run::new();
    for number in 0..1000 {
        run.offer(number, number);
        if number == 900 {
            run.offer(100, number); // 1.06 s late, a repetition
            run.offer_key(5000, -77 * STEP, number * STEP); // never sent before
        }
    }
    let mut run = run.finish();
    assert_eq!(run.numbers(), (0..1000).collect::<Vec<_>>());
    let strays = run.order.take_strays();
    assert_eq!((strays.duplicated, strays.too_late), (1, 1));
}

#[test]
fn two_sensors_with_clocks_apart_clash() {
    let mut run = Run::new();
    for number in 0..200 {
        run.offer(number, number);
        run.offer_key(number + 1000, (number + 9000) * STEP, number * STEP);
    }
    let mut run = run.finish();
    assert_eq!(run.numbers().iter().filter(|n| **n < 1000).count(), 200);
    assert!(run.order.take_strays().clashing > 150);
}

#[test]
fn no_key_panics() {
    let mut run = Run::new();
    for (number, key) in [0, i64::MAX, i64::MIN, 1, i64::MAX - 1, -1]
        .into_iter()
        .cycle()
        .take(200)
        .enumerate()
    {
        run.offer_key(number as i64, key, number as i64 * STEP);
    }
    run.finish();
}
