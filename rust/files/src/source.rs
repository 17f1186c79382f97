//! One file as a stream of uncompressed bytes that knows how far it came in the compressed ones.

use std::fs::{self, File};
use std::io::{self, BufReader, Chain, Cursor, ErrorKind, Read};
use std::path::Path;

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
    Gzip(Box<GzipMembers<BufReader<Counted>>>),
    Zstd(Box<zstd::Decoder<'static, BufReader<Counted>>>),
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
            Unpacked::Gzip(gzip) => gzip.get_ref().map_or(0, |reader| reader.get_ref().count),
            Unpacked::Zstd(zstd) => zstd.get_ref().get_ref().count,
        }
    }
}

fn unpack(container: Container, bytes: Counted) -> io::Result<Unpacked> {
    let buffered = |bytes| BufReader::with_capacity(BUFFER_LEN, bytes);
    Ok(match container {
        Container::Plain => Unpacked::Plain(bytes),
        Container::Gzip => Unpacked::Gzip(Box::new(GzipMembers::new(buffered(bytes)))),
        Container::Zstd => Unpacked::Zstd(Box::new(zstd::Decoder::with_buffer(buffered(bytes))?)),
    })
}

impl Read for Source {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match &mut self.0 {
            Unpacked::Plain(bytes) => bytes.read(into),
            Unpacked::Gzip(gzip) => gzip.read(into),
            Unpacked::Zstd(zstd) => zstd.read(into),
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
