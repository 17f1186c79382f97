//! How packets become returns.

use super::blocks::Point;
use super::columns::Columns;
use super::description::Angles;
use super::sensor::{Body, Shot, Solid};
use crate::cloud::{Return, ReturnKind};
use crate::packet::aim::{Centidegrees, bear, wrapped};
use crate::packet::batch::Batch;
use crate::packet::echoes::{RawEcho, judge};
use crate::packet::{Decoded, Decoder, Model, Place, ReturnMode};

/// Metres of one unit of range.
const UNIT_M: f64 = 0.005;

/// Decodes the packets of one unit.
pub struct SolidDecoder {
    /// The model.
    pub model: Solid,
    /// Sines and cosines of its angles.
    pub table: Centidegrees,
    /// Of the rows of columns.
    pub angles: Option<Angles>,
    /// Returns of the packet at hand.
    pub batch: Batch,
}

/// Where and when a shot was fired.
struct Ray {
    direction: [f64; 3],
    azimuth_rad: f32,
    since_ns: i64,
    ring: u16,
    block: u16,
}

struct Work<'a> {
    place: Place,
    encoder_rad: f32,
    merged: u64,
    out: &'a mut Batch,
}

impl Work<'_> {
    #[inline]
    fn push(&mut self, ray: &Ray, echo: RawEcho, index: u8, kind: ReturnKind) {
        let range_m = f64::from(echo.range) * UNIT_M;
        let echo = Return {
            xyz_m: ray.direction.map(|part| (range_m * part) as f32),
            time: self.place.time + ray.since_ns,
            range_m: range_m as f32,
            azimuth_rad: ray.azimuth_rad,
            ring: ray.ring,
            intensity: echo.intensity.into(),
            return_index: index,
            return_kind: kind,
            packet: self.place.packet,
            block: ray.block,
        };
        self.out.push(echo, self.encoder_rad);
    }

    fn push_pair(&mut self, ray: &Ray, echoes: [RawEcho; 2], mode: ReturnMode) {
        let (kinds, merged) = judge(mode, &echoes);
        self.merged += u64::from(merged);
        for (index, (echo, kind)) in echoes.into_iter().zip(kinds).enumerate() {
            if let Some(kind) = kind {
                self.push(ray, echo, index as u8, kind);
            }
        }
    }
}

impl SolidDecoder {
    fn ray(&self, point: Point, shot: &Shot<'_>) -> Ray {
        let aim = point.aim(shot.point, self.table);
        Ray {
            direction: aim.direction,
            azimuth_rad: aim.azimuth_rad,
            since_ns: shot.block.since_ns(),
            ring: shot.channel as u16,
            block: shot.number as u16,
        }
    }

    fn columns(&self, columns: Columns, payload: &[u8], work: &mut Work<'_>) {
        let Some(angles) = &self.angles else { return };
        let mode = self.model.mode(payload);
        let returns = mode.returns();
        let lead_ns = columns.lead_ns(payload);
        let aims = columns.aims(payload, angles);
        for (place, slot) in columns.slots(payload, returns).enumerate().step_by(returns) {
            let (direction, yaw_rad) = aims.row(slot.row, slot.row / columns.zone_rows(), angles);
            let ray = Ray {
                direction,
                azimuth_rad: wrapped(yaw_rad),
                since_ns: columns.since_ns(slot.row, lead_ns),
                ring: slot.row as u16,
                block: place as u16,
            };
            let echo = |place: usize| self.model.cut(columns.echo(payload, place));
            if returns == 2 {
                work.push_pair(&ray, [echo(place), echo(place + 1)], mode);
            } else if echo(place).range != 0 {
                work.push(&ray, echo(place), 0, single_kind(mode, 0));
            }
        }
    }
}

impl Decoder for SolidDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(head) = self.model.head(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let mode = head.return_mode;
        let mut batch = std::mem::take(&mut self.batch);
        let mut work = Work {
            place,
            encoder_rad: wrapped(head.azimuth_rad),
            merged: 0,
            out: &mut batch,
        };
        match self.model.body {
            Body::Columns(columns) => self.columns(columns, payload, &mut work),
            Body::Blocks(blocks) if self.model.returns(payload) == 1 => {
                self.model.singles(blocks, payload, |shot, echo| {
                    let index = shot.block.return_index();
                    let kind = single_kind(mode, index);
                    work.push(&self.ray(blocks.point, &shot), echo, index, kind);
                });
            }
            Body::Blocks(blocks) => self.model.pairs(blocks, payload, |shot, echoes| {
                work.push_pair(&self.ray(blocks.point, &shot), echoes, mode);
            }),
        }
        out.merged += work.merged;
        let first = out.cloud.len();
        batch.flush(out);
        self.batch = batch;
        if let Body::Blocks(blocks) = self.model.body
            && blocks.point != Point::Angles
        {
            let cloud = &mut out.cloud;
            bear(&cloud.xyz_m[first..], &mut cloud.azimuth_rad[first..]);
        }
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
