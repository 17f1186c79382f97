//! Packets of known formats that are not decoded: which sensor or setting sends them, and what to do.
//!
//! Without this list such a packet would be told as a misfit of the model whose size it has, with the advice to
//! name that model: a wrong guess.

use super::Misfit;
use super::hesai::layout::{Header, MAGIC};
use super::leishen::ch;
use super::robosense::{layout, solid::header};

/// Hesai's protocols, major and minor, and who speaks them.
const HESAI: [((u8, u8), &str); 9] = [
    ((1, 4), "Pandar128E3X and its siblings"),
    ((1, 8), "JT16"),
    ((3, 1), "PandarQT64"),
    ((3, 2), "QT128C2X"),
    ((4, 1), "AT128"),
    ((4, 3), "AT128"),
    ((4, 7), "ATX"),
    ((6, 1), "PandarXT-16, XT-32, XT32M2X"),
    ((7, 2), "FT120"),
];
/// Type byte of an EM4.
const EM4: u8 = 0x70;
/// Bytes of the packets of spinning RoboSense sensors that are decoded.
const SPINNING_LENS: [usize; 2] = [1248, 1268];
const ELSEWHERE: &str = "which is not decoded: export points with the maker's program";

/// What a packet is that no model takes although its format is known; `None` for any other.
pub fn stranger(payload: &[u8]) -> Option<Misfit> {
    let why = hesai_modern(payload)
        .or_else(|| hesai_older(payload))
        .or_else(|| robosense_solid(payload))
        .or_else(|| robosense_spinning(payload))
        .or_else(|| leishen_mirror(payload))?;
    Some(Misfit { why, may_be: None })
}

/// Packets with the maker's common header whose protocol or size is none that is decoded.
fn hesai_modern(payload: &[u8]) -> Option<String> {
    let header = Header::new(payload)?;
    let (major, minor) = header.protocol;
    // The oldest models have the numbers of lasers and blocks in the place of the protocol.
    let is_protocol = (1..16).contains(&major) && minor < 16;
    let known = HESAI
        .iter()
        .find(|(protocol, _)| *protocol == (major, minor));
    let who = known.map_or(String::new(), |(_, models)| format!(" ({models})"));
    let (lasers, blocks, len) = (header.lasers, header.blocks, payload.len());
    is_protocol.then(|| {
        format!("Hesai protocol {major}.{minor}{who} with {blocks} blocks of {lasers} channels in {len} bytes, {ELSEWHERE}")
    })
}

/// Lasers and blocks behind the mark, as packets of the Pandar64 and of its smaller siblings have them.
fn hesai_older(payload: &[u8]) -> Option<String> {
    let is_older = payload.starts_with(&[MAGIC[0], MAGIC[1], 20, 20]);
    is_older.then(|| format!("a Hesai Pandar20A or Pandar20B, {ELSEWHERE}"))
}

/// Packets of solid RoboSense sensors in other lengths than those that are decoded.
fn robosense_solid(payload: &[u8]) -> Option<String> {
    const SECOND_PART: [u8; 4] = [0x55, 0xAA, 0x5A, 0x02];
    let is_part = payload.starts_with(&SECOND_PART);
    let is_solid = payload.starts_with(&header::ID) && payload.len() > header::LEN;
    let (kind, len) = (header::kind(payload), payload.len());
    if is_part || is_solid && kind == EM4 {
        return Some(format!(
            "{len} bytes of a RoboSense EM4 that compresses its packets, which is not decoded: set the sensor to packets \
             of fixed length (1084 bytes), or export points with the maker's program"
        ));
    }
    is_solid.then(|| {
        format!("{len} bytes of a solid RoboSense sensor of type {kind:#04x}, {ELSEWHERE}")
    })
}

/// Packets of spinning RoboSense sensors in other lengths than those that are decoded.
fn robosense_spinning(payload: &[u8]) -> Option<String> {
    let is_own = payload.starts_with(&layout::ID) || payload.starts_with(&layout::CLASSIC_ID);
    let len = payload.len();
    let kinds = payload.get(layout::field::TYPE)?;
    (is_own && !SPINNING_LENS.contains(&len)).then(|| {
        format!("{len} bytes of a spinning RoboSense sensor with the type bytes {kinds:02x?}, {ELSEWHERE}")
    })
}

/// Packets of the two mirror sensors of Leishen that are not decoded.
fn leishen_mirror(payload: &[u8]) -> Option<String> {
    if ch::is_wide(payload) {
        return Some(format!(
            "a Leishen CH64W, whose two sides see 180 degrees, {ELSEWHERE}"
        ));
    }
    ch::is_one_line(payload).then(|| format!("a Leishen CX1S3, which has one line, {ELSEWHERE}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(head: &[u8], len: usize) -> String {
        let mut payload = head.to_vec();
        payload.resize(len, 0);
        stranger(&payload)
            .map(|misfit| misfit.why)
            .unwrap_or_default()
    }

    #[test]
    fn formats_that_are_not_decoded_are_named() {
        let mut em4 = header::ID.to_vec();
        em4.resize(header::LEN, 0);
        em4[30] = EM4;
        assert!(told(&em4, 700).contains("RoboSense EM4 that compresses"));
        assert!(told(&[0x55, 0xAA, 0x5A, 0x02], 300).contains("fixed length"));
        em4[30] = 0x99;
        assert!(told(&em4, 700).contains("type 0x99"));
        assert!(
            told(&[0xEE, 0xFF, 2, 5, 0, 0, 40, 4], 900)
                .contains("protocol 2.5 with 4 blocks of 40")
        );
        assert!(
            told(&[0xEE, 0xFF, 1, 4, 0, 0, 40, 2], 500).contains("Pandar128E3X and its siblings")
        );
        assert!(told(&[0xEE, 0xFF, 20, 20], 1270).contains("Pandar20A or Pandar20B"));
        assert!(told(&layout::CLASSIC_ID, 1300).contains("type bytes [00, 00, 00]"));
    }

    #[test]
    fn other_packets_are_no_strangers() {
        assert_eq!(told(&[], 48), "");
        assert_eq!(told(&[0xFF, 0xEE], 1206), "");
        assert_eq!(told(&[0xEE, 0xFF, 64, 6], 1200), "");
    }
}
