//! Data packets of every sensor without a rotor, made from what is seen.
#![allow(dead_code)] // each test crate uses a part of it

use lidar_deflect_core::cloud::Return;
use lidar_deflect_core::packet::livox::points::{Coordinates, Form, RawPoint};
use lidar_deflect_core::packet::livox::sensor::{self as livox, Livox, Protocol};
use lidar_deflect_core::packet::livox::shots::Sync;
use lidar_deflect_core::packet::livox::{sdk1, sdk2};
use lidar_deflect_core::packet::robosense::solid::blocks::{self, Blocks, Point};
use lidar_deflect_core::packet::robosense::solid::columns::{Columns, RawColumn};
use lidar_deflect_core::packet::robosense::solid::description::encode_em4;
use lidar_deflect_core::packet::robosense::solid::header::RawHeader;
use lidar_deflect_core::packet::robosense::solid::sensor::{self as solid, Body, Solid};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{Model, ModelRef, ReturnMode};

/// 2024-06-10 06:13:20.5 UTC.
pub const START_NS: i64 = 1_718_000_000_500_000_000;

/// What one return sees; range 0: nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    pub range_m: f64,
    pub yaw_rad: f64,
    pub pitch_rad: f64,
    pub brightness: u8,
}

impl Seen {
    fn direction(&self) -> [f64; 3] {
        let (up, level) = self.pitch_rad.sin_cos();
        let (left, forward) = self.yaw_rad.sin_cos();
        [level * forward, level * left, up]
    }

    /// The other in this direction.
    fn towards(self, other: Seen) -> Seen {
        Seen {
            yaw_rad: self.yaw_rad,
            pitch_rad: self.pitch_rad,
            ..other
        }
    }

    pub fn xyz_m(&self) -> [f64; 3] {
        self.direction().map(|part| self.range_m * part)
    }
}

/// What is seen by shot and return.
pub type At<'a> = &'a dyn Fn(usize, usize) -> Seen;

