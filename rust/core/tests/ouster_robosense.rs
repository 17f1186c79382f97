//! Does every Ouster and RoboSense model give back what was written into its packets, count what is
//! missing, and survive any bytes?

#[path = "support/line.rs"]
mod line;

use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::ouster::layout::{self as columns, Layout, RawColumn};
use lidar_deflect_core::packet::ouster::profile::PROFILES;
use lidar_deflect_core::packet::ouster::{metadata, profile::Profile};
use lidar_deflect_core::packet::robosense::rotating::{Family, Rotating};
use lidar_deflect_core::packet::robosense::{airy, bpearl, difop, helios, layout, rs, ruby};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{
    Decoded, Decoder, Model, ModelRef, PacketKind, Place, model, unit_models,
};
use lidar_deflect_core::stream::{Given, Scan, ScanOptions, ScanReport};
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MUTATIONS: usize = 100_000;
/// 2024-06-10 06:13:20.5 UTC.
const START_NS: i64 = 1_718_000_000_500_000_000;

/// Range in units and brightness of an echo, by block or column, channel and return.
type Echo<'a> = &'a dyn Fn(usize, usize, usize) -> (u32, u8);

/// Writes the packet with a number, of so many returns, with echoes.
type Encode = Box<dyn Fn(u32, usize, Echo<'_>) -> Vec<u8>>;

/// A model with what writes its packets.
struct Writer {
    model: ModelRef,
    files: Vec<UnitFile>,
    /// Metres of one unit.
    unit_m: f64,
    /// Writes its packets.
    encode: Encode,
    /// Returns of a shot that it can write.
    returns: &'static [usize],
    period_ns: i64,
}

/// Metadata of a sensor with 32 beams.
fn metadata_of(profile: &Profile, window: (usize, usize)) -> UnitFile {
    let angles = |factor: f64| -> String {
        let list: Vec<String> = (0..32)
            .map(|beam| format!("{:.2}", factor * f64::from(16 - beam)))
            .collect();
        list.join(",")
    };
    let text = format!(
        r#"{{"sensor_info": {{"prod_line": "OS-1-32", "prod_sn": "122239000672", "initialization_id": 77}},
        "beam_intrinsics": {{"beam_altitude_angles": [{}], "beam_azimuth_angles": [{}]}},
        "lidar_data_format": {{"columns_per_frame": 1024, "columns_per_packet": 16, "pixels_per_column": 32,
          "column_window": [{}, {}], "udp_profile_lidar": "{}"}},
        "config_params": {{"lidar_mode": "1024x10"}}}}"#,
        angles(1.3),
        angles(0.2),
        window.0,
        window.1,
        profile.name
    );
    UnitFile::new(format!("{}.json", profile.name), text)
}

fn ouster(profile: &'static Profile, window: (usize, usize)) -> Writer {
    let file = metadata_of(profile, window);
    let metadata = metadata::read(&file).unwrap().unwrap();
    let layout = metadata.layout;
    let packets = metadata.packets_per_turn() as u32;
    let returns: &[usize] = if profile.echoes.len() == 2 {
        &[2]
    } else {
        &[1]
    };
    Writer {
        model: unit_models(std::slice::from_ref(&file))[0],
        files: vec![file],
        unit_m: 0.001,
        encode: Box::new(move |number, _, echo| {
            let first = window.0 as u32 / 16 * 16 + number % packets * 16;
            ouster_packet(layout, profile, number / packets, first, echo)
        }),
        returns,
        period_ns: 1_562_500,
    }
}

fn ouster_packet(
    layout: Layout,
    profile: &Profile,
    turn: u32,
    first: u32,
    echo: Echo<'_>,
) -> Vec<u8> {
    let column = |place: u32| {
        let pixel = |ring: usize| {
            let mut bytes = vec![0; profile.pixel_len];
            for (index, field) in profile.echoes.iter().enumerate() {
                let (range, brightness) = echo(place as usize, ring, index);
                field.range.write(&mut bytes, range);
                field.reflectivity.write(&mut bytes, brightness.into());
            }
            bytes
        };
        let since = u64::from(turn) * 1024 + u64::from(first + place);
        RawColumn {
            time_ns: START_NS as u64 + since * 97_656,
            number: (first + place) as u16,
            is_valid: true,
            pixels: (0..32).map(pixel).collect(),
        }
    };
    let packet = columns::RawPacket {
        frame: (65_530 + turn) % 65_536,
        init_id: 77,
        serial: 122_239_000_672,
        columns_per_turn: 1024,
        columns: (0..16).map(column).collect(),
    };
    columns::encode(layout, &packet)
}

