//! Data packets of every Ouster and of every RoboSense with a rotor, made from echoes, and what tests ask of them.
#![allow(dead_code)] // each test crate uses a part of it

use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::ouster::layout::{self as columns, Layout, RawColumn};
use lidar_deflect_core::packet::ouster::{metadata, profile::PROFILES, profile::Profile};
use lidar_deflect_core::packet::robosense::rotating::{Family, Rotating};
use lidar_deflect_core::packet::robosense::{airy, bpearl, difop, helios, layout, rs, ruby};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{
    Decoded, Decoder, Model, ModelRef, Place, ReturnMode, model, unit_models,
};
use lidar_deflect_core::stream::{Given, Scan, ScanOptions, ScanReport};
use lidar_deflect_core::time::Timestamp;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::line;

/// Packets that are changed of each maker.
pub const MUTATIONS: usize = 100_000;
/// 2024-06-10 06:13:20.5 UTC.
const START_NS: i64 = 1_718_000_000_500_000_000;

/// Range in units and brightness of an echo, by block or column, channel and return.
pub type Echo<'a> = &'a dyn Fn(usize, usize, usize) -> (u32, u8);

/// Writes the packet with a number, of so many returns, with echoes.
pub type Encode = Box<dyn Fn(u32, usize, Echo<'_>) -> Vec<u8>>;

/// A model with what writes its packets.
pub struct Writer {
    pub model: ModelRef,
    pub files: Vec<UnitFile>,
    /// Metres of one unit.
    pub unit_m: f64,
    /// Writes its packets.
    pub encode: Encode,
    /// Returns of a shot that it can write.
    pub returns: &'static [usize],
    pub period_ns: i64,
}

/// Metadata of a sensor with 32 beams.
pub fn metadata_of(profile: &Profile, window: (usize, usize)) -> UnitFile {
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

pub fn ouster(profile: &'static Profile, window: (usize, usize)) -> Writer {
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
pub fn unit(azimuths: usize) -> Vec<UnitFile> {
    let angles: Vec<(i32, i32)> = (0..128)
        .map(|laser| (1500 - 20 * laser, 300 - 4 * laser))
        .collect();
    let lasers = (azimuths - 468) / 3;
    vec![UnitFile::new(
        "difop",
        difop::encode(600, 0, azimuths, &angles[..lasers.min(128)]),
    )]
}

pub fn robosense<F: Family>(
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
        period_ns: rotating.period_ns(ReturnMode::Strongest),
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
                    + i64::from(number) * rotating.period_ns(ReturnMode::Strongest) / 1000 * 1000,
                counter: number.wrapping_add(u32::MAX - 40),
                header,
                blocks: (0..layout.blocks).map(block).collect(),
            })
        }),
    }
}

pub fn ousters() -> Vec<Writer> {
    let mut writers: Vec<Writer> = PROFILES
        .iter()
        .map(|profile| ouster(profile, (0, 1023)))
        .collect();
    writers.push(ouster(&PROFILES[1], (320, 700)));
    writers
}

pub fn robosenses() -> Vec<Writer> {
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

pub fn writers() -> Vec<Writer> {
    ousters().into_iter().chain(robosenses()).collect()
}

pub fn decode(writer: &Writer, payload: &[u8], out: &mut Decoded) {
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

/// Everything that may be asked of a payload.
pub fn ask_everything(
    writer: &Writer,
    decoder: &mut dyn Decoder,
    payload: &[u8],
    out: &mut Decoded,
) {
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

pub fn steady(place: usize, channel: usize, index: usize) -> (u32, u8) {
    (
        (1_000 + 37 * place + 11 * channel + 400 * index) as u32 / 8 * 8,
        channel as u8,
    )
}

pub fn survive(own: &[Writer], seed: u64) {
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

/// Sends packets as `order` says; each arrives when it is complete.
pub fn scan(writer: &Writer, order: &[u32]) -> ScanReport {
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
