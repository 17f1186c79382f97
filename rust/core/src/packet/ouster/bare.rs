//! Ouster packets whose sensor is not known: recognised by columns that follow each other, without points.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use super::layout::{ENCODER_TICKS, Header, Layout, View};
use super::profile::{PROFILES, Profile};
use super::{OBTAIN, Span, inertial, metadata, unit};
use crate::angle::wrap_turn;
use crate::error::UnitError;
use crate::packet::unit::{Fitted, UnitFile};
use crate::packet::{
    Counting, Head, Misfit, Model, ModelRef, PacketKind, ReturnMode, Tally, UnitFacts,
};

const fn bare(id: &'static str, title: &'static str) -> Bare {
    Bare { id, title }
}

/// Any Ouster sensor; with metadata it is found as the product that they name.
pub static OUSTER: Bare = bare("ouster", "Ouster OS0, OS1, OS2 or OSDome");
/// A product line whose number of beams is not known.
pub static OS0: Bare = bare("os0", "Ouster OS0");
/// As [`OS0`].
pub static OS1: Bare = bare("os1", "Ouster OS1");
/// As [`OS0`].
pub static OS2: Bare = bare("os2", "Ouster OS2");
/// As [`OS0`].
pub static OSDOME: Bare = bare("osdome", "Ouster OSDome");
/// Products by their number of beams.
pub static PRODUCTS: [Bare; 13] = [
    bare("os0-32", "Ouster OS0-32"),
    bare("os0-64", "Ouster OS0-64"),
    bare("os0-128", "Ouster OS0-128"),
    bare("os1-16", "Ouster OS1-16"),
    bare("os1-32", "Ouster OS1-32"),
    bare("os1-64", "Ouster OS1-64"),
    bare("os1-128", "Ouster OS1-128"),
    bare("os2-32", "Ouster OS2-32"),
    bare("os2-64", "Ouster OS2-64"),
    bare("os2-128", "Ouster OS2-128"),
    bare("osdome-32", "Ouster OSDome-32"),
    bare("osdome-64", "Ouster OSDome-64"),
    bare("osdome-128", "Ouster OSDome-128"),
];

/// Columns of a packet that occur; 16 unless the sensor was set otherwise.
const COLUMNS: [usize; 4] = [16, 8, 32, 4];
const PIXELS: [usize; 4] = [128, 64, 32, 16];
const PIXEL_LENS: [usize; 5] = [12, 16, 4, 8, 20];
/// 16 columns of 1024 at 10 Hz, as sensors are delivered.
const PERIOD_NS: i64 = 1_562_500;

/// Ouster without metadata.
#[derive(Debug)]
pub struct Bare {
    id: &'static str,
    title: &'static str,
}

/// A layout whose columns follow each other. Several share sizes; they put columns at the same places, so
/// that times and numbers are right whichever it is.
fn guess(payload: &[u8]) -> Option<View<'_>> {
    layouts(payload).next()
}

/// All layouts of the payload's size whose columns follow each other.
fn layouts(payload: &[u8]) -> impl Iterator<Item = View<'_>> {
    let is_size = PACKET_LENS.binary_search(&payload.len()).is_ok();
    let layouts = is_size.then(all_layouts).into_iter().flatten();
    let views = layouts.filter_map(|layout| View::new(payload, layout));
    views.filter(is_sound)
}

/// Sizes of all packets, ascending: most payloads have none of them.
static PACKET_LENS: LazyLock<Vec<usize>> = LazyLock::new(|| {
    let mut lens: Vec<usize> = all_layouts().map(|layout| layout.packet_len()).collect();
    lens.sort_unstable();
    lens
});

fn all_layouts() -> impl Iterator<Item = Layout> {
    let headers = [Header::Standard, Header::Safety, Header::Legacy];
    let sized = headers.into_iter().flat_map(|header| {
        COLUMNS
            .into_iter()
            .flat_map(move |columns| sizes(header).map(move |size| (header, columns, size)))
    });
    sized.map(|(header, columns, (pixels, pixel_len))| Layout {
        header,
        columns,
        pixels,
        pixel_len,
    })
}