/// A unit that tells its angles where they are at `azimuths`.
fn unit(azimuths: usize) -> Vec<UnitFile> {
    let angles: Vec<(i32, i32)> = (0..128)
        .map(|laser| (1500 - 20 * laser, 300 - 4 * laser))
        .collect();
    let lasers = (azimuths - 468) / 3;
    vec![UnitFile::new(
        "difop",
        difop::encode(600, 0, azimuths, &angles[..lasers.min(128)]),
    )]
}

fn robosense<F: Family>(
    rotating: &'static Rotating<F>,
    header: &[(usize, u8)],
    files: Vec<UnitFile>,
    unit_m: f64,
) -> Writer {
    let header = header.to_vec();
    let layout = rotating.0.layout();
    let is_half = rotating.0.lasers() == 16;
    Writer {
        model: rotating,
        files,
        unit_m,
        returns: &[1, 2],
        period_ns: rotating.period_ns(lidar_deflect_core::packet::ReturnMode::Strongest),
        encode: Box::new(move |number, returns, echo| {
            let full = rotating.0.blocks_of_firing(returns);
            let firings = layout.blocks.div_ceil(full);
            let block = |block: usize| {
                let firing = number as usize * firings + block / full;
                let channel = |channel: usize| {
                    let slot = rotating.0.slot(returns, block % full, channel);
                    let place = if is_half && returns == 2 {
                        channel % 16
                    } else {
                        channel
                    };
                    let (range, intensity) = echo(block / full * full, place, slot.echo);
                    RawEcho {
                        range: range as u16,
                        intensity,
                    }
                };
                (
                    (firing * 20 % 36_000) as u16,
                    (0..layout.channels).map(channel).collect(),
                )
            };
            let mut header = header.clone();
            if layout.body == 80 {
                header.push((7, if returns == 2 { 3 } else { 1 }));
            }
            rotating.encode(&layout::RawPacket {
                time_ns: START_NS
                    + i64::from(number)
                        * rotating.period_ns(lidar_deflect_core::packet::ReturnMode::Strongest)
                        / 1000
                        * 1000,
                counter: number.wrapping_add(u32::MAX - 40),
                header,
                blocks: (0..layout.blocks).map(block).collect(),
            })
        }),
    }
}

fn ousters() -> Vec<Writer> {
    let mut writers: Vec<Writer> = PROFILES
        .iter()
        .map(|profile| ouster(profile, (0, 1023)))
        .collect();
    writers.push(ouster(&PROFILES[1], (320, 700)));
    writers
}

fn robosenses() -> Vec<Writer> {
    let angles_32 = || unit(564);
    let mut classic = vec![
        robosense(&rs::RS_16, &[(31, 1)], Vec::new(), 0.005),
        robosense(&rs::RS_32, &[(31, 2)], angles_32(), 0.005),
        robosense(&bpearl::BPEARL, &[(31, 3)], angles_32(), 0.005),
        robosense(&bpearl::BPEARL_4, &[(31, 3), (32, 4)], Vec::new(), 0.0025),
        robosense(
            &helios::HELIOS_32,
            &[(17, 1), (31, 6), (32, 1)],
            angles_32(),
            0.0025,
        ),
        robosense(
            &helios::HELIOS_16P,
            &[(17, 1), (31, 6), (32, 3)],
            Vec::new(),
            0.0025,
        ),
        robosense(
            &helios::HELIOS_32_31DEG,
            &[(17, 0), (31, 6), (32, 2)],
            Vec::new(),
            0.005,
        ),
        robosense(
            &helios::HELIOS_32_26DEG,
            &[(17, 1), (31, 6), (32, 4)],
            Vec::new(),
            0.0025,
        ),
        robosense(&airy::AIRY, &[(31, 0x31), (32, 2)], unit(756), 0.005),
        robosense(&airy::FAIRY, &[(31, 0x0A), (32, 2)], unit(756), 0.005),
    ];
    for (rotating, kind) in [
        (&ruby::RUBY_128, 4),
        (&ruby::RUBY_80, 4),
        (&ruby::RUBY_48, 4),
        (&ruby::PLUS_128, 5),
        (&ruby::PLUS_80, 5),
        (&ruby::PLUS_48, 5),
    ] {
        classic.push(robosense(rotating, &[(31, kind)], unit(852), 0.005));
    }
    classic
}

fn writers() -> Vec<Writer> {
    ousters().into_iter().chain(robosenses()).collect()
}

