//! Does every Leishen model give back what was written into its packets, is it told from the Velodyne that
//! it looks like, and does it survive any bytes?

#[path = "support/leishen.rs"]
mod support;

use lidar_deflect_core::cloud::ReturnKind;
use lidar_deflect_core::packet::leishen::ch::{RawPacket as ChPacket, Record};
use lidar_deflect_core::packet::leishen::cx::{Cx, RawPacket};
use lidar_deflect_core::packet::leishen::difop;
use lidar_deflect_core::packet::leishen::mirror::{self, MIRRORS};
use lidar_deflect_core::packet::leishen::products::{self, PRODUCTS};
use lidar_deflect_core::packet::unit::{Calibration, UnitFile};
use lidar_deflect_core::packet::velodyne::{BLOCKS, RawReturn};
use lidar_deflect_core::packet::{Decoded, Decoder, Model, PacketKind, Place, ReturnMode, closest};
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::*;

const MUTATIONS: usize = 100_000;

fn raw() -> impl Strategy<Value = RawReturn> {
    let range = prop_oneof![1 => Just(0), 4 => 50..60_000_u16];
    (range, any::<u8>()).prop_map(|(range, intensity)| RawReturn { range, intensity })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn what_is_written_comes_back(
        echoes in prop::collection::vec(raw(), BLOCKS * 32),
        first in 0..36_000_u32,
        below_ns in 0..1_000_000_000_i64,
        is_ptp in any::<bool>(),
    ) {
        for model in &products::MODELS {
            for mode in MODES {
                check(model, mode, &echoes, (first, START_NS / 1_000_000_000 * 1_000_000_000 + below_ns / 1000 * 1000), is_ptp);
            }
        }
    }
}

fn check(
    model: &Cx,
    mode: ReturnMode,
    echoes: &[RawReturn],
    (first, time_ns): (u32, i64),
    is_ptp: bool,
) {
    let (id, count) = (model.id(), lasers(model));
    let sent = RawPacket {
        time_ns,
        is_ptp,
        mode,
        blocks: blocks(first, mode, |block, channel| echoes[block * 32 + channel]),
    };
    let payload = model.encode(&sent);
    assert_eq!(model.recognise(&payload), Some(PacketKind::Data), "{id}");
    let head = model.head(&payload).unwrap();
    assert_eq!(head.return_mode, mode, "{id}");
    let wrap_ns = model.counting().clock_wrap_ns.unwrap_or(i64::MAX);
    // The stamp is that of the last shot, the head that of the first.
    let shot_ns = model.period_ns(mode) / (384 / mode.returns() as i64);
    let until_ns = time_ns - head.device_ns - (head.duration_ns - shot_ns);
    let off_ns = (until_ns + 5).rem_euclid(wrap_ns) - 5;
    assert!(off_ns.abs() <= 5, "{id}: {off_ns}");
    let out = decode(model, &[], &payload);
    let tally = model.tally(&payload);
    assert_eq!(
        (out.returns.len(), out.merged),
        (tally.points as usize, u64::from(tally.merged)),
        "{id}"
    );
    let product = PRODUCTS.iter().find(|product| product.id == id).unwrap();
    let mut expected = 0;
    for row in 0..BLOCKS / mode.returns() {
        for channel in 0..32 {
            let pair: Vec<RawReturn> = (0..mode.returns())
                .map(|k| echoes[(row * mode.returns() + k) * 32 + channel])
                .collect();
            let is_merged = pair.len() == 2 && pair[0].range == pair[1].range;
            for (index, echo) in pair.iter().enumerate() {
                if echo.range == 0 || index == 1 && is_merged {
                    continue;
                }
                let found = &out.returns[expected];
                expected += 1;
                let range_m = f64::from(echo.range) * product.unit_m;
                assert!((f64::from(found.range_m) - range_m).abs() < 1e-4, "{id}");
                assert_eq!(
                    (found.intensity, found.return_index),
                    (echo.intensity.into(), index as u8)
                );
                let aside_deg = if id == "c32w" && [6, 7, 14, 15, 22, 23, 29, 30].contains(&channel)
                {
                    3.89
                } else {
                    0.0
                };
                let azimuth_deg = (f64::from(first) + 36.0 * (row as f64 + channel as f64 / 32.0))
                    * 0.01
                    + aside_deg;
                let azimuth = azimuth_deg.to_radians();
                let elevation = product.elevation_deg[channel % count].to_radians();
                let (lens_m, behind_deg) = product.lens;
                let level_m = range_m * elevation.cos();
                let lens = azimuth - behind_deg.to_radians();
                let point = [
                    level_m * azimuth.sin() + lens_m * lens.sin(),
                    level_m * azimuth.cos() + lens_m * lens.cos(),
                    range_m * elevation.sin(),
                ];
                for (one, other) in found.xyz_m.iter().zip(point) {
                    // f32 of up to 240 m, and azimuths in f64.
                    assert!(
                        (f64::from(*one) - other).abs() < 5e-5,
                        "{id} {found:?} {point:?}"
                    );
                }
                let delay_ns = shot_ns * (row as i64 * 32 + channel as i64);
                let off_ns = found.time - Timestamp(head.device_ns) - delay_ns;
                assert!(off_ns.abs() < 400, "{id}: {off_ns}");
            }
        }
    }
    assert_eq!(expected, out.returns.len(), "{id}");
}