/// Writes the packet with a number.
pub type Encode = Box<dyn Fn(u32, At<'_>) -> Vec<u8>>;

/// One way in which a model sends.
pub struct Setting {
    pub name: &'static str,
    pub mode: ReturnMode,
    /// Shots of a packet, and returns of a shot in it.
    pub shots: usize,
    pub echoes: usize,
    pub encode: Encode,
    /// Device time of the first shot of a packet, and time of each shot after it.
    pub first_ns: Box<dyn Fn(u32) -> i64>,
    pub since_ns: Box<dyn Fn(u32, usize) -> i64>,
    pub shot_of: Box<dyn Fn(&Return) -> usize>,
    /// What is seen in the direction that the packet has for a shot; the last is what its first return sees.
    pub aimed: Box<dyn Fn(u32, usize, Seen, Seen) -> Seen>,
    /// How coarse places are written: metres, and radians.
    pub grain_m: f64,
    pub grain_rad: f64,
    pub period_ns: i64,
    /// Packets of a frame, which are a tenth of a second where `is_timed`.
    pub frame: u32,
    pub is_timed: bool,
}

/// A model with all ways in which it sends.
pub struct Writer {
    pub model: ModelRef,
    pub files: Vec<UnitFile>,
    pub is_told: bool,
    pub settings: Vec<Setting>,
}

fn livox_point(form: Form, seen: &Seen, tag: u8) -> RawPoint {
    let place = |unit_m: f64| seen.xyz_m().map(|metres| (metres / unit_m).round() as i32);
    let centideg = |rad: f64| (rad.to_degrees() * 100.0).round().rem_euclid(36_000.0) as i32;
    let numbers = match form.coordinates {
        Coordinates::Wide => place(0.001),
        Coordinates::Narrow => place(0.01),
        Coordinates::Spherical => [
            (seen.range_m * 1000.0).round() as i32,
            centideg(std::f64::consts::FRAC_PI_2 - seen.pitch_rad),
            centideg(seen.yaw_rad),
        ],
    };
    RawPoint {
        numbers,
        reflectivity: seen.brightness,
        tag,
    }
}

fn livox_shots(form: Form, shots: usize, at: At<'_>) -> Vec<Vec<RawPoint>> {
    // Rain in two shots of a packet.
    let tag = |shot: usize| if shot % 48 == 5 { 0b1000 } else { 0 };
    let shot = |shot: usize| {
        let seen = |echo: usize| match form.coordinates {
            Coordinates::Spherical => at(shot, 0).towards(at(shot, echo)),
            _ => at(shot, echo),
        };
        let echoes = 0..form.echoes;
        echoes
            .map(|echo| livox_point(form, &seen(echo), tag(shot)))
            .collect()
    };
    (0..shots).map(shot).collect()
}

/// Packets of a frame that a sensor of the second protocol numbers.
pub const FRAME_LEN: u32 = 5;

fn livox_setting(model: &'static Livox, data_type: u8, name: &'static str) -> Setting {
    let (shots, form) = match model.protocol {
        Protocol::First => sdk1::form(data_type).unwrap(),
        Protocol::Second => (sdk2::POINTS, sdk2::form(data_type).unwrap()),
    };
    // The second protocol writes the time over a packet in tenths of microseconds.
    let interval_ns = model.step().until(shots - 1) / 100 * 100;
    let (period_ns, until): (i64, Box<dyn Fn(usize) -> i64>) = match model.protocol {
        Protocol::First => (
            model.step().until(shots),
            Box::new(|shot| model.step().until(shot)),
        ),
        Protocol::Second => {
            let until = move |shot: usize| shot as i64 * interval_ns / (shots as i64 - 1);
            (until(shots), Box::new(until))
        }
    };
    let first_ns = move |number: u32| START_NS + i64::from(number) * period_ns;
    let encode = move |number: u32, at: At<'_>| {
        let shots = livox_shots(form, shots, at);
        let (sync, time_ns) = (Sync::Ptp, first_ns(number));
        match model.protocol {
            Protocol::First => sdk1::encode(&sdk1::RawPacket {
                data_type,
                sync,
                time_ns,
                shots,
            }),
            Protocol::Second => sdk2::encode(&sdk2::RawPacket {
                data_type,
                sync,
                time_ns,
                interval_ns,
                counter: number.wrapping_add(64_000) as u16,
                frame: (number / FRAME_LEN) as u8,
                shots,
            }),
        }
    };
    let (grain_m, grain_rad) = match form.coordinates {
        Coordinates::Wide => (0.001, 0.0),
        Coordinates::Narrow => (0.01, 0.0),
        Coordinates::Spherical => (0.0006, 1.3e-4),
    };
    Setting {
        name,
        mode: match form.echoes {
            1 => ReturnMode::Strongest,
            2 => ReturnMode::FirstSecond,
            _ => ReturnMode::Triple,
        },
        shots,
        echoes: form.echoes,
        encode: Box::new(encode),
        first_ns: Box::new(first_ns),
        since_ns: Box::new(move |_, shot| until(shot)),
        shot_of: Box::new(|echo| usize::from(echo.block)),
        aimed: Box::new(move |_, _, seen, first| match form.coordinates {
            Coordinates::Spherical => first.towards(seen),
            _ => seen,
        }),
        grain_m,
        grain_rad,
        period_ns,
        frame: (1e8 / period_ns as f64).round() as u32,
        is_timed: true,
    }
}

fn livox(model: &'static Livox, is_told: bool, types: &[(u8, &'static str)]) -> Writer {
    let settings = types
        .iter()
        .map(|(kind, name)| livox_setting(model, *kind, name));
    Writer {
        model,
        files: Vec::new(),
        is_told,
        settings: settings.collect(),
    }
}

/// Times that packets tell in whole microseconds.
fn solid_ns(number: u32, frame: u32) -> i64 {
    START_NS + i64::from(number) * 100_000_000 / i64::from(frame) / 1000 * 1000
}

fn header(model: &Solid, mode: ReturnMode, number: u32, frame: u32) -> RawHeader {
    RawHeader {
        number: (number % frame + model.first_number()) as u16,
        return_mode: mode,
        time_ns: solid_ns(number, frame),
    }
}

fn block_point(layout: Blocks, echoes: [Seen; 2]) -> blocks::RawPoint {
    let raw = |metres: f64| (metres / 0.005).round() as u16;
    let aim = match layout.point {
        Point::Angles => {
            let centideg = |rad: f64| (rad.to_degrees() * 100.0).round() as i16;
            [
                centideg(echoes[0].pitch_rad),
                centideg(echoes[0].yaw_rad),
                0,
            ]
        }
        _ => echoes[0]
            .direction()
            .map(|part| (part * 32_768.0).round() as i16),
    };
    blocks::RawPoint {
        ranges: echoes.map(|echo| raw(echo.range_m)),
        intensities: echoes.map(|echo| echo.brightness),
        aim,
    }
}

