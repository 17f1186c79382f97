//! HDL-64E S2 and S3: two blocks hold one firing of the 64 lasers, upper and lower.
//!
//! Every unit has its own angles, ranges and brightness; they come from a file, or byte by byte from
//! the last two bytes of the data packets. Without them there are no points.
//!
//! Source: HDL-64E S2 and S3 manuals. Where manual and the usual decoder differ on the range along z, the
//! latter's mean of the two corrections is taken.

mod stream;

use super::calibration::{self, Laser};
use super::rotation::Rotation;
use super::{BLOCKS, CHANNELS, Packet, RawReturn, TURN_CENTIDEG};
use crate::cloud::Return;
use crate::error::UnitError;
use crate::packet::aim::{add, turn, wrapped};
use crate::packet::echoes::judge;
use crate::packet::unit::{Calibration, Fitted, Gather, UnitFile};
use crate::packet::{Decoded, Decoder, Head, Misfit, Model, PacketKind, Place, ReturnMode, Tally};

/// Lasers of one unit.
pub const LASERS: usize = 64;
const BANKS: usize = LASERS / CHANNELS;
/// Metres of one unit of range.
const RANGE_UNIT_M: f64 = 0.002;
/// Ranges of the two targets that the range corrections were taken at; the near one along x and along y.
const FAR_M: f64 = 25.04;
const NEAR_X_M: f64 = 2.4;
const NEAR_Y_M: f64 = 1.93;
/// The brightness correction's scale of ranges.
const FOCAL_SCALE_M: f64 = 131.0;
/// How to get a calibration.
const OBTAIN: &str = "record at least 4 s, so that the packets hold the calibration once, or give the unit's db.xml or \
    YAML file: --beams ADDRESS=FILE";

/// The HDL-64E S2.
pub static HDL64E_S2: Hdl64e = Hdl64e {
    id: "hdl64e-s2",
    title: "Velodyne HDL-64E S2",
    row_ns: 48_000,
    four_ns: 6_000,
    within_four_ns: [0, 1_260, 2_460, 3_660],
};

/// The HDL-64E S3.
pub static HDL64E_S3: Hdl64e = Hdl64e {
    id: "hdl64e",
    title: "Velodyne HDL-64E S3",
    row_ns: 57_600,
    four_ns: 7_200,
    within_four_ns: [0, 1_300, 2_500, 3_700],
};

/// One model.
#[derive(Debug)]
pub struct Hdl64e {
    id: &'static str,
    title: &'static str,
    /// From one firing of all lasers to the next.
    row_ns: i64,
    /// From four lasers to the next four; upper and lower bank fire together.
    four_ns: i64,
    within_four_ns: [i64; 4],
}

impl Hdl64e {
    fn rotation(&self, packet: &Packet<'_>, mean_rate_rad_per_ns: f64) -> Rotation {
        let stride = BANKS * mode(packet).returns();
        let rows = (0..BLOCKS).step_by(stride);
        let azimuths = rows.map(|block| packet.azimuth_centideg(block));
        Rotation::new(azimuths, self.row_ns, mean_rate_rad_per_ns)
    }

    fn delay_ns(&self, channel: usize) -> i64 {
        (channel / 4) as i64 * self.four_ns + self.within_four_ns[channel % 4]
    }
}

/// Dual return is not flagged: each azimuth then comes four times, not twice.
fn mode(packet: &Packet<'_>) -> ReturnMode {
    let quads = (0..BLOCKS).step_by(2 * BANKS);
    let mut same =
        quads.map(|block| packet.azimuth_centideg(block) == packet.azimuth_centideg(block + 2));
    if same.all(|same| same) {
        ReturnMode::Dual
    } else {
        ReturnMode::Strongest
    }
}

/// First block of each bank of each firing, with its row and bank, where flags and azimuth are sound.
fn usable<'a>(packet: &'a Packet<'a>) -> impl Iterator<Item = (usize, usize, usize)> + 'a {
    let returns = mode(packet).returns();
    let rows = 0..BLOCKS / (BANKS * returns);
    let banks = rows.flat_map(|row| (0..BANKS).map(move |bank| (row, bank)));
    banks.filter_map(move |(row, bank)| {
        let first = row * BANKS * returns + bank;
        let mut blocks = (0..returns).map(|place| first + place * BANKS);
        let is_bank = blocks.all(|block| packet.bank(block) == Some(bank));
        let is_azimuth = packet.azimuth_centideg(first) < TURN_CENTIDEG;
        (is_bank && is_azimuth).then_some((row, bank, first))
    })
}

