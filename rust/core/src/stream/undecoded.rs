//! The packets of one turn, put aside to be decoded later.

use std::ops::Range;

use super::intake::Ready;
use crate::cloud::PointCloud;
use crate::frame::Sensor;
use crate::packet::part::Part;
use crate::packet::split::Following;
use crate::packet::{Decoded, Decoder, Head, Place};
use crate::sweep::{Gathered, Kept};

/// Packets with their places, in order.
#[derive(Debug, Default)]
pub struct Undecoded {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    payload: Range<usize>,
    /// Bytes and number of the packet in which the last firing goes on.
    following: Option<(Range<usize>, u32)>,
    place: Place,
    head: Head,
    part: Part,
    is_counted: bool,
}

impl Undecoded {
    /// Adds a part of a packet; what of the packet is counted, is counted with one of its parts.
    pub fn push(&mut self, packet: &Ready<'_>, part: Part, is_counted: bool) {
        let entry = Entry {
            payload: self.add(packet.payload),
            following: packet
                .following
                .map(|next| (self.add(next.payload), next.packet)),
            place: packet.place,
            head: packet.placed.head,
            part,
            is_counted,
        };
        self.entries.push(entry);
    }

    fn add(&mut self, payload: &[u8]) -> Range<usize> {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(payload);
        start..self.bytes.len()
    }

    /// Takes the returns of all packets; `decoded` is the room for those of one.
    pub fn decode<K: Kept>(&self, decoder: &mut dyn Decoder, decoded: &mut Decoded, kept: &mut K) {
        for entry in &self.entries {
            let merged = decoded.merged;
            match kept.cloud().filter(|_| entry.part.is_whole()) {
                Some(cloud) => self.decode_into(cloud, entry, decoder, decoded),
                None => {
                    decoded.clear();
                    self.decode_one(entry, decoder, decoded);
                    kept.take(&decoded.cloud, decoded.places(&entry.head, entry.part));
                }
            }
            if !entry.is_counted {
                decoded.merged = merged;
            }
        }
    }

    /// Appends the returns of a packet where they stay, without a move of all columns.
    fn decode_into(
        &self,
        cloud: &mut PointCloud<Sensor>,
        entry: &Entry,
        decoder: &mut dyn Decoder,
        decoded: &mut Decoded,
    ) {
        decoded.encoder_rad.clear();
        std::mem::swap(cloud, &mut decoded.cloud);
        self.decode_one(entry, decoder, decoded);
        std::mem::swap(cloud, &mut decoded.cloud);
    }

    fn decode_one(&self, entry: &Entry, decoder: &mut dyn Decoder, decoded: &mut Decoded) {
        let bytes = |place: &Range<usize>| &self.bytes[place.clone()];
        let following = entry.following.as_ref().map(|(place, packet)| Following {
            payload: bytes(place),
            packet: *packet,
        });
        decoder.decode_before(bytes(&entry.payload), following, entry.place, decoded);
    }
}

impl Gathered for Undecoded {
    fn count(&self) -> usize {
        self.entries.len()
    }

    fn make_room(&mut self, additional: usize) {
        self.entries.reserve(additional);
    }

    fn empty(&mut self) {
        self.bytes.clear();
        self.entries.clear();
    }
}
