//! Ouster: columns of pixels that mean nothing without the metadata of the sensor, little endian.
//!
//! A sensor whose metadata are at hand is a model of its own, [`unit::Unit`]; packets of one without are
//! recognised by their columns alone ([`bare::Bare`]) and give no points.
//!
//! Source: the maker's sensor manual and development kit.

pub mod bare;
pub mod geometry;
mod inertial;
pub mod json;
pub mod layout;
pub mod metadata;
pub mod profile;
pub mod unit;
pub mod writer;

use layout::{Column, View};

/// How to get the metadata.
pub const OBTAIN: &str = "fetch the metadata from the sensor (http://SENSOR/api/v1/sensor/metadata, or ouster-cli source SENSOR \
    metadata) and lay the JSON file beside the capture under its name or give it: --beams ADDRESS=FILE";

/// Times and numbers of the valid columns of a packet.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    /// Device time of the first valid column, ns.
    time_ns: i64,
    /// Its number within the turn.
    first: usize,
    /// Time of one column, ns; `None` where a single one is valid.
    column_ns: Option<f64>,
    /// Columns from the first valid one to the end of the packet.
    columns: usize,
}

impl Span {
    /// `None` where no column is valid.
    fn of(view: &View<'_>) -> Option<Self> {
        let mut valid = view
            .columns()
            .enumerate()
            .filter(|(_, column)| column.is_valid());
        let (place, first) = valid.next()?;
        let time = |column: &Column<'_>| i64::try_from(column.time_ns()).ok();
        let time_ns = time(&first)?;
        let last = valid.last();
        let step = last.and_then(|(end, column)| {
            let elapsed_ns = time(&column)?.checked_sub(time_ns)?;
            Some(elapsed_ns as f64 / (end - place) as f64)
        });
        Some(Self {
            time_ns,
            first: usize::from(first.number()),
            column_ns: step.filter(|ns| (1e3..1e7).contains(ns)),
            columns: view.layout().columns - place,
        })
    }
}
