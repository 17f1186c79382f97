//! Datagrams put aside, so that several threads can look at them.

use std::net::SocketAddr;
use std::ops::Range;

use super::Datagram;
use crate::time::Timestamp;

/// Owned datagrams in the order of their arrival; the memory is kept from batch to batch.
#[derive(Debug, Default)]
pub struct DatagramBatch {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    time: Timestamp,
    source: SocketAddr,
    destination: SocketAddr,
    payload: Range<usize>,
    record: u64,
    offset: u64,
}

impl DatagramBatch {
    /// Puts a datagram aside.
    pub fn push(&mut self, datagram: &Datagram<'_>) {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(datagram.payload);
        self.entries.push(Entry {
            time: datagram.time,
            source: datagram.source,
            destination: datagram.destination,
            payload: start..self.bytes.len(),
            record: datagram.record,
            offset: datagram.offset,
        });
    }

    /// Bytes of all payloads.
    pub fn bytes(&self) -> usize {
        self.bytes.len()
    }

    /// Whether there is no datagram in it.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Empties the batch and keeps its memory.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.entries.clear();
    }

    /// The datagrams in the order of their arrival.
    pub fn iter(&self) -> impl Iterator<Item = Datagram<'_>> {
        self.entries.iter().map(|entry| Datagram {
            time: entry.time,
            source: entry.source,
            destination: entry.destination,
            payload: &self.bytes[entry.payload.clone()],
            record: entry.record,
            offset: entry.offset,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagrams_come_back_as_they_were_and_a_cleared_batch_is_empty() {
        let address: SocketAddr = "192.168.1.201:2368".parse().unwrap();
        let datagram = |payload, record| Datagram {
            time: Timestamp(7 + record as i64),
            source: address,
            destination: address,
            payload,
            record,
            offset: 10 * record,
        };
        let mut batch = DatagramBatch::default();
        for _ in 0..2 {
            let given = [
                datagram(b"abc".as_slice(), 1),
                datagram(b"", 2),
                datagram(b"de", 3),
            ];
            given.iter().for_each(|d| batch.push(d));
            assert_eq!(batch.bytes(), 5);
            assert_eq!(batch.iter().collect::<Vec<_>>(), given);
            batch.clear();
            assert_eq!(batch.iter().count(), 0);
        }
    }
}
