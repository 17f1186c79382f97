//! A sliding window over a stream of bytes: what is needed is made contiguous, memory stays bounded.

use std::io::{self, ErrorKind, Read};

/// Room of a window before any record asks for more; a few hundred lidar packets.
const INITIAL_ROOM: usize = 512 * 1024;

/// How the stream behind a window ended.
#[derive(Debug)]
pub(crate) enum End {
    /// At its end.
    Clean,
    /// In the middle of a compressed stream: what came before is good.
    CutShort(String),
    /// With a failure of the reader that has not been told yet.
    Failed(io::Error),
    /// With a failure that has been told.
    FailureTold,
}

/// Buffered bytes of a reader, with the place of the first one in the stream.
#[derive(Debug)]
pub(crate) struct Window<R> {
    reader: R,
    buffer: Vec<u8>,
    start: usize,
    stop: usize,
    offset: u64,
    end: Option<End>,
}

impl<R: Read> Window<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self {
            reader,
            buffer: vec![0; INITIAL_ROOM],
            start: 0,
            stop: 0,
            offset: 0,
            end: None,
        }
    }

    pub(crate) fn get_ref(&self) -> &R {
        &self.reader
    }

    /// Place of the first unread byte in the stream.
    pub(crate) fn offset(&self) -> u64 {
        self.offset
    }

    /// Bytes read ahead and not yet consumed.
    pub(crate) fn available(&self) -> usize {
        self.stop - self.start
    }

    /// How the stream ended, once it did.
    pub(crate) fn end(&self) -> Option<&End> {
        self.end.as_ref()
    }

    /// Makes the next `count` bytes contiguous. `false`: the stream ends before them.
    ///
    /// # Errors
    /// The failure of the reader, once, when `count` bytes cannot be had because of it.
    #[inline]
    pub(crate) fn require(&mut self, count: usize) -> io::Result<bool> {
        if self.available() >= count {
            return Ok(true);
        }
        self.fill(count)
    }

    fn fill(&mut self, count: usize) -> io::Result<bool> {
        self.make_room(count);
        while self.available() < count && self.end.is_none() {
            self.read_once();
        }
        if self.available() >= count {
            return Ok(true);
        }
        match self.end.take() {
            Some(End::Failed(error)) => {
                self.end = Some(End::FailureTold);
                Err(error)
            }
            other => {
                self.end = other;
                Ok(false)
            }
        }
    }

    fn make_room(&mut self, count: usize) {
        self.buffer.copy_within(self.start..self.stop, 0);
        self.stop -= self.start;
        self.start = 0;
        if self.buffer.len() < count {
            self.buffer.resize(count, 0);
        }
    }

    fn read_once(&mut self) {
        match self.reader.read(&mut self.buffer[self.stop..]) {
            Ok(0) => self.end = Some(End::Clean),
            // A reader that claims more than it was given must not make us panic.
            Ok(count) => self.stop = (self.stop + count).min(self.buffer.len()),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                self.end = Some(End::CutShort(error.to_string()));
            }
            Err(error) => self.end = Some(End::Failed(error)),
        }
    }

    /// The bytes that stand ready.
    #[inline]
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.buffer[self.start..self.stop]
    }

    /// Steps over `count` bytes of those that stand ready and returns the place of the first, to be
    /// read by [`Window::slice`] until the next call of [`Window::require`].
    #[inline]
    pub(crate) fn consume(&mut self, count: usize) -> usize {
        let place = self.start;
        self.start += count.min(self.available());
        self.offset += (self.start - place) as u64;
        place
    }

    /// Bytes that were consumed since the last [`Window::require`].
    #[inline]
    pub(crate) fn slice(&self, place: usize, len: usize) -> &[u8] {
        &self.buffer[place..place + len]
    }

    /// Steps over `count` bytes without keeping them. `false`: the stream ends before them.
    ///
    /// # Errors
    /// As [`Window::require`].
    pub(crate) fn skip(&mut self, mut count: u64) -> io::Result<bool> {
        while count > 0 {
            if !self.require(1)? {
                return Ok(false);
            }
            let step = count.min(self.available() as u64);
            self.consume(step as usize);
            count -= step;
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives three bytes, then fails.
    struct Failing(u8);
    impl Read for Failing {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.0 += 1;
            match self.0 {
                1..=3 => {
                    into[0] = self.0;
                    Ok(1)
                }
                4 => Err(ErrorKind::Interrupted.into()),
                _ => Err(io::Error::other("disk on fire")),
            }
        }
    }

    #[test]
    fn what_was_read_before_a_failure_is_not_lost() {
        let mut window = Window::new(Failing(0));
        assert!(window.require(2).unwrap());
        window.consume(2);
        assert!(window.require(2).is_err());
        assert_eq!(window.bytes(), [3]);
        assert!(!window.require(2).unwrap(), "a failure is told once");
    }

    #[test]
    fn records_larger_than_the_window_fit() {
        let bytes = vec![7; INITIAL_ROOM + 10];
        let mut window = Window::new(&bytes[..]);
        assert!(window.require(5).unwrap());
        window.consume(5);
        assert!(window.require(INITIAL_ROOM + 5).unwrap());
        assert!(!window.require(INITIAL_ROOM + 6).unwrap());
        assert_eq!((window.offset(), window.available()), (5, INITIAL_ROOM + 5));
    }

    #[test]
    fn skipping_counts_places() {
        let bytes = vec![7; 3 * INITIAL_ROOM];
        let mut window = Window::new(&bytes[..]);
        assert!(window.skip(2 * INITIAL_ROOM as u64 + 1).unwrap());
        assert_eq!(window.offset(), 2 * INITIAL_ROOM as u64 + 1);
        assert!(!window.skip(INITIAL_ROOM as u64).unwrap());
        assert_eq!(window.offset(), 3 * INITIAL_ROOM as u64);
    }
}