#[test]
fn rings_count_from_the_lowest() {
    for model in &products::MODELS {
        let out = decode(
            model,
            &[],
            &cx_packet(model, ReturnMode::Strongest, 0, 1_200_000),
        );
        let mut heights: Vec<(u16, f32)> = out
            .returns
            .iter()
            .map(|r| (r.ring, r.xyz_m[2] / r.range_m))
            .collect();
        heights.sort_by_key(|(ring, _)| *ring);
        assert!(
            heights.windows(2).all(|pair| pair[0].1 <= pair[1].1 + 1e-6),
            "{}",
            model.id()
        );
        assert_eq!(usize::from(heights.last().unwrap().0) + 1, lasers(model));
    }
}

#[test]
fn the_mirror_series_gives_back_what_was_written() {
    for (model, mirror) in mirror::MODELS.iter().zip(&MIRRORS) {
        for is_double in [false, true] {
            let payload = ch_packet(model, mirror.lines, is_double, 3);
            assert_eq!(
                model.recognise(&payload),
                Some(PacketKind::Data),
                "{}",
                mirror.id
            );
            let head = model.head(&payload).unwrap();
            assert!(
                head.turned_rad > 0.0 && head.left_out.is_none(),
                "{}",
                mirror.id
            );
            let out = decode(model, &[], &payload);
            let tally = model.tally(&payload);
            assert_eq!(out.returns.len(), tally.points as usize);
            let count = if is_double { 2 * 109 } else { 171 };
            assert_eq!(out.returns.len(), count, "{}", mirror.id);
            let first = &out.returns[0];
            let shot = 3 * if is_double { 109 } else { 171 };
            assert_eq!(
                usize::from(first.ring),
                (mirror.lines - 1 + shot) % mirror.lines
            );
            assert!((f64::from(first.range_m) - (256_000 + shot) as f64 / 25_600.0).abs() < 1e-5);
            let [x, y, z] = first.xyz_m.map(f64::from);
            let stated_deg = (3_000 + shot) as f64 * 0.01;
            assert!((y.atan2(x).to_degrees() - mirror.azimuth_deg(stated_deg)).abs() < 1e-3);
            assert!(((x * x + y * y + z * z).sqrt() - f64::from(first.range_m)).abs() < 1e-4);
            if is_double {
                assert_eq!(
                    (first.return_kind, out.returns[1].return_kind),
                    (ReturnKind::First, ReturnKind::Last)
                );
            }
        }
    }
}

#[test]
fn a_mirror_at_right_angles_lifts_the_beam_by_twice_its_own_angle() {
    // At azimuth 0 the beam of prism angle a and mirror angle b leaves at a + 2 b cos(b) cos(a) - ..., which
    // for small angles is a + 2 b: the line above the first of a group of CH256 stands 0.22 degree higher.
    let model = &mirror::MODELS[7];
    let record = |line: u8| {
        Some(Record {
            line,
            azimuth: 0,
            echoes: [(2_560_000, 1), (0, 0)],
        })
    };
    let payload = model.encode(&ChPacket {
        time_ns: START_NS,
        is_double: false,
        is_ptp: true,
        records: vec![record(128), record(129)],
    });
    let out = decode(model, &[], &payload);
    let elevation = |k: usize| {
        (out.returns[k].xyz_m[2] / out.returns[k].range_m)
            .asin()
            .to_degrees()
    };
    assert!((elevation(0) - 0.0).abs() < 1e-4);
    assert!((elevation(1) - 0.22).abs() < 1e-3, "{}", elevation(1));
}