fn blocks_setting(model: &'static Solid, mode: ReturnMode, name: &'static str) -> Setting {
    let Body::Blocks(layout) = model.body else {
        unreachable!("{name} has columns")
    };
    let frame = model.packets(mode) as u32;
    let echoes = if layout.point == Point::Pair {
        mode.returns()
    } else {
        1
    };
    let micros = move |block: usize| (block * (240 / layout.count)) as u16;
    let encode = move |number: u32, at: At<'_>| {
        let block = |block: usize| {
            let point = |channel: usize| {
                let shot = block * layout.points + channel;
                let second = if echoes == 2 {
                    at(shot, 1)
                } else {
                    Seen::default()
                };
                block_point(layout, [at(shot, 0), second])
            };
            let number = if mode.returns() == 2 {
                number % 2 + 1
            } else {
                1
            };
            let points = (0..layout.points).map(point).collect();
            (micros(block), number as u8, points)
        };
        let blocks: Vec<_> = (0..layout.count).map(block).collect();
        layout.encode(model.kind(), &header(model, mode, number, frame), &blocks)
    };
    Setting {
        name,
        mode,
        shots: layout.count * layout.points,
        echoes,
        encode: Box::new(encode),
        first_ns: Box::new(move |number| solid_ns(number, frame)),
        since_ns: Box::new(move |_, shot| i64::from(micros(shot / layout.points)) * 1000),
        shot_of: Box::new(move |echo| {
            usize::from(echo.block) * layout.points + usize::from(echo.ring)
        }),
        // The second of a pair is where the first is.
        aimed: Box::new(|_, _, seen, first| first.towards(seen)),
        grain_m: 1e-6,
        grain_rad: if layout.point == Point::Angles {
            1.3e-4
        } else {
            5e-5
        },
        period_ns: 100_000_000 / i64::from(frame),
        frame,
        is_timed: false,
    }
}

/// Pitches of an EM4, hundredths of a degree; offsets of its zones and surfaces.
const EM4_PITCH: fn(usize) -> i16 = |row| -1300 + 5 * row as i16;
const EM4_ZONE: fn(usize) -> i8 = |zone| zone as i8 - 13;
const EM4_SURFACE: [i16; 4] = [15, 0, -7, 3];
/// 189 us.
const EM4_INTERVAL_US: i8 = -67;

fn columns_setting(model: &'static Solid, mode: ReturnMode, name: &'static str) -> Setting {
    let Body::Columns(columns) = model.body else {
        unreachable!("{name} has blocks")
    };
    let frame = model.packets(mode) as u32;
    let echoes = mode.returns();
    let shots = columns.count() / echoes;
    let parts = (columns.rows() / shots) as u32;
    let is_em4 = columns == Columns::Em4;
    let row = move |number: u32, shot: usize| (number % frame % parts) as usize * shots + shot;
    let lead_ns = if is_em4 { 189_000 } else { 0 };
    let yaw = |number: u32| (number % 4000) as i16 - 2000;
    let surface = move |number: u32| (number % 2 + u32::from(is_em4)) as u8;
    let encode = move |number: u32, at: At<'_>| {
        let point = |place: usize| {
            let seen = at(place / echoes, place % echoes);
            ((seen.range_m / 0.005).round() as u16, seen.brightness)
        };
        let column = RawColumn {
            header: header(model, mode, number, frame),
            yaw: yaw(number),
            pitch_offset: 3277,
            surface: surface(number),
            interval_us: EM4_INTERVAL_US,
            points: (0..columns.count()).map(point).collect(),
        };
        columns.encode(model.kind(), &column)
    };
    let aimed = move |number: u32, shot: usize, seen: Seen, _| {
        let row = row(number, shot);
        let (yaw_deg, pitch_deg) = if is_em4 {
            let yaw = f64::from(yaw(number)) + f64::from(EM4_ZONE(row / 20));
            let surface = EM4_SURFACE[usize::from(surface(number)) - 1];
            (yaw / 100.0, f64::from(EM4_PITCH(row) + surface) / 100.0)
        } else {
            let pitch_deg = -12.08 + 0.105 * row as f64 - 3277.0 / 32_768.0;
            (f64::from(yaw(number)) / 512.0, pitch_deg)
        };
        Seen {
            yaw_rad: yaw_deg.to_radians(),
            pitch_rad: pitch_deg.to_radians(),
            ..seen
        }
    };
    Setting {
        name,
        mode,
        shots,
        echoes,
        encode: Box::new(encode),
        first_ns: Box::new(move |number| solid_ns(number, frame) - lead_ns),
        since_ns: Box::new(move |number, shot| {
            let is_even_zone = is_em4 && row(number, shot) / 20 % 2 == 1;
            if is_even_zone { lead_ns } else { 0 }
        }),
        shot_of: Box::new(move |echo| usize::from(echo.block) / echoes),
        aimed: Box::new(aimed),
        grain_m: 1e-6,
        grain_rad: 1e-8,
        period_ns: 100_000_000 / i64::from(frame),
        frame,
        is_timed: false,
    }
}

