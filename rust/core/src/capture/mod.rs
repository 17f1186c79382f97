//! From the bytes of a capture to UDP datagrams.

use std::net::SocketAddr;

use crate::time::Timestamp;

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
