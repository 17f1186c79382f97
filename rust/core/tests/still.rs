//! Does every sensor without a rotor (Livox; RoboSense M series, E1, EMX, EM4) give back what was written
//! into its packets, and survive any bytes?

#[path = "support/still.rs"]
mod still;

use lidar_deflect_core::cloud::ReturnKind;
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{Decoded, Decoder, MODELS, ModelRef, PacketKind, Place};
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use still::{Seen, Setting, Writer, steady, writers};

const MUTATIONS: usize = 100_000;

fn place_at(device_ns: i64) -> Place {
    Place {
        time: Timestamp(device_ns),
        packet: 7,
        mean_rate_rad_per_ns: 0.0,
    }
}

fn seen() -> impl Strategy<Value = Seen> {
    // Within the limits of all models and the centimetres of the coarsest coordinates.
    let range = prop_oneof![1 => Just(0.0), 4 => (1..180_u32).prop_map(f64::from)];
    let angles = (-1.0..1.0, -0.3..0.3);
    (range, angles, any::<u8>()).prop_map(|(range_m, (yaw_rad, pitch_rad), brightness)| Seen {
        range_m,
        yaw_rad,
        pitch_rad,
        brightness,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn what_is_written_comes_back(all in prop::collection::vec(seen(), 997), number in 0..100_000_u32) {
        let at = |shot: usize, echo: usize| all[(shot * 31 + echo * 7) % all.len()];
        for writer in writers() {
            for setting in &writer.settings {
                check(&writer, setting, number, &at);
            }
        }
    }
}

fn check(writer: &Writer, setting: &Setting, number: u32, at: &dyn Fn(usize, usize) -> Seen) {
    let (model, name) = (writer.model, setting.name);
    let payload = (setting.encode)(number, at);
    let kind = model.recognise(&payload);
    let is_told = writer.is_told;
    assert_eq!(kind, is_told.then_some(PacketKind::Data), "{name}");
    assert!(model.fits(&payload), "{name}");
    let head = model.head(&payload).unwrap();
    assert_eq!(head.return_mode, setting.mode, "{name}");
    assert_eq!(head.device_ns, (setting.first_ns)(number), "{name}");
    let mut out = Decoded::default();
    let mut decoder = model.fit(&writer.files).unwrap().decoder;
    decoder.decode(&payload, place_at(head.device_ns), &mut out);
    let tally = model.tally(&payload);
    let found = (out.cloud.len(), out.merged);
    assert_eq!(
        found,
        (tally.points as usize, u64::from(tally.merged)),
        "{name}"
    );
    // Every echo that was written is found, once, or was merged into its equal.
    let mut written = 0;
    for shot in 0..setting.shots {
        for echo in 0..setting.echoes {
            written += u64::from(at(shot, echo).range_m > 0.0);
        }
    }
    assert_eq!(found.0 as u64 + found.1, written, "{name}");
    for echo in out.cloud.iter() {
        let shot = (setting.shot_of)(&echo);
        let sent = at(shot, usize::from(echo.return_index) % setting.echoes);
        let range_m = f64::from(echo.range_m);
        // Directions are written in parts of 1/32768 or in whole millimetres or centimetres.
        let grain_m = setting.grain_m + sent.range_m * setting.grain_rad;
        assert!(
            (range_m - sent.range_m).abs() <= grain_m,
            "{name}: {echo:?} of {sent:?}"
        );
        assert_eq!(echo.intensity, u16::from(sent.brightness), "{name}");
        let sent = (setting.aimed)(number, shot, sent, at(shot, 0));
        for (metres, wanted) in echo.xyz_m.iter().zip(sent.xyz_m()) {
            assert!(
                (f64::from(*metres) - wanted).abs() <= grain_m + 1e-5,
                "{name}: {echo:?} of {sent:?}"
            );
        }
        let [x, y, _] = echo.xyz_m.map(f64::from);
        let azimuth_rad = f64::from(echo.azimuth_rad);
        let level_m = x.hypot(y);
        assert!(
            (level_m * azimuth_rad.cos() - x).abs() < grain_m + 1e-3,
            "{name}: {echo:?}"
        );
        assert!(
            (level_m * azimuth_rad.sin() - y).abs() < grain_m + 1e-3,
            "{name}: {echo:?}"
        );
        let since_ns = echo.time - Timestamp(head.device_ns);
        assert_eq!(
            since_ns,
            (setting.since_ns)(number, shot),
            "{name}: shot {shot}"
        );
    }
}

#[test]
fn a_farther_return_is_the_later_one_in_whatever_order() {
    for writer in writers() {
        for setting in writer.settings.iter().filter(|setting| setting.echoes > 1) {
            for is_far_first in [true, false] {
                let at = |_: usize, echo: usize| Seen {
                    range_m: 10.0 + if is_far_first { 9 - echo } else { echo } as f64,
                    brightness: 9,
                    ..Seen::default()
                };
                let payload = (setting.encode)(3, &at);
                let mut out = Decoded::default();
                let mut decoder = writer.model.fit(&writer.files).unwrap().decoder;
                decoder.decode(&payload, place_at(0), &mut out);
                let nearest = out
                    .cloud
                    .iter()
                    .map(|echo| echo.range_m)
                    .fold(f32::MAX, f32::min);
                for echo in out.cloud.iter() {
                    let is_near = echo.range_m - nearest < 0.5;
                    let is_first =
                        matches!(echo.return_kind, ReturnKind::First | ReturnKind::Strongest);
                    assert_eq!(is_near, is_first, "{}: {echo:?}", setting.name);
                }
            }
        }
    }
}

#[test]
fn an_echo_that_is_repeated_is_one_point() {
    for writer in writers() {
        for setting in writer.settings.iter().filter(|setting| setting.echoes > 1) {
            let at = |_: usize, _: usize| Seen {
                range_m: 12.0,
                ..Seen::default()
            };
            let payload = (setting.encode)(3, &at);
            let tally = writer.model.tally(&payload);
            let shots = setting.shots as u32;
            assert_eq!(tally.points, shots, "{}", setting.name);
            assert_eq!(
                tally.merged,
                shots * (setting.echoes as u32 - 1),
                "{}",
                setting.name
            );
        }
    }
}

/// Everything that may be asked of a payload.
fn ask_everything(writer: &Writer, decoder: &mut dyn Decoder, payload: &[u8], out: &mut Decoded) {
    let model = writer.model;
    let _ = (
        model.recognise(payload),
        model.fits(payload),
        model.misfit(payload),
    );
    let _ = (model.is_sure(payload), model.suits(&[payload]));
    if let Some(mut gather) = model.gather() {
        gather.take(payload);
        let files: Vec<UnitFile> = gather.file().into_iter().collect();
        let _ = (
            model.describe(&files),
            files.iter().all(|file| model.takes(file)),
        );
    }
    if let Some(head) = model.head(payload) {
        let _ = (
            head.paced(1e-8),
            head.arcs().count(),
            head.next_azimuth_rad(),
        );
        let _ = (head.frame_len(), head.first_number(77), head.in_frame(5, 9));
    }
    out.clear();
    let merged = out.merged;
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: u32::MAX,
        mean_rate_rad_per_ns: 1e-8,
    };
    decoder.decode(payload, place, out);
    let tally = model.tally(payload);
    assert_eq!(out.cloud.len(), tally.points as usize, "{}", model.id());
    assert_eq!(
        out.merged - merged,
        u64::from(tally.merged),
        "{}",
        model.id()
    );
    for echo in out.cloud.iter() {
        assert!(
            echo.xyz_m.iter().all(|metres| metres.is_finite()),
            "{echo:?}"
        );
        assert!(
            (0.0..std::f32::consts::TAU).contains(&echo.azimuth_rad),
            "{echo:?}"
        );
    }
    assert!(out.encoder_rad.iter().all(|rad| (0.0..7.0).contains(rad)));
}

#[test]
fn every_prefix_of_every_packet_is_survived() {
    let mut out = Decoded::default();
    for writer in writers() {
        let mut decoder = writer.model.fit(&writer.files).unwrap().decoder;
        for setting in &writer.settings {
            let whole = (setting.encode)(9, &steady);
            for length in 0..whole.len() {
                let prefix = &whole[..length];
                ask_everything(&writer, &mut *decoder, prefix, &mut out);
                // A packet of a jumbo datagram is an M1's cut short.
                let claims = |model: &&ModelRef| {
                    model.id() != "m1-jumbo" && model.recognise(prefix).is_some()
                };
                // The length alone tells those whose type byte is not known.
                let is_typed = !matches!(writer.model.id(), "m2" | "m3" | "mx");
                let known = MODELS.iter().find(claims).filter(|_| is_typed);
                assert!(
                    known.is_none(),
                    "{length} bytes of {} are {known:?}",
                    setting.name
                );
            }
        }
    }
}

fn survive(is_own: impl Fn(&Writer) -> bool, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = Decoded::default();
    let own: Vec<Writer> = writers().into_iter().filter(is_own).collect();
    let decoder = |writer: &Writer| writer.model.fit(&writer.files).unwrap().decoder;
    let mut decoders: Vec<_> = own.iter().map(decoder).collect();
    let samples = |writer: &Writer| -> Vec<Vec<u8>> {
        let settings = writer.settings.iter();
        settings
            .map(|setting| (setting.encode)(9, &steady))
            .collect()
    };
    let samples: Vec<Vec<Vec<u8>>> = own.iter().map(samples).collect();
    for round in 0..MUTATIONS {
        let place = round % own.len();
        let sent = &samples[place];
        let mut payload = sent[round / own.len() % sent.len()].clone();
        for _ in 0..random.random_range(1..20) {
            // Headers matter more than points.
            let at = match random.random_range(0..2) {
                0 => random.random_range(0..40),
                _ => random.random_range(0..payload.len()),
            };
            payload[at] = random.random();
        }
        ask_everything(&own[place], &mut *decoders[place], &payload, &mut out);
    }
}

#[test]
fn changed_bytes_of_livox_are_survived() {
    survive(|writer| writer.model.title().starts_with("Livox"), 11);
}

#[test]
fn changed_bytes_of_the_solid_robosense_are_survived() {
    survive(|writer| writer.model.title().starts_with("RoboSense"), 12);
}
