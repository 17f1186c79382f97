//! Does every Ouster, and every RoboSense with a rotor, give back what was written into its packets, and
//! survive any bytes?

#[path = "support/line.rs"]
mod line;
#[path = "support/spinning.rs"]
mod spinning;

use lidar_deflect_core::packet::ouster::{metadata, profile::PROFILES};
use lidar_deflect_core::packet::robosense::rotating::Family as _;
use lidar_deflect_core::packet::robosense::{difop, helios};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{Decoded, PacketKind};
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use spinning::{
    Echo, Writer, ask_everything, decode, metadata_of, ousters, robosenses, steady, survive, unit,
    writers,
};

fn raw() -> impl Strategy<Value = (u32, u8)> {
    // Whole steps of 8 mm, so that the low-data profiles hold them; within the limits of all models.
    let range = prop_oneof![1 => Just(0), 4 => (30..1_000_u32).prop_map(|steps| steps * 8)];
    (range, any::<u8>())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn what_is_written_comes_back(echoes in prop::collection::vec(raw(), 1301), number in 0..100_000_u32) {
        let at = |place: usize, channel: usize, index: usize| echoes[(place * 131 + channel * 7 + index * 3) % echoes.len()];
        for writer in writers() {
            for returns in writer.returns {
                check(&writer, *returns, number, &at);
            }
        }
    }
}

fn check(writer: &Writer, returns: usize, number: u32, at: Echo<'_>) {
    let id = writer.model.id();
    let payload = (writer.encode)(number, returns, at);
    assert_eq!(
        writer.model.recognise(&payload),
        Some(PacketKind::Data),
        "{id}"
    );
    let head = writer.model.head(&payload).unwrap();
    assert!(
        head.rate_rad_per_ns > 0.0 && head.turned_rad > 0.0,
        "{id}: {head:?}"
    );
    let mut out = Decoded::default();
    decode(writer, &payload, &mut out);
    let tally = writer.model.tally(&payload);
    assert_eq!(
        (out.cloud.len(), out.merged),
        (tally.points as usize, u64::from(tally.merged)),
        "{id}"
    );
    let is_half = matches!(id, "rs16" | "helios16p");
    if is_half && returns == 2 {
        return; // without equal echoes two returns are taken for two shots
    }
    assert!(!out.cloud.is_empty(), "{id}");
    for echo in out.cloud.iter() {
        let units = (f64::from(echo.range_m) / writer.unit_m).round() as u32;
        assert!(
            (f64::from(echo.range_m) - f64::from(units) * writer.unit_m).abs() < 1e-5,
            "{id}"
        );
        let [x, y, z] = echo.xyz_m.map(f64::from);
        let found_m = (x * x + y * y + z * z).sqrt();
        // Lenses and the base stand up to 0.1 m off the origin.
        assert!(
            (found_m - f64::from(echo.range_m)).abs() < 0.15,
            "{id}: {echo:?}"
        );
        let firsts: Vec<usize> = if id.starts_with("os") {
            vec![usize::from(echo.block) % 16]
        } else {
            (0..12).collect()
        };
        let is_written = firsts.iter().any(|first| {
            (0..128).any(|channel| {
                let (range, brightness) = at(*first, channel, usize::from(echo.return_index));
                range == units && u16::from(brightness) == echo.intensity
            })
        });
        assert!(is_written, "{id}: {echo:?}");
        let since_ns = echo.time - Timestamp(head.device_ns);
        // A firing of which the next packet has the second return counts half.
        let is_shared = id.starts_with("ruby") && returns == 2;
        let most_ns = head.duration_ns + i64::from(is_shared) * 56_000;
        assert!(
            (0..=most_ns).contains(&since_ns),
            "{id}: {since_ns} of {most_ns}"
        );
    }
}

#[test]
fn every_prefix_of_every_packet_is_survived() {
    let mut out = Decoded::default();
    for writer in writers() {
        let mut decoder = writer.model.fit(&writer.files).unwrap().decoder;
        let whole = (writer.encode)(9, writer.returns[0], &steady);
        for length in 0..whole.len() {
            let prefix = &whole[..length];
            ask_everything(&writer, &mut *decoder, prefix, &mut out);
            assert_eq!(
                writer.model.recognise(prefix),
                None,
                "{} {length}",
                writer.model.id()
            );
        }
    }
}

#[test]
fn changed_bytes_of_ouster_are_survived() {
    survive(&ousters(), 3);
}

#[test]
fn changed_bytes_of_robosense_are_survived() {
    survive(&robosenses(), 4);
}

#[test]
fn changed_descriptions_of_units_are_survived() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let metadata = metadata_of(&PROFILES[1], (0, 1023)).content;
    let difop = unit(564).remove(0).content;
    for round in 0..20_000 {
        let mut content = if round % 2 == 0 {
            metadata.clone()
        } else {
            difop.clone()
        };
        for _ in 0..random.random_range(1..20) {
            let at = random.random_range(0..content.len());
            content[at] = random.random();
        }
        let file = UnitFile::new("changed", content);
        let _ = metadata::read(&file);
        let _ = helios::HELIOS_32
            .0
            .told(&difop::Difop::new(&difop).unwrap());
        if let Some(bytes) = difop::packet(&file) {
            let told = difop::Difop::new(&bytes).unwrap();
            let _ = (
                told.rs16_angles(),
                told.angles(128, 852, 0.01),
                told.clock(),
                told.serial(),
            );
        }
    }
}
