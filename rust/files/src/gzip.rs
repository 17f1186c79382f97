//! Gzip files of any number of members, as `cat a.gz b.gz`, bgzip and pigz make them.

use std::io::{self, BufRead, ErrorKind, Read};

use flate2::bufread::GzDecoder;

/// Decompresses members one after another until the file ends.
///
/// Zeros behind the last member are padding of tapes and block devices and are passed over; other
/// bytes there are an error.
#[derive(Debug)]
pub(crate) struct GzipMembers<R> {
    /// `None` only while one decoder gives way to the next.
    member: Option<GzDecoder<R>>,
    ended: bool,
}

impl<R: BufRead> GzipMembers<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self {
            member: Some(GzDecoder::new(reader)),
            ended: false,
        }
    }

    /// The reader of the compressed bytes.
    pub(crate) fn get_ref(&self) -> Option<&R> {
        self.member.as_ref().map(GzDecoder::get_ref)
    }

    /// Goes on to the next member, if there is one.
    fn next_member(&mut self) -> io::Result<()> {
        let Some(member) = self.member.take() else {
            return Ok(());
        };
        let mut reader = member.into_inner();
        let found = skip_zeros(&mut reader);
        self.member = Some(GzDecoder::new(reader));
        self.ended = !matches!(found, Ok(Some(0x1F)));
        match found? {
            None | Some(0x1F) => Ok(()),
            Some(_) => Err(io::Error::new(
                ErrorKind::InvalidData,
                "behind the last gzip member stand bytes that are no gzip",
            )),
        }
    }
}

/// The first byte that is not zero, left in the reader; `None` at the end.
fn skip_zeros(reader: &mut impl BufRead) -> io::Result<Option<u8>> {
    loop {
        let bytes = reader.fill_buf()?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let zeros = bytes.iter().take_while(|byte| **byte == 0).count();
        let found = bytes.get(zeros).copied();
        reader.consume(zeros);
        if found.is_some() {
            return Ok(found);
        }
    }
}

impl<R: BufRead> Read for GzipMembers<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while !self.ended && !into.is_empty() {
            let Some(member) = &mut self.member else {
                break;
            };
            match member.read(into)? {
                0 => self.next_member()?,
                count => return Ok(count),
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::{BufReader, Write};

    fn member(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn unpack(bytes: &[u8]) -> (Vec<u8>, io::Result<usize>) {
        // A small buffer, so that members begin at its edges.
        let mut reader = GzipMembers::new(BufReader::with_capacity(3, bytes));
        let mut unpacked = Vec::new();
        let result = reader.read_to_end(&mut unpacked);
        (unpacked, result)
    }

    #[test]
    fn members_follow_one_another() {
        let packed = [
            member(b"blade "),
            member(b""),
            member(b"root"),
            member(&[7; 99_999]),
        ]
        .concat();
        let (unpacked, result) = unpack(&packed);
        assert_eq!(result.unwrap(), 10 + 99_999);
        assert!(unpacked.starts_with(b"blade root\x07"));
    }

    #[test]
    fn zeros_behind_the_end_are_padding_and_garbage_is_told() {
        let padded = [member(b"tip"), vec![0; 512]].concat();
        assert_eq!(unpack(&padded).1.unwrap(), 3);
        let (unpacked, result) = unpack(&[member(b"tip"), b"garbage".to_vec()].concat());
        assert_eq!(
            (unpacked, result.unwrap_err().kind()),
            (b"tip".to_vec(), ErrorKind::InvalidData)
        );
    }

    #[test]
    fn a_cut_file_ends_unexpectedly() {
        let packed = [member(b"root"), member(&[7; 1000])].concat();
        let whole = member(b"root").len();
        for len in (1..packed.len()).filter(|len| *len != whole) {
            let (unpacked, result) = unpack(&packed[..len]);
            assert_eq!(
                result.unwrap_err().kind(),
                ErrorKind::UnexpectedEof,
                "{len} bytes"
            );
            assert!(unpacked.starts_with(b"root") || len < whole);
        }
    }
}
