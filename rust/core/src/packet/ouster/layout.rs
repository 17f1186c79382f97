//! Data packets: columns of pixels, little endian, with a header and a footer where the profile is not
//! the legacy one.
//!
//! Source: the maker's development kit, packet formats. No size and no byte names the layout; it is told
//! by the metadata, or guessed from columns that follow each other.

use std::ops::Range;

/// Byte ranges of the packet header.
mod header {
    use std::ops::Range;

    pub const LEN: usize = 32;
    pub const TYPE: Range<usize> = 0..2; // u16, 1 = lidar
    pub const FRAME: Range<usize> = 2..4; // u16
    pub const INIT: Range<usize> = 4..7; // u24
    pub const SERIAL: Range<usize> = 7..12; // u40

    /// Functional safety firmware.
    pub mod safety {
        use std::ops::Range;

        pub const TYPE: Range<usize> = 0..1; // u8
        pub const INIT: Range<usize> = 1..4; // u24
        pub const FRAME: Range<usize> = 4..8; // u32
        pub const SERIAL: Range<usize> = 11..16; // u40
    }
}

/// Byte ranges of a column.
mod column {
    use std::ops::Range;

    pub const TIME: Range<usize> = 0..8; // u64, ns
    pub const NUMBER: Range<usize> = 8..10; // u16, measurement id
    pub const STATUS: Range<usize> = 10..12; // u16, bit 0 = valid
    pub const LEN: usize = 12;

    /// Without a packet header.
    pub mod legacy {
        use std::ops::Range;

        pub const FRAME: Range<usize> = 10..12; // u16
        pub const ENCODER: Range<usize> = 12..16; // u32, ticks
        pub const LEN: usize = 16;
        pub const STATUS_LEN: usize = 4; // behind the pixels, all ones = valid
    }
}

/// Encoder ticks of a turn.
pub const ENCODER_TICKS: u32 = 90_112;

/// What the packet header looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Header {
    /// There is none.
    Legacy,
    /// The usual one.
    Standard,
    /// That of the functional safety firmware.
    Safety,
}

/// Sizes within a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Header.
    pub header: Header,
    /// Columns of a packet.
    pub columns: usize,
    /// Pixels of a column.
    pub pixels: usize,
    /// Bytes of a pixel.
    pub pixel_len: usize,
}

impl Layout {
    /// Bytes before the first column.
    fn header_len(&self) -> usize {
        match self.header {
            Header::Legacy => 0,
            _ => header::LEN,
        }
    }

    /// Bytes before the first pixel of a column.
    fn column_header_len(&self) -> usize {
        match self.header {
            Header::Legacy => column::legacy::LEN,
            _ => column::LEN,
        }
    }

    fn column_len(&self) -> usize {
        let status = match self.header {
            Header::Legacy => column::legacy::STATUS_LEN,
            _ => 0,
        };
        self.column_header_len() + self.pixels * self.pixel_len + status
    }

    /// Bytes of a packet; the footer is as long as the header.
    pub fn packet_len(&self) -> usize {
        2 * self.header_len() + self.columns * self.column_len()
    }
}

/// Borrowed data packet. Its length was checked, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    bytes: &'a [u8],
    layout: Layout,
}

/// Borrowed column.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    bytes: &'a [u8],
    layout: Layout,
}

fn little(bytes: &[u8], range: Range<usize>) -> u64 {
    let known = bytes.get(range).unwrap_or(&[]);
    known
        .iter()
        .rev()
        .fold(0, |value, byte| value << 8 | u64::from(*byte))
}

fn put(bytes: &mut [u8], range: Range<usize>, value: u64) {
    let length = range.len();
    if let Some(place) = bytes.get_mut(range) {
        place.copy_from_slice(&value.to_le_bytes()[..length]);
    }
}

impl<'a> View<'a> {
    /// Takes a payload of the layout's length that says that it is a data packet; `None` for any other.
    pub fn new(bytes: &'a [u8], layout: Layout) -> Option<Self> {
        if bytes.len() != layout.packet_len() {
            return None;
        }
        let kind = match layout.header {
            Header::Legacy => 1,
            Header::Standard => little(bytes, header::TYPE),
            Header::Safety => little(bytes, header::safety::TYPE),
        };
        (kind == 1).then_some(Self { bytes, layout })
    }

