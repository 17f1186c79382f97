//! The last records of a file without reading what stands before them.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use lidar_deflect_core::capture::DatagramReader;

/// Bytes at the end that are looked at.
const TAIL_LEN: u64 = 1 << 20;
/// Bytes at the start in which a pcapng describes its interfaces.
const HEAD_LEN: u64 = 1 << 16;
/// So many records in a row that end with the file are no accident.
const ENOUGH_RECORDS: usize = 8;
/// No record is longer.
const MAX_RECORD: usize = 1 << 18;

const PCAP_HEADER: usize = 24;
const RECORD_HEADER: usize = 16;
const SECTION: u32 = 0x0A0D_0D0A;
const PACKET_BLOCKS: [u32; 3] = [2, 3, 6];

/// The datagrams of the last megabyte of a plain capture; `None` where that cannot be told from
/// its end: compressed, damaged, or shorter than that.
pub fn tail(path: &Path) -> Option<DatagramReader<Cursor<Vec<u8>>>> {
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    if length < TAIL_LEN + HEAD_LEN {
        return None;
    }
    let mut head = Vec::new();
    (&mut file).take(HEAD_LEN).read_to_end(&mut head).ok()?;
    file.seek(SeekFrom::Start(length - TAIL_LEN)).ok()?;
    let mut end = Vec::new();
    file.read_to_end(&mut end).ok()?;
    DatagramReader::new(Cursor::new(joined(&head, &end)?)).ok()
}

/// Head of the file and its last whole records, as a capture of its own.
fn joined(head: &[u8], end: &[u8]) -> Option<Vec<u8>> {
    let word = |big: bool| Words { big };
    match head.get(..4)? {
        [0xD4, 0xC3, 0xB2, 0xA1] | [0x4D, 0x3C, 0xB2, 0xA1] => pcap(head, end, word(false)),
        [0xA1, 0xB2, 0xC3, 0xD4] | [0xA1, 0xB2, 0x3C, 0x4D] => pcap(head, end, word(true)),
        [0x0A, 0x0D, 0x0D, 0x0A] => {
            let big = *head.get(8..12)? == [0x1A, 0x2B, 0x3C, 0x4D];
            pcapng(head, end, word(big))
        }
        _ => None,
    }
}

/// Numbers of 32 bits in the byte order of the file.
#[derive(Clone, Copy)]
struct Words {
    big: bool,
}

impl Words {
    fn at(self, bytes: &[u8], place: usize) -> Option<u32> {
        let word = bytes.get(place..place.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big {
            u32::from_be_bytes(word)
        } else {
            u32::from_le_bytes(word)
        })
    }
}

fn pcap(head: &[u8], end: &[u8], words: Words) -> Option<Vec<u8>> {
    let start = (0..end.len().min(MAX_RECORD)).find(|start| is_chain(end, *start, words))?;
    Some([&head[..PCAP_HEADER], &end[start..]].concat())
}

/// Whether records follow each other from `start` to the very end.
fn is_chain(end: &[u8], start: usize, words: Words) -> bool {
    let mut place = start;
    let mut records = 0;
    while place < end.len() {
        let lengths = words.at(end, place + 8).zip(words.at(end, place + 12));
        let is_sound = |(kept, sent): &(u32, u32)| kept <= sent && *sent < MAX_RECORD as u32;
        let Some((kept, _)) = lengths.filter(is_sound) else {
            return false;
        };
        if words
            .at(end, place + 4)
            .is_none_or(|fraction| fraction >= 1_000_000_000)
        {
            return false;
        }
        place += RECORD_HEADER + kept as usize;
        records += 1;
    }
    place == end.len() && records >= ENOUGH_RECORDS
}

/// Blocks state their length at their end too, so one can walk back.
fn pcapng(head: &[u8], end: &[u8], words: Words) -> Option<Vec<u8>> {
    let mut start = end.len();
    let mut is_section = false;
    while start >= 12 && !is_section {
        let length = words.at(end, start - 4)? as usize;
        let is_whole = length >= 12 && length.is_multiple_of(4) && length <= start;
        if !is_whole || words.at(end, start - length + 4)? as usize != length {
            break;
        }
        start -= length;
        is_section = words.at(end, start)? == SECTION;
    }
    if start == end.len() {
        return None;
    }
    let described = if is_section {
        0
    } else {
        first_packet(head, words)?
    };
    Some([&head[..described], &end[start..]].concat())
}

