//! One capture as a stream of UDP datagrams.

use std::io::Read;

use super::facts::{CaptureFacts, FragmentFacts};
use super::{Assembler, Datagram, RecordReader};
use crate::drops::Drops;
use crate::error::CaptureError;

/// Reads the UDP datagrams of one pcap or pcapng capture, in the order of their records.
///
/// Memory is constant in the size of the capture; a record allocates nothing.
///
/// ```
/// use lidar_deflect_core::capture::{DatagramReader, PcapWriter};
/// use lidar_deflect_core::time::Timestamp;
///
/// let (lidar, host) = ("192.168.1.201:2368".parse()?, "192.168.1.100:2368".parse()?);
/// let mut writer = PcapWriter::new(Vec::new())?;
/// writer.write_udp(Timestamp(1_700_000_000_123_456_789), lidar, host, &[0xFF, 0xEE])?;
/// let capture = writer.into_inner();
///
/// let mut reader = DatagramReader::new(&capture[..])?;
/// while let Some(datagram) = reader.next()? {
///     assert_eq!((datagram.source, datagram.payload), (lidar, &[0xFF, 0xEE][..]));
/// }
/// assert_eq!(reader.facts().records, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct DatagramReader<R> {
    records: RecordReader<R>,
    assembler: Assembler,
}

impl<R: Read> DatagramReader<R> {
    /// Reads the head of the capture; its first bytes decide the format.
    ///
    /// # Errors
    /// As [`RecordReader::new`].
    pub fn new(reader: R) -> Result<Self, CaptureError> {
        Ok(Self {
            records: RecordReader::new(reader)?,
            assembler: Assembler::default(),
        })
    }

    /// The next datagram, valid until the next call; `None` at the end of the capture.
    ///
    /// # Errors
    /// As [`RecordReader::advance`]: garbage or a failing reader, told once; then `None`.
    // Not an Iterator: the datagram borrows from the reader.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Result<Option<Datagram<'_>>, CaptureError> {
        let found = loop {
            if !self.advance()? {
                return Ok(None);
            }
            if let Some(found) = self.assembler.push(&self.records.record()) {
                break found;
            }
        };
        Ok(Some(
            self.assembler.datagram(&found, &self.records.record()),
        ))
    }

    fn advance(&mut self) -> Result<bool, CaptureError> {
        let step = self.records.advance();
        if !matches!(step, Ok(true)) {
            self.assembler.finish();
        }
        step
    }

    /// What was left out so far, by reason; see [`Assembler`].
    pub fn drops(&self) -> &Drops {
        self.assembler.drops()
    }

    /// Records, bytes, times, link types and warnings so far.
    pub fn facts(&self) -> &CaptureFacts {
        self.records.facts()
    }

    /// What became of IP fragments so far.
    pub fn fragments(&self) -> FragmentFacts {
        self.assembler.fragments()
    }

    /// The reader that the bytes come from.
    pub fn get_ref(&self) -> &R {
        self.records.get_ref()
    }
}
