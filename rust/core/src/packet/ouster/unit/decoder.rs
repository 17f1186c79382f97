//! From columns of pixels to returns.

use std::f64::consts::TAU;

use super::Unit;
use crate::cloud::ReturnKind;
use crate::packet::fan::{Desk, Fan, Row};
use crate::packet::ouster::Span;
use crate::packet::ouster::geometry::Geometry;
use crate::packet::ouster::layout::Column;
use crate::packet::{Decoded, Decoder, Place, ReturnMode};

pub(super) struct UnitDecoder {
    unit: Unit,
    geometry: Geometry,
    fan: Fan,
    desk: Desk,
}

impl UnitDecoder {
    pub fn new(unit: Unit) -> Self {
        let geometry = Geometry::new(&unit.metadata);
        Self {
            unit,
            fan: geometry.fan(),
            geometry,
            desk: Desk::default(),
        }
    }

    /// Lays the pixels of a column on the desk.
    fn read(&mut self, column: &Column<'_>) {
        let profile = self.unit.metadata.profile;
        self.desk.open(self.fan.len(), profile.echoes.len());
        for (number, echo) in profile.echoes.iter().enumerate() {
            let room = self.desk.echoes(number);
            room.block.fill(column.number());
            let (pixels, len) = (column.body(), profile.pixel_len);
            let range = |value: u32| value as i32;
            echo.range.read_each(pixels, len, room.range, range);
            let brightness = |value: u32| value as u16;
            let intensities = room.intensity;
            echo.reflectivity
                .read_each(pixels, len, intensities, brightness);
        }
    }

    /// Finds what the two echoes of all pixels are; gives how many were merged into others.
    fn judge(&mut self, first: ReturnKind) -> u64 {
        let is_by_distance = self.unit.metadata.return_mode == ReturnMode::FirstLast;
        let mut merged = 0;
        for lane in 0..self.fan.len() {
            let [one, other] = [0, 1].map(|echo| self.desk.range(lane, echo));
            let kinds = match (one != 0, other != 0) {
                (true, true) if one == other => {
                    merged += 1;
                    [Some(ReturnKind::Merged), None]
                }
                (true, true) if is_by_distance && one < other => {
                    [Some(ReturnKind::First), Some(ReturnKind::Last)]
                }
                (true, true) if is_by_distance => [Some(ReturnKind::Last), Some(ReturnKind::First)],
                (is_one, is_other) => [
                    is_one.then_some(first),
                    is_other.then_some(ReturnKind::Second),
                ],
            };
            for (echo, kind) in kinds.into_iter().enumerate() {
                if let Some(kind) = kind {
                    self.desk.hit(lane, echo, kind);
                }
            }
        }
        merged
    }

    /// What the first echo is where nothing else tells it.
    fn first_kind(&self) -> ReturnKind {
        match self.unit.metadata.return_mode {
            ReturnMode::Last => ReturnKind::Last,
            ReturnMode::First => ReturnKind::First,
            _ => ReturnKind::Strongest,
        }
    }

    fn push(&mut self, row: &Row, out: &mut Decoded) {
        let first = self.first_kind();
        if self.unit.metadata.profile.echoes.len() == 1 {
            return self.desk.push_single(&self.fan, None, row, first, out);
        }
        out.merged += self.judge(first);
        self.desk.finish(&self.fan, None, row, out);
    }
}

impl Decoder for UnitDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let view = self.unit.view(payload);
        let Some((view, span)) = view.and_then(|view| Some((view, Span::of(&view)?))) else {
            return out.drops.add("packet_size", 1);
        };
        for column in view.columns() {
            if !column.is_valid() {
                out.drops.add("column_invalid", 1);
                continue;
            }
            let turn = self.unit.metadata.columns_per_turn as f64;
            let azimuth_rad = TAU * f64::from(column.number()) / turn;
            let Some((axes, origin_m)) = self.geometry.frame(usize::from(column.number())) else {
                continue;
            };
            let time_ns = i64::try_from(column.time_ns()).unwrap_or(i64::MAX);
            let row = Row {
                encoder_rad: azimuth_rad,
                azimuth_rad,
                axes,
                origin_m,
                unit_m: 0.001,
                time_ns: (place.time + time_ns.saturating_sub(span.time_ns)).0,
                packets: [place.packet; 3],
            };
            self.read(&column);
            self.push(&row, out);
        }
        self.desk.flush(out);
    }
}
