//! How packets become returns.

use super::blocks::{Blocks, Point};
use super::columns::{ColumnAim, Columns, RowAngles};
use super::description::Angles;
use super::sensor::{Body, Solid};
use crate::cloud::ReturnKind;
use crate::packet::aim::{Centidegrees, wrapped};
use crate::packet::echoes::MOST;
use crate::packet::rays::Rays;
use crate::packet::sheet::{LANES, Sheet, lane, lane_mut};
use crate::packet::{Decoded, Decoder, Model, Place, ReturnMode};
use crate::simd::{Kernel, vectorized};
use crate::time::Timestamp;

/// Metres of one unit of range.
const UNIT_M: f64 = 0.005;

/// Decodes the packets of one unit.
pub struct SolidDecoder {
    model: Solid,
    table: Centidegrees,
    /// Channels and blocks of the shots of a packet of blocks, rows of one of columns.
    numbers: [Vec<u16>; 2],
    /// Added to the pitch on each surface of the mirror.
    surface_rad: Vec<f64>,
    /// Angles of the rows, with room for a chunk behind the last one.
    rows: Vec<RowAngles>,
    rays: Rays,
    sheet: Sheet,
}

impl SolidDecoder {
    /// Of a unit; `angles` are those of the rows of columns.
    pub fn new(model: Solid, angles: Option<&Angles>) -> Self {
        let (shots, points) = match model.body {
            Body::Columns(columns) => (columns.rows(), columns.rows()),
            Body::Blocks(blocks) => (blocks.count * blocks.points, blocks.points),
        };
        let numbered = |number: &dyn Fn(usize) -> usize| {
            let numbers = (0..shots).map(number);
            numbers.map(|number| number as u16).collect()
        };
        let rows = match (model.body, angles) {
            (Body::Columns(columns), Some(angles)) => {
                let rows = 0..shots + LANES;
                rows.map(|row| angles.row(columns, row)).collect()
            }
            _ => Vec::new(),
        };
        Self {
            model,
            table: Centidegrees::table(),
            numbers: [
                numbered(&|shot| shot % points),
                numbered(&|shot| shot / points),
            ],
            surface_rad: angles.map_or_else(Vec::new, |angles| angles.surface_rad.clone()),
            rows,
            rays: Rays::default(),
            sheet: Sheet::default(),
        }
    }

    fn open(&mut self, shots: usize, returns: usize) {
        self.sheet.open(shots, returns);
        self.rays.open(shots);
    }

    fn blocks(&mut self, blocks: Blocks, payload: &[u8], place: Place) {
        let (shots, returns) = (blocks.count * blocks.points, self.model.returns(payload));
        self.open(shots, returns);
        // Layouts that are known to the compiler.
        let start = place.time;
        match (blocks.point, blocks.point_len) {
            (Point::Angles, 7) => self.read::<7>(blocks, Point::Angles, payload, start),
            (Point::Angles, _) => self.read::<9>(blocks, Point::Angles, payload, start),
            (Point::Vector, _) => self.read::<10>(blocks, Point::Vector, payload, start),
            (Point::Pair, _) => self.read::<13>(blocks, Point::Pair, payload, start),
        }
        let [channels, numbers] = &self.numbers;
        self.sheet.ring[..shots].copy_from_slice(channels);
        self.sheet.block[..shots].copy_from_slice(numbers);
        self.place(returns, blocks.point != Point::Angles);
    }

    /// Reads the points of a packet that begins at `start`.
    #[inline(always)]
    fn read<const LEN: usize>(
        &mut self,
        blocks: Blocks,
        kind: Point,
        payload: &[u8],
        start: Timestamp,
    ) {
        let sheet = &mut self.sheet;
        let shots = sheet.echoes(0).len();
        let is_double = sheet.len() > shots;
        let (ranges, more_ranges) = sheet.range.split_at_mut(shots);
        let (intensities, more_intensities) = sheet.intensity.split_at_mut(shots);
        let [x, y, z] = self.rays.parts.each_mut().map(|part| &mut part[..shots]);
        let azimuths_rad = &mut sheet.azimuth_rad[..shots];
        let times_ns = &mut sheet.time_ns[..shots];
        let (limits, table, body) = (self.model.limits, self.table, blocks.body());
        let mut at = 0;
        for block in blocks.blocks(payload) {
            let time_ns = (start + block.since_ns()).0;
            for point in block.points_of::<LEN>(&body) {
                if at == shots {
                    return;
                }
                let [one, other] = kind.echoes(point).map(|echo| limits.cut(echo));
                let aim = kind.aim(point, table);
                [x[at], y[at], z[at]] = aim.direction;
                times_ns[at] = time_ns;
                if kind == Point::Angles {
                    azimuths_rad[at] = aim.azimuth_rad;
                }
                (ranges[at], intensities[at]) = (one.range.into(), one.intensity.into());
                if is_double {
                    more_ranges[at] = other.range.into();
                    more_intensities[at] = other.intensity.into();
                }
                at += 1;
            }
        }
    }