fn decode(writer: &Writer, payload: &[u8], out: &mut Decoded) {
    let head = writer.model.head(payload).unwrap();
    let place = Place {
        time: Timestamp(head.device_ns),
        packet: 7,
        mean_rate_rad_per_ns: 0.0,
    };
    writer
        .model
        .fit(&writer.files)
        .unwrap()
        .decoder
        .decode(payload, place, out);
}

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

/// Everything that may be asked of a payload.
fn ask_everything(writer: &Writer, decoder: &mut dyn Decoder, payload: &[u8], out: &mut Decoded) {
    for model in [writer.model, model("ouster").unwrap()] {
        let _ = (
            model.recognise(payload),
            model.fits(payload),
            model.misfit(payload),
            model.is_sure(payload),
        );
        let _ = (model.suits(&[payload]), model.tally(payload));
        if let Some(head) = model.head(payload) {
            let _ = (
                head.paced(1e-8),
                head.arcs().count(),
                head.next_azimuth_rad(),
            );
        }
    }
    out.clear();
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: u32::MAX,
        mean_rate_rad_per_ns: 1e-8,
    };
    decoder.decode(payload, place, out);
    assert!(out.cloud.len() <= 32 * 1024);
    for echo in out.cloud.iter() {
        assert!(
            echo.xyz_m.iter().all(|metres| metres.is_finite()),
            "{echo:?}"
        );
    }
}