#[test]
fn a_prism_that_the_unit_tells_is_taken() {
    let model = &mirror::MODELS[0];
    let payload = ch_packet(model, 128, false, 0);
    let told = difop::encode(
        0,
        &[(240, 50), (242, 0), (244, -20), (246, -40), (248, -60)],
    );
    let files = [UnitFile::new("packets to port 2369", told)];
    let fitted = model.fit(&files).unwrap().calibration;
    assert_eq!(
        fitted,
        Calibration::Unit {
            names: vec!["packets to port 2369".into()]
        }
    );
    let (usual, own) = (
        decode(model, &[], &payload),
        decode(model, &files, &payload),
    );
    let moved = usual
        .returns
        .iter()
        .zip(&own.returns)
        .filter(|(a, b)| a.xyz_m != b.xyz_m);
    assert!(moved.count() > 100);
}

#[test]
fn every_prefix_is_survived_and_none_is_taken() {
    let mut out = Decoded::default();
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: 1,
        mean_rate_rad_per_ns: 1e-8,
    };
    let mut all: Vec<(&dyn Model, Vec<u8>)> = Vec::new();
    for model in &products::MODELS {
        all.push((model, cx_packet(model, ReturnMode::Dual, 5, 600_000)));
    }
    for (model, mirror) in mirror::MODELS.iter().zip(&MIRRORS) {
        all.push((model, ch_packet(model, mirror.lines, true, 5)));
    }
    for (model, whole) in all {
        let mut decoder = model.fit(&[]).unwrap().decoder;
        for length in 0..whole.len() {
            let prefix = &whole[..length];
            assert_eq!(model.recognise(prefix), None, "{} {length}", model.id());
            let _ = (
                model.head(prefix),
                model.tally(prefix),
                model.misfit(prefix),
                closest(prefix),
            );
            decoder.decode(prefix, place, &mut out);
        }
    }
}

/// A model, its decoder and a packet.
type Sample = (&'static dyn Model, Box<dyn Decoder>, Vec<u8>);

#[test]
fn changed_bytes_are_survived() {
    let mut random = ChaCha8Rng::seed_from_u64(71);
    let mut samples: Vec<Sample> = Vec::new();
    for model in &products::MODELS {
        for mode in MODES {
            let decoder = model.fit(&[]).unwrap().decoder;
            samples.push((model, decoder, cx_packet(model, mode, 5, 600_000)));
        }
    }
    for (model, mirror) in mirror::MODELS.iter().zip(&MIRRORS) {
        for is_double in [false, true] {
            let decoder = model.fit(&[]).unwrap().decoder;
            samples.push((model, decoder, ch_packet(model, mirror.lines, is_double, 5)));
        }
    }
    let mut out = Decoded::default();
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: u32::MAX,
        mean_rate_rad_per_ns: 1e-8,
    };
    let count = samples.len();
    for round in 0..MUTATIONS {
        let (model, decoder, whole) = &mut samples[round % count];
        let mut payload = whole.clone();
        for _ in 0..random.random_range(1..40) {
            let at = match random.random_range(0..3) {
                0 => payload.len() - 1 - random.random_range(0..14),
                _ => random.random_range(0..payload.len()),
            };
            payload[at] = random.random();
        }
        let _ = (
            model.recognise(&payload),
            model.fits(&payload),
            model.misfit(&payload),
        );
        let _ = (model.suits(&[&payload]), model.doubt(&[&payload]));
        if let Some(head) = model.head(&payload) {
            let _ = (
                head.paced(1e-8),
                head.arcs().count(),
                head.next_azimuth_rad(),
            );
        }
        out.clear();
        let merged = out.merged;
        decoder.decode(&payload, place, &mut out);
        let tally = model.tally(&payload);
        assert_eq!(out.cloud.len(), tally.points as usize, "{}", model.id());
        assert_eq!(out.merged - merged, u64::from(tally.merged));
        assert!(
            out.cloud
                .iter()
                .all(|echo| echo.xyz_m.iter().all(|m| m.is_finite()))
        );
        let file = UnitFile::new("noise", payload);
        let _ = model.takes(&file);
    }
}
