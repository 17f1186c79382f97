//! Records of a capture, one after another, whatever the file format.

use std::io::{self, Read};

use super::facts::{CaptureFacts, CaptureWarning, Format};
use super::window::{End, Window};
use super::{pcap, pcapng};
use crate::error::CaptureError;
use crate::time::Timestamp;

/// The largest record that is believed. Whole reassembled datagrams stay far below it; a length above
/// it is garbage.
pub const MAX_RECORD_LEN: u32 = 1024 * 1024;

/// One packet as it was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record<'a> {
    /// Arrival at the recording host; for records without a stamp that of the record before, and
    /// 1970 where there is none before.
    pub time: Timestamp,
    /// Link type, as registered for pcap files.
    pub linktype: u32,
    /// Captured bytes, from the link layer on.
    pub data: &'a [u8],
    /// Length on the wire; above the captured length where the recording cut the packet.
    pub original_len: u32,
    /// Number in the capture, 0-based.
    pub number: u64,
    /// Byte of the uncompressed capture where the record begins.
    pub offset: u64,
    /// Why the record cannot be used although the file goes on: a reason for the drop counts.
    pub defect: Option<&'static str>,
}

/// What a format's parser found: a record by its place in the window.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Head {
    pub time: Option<Timestamp>,
    pub linktype: u32,
    pub place: usize,
    pub len: usize,
    pub original_len: u32,
    pub offset: u64,
    pub defect: Option<&'static str>,
}

/// Why a parser cannot go on.
#[derive(Debug)]
pub(crate) enum Stop {
    /// The stream ends inside a record that begins at this byte.
    Tail(u64),
    /// The reader failed.
    Read(io::Error),
    /// Garbage at this byte.
    Damaged(u64, String, String),
    /// Something with its final error.
    Final(CaptureError),
}

/// Result of one step of a parser.
pub(crate) type Step<T> = Result<T, Stop>;

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

/// Makes `count` bytes ready that belong to the record at byte `offset`.
#[inline]
pub(crate) fn need<R: Read>(window: &mut Window<R>, count: usize, offset: u64) -> Step<()> {
    if window.require(count)? {
        Ok(())
    } else {
        Err(Stop::Tail(offset))
    }
}

#[derive(Debug)]
enum Parser {
    Pcap(pcap::FileHeader),
    PcapNg(pcapng::Section),
    Done,
}

/// Reads the records of a pcap or pcapng capture; the first bytes decide which.
///
/// Memory stays bounded, no record allocates. [`RecordReader::advance`] steps on,
/// [`RecordReader::record`] looks at the record it stands on.
#[derive(Debug)]
pub struct RecordReader<R> {
    window: Window<R>,
    parser: Parser,
    head: Head,
    time: Timestamp,
    facts: CaptureFacts,
}

impl<R: Read> RecordReader<R> {
    /// Reads the head of the capture.
    ///
    /// # Errors
    /// [`CaptureError::UnknownFormat`], [`CaptureError::Version`] and [`CaptureError::Read`].
    pub fn new(reader: R) -> Result<Self, CaptureError> {
        let mut window = Window::new(reader);
        let parser = recognise(&mut window).map_err(|stop| final_error(stop, 0))?;
        let format = match parser {
            Parser::Pcap(_) => Format::Pcap,
            _ => Format::PcapNg,
        };
        let facts = CaptureFacts {
            format: Some(format),
            bytes: window.offset(),
            ..CaptureFacts::default()
        };
        Ok(Self {
            window,
            parser,
            head: Head::default(),
            time: Timestamp::default(),
            facts,
        })
    }