/// What a layout is, for people.
fn wording(view: &View<'_>) -> String {
    let layout = view.layout();
    let is_legacy = |profile: &Profile| profile.name == PROFILES[0].name;
    let is_safety = |profile: &Profile| profile.name.starts_with("FUSA");
    let fits = |profile: &&Profile| {
        profile.pixel_len == layout.pixel_len
            && is_legacy(profile) == (layout.header == Header::Legacy)
            && (layout.header != Header::Safety || is_safety(profile))
            && (layout.header == Header::Safety || !is_safety(profile))
    };
    let names: Vec<&str> = PROFILES.iter().filter(fits).map(|p| p.name).collect();
    let names = if names.is_empty() {
        "an unknown profile".into()
    } else {
        names.join(" or ")
    };
    let (columns, beams) = (layout.columns, layout.pixels);
    format!("{columns} columns of {beams} beams with {names}")
}

/// Pixels of a column and bytes of a pixel.
fn sizes(header: Header) -> impl Iterator<Item = (usize, usize)> {
    let lens: &[usize] = match header {
        Header::Legacy => &[12],
        Header::Standard => &PIXEL_LENS,
        Header::Safety => &[8, 4],
    };
    PIXELS
        .into_iter()
        .flat_map(move |pixels| lens.iter().map(move |len| (pixels, *len)))
}

fn is_sound(view: &View<'_>) -> bool {
    let valid = view
        .columns()
        .filter(super::layout::Column::is_valid)
        .count();
    valid >= 2 && view.is_plausible(None)
}

impl Model for Bare {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    /// The line and the number of beams are known from the metadata alone.
    fn candidates(&self) -> &'static [&'static str] {
        if self.id == OUSTER.id {
            &["os0", "os1", "os2", "osdome"]
        } else {
            &[]
        }
    }

    /// The lines cannot be told apart, so that only the first model claims packets.
    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if self.id != OUSTER.id {
            return None;
        }
        let data = guess(payload).map(|_| PacketKind::Data);
        data.or_else(|| inertial::kind(payload))
    }

    fn remarks(&self, payload: &[u8]) -> Vec<String> {
        let fits: Vec<String> = layouts(payload).map(|view| wording(&view)).collect();
        let mut remarks = vec![format!(
            "{} bytes are {}",
            payload.len(),
            fits.join(", or ")
        )];
        let serial = guess(payload).map_or(0, |view| view.serial());
        if serial != 0 {
            remarks.push(format!("the packets name serial number {serial}"));
        }
        remarks
    }

    fn fits(&self, payload: &[u8]) -> bool {
        guess(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = format!(
            "{} bytes without columns that follow each other",
            payload.len()
        );
        Misfit {
            why,
            may_be: Some(self.id),
        }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = guess(payload)?;
        let span = Span::of(&view)?;
        let column_ns = span.column_ns?;
        let (azimuth_rad, rate_rad_per_ns) = encoder(&view, &span);
        let duration_ns = column_ns * span.columns as f64;
        Some(Head {
            device_ns: span.time_ns,
            sequence: None,
            azimuth_rad,
            turned_rad: rate_rad_per_ns * duration_ns,
            rate_rad_per_ns,
            duration_ns: duration_ns.round() as i64,
            left_out: None,
            return_mode: ReturnMode::Strongest,
        })
    }

    /// What a pixel holds is not known.
    fn tally(&self, _payload: &[u8]) -> Tally {
        Tally::default()
    }

    fn period_ns(&self, _mode: ReturnMode) -> i64 {
        PERIOD_NS
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: None,
        }
    }

    fn takes(&self, file: &UnitFile) -> bool {
        metadata::read(file).is_some()
    }

    fn units(&self, files: &[UnitFile]) -> Vec<ModelRef> {
        if self.id == OUSTER.id {
            unit::models(files)
        } else {
            Vec::new()
        }
    }

    fn covers(&self, unit: ModelRef) -> bool {
        let is_line = unit.id().strip_prefix(self.id);
        is_line.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
            || self.id == OUSTER.id && unit.title().starts_with("Ouster")
    }

    fn describe(&self, _files: &[UnitFile]) -> UnitFacts {
        UnitFacts {
            return_mode: Some("unknown"),
            notes: vec![
                "without metadata neither the model nor its return mode can be told, and there are no points; \
                 lost packets are counted from the clock alone"
                    .into(),
            ],
        }
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let Some(file) = files.first() else {
            return Err(UnitError::Missing {
                model: self.title,
                obtain: OBTAIN,
            });
        };
        let metadata = metadata::read(file).transpose()?;
        if files.len() > 1 {
            let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
            let expected = "the metadata of the one sensor that sends from this address: name them with --beams ADDRESS=FILE";
            return Err(file.refuse(None, expected, names.join(", ")));
        }
        let found = metadata.map_or_else(String::new, |metadata| {
            format!(
                "those of {} with packets of {} bytes",
                metadata.product,
                metadata.layout.packet_len()
            )
        });
        Err(file.refuse(
            None,
            "the metadata of the sensor that sends these packets",
            found,
        ))
    }
}

