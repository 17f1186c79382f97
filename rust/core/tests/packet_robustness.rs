//! Does any prefix, any change of bytes or any noise break a decoder or a scan?

#[path = "support/puck.rs"]
mod puck;

use lidar_deflect_core::packet::velodyne::position::Position;
use lidar_deflect_core::packet::velodyne::puck::{
    PRODUCT_HIRES, PRODUCT_VLP16, VLP16, VLP16_HIRES,
};
use lidar_deflect_core::packet::velodyne::{RawBlock, RawReturn, encode};
use lidar_deflect_core::packet::{
    Decoded, MODELS, ModelRef, Place, ReturnMode, closest, companion, model,
};
use lidar_deflect_core::stream::ScanOptions;
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use puck::{Puck, Sent, read, scan};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MUTATIONS: usize = 100_000;

/// Everything that may be asked of a payload; the sums must agree whatever the bytes are.
fn ask_everything(model: ModelRef, payload: &[u8], out: &mut Decoded) {
    let _ = (
        model.recognise(payload),
        model.fits(payload),
        model.misfit(payload),
    );
    let _ = (closest(payload), companion(payload), model.is_sure(payload));
    if let Some(position) = Position::new(payload) {
        let _ = (position.pps(), position.sentence(), position.has_fix());
    }
    if let Some(head) = model.head(payload) {
        let _ = (
            head.paced(1e-8),
            head.arcs().count(),
            head.next_azimuth_rad(),
        );
        let _ = head.time_at(Timestamp(i64::MAX), 1.0);
    }
    out.clear();
    let merged = out.merged;
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: u32::MAX,
        mean_rate_rad_per_ns: 1e-8,
    };
    let Ok(fitted) = model.fit(&[]) else {
        return; // means nothing without the unit's calibration
    };
    let mut decoder = fitted.decoder;
    decoder.decode(payload, place, out);
    let tally = model.tally(payload);
    assert_eq!(out.cloud.len(), tally.points as usize);
    assert_eq!(out.merged - merged, u64::from(tally.merged));
    for echo in out.cloud.iter() {
        assert!(echo.xyz_m.iter().all(|metres| metres.is_finite()));
        assert!(
            (0.0..std::f32::consts::TAU).contains(&echo.azimuth_rad),
            "{echo:?}"
        );
    }
}

fn samples() -> Vec<Vec<u8>> {
    let dual = Puck {
        mode: ReturnMode::Dual,
        ..Puck::default()
    };
    let cut = Puck {
        view_deg: (40.0, 200.0),
        ..Puck::default()
    };
    let sets = [Puck::default(), dual, cut].map(|puck| puck.packets(0.2));
    sets.iter()
        .flatten()
        .step_by(13)
        .map(|sent| sent.payload.clone())
        .collect()
}

#[test]
fn every_prefix_of_a_packet_is_survived() {
    let mut out = Decoded::default();
    let whole = &samples()[0];
    for length in 0..whole.len() {
        for model in MODELS {
            ask_everything(*model, &whole[..length], &mut out);
            assert_eq!(model.recognise(&whole[..length]), None);
        }
    }
}

#[test]
fn changed_bytes_are_survived() {
    let mut random = ChaCha8Rng::seed_from_u64(16);
    let samples = samples();
    let mut out = Decoded::default();
    for round in 0..MUTATIONS {
        let mut payload = samples[round % samples.len()].clone();
        for _ in 0..random.random_range(1..40) {
            let place = random.random_range(0..payload.len());
            payload[place] = random.random();
        }
        ask_everything(MODELS[round % MODELS.len()], &payload, &mut out);
    }
}

