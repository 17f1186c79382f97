//! What a file is by its first bytes; its name does not count.

use crate::error::Foreign;

/// Bytes that decide; enough to tell text from data.
pub(crate) const HEAD_LEN: usize = 4096;

/// How the bytes of a capture are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Container {
    Plain,
    Gzip,
    Zstd,
}

const CAPTURES: [[u8; 4]; 5] = [
    [0xD4, 0xC3, 0xB2, 0xA1],
    [0xA1, 0xB2, 0xC3, 0xD4],
    [0x4D, 0x3C, 0xB2, 0xA1],
    [0xA1, 0xB2, 0x3C, 0x4D],
    [0x0A, 0x0D, 0x0D, 0x0A],
];

const FOREIGN: [(&[u8], Foreign); 9] = [
    (&[0xFD, b'7', b'z', b'X', b'Z', 0], Foreign::Xz),
    (b"BZh", Foreign::Bzip2),
    (&[0x04, 0x22, 0x4D, 0x18], Foreign::Lz4),
    (b"PK\x03\x04", Foreign::Zip),
    (b"7z\xBC\xAF\x27\x1C", Foreign::SevenZip),
    (b"#ROSBAG V2.0", Foreign::RosBag),
    (b"SQLite format 3\0", Foreign::Ros2Database),
    (b"\x89MCAP0\r\n", Foreign::Mcap),
    (b"PAR1", Foreign::Parquet),
];

/// Decides by the first bytes of a file, up to [`HEAD_LEN`].
///
/// # Errors
/// What the file seems to be instead of a capture.
pub(crate) fn recognise(head: &[u8]) -> Result<Container, Foreign> {
    if CAPTURES.iter().any(|magic| head.starts_with(magic)) {
        return Ok(Container::Plain);
    }
    match head {
        [0x1F, 0x8B, ..] => return Ok(Container::Gzip),
        [0x28, 0xB5, 0x2F, 0xFD, ..] | [0x50..=0x5F, 0x2A, 0x4D, 0x18, ..] => {
            return Ok(Container::Zstd);
        }
        _ => {}
    }
    Err(foreign(head))
}

fn foreign(head: &[u8]) -> Foreign {
    let known = FOREIGN.iter().find(|(magic, _)| head.starts_with(magic));
    match known {
        Some((_, kind)) => *kind,
        None if is_text(head) => Foreign::Text,
        None => Foreign::Unknown,
    }
}

fn is_text(head: &[u8]) -> bool {
    let text = match std::str::from_utf8(head) {
        Ok(text) => text,
        // The head may end inside a character.
        Err(error) if error.error_len().is_none() => {
            std::str::from_utf8(&head[..error.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return false,
    };
    let is_printable = |c: char| !c.is_control() || matches!(c, '\n' | '\r' | '\t' | '\u{FEFF}');
    !text.is_empty() && text.chars().all(is_printable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captures_and_compressed_ones() {
        for magic in CAPTURES {
            assert_eq!(recognise(&magic), Ok(Container::Plain));
        }
        assert_eq!(recognise(&[0x1F, 0x8B, 8]), Ok(Container::Gzip));
        assert_eq!(recognise(&[0x28, 0xB5, 0x2F, 0xFD]), Ok(Container::Zstd));
        assert_eq!(recognise(&[0x53, 0x2A, 0x4D, 0x18]), Ok(Container::Zstd));
    }

    #[test]
    fn other_files_by_name() {
        for (magic, kind) in FOREIGN {
            assert_eq!(recognise(magic), Err(kind));
        }
        assert_eq!(recognise("x,y,z\n1,2,3 µm".as_bytes()), Err(Foreign::Text));
        assert_eq!(recognise(&"µ".as_bytes()[..1]), Err(Foreign::Unknown));
        assert_eq!(recognise(b"ab\xC2"), Err(Foreign::Text));
        assert_eq!(recognise(&[0xD4, 0xC3]), Err(Foreign::Unknown));
    }
}