/// Azimuth of the first valid column and rotation rate, where the packets have the encoder.
fn encoder(view: &View<'_>, span: &Span) -> (f64, f64) {
    if view.layout().header != Header::Legacy {
        return (0.0, 0.0);
    }
    let mut valid = view.columns().filter(super::layout::Column::is_valid);
    let (Some(first), Some(second)) = (valid.next(), valid.next()) else {
        return (0.0, 0.0);
    };
    let radians = |ticks: u32| f64::from(ticks) / f64::from(ENCODER_TICKS) * TAU;
    let columns = f64::from(second.number()) - f64::from(first.number());
    let step_rad = radians(second.encoder().saturating_sub(first.encoder())) / columns.max(1.0);
    let rate = span.column_ns.map_or(0.0, |ns| step_rad / ns);
    // A turn of the encoder is a turn; more within one column is no encoder.
    let rate = if step_rad < 0.1 { rate } else { 0.0 };
    (wrap_turn(radians(first.encoder())), rate)
}

#[cfg(test)]
mod tests {
    use super::super::layout::{RawColumn, RawPacket, encode};
    use super::*;

    fn packet(header: Header) -> Vec<u8> {
        let layout = Layout {
            header,
            columns: 16,
            pixels: 64,
            pixel_len: if header == Header::Safety { 8 } else { 12 },
        };
        let columns = (0..16_u16).map(|place| RawColumn {
            time_ns: 7_000_000_000 + u64::from(place) * 97_656,
            number: 512 + place,
            is_valid: true,
            pixels: Vec::new(),
        });
        let packet = RawPacket {
            frame: 9,
            init_id: 3,
            serial: 4,
            columns_per_turn: 1024,
            columns: columns.collect(),
        };
        encode(layout, &packet)
    }

    #[test]
    fn packets_are_recognised_by_their_columns() {
        for header in [Header::Legacy, Header::Standard, Header::Safety] {
            let mut bytes = packet(header);
            assert_eq!(OUSTER.recognise(&bytes), Some(PacketKind::Data));
            let head = OUSTER.head(&bytes).unwrap();
            assert_eq!(
                (head.device_ns, head.duration_ns),
                (7_000_000_000, 1_562_496)
            );
            let middle = bytes.len() / 2;
            bytes[..middle].fill(0x5A);
            assert_eq!(OUSTER.recognise(&bytes), None);
        }
        let head = OUSTER.head(&packet(Header::Legacy)).unwrap();
        assert!((head.azimuth_rad - TAU / 2.0).abs() < 1e-9);
        assert!((head.rate_rad_per_ns * 1e9 / TAU - 10.0).abs() < 1e-3);
        assert_eq!(OS1.recognise(&packet(Header::Legacy)), None);
        assert!(OS1.fits(&packet(Header::Legacy)));
    }

    #[test]
    fn what_it_can_be_is_said() {
        let remarks = OUSTER.remarks(&packet(Header::Standard));
        assert!(remarks[0].starts_with("12544 bytes are 16 columns of 64 beams with RNG19"));
        assert!(remarks[1].ends_with("serial number 4"));
        let safety = OUSTER.remarks(&packet(Header::Safety));
        assert!(safety[0].contains("64 beams with FUSA_RNG15"), "{safety:?}");
    }

    #[test]
    fn without_metadata_it_says_how_to_get_them() {
        use crate::error::Coded;
        let error = OUSTER.fit(&[]).err().unwrap();
        assert_eq!(error.code(), "beams.missing");
        assert!(error.hint().unwrap().contains("--beams"));
        let other = UnitFile::new(
            "m.json",
            r#"{"beam_altitude_angles": [1], "beam_azimuth_angles": [1], "prod_line": "OS-1-1"}"#,
        );
        let error = OUSTER.fit(&[other]).err().unwrap();
        assert!(error.to_string().contains("OS-1-1"), "{error}");
    }
}