/// Where the first packet of a pcapng stands.
fn first_packet(head: &[u8], words: Words) -> Option<usize> {
    let mut place = 0;
    loop {
        if PACKET_BLOCKS.contains(&words.at(head, place)?) {
            return Some(place);
        }
        let length = words.at(head, place + 4)? as usize;
        place = place.checked_add(length.max(12))?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lidar_deflect_core::capture::PcapWriter;
    use lidar_deflect_core::time::Timestamp;

    fn datagrams(bytes: &[u8]) -> Vec<(i64, usize)> {
        let mut reader = DatagramReader::new(bytes).unwrap();
        let mut found = vec![];
        while let Some(datagram) = reader.next().unwrap() {
            found.push((datagram.time.0, datagram.payload.len()));
        }
        found
    }

    fn written() -> Vec<u8> {
        let mut writer = PcapWriter::new(Vec::new()).unwrap();
        let (from, to) = ("10.0.0.1:1".parse().unwrap(), "10.0.0.2:2".parse().unwrap());
        for number in 0..500_i64 {
            let payload = vec![number as u8; 100 + number as usize];
            let time = Timestamp(1_700_000_000_000_000_000 + number * 1_000_000);
            writer.write_udp(time, from, to, &payload).unwrap();
        }
        writer.into_inner()
    }

    #[test]
    fn the_end_of_a_pcap_is_found_from_any_byte() {
        let bytes = written();
        let whole = datagrams(&bytes);
        for cut in (bytes.len() - 60_000..bytes.len() - 20_000).step_by(777) {
            let joined = joined(&bytes, &bytes[cut..]).unwrap();
            let end = datagrams(&joined);
            assert!(end.len() > 20 && whole.ends_with(&end));
            // At most one record is lost at the cut.
            assert!(joined.len() + 700 > bytes.len() - cut);
        }
    }

    #[test]
    fn the_end_of_a_pcapng_is_found_from_any_byte() {
        let bytes = pcapng_of(&written());
        let whole = datagrams(&bytes);
        for cut in (bytes.len() - 60_000..bytes.len() - 20_000).step_by(777) {
            let end = datagrams(&joined(&bytes, &bytes[cut..]).unwrap());
            assert!(end.len() > 20 && whole.ends_with(&end));
        }
    }

    /// The same records as enhanced packets of one interface with nanoseconds.
    fn pcapng_of(pcap: &[u8]) -> Vec<u8> {
        let mut bytes = block(SECTION, &section());
        let mut interface = [1_u16.to_le_bytes(), [0; 2]].concat();
        interface.extend(0_u32.to_le_bytes());
        interface.extend([9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0]); // if_tsresol: 9
        bytes.extend(block(1, &interface));
        let mut place = PCAP_HEADER;
        let words = Words { big: false };
        while place < pcap.len() {
            let field = |n: usize| words.at(pcap, place + 4 * n).unwrap();
            let nanos = u64::from(field(0)) * 1_000_000_000 + u64::from(field(1));
            let length = field(2) as usize;
            let data = &pcap[place + RECORD_HEADER..place + RECORD_HEADER + length];
            let numbers = [0, (nanos >> 32) as u32, nanos as u32, field(2), field(2)];
            let mut packet: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            packet.extend(data);
            bytes.extend(block(6, &packet));
            place += RECORD_HEADER + length;
        }
        bytes
    }

    fn section() -> Vec<u8> {
        let mut body = 0x1A2B_3C4D_u32.to_le_bytes().to_vec();
        body.extend([1, 0, 0, 0]);
        body.extend([0xFF; 8]);
        body
    }

    fn block(kind: u32, body: &[u8]) -> Vec<u8> {
        let padding = body.len().next_multiple_of(4) - body.len();
        let length = (12 + body.len() + padding) as u32;
        let mut bytes = [kind.to_le_bytes(), length.to_le_bytes()].concat();
        bytes.extend(body);
        bytes.extend(vec![0; padding]);
        bytes.extend(length.to_le_bytes());
        bytes
    }

    #[test]
    fn noise_has_no_end() {
        assert!(joined(&[0; 100], &[0; 100]).is_none());
        let bytes = written();
        assert!(joined(&bytes, &bytes[bytes.len() - 60_000..bytes.len() - 3]).is_none());
    }
}