    /// Steps to the next record. `false`: the capture is at its end, or a failure was told before.
    ///
    /// # Errors
    /// [`CaptureError::Damaged`] where garbage stands in place of a record and [`CaptureError::Read`]
    /// where the reader fails; nothing can be read after either. A last record that is incomplete is
    /// no error: it is left out, counted and warned about in the facts.
    pub fn advance(&mut self) -> Result<bool, CaptureError> {
        let step = match &mut self.parser {
            Parser::Pcap(header) => header.next(&mut self.window),
            Parser::PcapNg(section) => section.next(&mut self.window),
            Parser::Done => Ok(None),
        };
        match step {
            Ok(Some(head)) => {
                self.take(head);
                Ok(true)
            }
            Ok(None) => self.close(None).map(|()| false),
            Err(stop) => self.close(Some(stop)).map(|()| false),
        }
    }

    fn take(&mut self, head: Head) {
        self.head = head;
        match head.time {
            Some(time) => {
                self.time = time;
                self.facts.see_time(time);
            }
            None => self.facts.without_time += 1,
        }
        self.facts.records += 1;
        self.facts.bytes = self.window.offset();
        if head.defect.is_none() {
            *self.facts.linktypes.entry(head.linktype).or_default() += 1;
        }
    }

    fn close(&mut self, stop: Option<Stop>) -> Result<(), CaptureError> {
        self.parser = Parser::Done;
        let number = self.facts.records;
        let outcome = match stop {
            None => Ok(()),
            Some(Stop::Tail(offset)) => {
                let found = self.window.offset() - offset + self.window.available() as u64;
                self.facts.see_tail(number, offset, found);
                self.window.consume(self.window.available());
                Ok(())
            }
            Some(Stop::Read(error)) => Err(CaptureError::Read {
                offset: self.window.offset() + self.window.available() as u64,
                reason: error.to_string(),
            }),
            Some(other) => Err(final_error(other, number)),
        };
        self.facts.bytes = self.window.offset();
        self.see_end_of_compression();
        outcome
    }

    fn see_end_of_compression(&mut self) {
        let told = (self.facts.warnings.iter())
            .any(|warning| matches!(warning, CaptureWarning::CompressionCutShort { .. }));
        if let (Some(End::CutShort(reason)), false) = (self.window.end(), told) {
            let warning = CaptureWarning::CompressionCutShort {
                offset: self.window.offset() + self.window.available() as u64,
                reason: reason.clone(),
            };
            self.facts.warnings.push(warning);
        }
    }

    /// The record that the last successful [`RecordReader::advance`] stepped to.
    #[inline]
    pub fn record(&self) -> Record<'_> {
        Record {
            time: self.time,
            linktype: self.head.linktype,
            data: self.window.slice(self.head.place, self.head.len),
            original_len: self.head.original_len,
            number: self.facts.records.saturating_sub(1),
            offset: self.head.offset,
            defect: self.head.defect,
        }
    }

    /// What was seen so far.
    pub fn facts(&self) -> &CaptureFacts {
        &self.facts
    }

    /// The reader that the bytes come from.
    pub fn get_ref(&self) -> &R {
        self.window.get_ref()
    }
}

fn recognise<R: Read>(window: &mut Window<R>) -> Step<Parser> {
    window.require(4)?;
    if let Some(header) = pcap::FileHeader::read(window)? {
        return Ok(Parser::Pcap(header));
    }
    if window.bytes().starts_with(&pcapng::SECTION_HEADER) {
        return Ok(Parser::PcapNg(pcapng::Section::default()));
    }
    Err(Stop::Final(CaptureError::UnknownFormat {
        found: describe(window.bytes()),
    }))
}

fn describe(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "nothing".into();
    }
    let hex: Vec<String> = bytes.iter().take(4).map(|b| format!("{b:02X}")).collect();
    hex.join(" ")
}

fn final_error(stop: Stop, record: u64) -> CaptureError {
    match stop {
        Stop::Final(error) => error,
        Stop::Damaged(offset, expected, found) => CaptureError::Damaged {
            record,
            offset,
            expected,
            found,
        },
        Stop::Read(error) => CaptureError::Read {
            offset: 0,
            reason: error.to_string(),
        },
        Stop::Tail(_) => CaptureError::UnknownFormat {
            found: "the beginning of a header, then the end".into(),
        },
    }
}