    fn columns(&mut self, columns: Columns, payload: &[u8], place: Place) {
        let returns = self.model.returns(payload);
        let (shots, limits) = (columns.count() / returns, self.model.limits);
        self.open(shots, returns);
        for echo in 0..returns {
            let entries = self.sheet.echoes(echo);
            let room = &mut self.sheet.range[entries.clone()];
            let room = room.iter_mut().zip(&mut self.sheet.intensity[entries]);
            let points = columns.points(payload).iter().skip(echo).step_by(returns);
            for ((range, intensity), point) in room.zip(points) {
                let echo = limits.cut(columns.echo(point));
                (*range, *intensity) = (echo.range.into(), echo.intensity.into());
            }
        }
        let first = columns.first_row(payload, returns);
        vectorized(Aim {
            rows: &self.rows[first..],
            aim: columns.aims(payload, &self.surface_rad),
            time_ns: [place.time, place.time + columns.lead_ns(payload)].map(|time| time.0),
            rays: &mut self.rays,
            sheet: &mut self.sheet,
        });
        let rows = &self.numbers[0];
        self.sheet.ring[..shots].copy_from_slice(&rows[first..first + shots]);
        let blocks = self.sheet.block[..shots].iter_mut().zip(rows);
        blocks.for_each(|(block, shot)| *block = shot * returns as u16);
        self.place(returns, false);
    }

    /// Places the echoes; what is the same for all returns of a shot is known for the first.
    fn place(&mut self, returns: usize, bears: bool) {
        if returns > 1 {
            self.sheet.repeat();
        }
        for echo in 0..returns {
            let (echoes, sheet) = (self.sheet.echoes(echo), &mut self.sheet);
            if bears {
                self.rays.place_and_bear(UNIT_M, echoes, sheet);
            } else {
                self.rays.place(0, UNIT_M, echoes, sheet);
            }
        }
    }

    /// Appends the returns.
    fn flush(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let (mode, packets) = (self.model.mode(payload), [place.packet; MOST]);
        if self.model.returns(payload) > 1 {
            out.merged += self.sheet.judge(mode);
            return self.sheet.flush(packets, out);
        }
        if let Body::Blocks(blocks) = self.model.body
            && blocks.has_return
            && blocks
                .blocks(payload)
                .any(|block| block.return_index() != 0)
        {
            for (number, block) in blocks.blocks(payload).enumerate() {
                let (index, first) = (block.return_index(), number * blocks.points);
                for shot in first..first + blocks.points {
                    if self.sheet.range[shot] != 0 {
                        self.sheet.hit(shot, index.into(), single_kind(mode, index));
                    }
                }
            }
            return self.sheet.flush(packets, out);
        }
        self.sheet
            .flush_singles(single_kind(mode, 0), place.packet, out);
    }
}

/// Where and when the shots of a column are fired.
struct Aim<'a> {
    rows: &'a [RowAngles],
    aim: ColumnAim,
    /// Of early and of late zones.
    time_ns: [i64; 2],
    rays: &'a mut Rays,
    sheet: &'a mut Sheet,
}

impl Kernel for Aim<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { aim, sheet, .. } = self;
        let [early_ns, late_ns] = self.time_ns;
        for at in sheet.echoes(0).step_by(LANES) {
            let rows = lane(self.rows, at);
            let [x, y, z] = self.rays.parts.each_mut().map(|part| lane_mut(part, at));
            let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
            let time_ns = lane_mut(&mut sheet.time_ns, at);
            for k in 0..LANES {
                let (direction, yaw_rad) = aim.row(&rows[k]);
                [x[k], y[k], z[k]] = direction;
                azimuth_rad[k] = wrapped(yaw_rad);
                time_ns[k] = if rows[k].is_late { late_ns } else { early_ns };
            }
        }
    }
}

impl Decoder for SolidDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(head) = self.model.head(payload) else {
            return out.drops.add("packet_size", 1);
        };
        match self.model.body {
            Body::Blocks(blocks) => self.blocks(blocks, payload, place),
            Body::Columns(columns) => self.columns(columns, payload, place),
        }
        let len = self.sheet.len();
        self.sheet.encoder_rad[..len].fill(wrapped(head.azimuth_rad));
        self.flush(payload, place, out);
    }
}

/// Meaning of a single return.
fn single_kind(mode: ReturnMode, index: u8) -> ReturnKind {
    match (mode, index) {
        (ReturnMode::Last, _) => ReturnKind::Last,
        (ReturnMode::First, _) => ReturnKind::First,
        // Of two returns in packets of their own the second is the last.
        (ReturnMode::Dual, 1) => ReturnKind::Last,
        _ => ReturnKind::Strongest,
    }
}