type Make = fn(&'static Solid, ReturnMode, &'static str) -> Setting;

fn solid(model: &'static Solid, make: Make, modes: &[(ReturnMode, &'static str)]) -> Writer {
    let settings = modes.iter().map(|(mode, name)| make(model, *mode, name));
    let pitches: Vec<i16> = (0..520).map(EM4_PITCH).collect();
    let zones: Vec<i8> = (0..26).map(EM4_ZONE).collect();
    let em4 = UnitFile::new("difop2", encode_em4(&pitches, &zones, &EM4_SURFACE));
    Writer {
        model,
        files: Vec::from_iter((model.id() == "em4").then_some(em4)),
        is_told: model.id() != "m1-plus",
        settings: settings.collect(),
    }
}

/// Every model without a rotor.
pub fn writers() -> Vec<Writer> {
    use ReturnMode::{Dual, First, FirstLast, FirstSecond, Last, Strongest};
    let fast = &[
        (2, "avia 2"),
        (3, "avia 3"),
        (4, "avia 4"),
        (5, "avia 5"),
        (7, "avia 7"),
        (8, "avia 8"),
    ];
    vec![
        livox(&livox::MID_40, true, &[(0, "mid-40 0"), (1, "mid-40 1")]),
        livox(
            &livox::MID_70,
            true,
            &[(2, "mid-70 2"), (3, "mid-70 3"), (4, "mid-70 4")],
        ),
        livox(&livox::AVIA, true, fast),
        livox(&livox::HORIZON, false, &[(2, "horizon 2")]),
        livox(&livox::TELE_15, false, &[(5, "tele-15 5")]),
        livox(
            &livox::MID_360,
            true,
            &[
                (1, "mid-360 1"),
                (2, "mid-360 2"),
                (3, "mid-360 3"),
                (0x11, "mid-360 11"),
            ],
        ),
        livox(
            &livox::HAP,
            true,
            &[(1, "hap 1"), (2, "hap 2"), (3, "hap 3")],
        ),
        solid(
            &solid::M1,
            blocks_setting,
            &[
                (Strongest, "m1"),
                (Last, "m1 last"),
                (First, "m1 first"),
                (Dual, "m1 dual"),
            ],
        ),
        solid(&solid::M1_PLUS, blocks_setting, &[(Strongest, "m1 plus")]),
        solid(
            &solid::M1_JUMBO,
            blocks_setting,
            &[(Strongest, "m1 jumbo"), (Dual, "m1 jumbo dual")],
        ),
        solid(
            &solid::M2,
            blocks_setting,
            &[(Strongest, "m2"), (Dual, "m2 dual")],
        ),
        solid(&solid::M3, blocks_setting, &[(Strongest, "m3")]),
        solid(
            &solid::MX,
            blocks_setting,
            &[(First, "mx first"), (Dual, "mx dual")],
        ),
        solid(&solid::E1, blocks_setting, &[(Strongest, "e1")]),
        solid(
            &solid::EMX,
            columns_setting,
            &[(Strongest, "emx"), (FirstLast, "emx dual")],
        ),
        solid(
            &solid::EM4,
            columns_setting,
            &[(Strongest, "em4"), (FirstSecond, "em4 dual")],
        ),
    ]
}

/// Something in every shot.
pub fn steady(shot: usize, echo: usize) -> Seen {
    Seen {
        range_m: (5 + shot % 90 + 20 * echo) as f64,
        yaw_rad: 0.01 * (shot % 50) as f64,
        pitch_rad: 0.02,
        brightness: shot as u8,
    }
}