    /// Sizes.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Number of the turn; starts again after 2^16, or 2^32 with the functional safety firmware.
    pub fn frame(&self) -> u32 {
        match self.layout.header {
            Header::Legacy => {
                let mut columns = self.columns();
                let valid = columns.clone().find(Column::is_valid);
                let column = valid.or_else(|| columns.next());
                column.map_or(0, |column| {
                    little(column.bytes, column::legacy::FRAME) as u32
                })
            }
            Header::Standard => little(self.bytes, header::FRAME) as u32,
            Header::Safety => little(self.bytes, header::safety::FRAME) as u32,
        }
    }

    /// Number that the sensor drew when it started; 0 where there is none.
    pub fn init_id(&self) -> u64 {
        match self.layout.header {
            Header::Legacy => 0,
            Header::Standard => little(self.bytes, header::INIT),
            Header::Safety => little(self.bytes, header::safety::INIT),
        }
    }

    /// Serial number; 0 where there is none.
    pub fn serial(&self) -> u64 {
        match self.layout.header {
            Header::Legacy => 0,
            Header::Standard => little(self.bytes, header::SERIAL),
            Header::Safety => little(self.bytes, header::safety::SERIAL),
        }
    }

    /// Columns in the order of the packet.
    pub fn columns(&self) -> impl Iterator<Item = Column<'a>> + Clone + use<'a> {
        let layout = self.layout;
        let start = layout.header_len().min(self.bytes.len());
        let columns = self.bytes[start..].chunks_exact(layout.column_len().max(1));
        columns
            .take(layout.columns)
            .map(move |bytes| Column { bytes, layout })
    }

    /// Whether the valid columns follow each other: numbers by one, times by less than 10 ms, and, where
    /// the columns of a turn are known, none beyond the last.
    pub fn is_plausible(&self, columns_per_turn: Option<usize>) -> bool {
        const MOST_NS: u64 = 10_000_000;
        let mut last: Option<(usize, u16, u64)> = None;
        for (place, column) in self.columns().enumerate() {
            if !column.has_sound_status() {
                return false;
            }
            if !column.is_valid() {
                continue;
            }
            let (number, time) = (column.number(), column.time_ns());
            if columns_per_turn.is_some_and(|count| usize::from(number) >= count)
                || time > i64::MAX as u64
            {
                return false;
            }
            if let Some((before, number_before, time_before)) = last {
                let steps = place - before;
                let ahead = usize::from(number).checked_sub(usize::from(number_before));
                let elapsed_ns = time.checked_sub(time_before);
                if ahead != Some(steps) || elapsed_ns.is_none_or(|ns| ns > MOST_NS * steps as u64) {
                    return false;
                }
            }
            last = Some((place, number, time));
        }
        true
    }
}

impl<'a> Column<'a> {
    /// Device time, ns.
    pub fn time_ns(&self) -> u64 {
        little(self.bytes, column::TIME)
    }

    /// Number within the turn, the measurement id.
    pub fn number(&self) -> u16 {
        little(self.bytes, column::NUMBER) as u16
    }

    /// Ticks of the encoder; only in legacy packets.
    pub fn encoder(&self) -> u32 {
        little(self.bytes, column::legacy::ENCODER) as u32
    }

    fn status(&self) -> u64 {
        match self.layout.header {
            Header::Legacy => {
                let end = self.layout.column_len();
                little(self.bytes, end - column::legacy::STATUS_LEN..end)
            }
            _ => little(self.bytes, column::STATUS),
        }
    }

    /// Whether anything was measured.
    pub fn is_valid(&self) -> bool {
        self.status() & 1 == 1
    }

    /// Whether the status is one that sensors write.
    fn has_sound_status(&self) -> bool {
        match self.layout.header {
            Header::Legacy => matches!(self.status(), 0 | 0xFFFF_FFFF),
            _ => true,
        }
    }

    /// Bytes of all pixels, from the top beam.
    pub fn body(&self) -> &'a [u8] {
        let start = self.layout.column_header_len();
        let length = self.layout.pixels * self.layout.pixel_len;
        self.bytes.get(start..start + length).unwrap_or(&[])
    }

    /// Bytes of the pixels, from the top beam.
    pub fn pixels(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.body().chunks_exact(self.layout.pixel_len.max(1))
    }
}

/// A column to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawColumn {
    /// Device time, ns.
    pub time_ns: u64,
    /// Number within the turn.
    pub number: u16,
    /// Whether anything was measured.
    pub is_valid: bool,
    /// Bytes of the pixels, from the top beam.
    pub pixels: Vec<Vec<u8>>,
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Number of the turn.
    pub frame: u32,
    /// Number that the sensor drew when it started.
    pub init_id: u32,
    /// Serial number.
    pub serial: u64,
    /// Columns of a turn, for the encoder.
    pub columns_per_turn: u32,
    /// Columns.
    pub columns: Vec<RawColumn>,
}

