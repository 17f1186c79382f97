//! From the bytes of a capture to UDP datagrams.
//!
//! Records come out of a file ([`RecordReader`]: pcap or pcapng), datagrams out of records
//! ([`Assembler`]: link layer, IP, fragments, UDP); [`DatagramReader`] joins the two. [`PcapWriter`]
//! goes the other way. Nothing here opens a file, and no input of bytes panics.

use std::net::SocketAddr;

use crate::time::Timestamp;

mod facts;
mod order;
mod window;

mod pcap;
mod pcapng;
mod record;

mod assembly;
mod fragments;
mod ip;
mod link;
mod udp;

mod assembler;
mod batch;
mod reader;

mod frame;
mod writer;

pub use assembler::{Assembler, Found};
pub use batch::DatagramBatch;
pub use facts::{CaptureFacts, CaptureWarning, Format, FragmentFacts};
pub use reader::DatagramReader;
pub use record::{MAX_RECORD_LEN, Record, RecordReader};
pub use writer::PcapWriter;

/// One UDP datagram, put together from its fragments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datagram<'a> {
    /// Arrival at the recording host; for records without a stamp that of the record before.
    pub time: Timestamp,
    /// Sender.
    pub source: SocketAddr,
    /// Receiver; sensors often send to broadcast or multicast addresses.
    pub destination: SocketAddr,
    /// UDP payload.
    pub payload: &'a [u8],
    /// Number of the capture record that completed it, 0-based.
    pub record: u64,
    /// Place of that record in the uncompressed capture, bytes.
    pub offset: u64,
}