fn steady(place: usize, channel: usize, index: usize) -> (u32, u8) {
    (
        (1_000 + 37 * place + 11 * channel + 400 * index) as u32 / 8 * 8,
        channel as u8,
    )
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

fn survive(own: &[Writer], seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = Decoded::default();
    let mut decoders: Vec<_> = own
        .iter()
        .map(|writer| writer.model.fit(&writer.files).unwrap().decoder)
        .collect();
    let samples: Vec<Vec<u8>> = own
        .iter()
        .map(|writer| (writer.encode)(9, writer.returns[0], &steady))
        .collect();
    for round in 0..MUTATIONS {
        let place = round % own.len();
        let mut payload = samples[place].clone();
        for _ in 0..random.random_range(1..40) {
            // Headers and tails matter more than echoes.
            let at = match random.random_range(0..3) {
                0 => random.random_range(0..96),
                1 => payload.len() - 1 - random.random_range(0..60),
                _ => random.random_range(0..payload.len()),
            };
            payload[at] = random.random();
        }
        ask_everything(&own[place], &mut *decoders[place], &payload, &mut out);
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

/// Sends packets as `order` says; each arrives when it is complete.
fn scan(writer: &Writer, order: &[u32]) -> ScanReport {
    let units = writer.files.iter().map(|file| Given {
        source: None,
        file: file.clone(),
        is_named: false,
    });
    let mut scan = Scan::new(ScanOptions {
        units: units.collect(),
        ..ScanOptions::default()
    });
    let sent = order.iter().map(|number| {
        let payload = (writer.encode)(*number, writer.returns[0], &steady);
        let head = writer.model.head(&payload).unwrap();
        (Timestamp(head.device_ns) + writer.period_ns, payload)
    });
    line::deliver(6699, sent, |datagram| scan.push(datagram));
    scan.finish()
}

#[test]
fn numbered_packets_that_are_lost_repeated_or_late_are_counted_exactly() {
    let numbered = |writer: &&Writer| writer.model.sequence_wrap().is_some();
    let all = writers();
    for writer in all.iter().filter(numbered) {
        let mut order = Vec::new();
        // Losses, repetitions and late packets far enough apart that one does not touch another.
        for number in 0..1500_u32 {
            match number % 45 {
                _ if !(100..1400).contains(&number) => order.push(number),
                5 => {}
                14 => order.extend([number, number]),
                23 => {} // comes two later
                25 => order.extend([number, number - 2]),
                _ => order.push(number),
            }
        }
        let count = |rest: u32| (100..1400).filter(|number| number % 45 == rest).count() as u64;
        let report = scan(writer, &order);
        let (id, title) = (writer.model.id(), writer.model.title());
        assert_eq!(report.lidars.len(), 1, "{title}: {:?}", report.others);
        let info = &report.lidars[0];
        assert_eq!(info.model.id(), id);
        let counts = info.counts;
        let found = (
            counts.packets,
            counts.lost,
            counts.duplicated,
            counts.late,
            counts.too_late,
        );
        assert_eq!(
            found,
            (1500 - count(5), count(5), count(14), count(23), 0),
            "{title}"
        );
        assert!(info.calibration.is_ok(), "{title}");
    }
}

#[test]
fn every_model_is_named_from_its_packets_and_the_description_of_its_unit() {
    for writer in writers() {
        let report = scan(&writer, &(0..200).collect::<Vec<_>>());
        let [info] = &report.lidars[..] else {
            panic!("{}: {:?}", writer.model.id(), report.others)
        };
        assert_eq!(info.model.id(), writer.model.id());
        assert_eq!(
            (info.counts.packets, info.counts.lost),
            (200, 0),
            "{}",
            info.model.id()
        );
        assert!(
            (info.rpm - 600.0).abs() < 4.0 || !matches!(info.model.id(), "os1-32" | "helios32"),
            "{} {}",
            info.model.id(),
            info.rpm
        );
    }
}

#[test]
fn ouster_without_metadata_is_found_and_says_how_to_get_them() {
    use lidar_deflect_core::error::Coded;
    for mut writer in ousters() {
        writer.files.clear();
        let report = scan(&writer, &(0..200).collect::<Vec<_>>());
        let info = &report.lidars[0];
        assert_eq!((info.model.id(), info.return_mode), ("ouster", "unknown"));
        let error = info.calibration.clone().unwrap_err();
        assert_eq!(error.code(), "beams.missing");
        assert!(error.hint().unwrap().contains("--beams ADDRESS=FILE"));
    }
}

#[test]
fn metadata_of_another_sensor_are_taken_with_a_warning_and_two_of_them_not_at_all() {
    let mut writer = ouster(&PROFILES[1], (0, 1023));
    let text = String::from_utf8(writer.files[0].content.clone()).unwrap();
    let other = |serial: &str| {
        let text = text.replace("122239000672", serial).replace(": 77", ": 78");
        UnitFile::new(format!("{serial}.json"), text)
    };
    writer.files = vec![other("111111111111")];
    let info = scan(&writer, &(0..200).collect::<Vec<_>>())
        .lidars
        .remove(0);
    assert_eq!(info.model.id(), "os1-32");
    assert!(
        info.notes
            .iter()
            .any(|note| note.contains("another sensor")),
        "{:?}",
        info.notes
    );
    writer.files.push(other("222222222222"));
    let info = scan(&writer, &(0..200).collect::<Vec<_>>())
        .lidars
        .remove(0);
    assert_eq!(info.model.id(), "ouster");
    assert!(
        info.calibration
            .unwrap_err()
            .to_string()
            .contains("222222222222.json")
    );
}

#[test]
fn two_files_that_differ_in_ports_alone_describe_one_sensor() {
    let mut writer = ouster(&PROFILES[1], (0, 1023));
    let text = String::from_utf8(writer.files[0].content.clone()).unwrap();
    let other = text.replacen('{', "{\"udp_port_imu\": 7504, ", 1);
    writer.files.push(UnitFile::new("other.json", other));
    let report = scan(&writer, &(0..200).collect::<Vec<_>>());
    assert_eq!(report.lidars[0].model.id(), "os1-32");
    assert!(report.lidars[0].calibration.is_ok());
    report.check_units().unwrap();
}

#[test]
fn an_older_helios_is_told_by_what_its_halves_see() {
    for is_half in [true, false] {
        let echo = move |place: usize, channel: usize, _: usize| {
            let beam = if is_half { channel % 16 } else { channel };
            (
                (1_000 + 37 * place + 300 * beam + channel / 16 * 5) as u32,
                9,
            )
        };
        let header = [(17, 1), (30, 6)];
        let mut writer = robosense(&helios::HELIOS_32, &header, Vec::new(), 0.0025);
        if is_half {
            writer = robosense(&helios::HELIOS_16P, &header, Vec::new(), 0.0025);
        }
        let packets: Vec<Vec<u8>> = (0..40)
            .map(|number| (writer.encode)(number, 1, &echo))
            .collect();
        let payloads: Vec<&[u8]> = packets.iter().map(Vec::as_slice).collect();
        // Where the halves differ the header still names no model: both stay possible.
        assert!(helios::HELIOS_16P.suits(&payloads));
        assert_eq!(helios::HELIOS_32.suits(&payloads), !is_half);
        let doubt = helios::HELIOS_16P.doubt(&payloads);
        assert_eq!(doubt.is_none(), is_half);
        assert!(doubt.is_none_or(|text| text.contains("--sensor SOURCE=helios32")));
        assert!(!helios::HELIOS_32_26DEG.suits(&payloads));
    }
}