/// Writes a data packet; what is too much is left out.
pub fn encode(layout: Layout, packet: &RawPacket) -> Vec<u8> {
    let mut bytes = vec![0; layout.packet_len()];
    let (frame, init_id) = (u64::from(packet.frame), u64::from(packet.init_id));
    match layout.header {
        Header::Legacy => {}
        Header::Standard => {
            put(&mut bytes, header::TYPE, 1);
            put(&mut bytes, header::FRAME, frame);
            put(&mut bytes, header::INIT, init_id);
            put(&mut bytes, header::SERIAL, packet.serial);
        }
        Header::Safety => {
            put(&mut bytes, header::safety::TYPE, 1);
            put(&mut bytes, header::safety::FRAME, frame);
            put(&mut bytes, header::safety::INIT, init_id);
            put(&mut bytes, header::safety::SERIAL, packet.serial);
        }
    }
    let places = bytes[layout.header_len()..].chunks_exact_mut(layout.column_len());
    for (place, column) in places.zip(&packet.columns) {
        write_column(layout, place, column, packet);
    }
    bytes
}

fn write_column(layout: Layout, bytes: &mut [u8], column: &RawColumn, packet: &RawPacket) {
    put(bytes, column::TIME, column.time_ns);
    put(bytes, column::NUMBER, column.number.into());
    if layout.header == Header::Legacy {
        let ticks = ENCODER_TICKS / packet.columns_per_turn.max(1);
        put(bytes, column::legacy::FRAME, packet.frame.into());
        let encoder = u64::from(column.number) * u64::from(ticks);
        put(bytes, column::legacy::ENCODER, encoder);
        let status = if column.is_valid { u32::MAX } else { 0 };
        let end = bytes.len();
        put(bytes, end - column::legacy::STATUS_LEN..end, status.into());
    } else {
        put(bytes, column::STATUS, column.is_valid.into());
    }
    let start = layout.column_header_len();
    let pixels = bytes[start..].chunks_exact_mut(layout.pixel_len.max(1));
    for (place, pixel) in pixels.take(layout.pixels).zip(&column.pixels) {
        let length = place.len().min(pixel.len());
        place[..length].copy_from_slice(&pixel[..length]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_manual() {
        let len = |header, pixels, pixel_len| {
            Layout {
                header,
                columns: 16,
                pixels,
                pixel_len,
            }
            .packet_len()
        };
        assert_eq!(len(Header::Legacy, 64, 12), 12_608);
        assert_eq!(len(Header::Standard, 128, 12), 24_832);
        assert_eq!(len(Header::Standard, 32, 16), 8_448);
        assert_eq!(len(Header::Safety, 128, 8), 16_640);
    }

    #[test]
    fn what_is_written_is_read_with_every_header() {
        for header in [Header::Legacy, Header::Standard, Header::Safety] {
            let layout = Layout {
                header,
                columns: 4,
                pixels: 2,
                pixel_len: 12,
            };
            let columns = (0..4_u16).map(|place| RawColumn {
                time_ns: 5_000_000_000 + u64::from(place) * 97_656,
                number: 100 + place,
                is_valid: place != 1,
                pixels: vec![vec![place as u8; 12]; 2],
            });
            let packet = RawPacket {
                frame: 65_535,
                init_id: 0x00AB_CDEF,
                serial: 992_210_000_957,
                columns_per_turn: 1024,
                columns: columns.collect(),
            };
            let bytes = encode(layout, &packet);
            let view = View::new(&bytes, layout).unwrap();
            assert_eq!(view.frame(), 65_535);
            if header != Header::Legacy {
                assert_eq!(
                    (view.init_id(), view.serial()),
                    (0x00AB_CDEF, packet.serial)
                );
            }
            assert!(view.is_plausible(Some(1024)) && !view.is_plausible(Some(102)));
            for (column, raw) in view.columns().zip(&packet.columns) {
                assert_eq!(column.time_ns(), raw.time_ns);
                assert_eq!(
                    (column.number(), column.is_valid()),
                    (raw.number, raw.is_valid)
                );
                assert!(column.pixels().eq(raw.pixels.iter().map(Vec::as_slice)));
            }
            assert!(View::new(&bytes[1..], layout).is_none());
        }
    }
}