impl Model for Hdl64e {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        Packet::new(payload)?
            .has_banks(&[0, 1])
            .then_some(PacketKind::Data)
    }

    /// The packet period alone tells S2 and S3 apart.
    fn is_sure(&self, _payload: &[u8]) -> bool {
        false
    }

    fn fits(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        super::misfit(payload, self.id())
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = Packet::new(payload)?;
        let rotation = self.rotation(&packet, 0.0);
        rotation.is_valid(0).then(|| Head {
            device_ns: i64::from(packet.timestamp_us()) * 1000,
            sequence: None,
            azimuth_rad: rotation.azimuth_rad(0),
            turned_rad: rotation.turned_rad(),
            rate_rad_per_ns: rotation.rate_rad_per_ns(),
            duration_ns: rotation.duration_ns(),
            left_out: rotation.left_out(),
            return_mode: mode(&packet),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(packet) = Packet::new(payload) else {
            return tally;
        };
        let is_dual = mode(&packet) == ReturnMode::Dual;
        for (_, _, block) in usable(&packet) {
            if is_dual {
                let pairs = packet.returns(block).zip(packet.returns(block + BANKS));
                pairs.for_each(|(one, other)| tally.add_pair(one.range, other.range));
            } else {
                let hits = packet.returns(block).filter(|echo| echo.range != 0);
                tally.points += hits.count() as u32;
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        (BLOCKS / (BANKS * mode.returns())) as i64 * self.row_ns
    }

    fn takes(&self, file: &UnitFile) -> bool {
        stream::takes(file) || calibration::has_lasers(file, LASERS)
    }

    fn gather(&self) -> Option<Box<dyn Gather>> {
        Some(Box::new(stream::Stream::default()))
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let missing = UnitError::Missing {
            model: self.title,
            obtain: OBTAIN,
        };
        let file = files.iter().find(|file| self.takes(file)).ok_or(missing)?;
        let lasers = if stream::takes(file) {
            stream::lasers(&file.content)
        } else {
            calibration::lasers(file)?
        };
        let lowest_first = |laser: &Laser| {
            let lower = lasers
                .iter()
                .filter(|other| other.elevation_rad < laser.elevation_rad);
            lower.count() as u16
        };
        let channels = lasers.iter().enumerate().map(|(number, laser)| Channel {
            laser: *laser,
            ring: lowest_first(laser),
            delay_ns: self.delay_ns(number % CHANNELS),
            rotation: (-laser.rotation_rad).sin_cos(),
            elevation: laser.elevation_rad.sin_cos(),
        });
        Ok(Fitted {
            decoder: Box::new(Hdl64eDecoder {
                model: Self { ..*self },
                channels: channels.collect(),
            }),
            calibration: Calibration::of(&[file], Calibration::Factory),
        })
    }
}

/// What decoding needs of one laser.
#[derive(Debug, Clone, Copy)]
struct Channel {
    laser: Laser,
    ring: u16,
    delay_ns: i64,
    rotation: (f64, f64),
    elevation: (f64, f64),
}

impl Channel {
    /// Position in the sensor frame and range of an echo, the head pointing by `(sin, cos)`.
    fn place(&self, raw: u16, (sin, cos): (f64, f64)) -> ([f64; 3], f64) {
        let (laser, (sin_v, cos_v)) = (&self.laser, self.elevation);
        let raw_m = f64::from(raw) * RANGE_UNIT_M;
        let range_m = raw_m + laser.distance_m;
        let level_m = range_m * cos_v;
        let right_m = raw_m + self.near(laser.distance_x_m, raw_m, (level_m * sin).abs(), NEAR_X_M);
        let ahead_m = raw_m + self.near(laser.distance_y_m, raw_m, (level_m * cos).abs(), NEAR_Y_M);
        let x = right_m * cos_v * sin - laser.horizontal_offset_m * cos;
        let y = ahead_m * cos_v * cos + laser.horizontal_offset_m * sin;
        let z = 0.5 * (right_m + ahead_m) * sin_v + laser.vertical_offset_m;
        ([y, -x, z], range_m)
    }

    /// Range correction at a distance along an axis, between the near and the far target.
    fn near(&self, near: Option<f64>, raw_m: f64, along_m: f64, near_m: f64) -> f64 {
        let far = self.laser.distance_m;
        match near {
            Some(near) if raw_m < FAR_M => {
                near + (far - near) * (along_m - near_m) / (FAR_M - near_m)
            }
            _ => far,
        }
    }

    fn intensity(&self, echo: RawReturn) -> u16 {
        let laser = &self.laser;
        let focus = (1.0 - laser.focal_distance_m / FOCAL_SCALE_M).powi(2);
        let here = (1.0 - f64::from(echo.range) / 65_535.0).powi(2);
        let corrected =
            f64::from(echo.intensity) + 256.0 * laser.focal_slope * (focus - here).abs();
        let most = if laser.max_intensity > 0.0 {
            laser.max_intensity
        } else {
            255.0
        };
        corrected.max(laser.min_intensity).min(most) as u16
    }
}

struct Hdl64eDecoder {
    model: Hdl64e,
    channels: Vec<Channel>,
}

impl Decoder for Hdl64eDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let rotation = self.model.rotation(&packet, place.mean_rate_rad_per_ns);
        let mode = mode(&packet);
        let returns = mode.returns();
        let expected = BLOCKS / returns;
        out.drops
            .add("block_invalid", (expected - usable(&packet).count()) as u64);
        for (row, bank, block) in usable(&packet) {
            let channels = self.channels[bank * CHANNELS..][..CHANNELS].iter();
            let second = packet.returns(block + (returns - 1) * BANKS);
            let row_rad = rotation.azimuth_rad(row);
            let time = place.time + rotation.start_ns(row);
            for (channel, pair) in channels.zip(packet.returns(block).zip(second)) {
                let turned_rad = rotation.rate_rad_per_ns() * channel.delay_ns as f64;
                let head = turn(row_rad.sin_cos(), turned_rad);
                let echoes = [pair.0, pair.1];
                let (kinds, merged) = judge(mode, &echoes[..returns]);
                out.merged += u64::from(merged);
                for (number, (echo, kind)) in echoes.into_iter().zip(kinds).enumerate() {
                    let Some(return_kind) = kind else { continue };
                    let (xyz_m, range_m) = channel.place(echo.range, add(head, channel.rotation));
                    out.encoder_rad.push(wrapped(row_rad + turned_rad));
                    out.cloud.push(&Return {
                        xyz_m: xyz_m.map(|value| value as f32),
                        time: time + channel.delay_ns,
                        range_m: range_m as f32,
                        azimuth_rad: wrapped(row_rad + turned_rad - channel.laser.rotation_rad),
                        ring: channel.ring,
                        intensity: channel.intensity(echo),
                        return_index: number as u8,
                        return_kind,
                        packet: place.packet,
                        block: (block + number * BANKS) as u16,
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel() -> Channel {
        Channel {
            laser: Laser {
                distance_m: 1.4,
                distance_x_m: Some(1.5),
                distance_y_m: Some(1.3),
                vertical_offset_m: 0.2,
                horizontal_offset_m: 0.026,
                focal_distance_m: 15.0,
                focal_slope: 1.2,
                min_intensity: 10.0,
                ..Laser::default()
            },
            ring: 0,
            delay_ns: 0,
            rotation: (0.0, 1.0),
            elevation: (0.0, 1.0),
        }
    }

    #[test]
    fn far_targets_have_one_correction_and_near_ones_one_along_each_axis() {
        // 30 m straight ahead: the far correction alone; the horizontal offset is to the left.
        let (xyz_m, range_m) = channel().place(15_000, (0.0, 1.0));
        assert!((range_m - 31.4).abs() < 1e-9);
        for (found, expected) in xyz_m.iter().zip([31.4, 0.026, 0.2]) {
            assert!((found - expected).abs() < 1e-9, "{xyz_m:?}");
        }
        // Ahead at the near target of the y axis: its correction takes the far one's place.
        let near = ((NEAR_Y_M - 1.4) / RANGE_UNIT_M).round() as u16;
        let (xyz_m, _) = channel().place(near, (0.0, 1.0));
        assert!(
            (xyz_m[0] - (f64::from(near) * RANGE_UNIT_M + 1.3)).abs() < 1e-3,
            "{xyz_m:?}"
        );
        // To the right, half way between the near and the far target of the x axis.
        let half = (((NEAR_X_M + FAR_M) / 2.0 - 1.4) / RANGE_UNIT_M).round() as u16;
        let (xyz_m, _) = channel().place(half, (1.0, 0.0));
        assert!(
            (xyz_m[1] + f64::from(half) * RANGE_UNIT_M + 1.45).abs() < 1e-3,
            "{xyz_m:?}"
        );
    }

    #[test]
    fn brightness_grows_off_the_focus_and_stays_within_its_limits() {
        let intensity = |range, intensity| channel().intensity(RawReturn { range, intensity });
        let focus = (65_535.0 * 15.0 / 131.0) as u16;
        assert_eq!(intensity(focus, 50), 50);
        assert!(intensity(60_000, 50) > 200);
        assert_eq!((intensity(60_000, 255), intensity(focus, 3)), (255, 10));
    }
}
