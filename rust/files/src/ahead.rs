//! Decompression on a thread of its own, while the caller works on what was unpacked before.

use std::io::{self, ErrorKind, Read};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// So much is unpacked where it is asked for, so that a look at the head of a file starts no thread.
const DIRECT_BYTES: u64 = 1 << 20;
/// Bytes handed over at once.
const CHUNK_BYTES: usize = 256 * 1024;
/// Chunks that may wait: what memory this may take.
const CHUNKS: usize = 8;

/// A reader that counts what it takes of the file.
pub(crate) trait Packed: Read + Send + Sync {
    /// Bytes of the file that were read so far.
    fn packed_bytes(&self) -> u64;
}

/// Gives the bytes of `reader`, and its errors, in the same order.
pub(crate) enum Ahead {
    /// On the caller's thread: what is left to read on it.
    Direct(Box<dyn Packed>, u64),
    /// On a thread of its own.
    Threaded(Taker),
}

struct Chunk {
    /// How many bytes of the buffer count: it keeps its length, as what is cut off would be zeroed anew.
    count: io::Result<usize>,
    bytes: Vec<u8>,
    packed_bytes: u64,
}

/// The caller's end.
pub(crate) struct Taker {
    chunks: Mutex<Receiver<Chunk>>, // never locked: it only makes the type one that threads may share
    emptied: SyncSender<Vec<u8>>,
    bytes: Vec<u8>,
    taken: usize,
    count: usize,
    packed_bytes: u64,
}

impl Ahead {
    pub(crate) fn new(reader: Box<dyn Packed>) -> Self {
        Self::Direct(reader, DIRECT_BYTES)
    }

    /// Bytes of the file that were read for what was given out so far, or a little more.
    pub(crate) fn packed_bytes(&self) -> u64 {
        match self {
            Self::Direct(reader, _) => reader.packed_bytes(),
            Self::Threaded(taker) => taker.packed_bytes,
        }
    }
}

impl Read for Ahead {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Direct(reader, left) => {
                let count = reader.read(into)?;
                *left = left.saturating_sub(count as u64);
                if *left == 0 {
                    self.detach()?;
                }
                Ok(count)
            }
            Self::Threaded(taker) => taker.read(into),
        }
    }
}

impl Ahead {
    /// Goes on with a thread.
    fn detach(&mut self) -> io::Result<()> {
        let nothing: Box<dyn Packed> = Box::new(Nothing);
        if let Self::Direct(reader, _) = std::mem::replace(self, Self::Direct(nothing, 0)) {
            *self = Self::Threaded(Taker::over(reader)?);
        }
        Ok(())
    }
}

impl Taker {
    fn over(reader: Box<dyn Packed>) -> io::Result<Self> {
        let (sender, chunks) = sync_channel(CHUNKS);
        let (emptied, empty) = sync_channel(CHUNKS + 2);
        let packed_bytes = reader.packed_bytes();
        std::thread::Builder::new().spawn(move || unpack(reader, &sender, &empty))?;
        Ok(Self {
            chunks: Mutex::new(chunks),
            emptied,
            bytes: Vec::new(),
            taken: 0,
            count: 0,
            packed_bytes,
        })
    }

    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.taken == self.count {
            let chunks = self.chunks.get_mut().map_err(|_| ErrorKind::Other)?;
            let Ok(chunk) = chunks.recv() else {
                return Ok(0); // the thread has told the end, and is gone
            };
            self.packed_bytes = chunk.packed_bytes;
            (self.taken, self.count) = (0, 0);
            self.count = chunk.count?;
            let used = std::mem::replace(&mut self.bytes, chunk.bytes);
            let _ = self.emptied.try_send(used);
        }
        let count = into.len().min(self.count - self.taken);
        into[..count].copy_from_slice(&self.bytes[self.taken..][..count]);
        self.taken += count;
        Ok(count)
    }
}

/// Unpacks until the end, an error, or until nobody takes any more.
fn unpack(mut reader: Box<dyn Packed>, sender: &SyncSender<Chunk>, empty: &Receiver<Vec<u8>>) {
    loop {
        let mut bytes = empty.try_recv().unwrap_or_default();
        bytes.resize(CHUNK_BYTES, 0);
        let count = loop {
            match reader.read(&mut bytes) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => break read,
            }
        };
        let is_last = !matches!(count, Ok(1..));
        let packed_bytes = reader.packed_bytes();
        let chunk = Chunk {
            count,
            bytes,
            packed_bytes,
        };
        if sender.send(chunk).is_err() || is_last {
            return;
        }
    }
}

/// Stands where a reader was taken away.
struct Nothing;

impl Read for Nothing {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        Ok(0)
    }
}

impl Packed for Nothing {
    fn packed_bytes(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts up, a few bytes at a time, and may break at the end; tells when it is dropped.
    struct Numbers {
        given: usize,
        end: usize,
        breaks: bool,
        gone: SyncSender<()>,
    }

    impl Drop for Numbers {
        fn drop(&mut self) {
            let _ = self.gone.try_send(());
        }
    }

    impl Read for Numbers {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let count = into.len().min(self.end - self.given).min(70_001);
            if count == 0 && self.breaks {
                return Err(io::Error::new(ErrorKind::InvalidData, "broken"));
            }
            for (place, byte) in into[..count].iter_mut().enumerate() {
                *byte = ((self.given + place) / 7) as u8;
            }
            self.given += count;
            Ok(count)
        }
    }

    impl Packed for Numbers {
        fn packed_bytes(&self) -> u64 {
            self.given as u64 / 10
        }
    }

    fn numbers(end: usize, breaks: bool) -> (Ahead, Receiver<()>) {
        let (gone, is_gone) = sync_channel(1);
        let numbers = Numbers {
            given: 0,
            end,
            breaks,
            gone,
        };
        (Ahead::new(Box::new(numbers)), is_gone)
    }

    #[test]
    fn all_bytes_come_in_their_order_and_then_the_end() {
        for end in [0, 1000, 1 << 20, 5_000_000] {
            let (mut ahead, _gone) = numbers(end, false);
            let mut bytes = Vec::new();
            ahead.read_to_end(&mut bytes).unwrap();
            assert_eq!(bytes.len(), end);
            let is_right = |(i, byte): (usize, &u8)| *byte == (i / 7) as u8;
            assert!(bytes.iter().enumerate().all(is_right));
            assert_eq!(ahead.packed_bytes(), end as u64 / 10);
            assert_eq!(ahead.read(&mut [0; 8]).unwrap(), 0);
        }
    }

    #[test]
    fn an_error_comes_behind_the_bytes_before_it() {
        for end in [1000, 5_000_000] {
            let (mut ahead, _gone) = numbers(end, true);
            let mut bytes = Vec::new();
            let error = ahead.read_to_end(&mut bytes).unwrap_err();
            assert_eq!((bytes.len(), error.kind()), (end, ErrorKind::InvalidData));
        }
    }

    #[test]
    fn the_thread_ends_when_nobody_takes_any_more() {
        let (mut ahead, gone) = numbers(1 << 30, false);
        ahead.read_exact(&mut vec![0; 3 << 20]).unwrap();
        assert!(matches!(ahead, Ahead::Threaded(_)) && gone.try_recv().is_err());
        drop(ahead);
        gone.recv().unwrap();
    }
}
