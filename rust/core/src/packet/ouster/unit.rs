//! An Ouster sensor whose metadata are known.

use std::f64::consts::TAU;
use std::sync::Mutex;

mod decoder;

use super::layout::{Column, View};
use super::metadata::{self, Metadata};
use super::{OBTAIN, Span};
use crate::error::UnitError;
use crate::packet::unit::{Calibration, Fitted, UnitFile};
use crate::packet::{
    Counting, Head, Misfit, Model, ModelRef, PacketKind, ReturnMode, Tally, UnitFacts,
};
use decoder::UnitDecoder;

/// Frames of the counter that all firmwares have; wider ones are cut to it.
const FRAMES: usize = 1 << 16;

/// One sensor as a model.
#[derive(Debug, Clone)]
pub struct Unit {
    metadata: Metadata,
    file: UnitFile,
    title: &'static str,
    /// Whether packets that name another serial number are taken as well.
    is_lenient: bool,
}

/// Sensors that were described so far, each once: models live as long as the program.
static KNOWN: Mutex<Vec<[&'static Unit; 2]>> = Mutex::new(Vec::new());
/// So many descriptions of sensors are remembered.
const MOST_KNOWN: usize = 10_000;

/// Models of the sensors that `files` describe: those that take their own packets alone, then those that
/// take all packets of the size.
pub fn models(files: &[UnitFile]) -> Vec<ModelRef> {
    let mut units: Vec<[&'static Unit; 2]> = Vec::new();
    for unit in files.iter().filter_map(known) {
        // Files that differ in ports or the like only describe one sensor.
        let is_same = |other: &[&'static Unit; 2]| other[0].metadata == unit[0].metadata;
        if !units.iter().any(is_same) {
            units.push(unit);
        }
    }
    let strict = units.iter().map(|unit| unit[0] as ModelRef);
    strict
        .chain(units.iter().map(|unit| unit[1] as ModelRef))
        .collect()
}

fn known(file: &UnitFile) -> Option<[&'static Unit; 2]> {
    let mut known = KNOWN.lock().ok()?;
    if let Some(unit) = known.iter().find(|unit| unit[0].file == *file) {
        return Some(*unit);
    }
    let metadata = metadata::read(file)?.ok()?;
    if known.len() >= MOST_KNOWN {
        return None;
    }
    let unit = [false, true].map(|is_lenient| {
        let unit: &'static Unit = Box::leak(Box::new(Unit::new(&metadata, file, is_lenient)));
        unit
    });
    known.push(unit);
    Some(unit)
}

impl Unit {
    fn new(metadata: &Metadata, file: &UnitFile, is_lenient: bool) -> Self {
        let product = metadata.product.replacen("OS-", "OS", 1);
        let name = if product.is_empty() {
            "sensor"
        } else {
            &product
        };
        Self {
            title: format!("Ouster {name}").leak(),
            metadata: metadata.clone(),
            file: file.clone(),
            is_lenient,
        }
    }

    fn view<'a>(&self, payload: &'a [u8]) -> Option<View<'a>> {
        let view = View::new(payload, self.metadata.layout)?;
        view.is_plausible(Some(self.metadata.columns_per_turn))
            .then_some(view)
    }

    /// Whether the packet's header names this sensor, or nothing that speaks against it. A new start
    /// draws a new number, so that the serial number alone is enough.
    fn is_own(&self, view: &View<'_>) -> bool {
        let same = |ours: u64, theirs: u64| (ours != 0 && theirs != 0).then_some(ours == theirs);
        let serial = same(self.metadata.serial, view.serial());
        let start = same(self.metadata.init_id, view.init_id());
        match (serial, start) {
            (Some(true), _) | (_, Some(true)) => true,
            (Some(false), _) | (_, Some(false)) => false,
            (None, None) => true,
        }
    }

    fn column_ns(&self) -> f64 {
        1e9 / (self.metadata.columns_per_turn as f64 * self.metadata.rate_hz)
    }

    /// Echoes of a pixel, mm and brightness.
    fn echoes(&self, pixel: &[u8]) -> [(u32, u32); 2] {
        let mut echoes = [(0, 0); 2];
        for (slot, echo) in echoes.iter_mut().zip(self.metadata.profile.echoes) {
            *slot = (echo.range.read(pixel), echo.reflectivity.read(pixel));
        }
        echoes
    }
}

impl Model for Unit {
    fn id(&self) -> &'static str {
        self.metadata.id()
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        let view = self.view(payload)?;
        (self.is_lenient || self.is_own(&view)).then_some(PacketKind::Data)
    }

    fn is_sure(&self, _payload: &[u8]) -> bool {
        !self.is_lenient
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.view(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let (found, expected) = (payload.len(), self.metadata.layout.packet_len());
        let why = format!("{found} bytes, {expected} by {}", self.file.name);
        Misfit { why, may_be: None }
    }

    fn frame_id(&self, payload: &[u8]) -> Option<u32> {
        self.view(payload).map(|view| view.frame())
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = self.view(payload)?;
        let span = Span::of(&view)?;
        let turn = self.metadata.columns_per_turn as f64;
        let column_ns = span.column_ns.unwrap_or(self.column_ns());
        let packets = self.metadata.packets_per_turn();
        let number = view.frame() as usize % FRAMES * packets + self.metadata.packet_of(span.first);
        Some(Head {
            device_ns: span.time_ns,
            sequence: u32::try_from(number).ok(),
            azimuth_rad: TAU * span.first as f64 / turn,
            turned_rad: TAU * span.columns as f64 / turn,
            rate_rad_per_ns: TAU / turn / column_ns,
            duration_ns: (column_ns * span.columns as f64).round() as i64,
            left_out: None,
            return_mode: self.metadata.return_mode,
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(view) = self.view(payload) else {
            return tally;
        };
        for column in view.columns().filter(Column::is_valid) {
            for pixel in column.pixels() {
                let [(one, _), (other, _)] = self.echoes(pixel);
                let is_merged = one != 0 && one == other;
                tally.points += u32::from(one != 0) + u32::from(other != 0) - u32::from(is_merged);
                tally.merged += u32::from(is_merged);
            }
        }
        tally
    }

    fn period_ns(&self, _mode: ReturnMode) -> i64 {
        (self.column_ns() * self.metadata.layout.columns as f64).round() as i64
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(32),
        }
    }

    fn sequence_wrap(&self) -> Option<i64> {
        Some((FRAMES * self.metadata.packets_per_turn()) as i64)
    }

    fn takes(&self, file: &UnitFile) -> bool {
        let is_same = |other: &Metadata| *other == self.metadata;
        *file == self.file || matches!(metadata::read(file), Some(Ok(other)) if is_same(&other))
    }

    fn describe(&self, _files: &[UnitFile]) -> UnitFacts {
        let metadata = &self.metadata;
        let clock = match metadata.clock.as_str() {
            "" => "not in the metadata",
            "TIME_FROM_INTERNAL_OSC" => "time since the sensor started",
            "TIME_FROM_SYNC_PULSE_IN" => "pulse per second at the sensor",
            "TIME_FROM_PTP_1588" => "PTP (TAI unless the master sends UTC)",
            other => other,
        };
        let mut notes = vec![format!(
            "profile {}, {} x {} Hz, serial number {}, clock source: {clock}",
            metadata.profile.name, metadata.columns_per_turn, metadata.rate_hz, metadata.serial
        )];
        if self.is_lenient {
            notes.push(format!(
                "the packets name another sensor than {} does (serial number {}): its angles may not be this unit's",
                self.file.name, metadata.serial
            ));
        }
        UnitFacts {
            return_mode: None,
            notes,
        }
    }

    fn fit(&self, _files: &[UnitFile]) -> Result<Fitted, UnitError> {
        Ok(Fitted {
            decoder: Box::new(UnitDecoder::new(self.clone())),
            calibration: Calibration::of(&[&self.file], Calibration::Nominal { obtain: OBTAIN }),
        })
    }
}