#[test]
fn a_stream_of_noise_is_survived_and_counted() {
    let mut random = ChaCha8Rng::seed_from_u64(24);
    let mut sent = Puck::default().packets(4.0);
    for packet in &mut sent {
        match random.random_range(0..10) {
            0 => random.fill_bytes(&mut packet.payload[1200..1204]),
            1 => {
                packet.arrival_ns = i64::from(random.random::<i32>()) << random.random_range(0..32);
            }
            2 => random.fill_bytes(&mut packet.payload[..1200]),
            3 => {
                let length = random.random_range(0..1206);
                packet.payload.truncate(length);
            }
            _ => {}
        }
    }
    let (report, sweeps) = read(&sent);
    assert_eq!(report.datagrams, sent.len() as u64);
    let dropped: u64 = report.drops.iter().map(|(_, count)| count).sum();
    let taken: u64 = report.lidars.iter().map(|lidar| lidar.counts.packets).sum();
    assert_eq!(dropped + taken, report.datagrams, "{:?}", report.drops);
    let packets: u64 = sweeps.iter().map(|sweep| u64::from(sweep.packets)).sum();
    assert_eq!(packets, taken);
}

#[test]
fn pure_noise_is_no_lidar() {
    let mut random = ChaCha8Rng::seed_from_u64(32);
    let noise = |number: i64| {
        let mut payload = vec![0; random.random_range(0..1500)];
        random.fill_bytes(&mut payload);
        Sent {
            arrival_ns: number * 1_000_000,
            source: "10.0.0.1:9".parse().unwrap(),
            port: 2368,
            payload,
        }
    };
    let sent: Vec<Sent> = (0..2000).map(noise).collect();
    let report = scan(&sent, ScanOptions::default());
    assert!(report.lidars.is_empty());
    assert_eq!(report.drops.count("foreign"), 2000);
}

prop_compose! {
    fn block()(azimuth_centideg in 0..36_000_u16, echoes in prop::array::uniform32(any::<(u16, u8)>())) -> RawBlock {
        let returns = echoes.map(|(range, intensity)| RawReturn { range, intensity });
        RawBlock { bank: 0, azimuth_centideg, returns }
    }
}

proptest! {
    #[test]
    fn what_is_encoded_comes_back(
        blocks in prop::array::uniform12(block()),
        timestamp_us in 0..3_600_000_000_u32,
        is_last in any::<bool>(),
        is_hires in any::<bool>(),
    ) {
        let mode = if is_last { ReturnMode::Last } else { ReturnMode::Strongest };
        let (id, product) = if is_hires { ("vlp16-hires", PRODUCT_HIRES) } else { ("vlp16", PRODUCT_VLP16) };
        let payload = encode(&blocks, timestamp_us, mode, product);
        let model = model(id).unwrap();
        let head = model.head(&payload).unwrap();
        prop_assert_eq!(head.device_ns, i64::from(timestamp_us) * 1000);
        prop_assert_eq!(head.return_mode, mode);
        let mut out = Decoded::default();
        let place = Place { time: Timestamp(head.device_ns), packet: 3, mean_rate_rad_per_ns: 0.0 };
        model.fit(&[]).unwrap().decoder.decode(&payload, place, &mut out);
        let beams = if is_hires { VLP16_HIRES.beams() } else { VLP16.beams() };
        let mut returns = out.cloud.iter();
        for (number, block) in blocks.iter().enumerate() {
            for (channel, echo) in block.returns.iter().enumerate() {
                if echo.range == 0 {
                    continue;
                }
                let found = returns.next().unwrap();
                let beam = beams.channels()[channel % 16];
                prop_assert_eq!(found.block as usize, number);
                prop_assert_eq!(found.ring, beam.ring);
                prop_assert_eq!(found.intensity, u16::from(echo.intensity));
                let range_m = f64::from(echo.range) * 0.002;
                prop_assert!((f64::from(found.range_m) - range_m).abs() < 1e-5);
                // The point lies where the range and the stated azimuth say.
                let [x, y, z] = found.xyz_m.map(f64::from);
                let azimuth_rad = f64::from(found.azimuth_rad);
                let level_m = range_m * beam.elevation_rad.cos();
                prop_assert!((x - level_m * azimuth_rad.cos()).abs() < 1e-4);
                prop_assert!((y + level_m * azimuth_rad.sin()).abs() < 1e-4);
                let height_m = range_m * beam.elevation_rad.sin() + beam.vertical_offset_m;
                prop_assert!((z - height_m).abs() < 1e-5);
            }
        }
        prop_assert!(returns.next().is_none());
    }
}
