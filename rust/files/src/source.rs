//! One file as a stream of uncompressed bytes that knows how far it came in the compressed ones.

use std::fs::{self, File};
use std::io::{self, BufReader, Chain, Cursor, ErrorKind, Read};
use std::path::Path;

use crate::ahead::{Ahead, Packed};
use crate::container::{Container, HEAD_LEN, recognise};
use crate::error::FileError;
use crate::gzip::GzipMembers;

/// Compressed bytes that are read at once.
const BUFFER_LEN: usize = 256 * 1024;

/// Counts what is read.
#[derive(Debug)]
struct Counted {
    reader: Chain<Cursor<Vec<u8>>, File>,
    count: u64,
}

impl Read for Counted {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(into)?;
        self.count += count as u64;
        Ok(count)
    }
}

enum Unpacked {
    Plain(Counted),
    Compressed(Ahead),
}

impl Packed for GzipMembers<BufReader<Counted>> {
    fn packed_bytes(&self) -> u64 {
        self.get_ref().map_or(0, |reader| reader.get_ref().count)
    }
}

impl Packed for zstd::Decoder<'static, BufReader<Counted>> {
    fn packed_bytes(&self) -> u64 {
        self.get_ref().get_ref().count
    }
}

/// A capture file, decompressed on the way.
pub(crate) struct Source(Unpacked);

impl Source {
    /// Opens a file; its first bytes decide how it is read.
    pub(crate) fn open(path: &Path) -> Result<Self, FileError> {
        let told = |error: io::Error| unreadable(path, &error);
        let mut file = File::open(path).map_err(told)?;
        let mut head = Vec::with_capacity(HEAD_LEN);
        // Not by seeking back: a pipe could not.
        (&mut file)
            .take(HEAD_LEN as u64)
            .read_to_end(&mut head)
            .map_err(told)?;
        if head.is_empty() {
            return Err(FileError::Empty { path: path.into() });
        }
        let container = recognise(&head).map_err(|kind| FileError::Foreign {
            path: path.into(),
            kind,
        })?;
        let bytes = Counted {
            reader: Cursor::new(head).chain(file),
            count: 0,
        };
        unpack(container, bytes).map(Self).map_err(told)
    }

    /// Compressed bytes that were read.
    pub(crate) fn bytes_read(&self) -> u64 {
        match &self.0 {
            Unpacked::Plain(bytes) => bytes.count,
            Unpacked::Compressed(ahead) => ahead.packed_bytes(),
        }
    }
}

fn unpack(container: Container, bytes: Counted) -> io::Result<Unpacked> {
    let buffered = |bytes| BufReader::with_capacity(BUFFER_LEN, bytes);
    let reader: Box<dyn Packed> = match container {
        Container::Plain => return Ok(Unpacked::Plain(bytes)),
        Container::Gzip => Box::new(GzipMembers::new(buffered(bytes))),
        Container::Zstd => Box::new(zstd::Decoder::with_buffer(buffered(bytes))?),
    };
    Ok(Unpacked::Compressed(Ahead::new(reader)))
}

impl Read for Source {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match &mut self.0 {
            Unpacked::Plain(bytes) => bytes.read(into),
            Unpacked::Compressed(ahead) => ahead.read(into),
        }
    }
}

/// Size of the file and whether it is a regular one, after the checks that need no opening.
pub(crate) fn size(path: &Path) -> Result<(u64, bool), FileError> {
    let metadata = fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if metadata.is_dir() {
        return Err(FileError::Directory { path: path.into() });
    }
    Ok((metadata.len(), metadata.is_file()))
}

fn unreadable(path: &Path, error: &io::Error) -> FileError {
    match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => FileError::NotFound { path: path.into() },
        ErrorKind::IsADirectory => FileError::Directory { path: path.into() },
        _ => FileError::Unreadable {
            path: path.into(),
            reason: error.to_string(),
        },
    }
}
