//! Are packets that are lost, repeated, late or foreign counted exactly, and does what arrived keep
//! its time and azimuth? Every shot of the simulated sensor is known.

#[path = "support/puck.rs"]
mod puck;

use lidar_deflect_core::clock::ClockKind;
use lidar_deflect_core::cloud::ReturnKind;
use lidar_deflect_core::packet::ReturnMode;
use lidar_deflect_core::packet::velodyne::puck::BLOCK_NS;
use lidar_deflect_core::stream::{ScanOptions, SweepOptions};
use lidar_deflect_core::sweep::Sweep;
use lidar_deflect_core::time::Timestamp;
use puck::{Puck, START_NS, Sent, in_order, read, scan, sweeps};

/// Half of the encoder's step of 0.01 degree, a little more for the rate between rows.
const AZIMUTH_TOLERANCE_DEG: f64 = 0.011;

/// Compares every return with the timetable; `clock_ns` is what the clock may be off.
fn assert_on_timetable(puck: &Puck, sweeps: &[Sweep], clock_ns: i64) -> usize {
    let mut returns = 0;
    for sweep in sweeps {
        let cloud = &sweep.cloud;
        for place in 0..cloud.len() {
            let elapsed_ns = cloud.time_ns[place] - puck.start_ns;
            let units = (f64::from(cloud.range_m[place]) / 0.002).round() as u16;
            let mut row = elapsed_ns / BLOCK_NS;
            if cloud.return_kind[place] == ReturnKind::Strongest && puck.mode == ReturnMode::Dual {
                row = (elapsed_ns + clock_ns) / BLOCK_NS; // told by its partner
            } else {
                let nearby = (row - 1..=row + 1).find(|row| Puck::range_units(*row) == units);
                row = nearby.unwrap_or_else(|| panic!("no row near {row} has range {units}"));
            }
            let laser = i64::from(cloud.ring[place] % 8 * 2 + cloud.ring[place] / 8);
            let azimuth_deg = f64::from(cloud.azimuth_rad[place]).to_degrees();
            let off_deg = |shot: i64| {
                let off_deg = azimuth_deg - puck.azimuth_deg(shot);
                ((off_deg + 180.0).rem_euclid(360.0) - 180.0).abs()
            };
            let is_it = |shot: &i64| {
                off_deg(*shot) < AZIMUTH_TOLERANCE_DEG && (shot - elapsed_ns).abs() <= clock_ns
            };
            let shots = [0, 1].map(|firing| Puck::shot_ns(row, firing, laser));
            let found = shots.iter().any(is_it);
            assert!(
                found,
                "{azimuth_deg} deg at {elapsed_ns} ns is none of {shots:?}"
            );
            returns += 1;
        }
    }
    returns
}

/// What tells a return from all others.
fn fingerprints(sweeps: &[Sweep]) -> Vec<(i64, u16, [u32; 3], u32)> {
    let mut all: Vec<_> = sweeps
        .iter()
        .flat_map(|sweep| {
            (0..sweep.cloud.len()).map(|place| {
                let xyz = sweep.cloud.xyz_m[place].map(f32::to_bits);
                let (time, ring) = (sweep.cloud.time_ns[place], sweep.cloud.ring[place]);
                (time, ring, xyz, sweep.index)
            })
        })
        .collect();
    all.sort_unstable();
    all
}

/// A number from 0 to `below` that looks random and is the same every time.
fn scattered(number: usize, below: u64) -> u64 {
    ((number as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33) % below
}

#[test]
fn every_shot_of_a_clean_stream_is_in_its_place() {
    for turns_per_s in [5.0, 10.0, 20.0] {
        let puck = Puck {
            turns_per_s,
            ..Puck::default()
        };
        let sent = puck.packets(3.0);
        let (report, sweeps) = read(&sent);
        let info = &report.lidars[0];
        assert_eq!(info.counts.packets, sent.len() as u64);
        assert_eq!(
            (info.counts.lost, info.counts.late, info.counts.duplicated),
            (0, 0, 0)
        );
        assert_eq!((info.model.id(), info.return_mode), ("vlp16", "strongest"));
        assert!((info.rpm - 60.0 * turns_per_s).abs() < 0.05, "{}", info.rpm);
        assert_eq!(info.clock.main().unwrap().kind, ClockKind::Utc);
        assert_eq!(info.first, Timestamp(START_NS));
        // Device stamps are cut to microseconds.
        let returns = assert_on_timetable(&puck, &sweeps, 1_000);
        assert_eq!(returns, sent.len() * 384);
        assert_eq!(info.points, returns as u64);
    }
}

#[test]
fn sweeps_are_cut_where_they_should_be() {
    let puck = Puck::default();
    let sent = puck.packets(2.0);
    let report = scan(&sent, ScanOptions::default());
    for cut_deg in [0.0_f64, 123.4, 359.99] {
        let options = SweepOptions {
            cut_azimuth_rad: vec![cut_deg.to_radians()],
            ..SweepOptions::default()
        };
        let sweeps = sweeps(&sent, &report, &options);
        let whole = &sweeps[1..sweeps.len() - 1];
        assert!(whole.len() >= 18);
        for (place, sweep) in whole.iter().enumerate() {
            assert_eq!(sweep.index as usize, place + 1);
            let turn_ns = (sweep.end - sweep.start) as f64;
            assert!((turn_ns - 1e8).abs() < 40_000.0, "{turn_ns}"); // 0.1 degree
            assert!((sweep.coverage - 1.0).abs() < 1e-3 && sweep.lost == 0);
            let after_cut =
                |azimuth: &f32| (f64::from(*azimuth).to_degrees() - cut_deg).rem_euclid(360.0);
            let azimuths: Vec<f64> = sweep.cloud.azimuth_rad.iter().map(after_cut).collect();
            assert!(azimuths.is_sorted_by(|a, b| a <= &(b + 0.011)));
            // Between two firings of all lasers there is a pause of 20.7 us, 0.075 degrees.
            assert!(azimuths[0] < 0.09 && azimuths[azimuths.len() - 1] > 359.91);
        }
        let total: usize = sweeps.iter().map(|sweep| sweep.cloud.len()).sum();
        assert_eq!(total, sent.len() * 384);
    }
}

#[test]
fn lost_packets_are_counted_and_shift_nothing() {
    let puck = Puck::default();
    let sent = puck.packets(6.0);
    // Single packets, short bursts, an outage of more than a turn and one of more than a second.
    let is_lost = |number: &usize| {
        scattered(*number, 40) == 0
            || (1000..1007).contains(number)
            || (1500..1600).contains(number)
            || (2500..3400).contains(number)
    };
    let last = sent.len() - 1;
    let lost = (1..last).filter(is_lost).count() as u64;
    let kept = (0..=last).filter(|n| *n == 0 || *n == last || !is_lost(n));
    let arrived: Vec<Sent> = kept.map(|number| sent[number].clone()).collect();
    let (report, sweeps_) = read(&arrived);
    assert_eq!(report.lidars[0].counts.lost, lost);
    let by_second: u64 = report.health().map(|second| second.counts.lost).sum();
    assert_eq!(by_second, lost);
    let (_, whole) = read(&sent);
    let whole = fingerprints(&whole);
    let rest = fingerprints(&sweeps_);
    assert_eq!(rest.len(), arrived.len() * 384);
    assert!(rest.iter().all(|echo| whole.binary_search(echo).is_ok()));
    // Sweeps in which nothing is missing are whole, and all are numbered as if nothing were.
    for sweep in &sweeps_[1..sweeps_.len() - 1] {
        let missing = f64::from(sweep.lost) * 4.7775; // degrees a packet
        let seen = f64::from(sweep.coverage) * 360.0;
        assert!(
            (seen + missing - 360.0).abs() < 7.2,
            "{sweep:?}",
            sweep = (seen, missing)
        );
    }
}

#[test]
fn losses_fall_into_their_seconds() {
    let sent = Puck::default().packets(4.0);
    // One second has 753.5 packets: number 1600 is in the third.
    let arrived: Vec<Sent> = (0..sent.len())
        .filter(|number| ![100, 101, 1600].contains(number))
        .map(|number| sent[number].clone())
        .collect();
    let (report, _) = read(&arrived);
    let lost: Vec<u64> = report.health().map(|second| second.counts.lost).collect();
    assert_eq!(lost, [2, 0, 1, 0]);
    let packets: u64 = report.health().map(|second| second.counts.packets).sum();
    assert_eq!(packets, arrived.len() as u64);
}

#[test]
fn packets_out_of_order_come_back_and_are_counted() {
    let puck = Puck::default();
    let sent = puck.packets(3.0);
    let mut shuffled = sent.clone();
    let mut late = 0;
    for (number, packet) in shuffled.iter_mut().enumerate() {
        if scattered(number, 50) == 0 {
            // By 2 to 45 ms: always behind its successor.
            packet.arrival_ns += 2_000_000 + scattered(number + 77, 43_000_000) as i64;
            late += 1;
        }
    }
    let (report, restored) = read(&in_order(shuffled));
    let counts = report.lidars[0].counts;
    assert_eq!((counts.lost, counts.too_late), (0, 0));
    // Of two late ones in a row only one may be behind a successor.
    assert!(
        counts.late <= late && counts.late * 10 >= late * 9,
        "{counts:?} {late}"
    );
    let strip = |sweeps: &[Sweep]| fingerprints(sweeps);
    assert_eq!(strip(&restored), strip(&read(&sent).1));
}

#[test]
fn what_comes_too_late_is_dropped_with_its_reason() {
    let sent = Puck::default().packets(3.0);
    let mut arrived = sent.clone();
    arrived[500].arrival_ns += 80_000_000;
    arrived[900].arrival_ns += 1_500_000_000;
    let (report, sweeps) = read(&in_order(arrived));
    let counts = report.lidars[0].counts;
    assert_eq!((counts.late, counts.too_late, counts.lost), (2, 2, 0));
    assert_eq!(report.drops.count("too_late"), 2);
    let returns: usize = sweeps.iter().map(|sweep| sweep.cloud.len()).sum();
    assert_eq!(returns, (sent.len() - 2) * 384);
}

#[test]
fn repeated_and_foreign_datagrams_are_counted() {
    let sent = Puck::default().packets(2.0);
    let mut arrived = sent.clone();
    for number in (10..sent.len()).step_by(37) {
        let mut again = sent[number].clone();
        again.arrival_ns += 1 + scattered(number, 30_000_000) as i64;
        arrived.push(again);
    }
    let repeated = (arrived.len() - sent.len()) as u64;
    for number in (0..sent.len()).step_by(100) {
        let mut foreign = sent[number].clone();
        foreign.payload.truncate(40);
        arrived.push(foreign.clone());
        foreign.source = "10.0.0.9:53".parse().unwrap();
        arrived.push(foreign);
    }
    let (report, sweeps) = read(&in_order(arrived));
    let info = &report.lidars[0];
    assert_eq!((info.counts.duplicated, info.counts.lost), (repeated, 0));
    let foreign = sent.len().div_ceil(100) as u64;
    assert_eq!(info.foreign, foreign);
    assert_eq!(report.drops.count("foreign"), 2 * foreign);
    assert_eq!(report.others.len(), 1);
    let returns: usize = sweeps.iter().map(|sweep| sweep.cloud.len()).sum();
    assert_eq!(returns, sent.len() * 384);
}

#[test]
fn the_hour_rolls_over() {
    let start_ns = START_NS - START_NS % 3_600_000_000_000 + 3_599_000_000_000;
    let puck = Puck {
        start_ns,
        ..Puck::default()
    };
    let sent = puck.packets(2.5);
    let (report, sweeps) = read(&sent);
    assert_eq!(report.lidars[0].counts.lost, 0);
    assert_eq!(report.lidars[0].clock.segments().len(), 1);
    assert_eq!(assert_on_timetable(&puck, &sweeps, 1_000), sent.len() * 384);
}

#[test]
fn a_free_clock_is_set_by_arrival_times() {
    let puck = Puck {
        offset_ns: 1_234_567_890_123,
        drift_ppm: 30,
        ..Puck::default()
    };
    let sent = puck.packets(20.0);
    let (report, sweeps) = read(&sent);
    let clock = report.lidars[0].clock.main().unwrap();
    assert_eq!(clock.kind, ClockKind::FreeRunning);
    // The device runs slow by 30 ppm, so UTC grows by as much on it.
    assert!((clock.drift * 1e6 - 30.0).abs() < 1.0, "{clock:?}");
    // Packets come 50 us after they are full, and the drift is known to 1 ppm over 20 s.
    assert_on_timetable(&puck, &sweeps, 75_000);
}

#[test]
fn a_jump_of_the_clock_costs_nothing() {
    let puck = Puck {
        offset_ns: 600_000_000_000,
        jump: Some((2_000, 600_000_000_000)), // the pulse per second came in
        ..Puck::default()
    };
    let sent = puck.packets(5.0);
    let (report, sweeps) = read(&sent);
    let info = &report.lidars[0];
    let kinds: Vec<ClockKind> = info.clock.segments().iter().map(|s| s.kind).collect();
    assert_eq!(kinds, [ClockKind::FreeRunning, ClockKind::Utc]);
    assert_eq!(info.counts.lost, 0);
    // Packet 2000 begins 2000 x 1.327104 ms after the first; arrival times vary by 50 us.
    let jumps: Vec<_> = info.clock.jumps().collect();
    let [jump] = jumps[..] else {
        panic!("{jumps:?}")
    };
    assert!((jump.by_ns - 600_000_000_000).abs() < 100_000, "{jump:?}");
    let told = "the device clock jumped 1 time: by +600.000 s, 2.7 s after its first packet";
    assert!(
        info.notes.iter().any(|note| note == told),
        "{:?}",
        info.notes
    );
    assert_eq!(
        assert_on_timetable(&puck, &sweeps, 75_000),
        sent.len() * 384
    );
}

#[test]
fn a_limited_field_of_view_is_no_loss() {
    for width_deg in [90.0, 180.0, 270.0, 340.0] {
        let puck = Puck {
            view_deg: (200.0, width_deg),
            ..Puck::default()
        };
        let sent = puck.packets(4.0);
        let (report, sweeps) = read(&sent);
        let info = &report.lidars[0];
        assert_eq!((info.counts.lost, info.counts.late), (0, 0), "{width_deg}");
        let seen_deg = 360.0 - info.view.blind_rad().to_degrees();
        assert!(
            (seen_deg - width_deg).abs() < 1.1,
            "{seen_deg} of {width_deg}"
        );
        // Within a packet the time over the gap comes from the rotation rate of the packets before:
        // a tenth of what 0.01 degree in the 4 degrees of a packet would leave. At both ends of
        // the gap 0.005 degrees are 1.4 us each.
        let gap_ns = (360.0 - width_deg) / 360.0 * 1e8;
        let clock_ns = 5_000 + (gap_ns * 2.5e-4) as i64;
        assert_eq!(
            assert_on_timetable(&puck, &sweeps, clock_ns),
            sent.len() * 384
        );
        for sweep in &sweeps[1..sweeps.len() - 1] {
            assert!((sweep.coverage - 1.0).abs() < 0.02, "{}", sweep.coverage);
            assert_eq!(sweep.lost, 0);
        }

        let is_lost = |number: usize| scattered(number, 60) == 0 && number > 0;
        let lost = (0..sent.len() - 1).filter(|n| is_lost(*n)).count() as u64;
        let last = sent.len() - 1;
        let kept = (0..=last).filter(|n| *n == last || !is_lost(*n));
        let arrived: Vec<Sent> = kept.map(|number| sent[number].clone()).collect();
        assert_eq!(read(&arrived).0.lidars[0].counts.lost, lost, "{width_deg}");
    }
}

#[test]
fn dual_returns_are_merged_where_they_repeat() {
    let puck = Puck {
        mode: ReturnMode::Dual,
        ..Puck::default()
    };
    let sent = puck.packets(1.0);
    let (report, sweeps) = read(&sent);
    let info = &report.lidars[0];
    // Of four channels two repeat, one differs, one has a single return; 6 x 32 shots a packet.
    let shots = sent.len() as u64 * 192;
    assert_eq!((info.points, info.merged), (shots / 4 * 5, shots / 2));
    assert_eq!(info.return_mode, "dual");
    let kinds = |kind: ReturnKind| {
        let all = sweeps.iter().flat_map(|sweep| &sweep.cloud.return_kind);
        all.filter(|found| **found == kind).count() as u64
    };
    assert_eq!(kinds(ReturnKind::Merged), shots / 2);
    assert_eq!(
        (kinds(ReturnKind::Last), kinds(ReturnKind::Strongest)),
        (shots / 2, shots / 4)
    );
    assert_on_timetable(&puck, &sweeps, 1_000);
}

#[test]
fn a_pause_of_the_recording_is_no_loss_but_an_outage_is() {
    let puck = Puck::default();
    let sent = puck.packets(40.0);
    let without = |range: std::ops::Range<usize>| -> Vec<Sent> {
        let kept = (0..sent.len()).filter(|number| !range.contains(number));
        kept.map(|number| sent[number].clone()).collect()
    };
    let (report, _) = read(&without(5_000..20_000)); // 19.9 s
    assert_eq!((report.lidars[0].counts.lost, report.pauses.len()), (0, 1));
    let (report, _) = read(&without(5_000..8_000)); // 4 s
    assert_eq!(
        (report.lidars[0].counts.lost, report.pauses.len()),
        (3_000, 0)
    );
}

#[test]
fn limits_of_time_choose_packets() {
    let puck = Puck::default();
    let sent = puck.packets(3.0);
    let report = scan(&sent, ScanOptions::default());
    let options = SweepOptions {
        start: Some(Timestamp(START_NS + 1_000_000_000)),
        stop: Some(Timestamp(START_NS + 1_500_000_000)),
        ..SweepOptions::default()
    };
    let part = sweeps(&sent, &report, &options);
    let times = part
        .iter()
        .flat_map(|sweep| sweep.cloud.time_ns.iter().copied());
    let (first, last) = times.fold((i64::MAX, 0), |(a, b), t| (a.min(t), b.max(t)));
    assert!((0..1_400_000).contains(&(first - START_NS - 1_000_000_000)));
    assert!((0..1_400_000).contains(&(last - START_NS - 1_500_000_000)));
    // Turns keep the numbers that they have in the whole capture.
    let whole = fingerprints(&sweeps(&sent, &report, &SweepOptions::default()));
    assert!(
        fingerprints(&part)
            .iter()
            .all(|echo| whole.binary_search(echo).is_ok())
    );
}

#[test]
fn several_lidars_come_out_merged() {
    let pucks = [1_u8, 2, 3].map(|number| Puck {
        source: format!("192.168.1.20{number}:2368").parse().unwrap(),
        start_ns: START_NS + i64::from(number) * 12_345_678,
        ..Puck::default()
    });
    let sent = in_order(pucks.iter().flat_map(|puck| puck.packets(2.0)).collect());
    let (report, sweeps) = read(&sent);
    assert_eq!(report.first, Some(Timestamp(START_NS + 12_345_000))); // in microseconds
    for (number, puck) in pucks.iter().enumerate() {
        let own: Vec<Sweep> = sweeps
            .iter()
            .filter(|s| s.lidar == number)
            .cloned()
            .collect();
        assert_eq!(
            assert_on_timetable(puck, &own, 1_000),
            puck.packets(2.0).len() * 384
        );
    }
    // As they complete: no sweep waits for the end of the capture.
    assert!(sweeps[..50].is_sorted_by(|a, b| a.end.0 <= b.end.0 + 20_000_000));
}
