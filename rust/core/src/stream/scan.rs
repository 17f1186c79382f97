//! The first pass over a capture: finds lidars, counts packets, judges clocks. Decodes no points.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::keys::KeyHasher;
use super::lidar::{Lidar, Shared};
use super::probe::Probe;
use super::report::{OtherStream, Pause, PositionFacts, ScanReport, StreamInfo};
use super::{ScanOptions, StreamKey, packets};
use crate::capture::Datagram;
use crate::drops::Drops;
use crate::packet::unit::UnitFile;
use crate::packet::velodyne::position::{Position, Pps};
use crate::packet::{Misfit, ModelRef, PacketKind, closest, companion};
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Silence of the whole capture for longer than this is a pause of the recording, not loss.
const PAUSE_NS: i64 = 10 * NANOS_PER_SECOND;
/// Streams beyond so many are counted, not followed.
const MAX_STREAMS: usize = 4096;
/// Foreign datagrams before a stream is decided whose second is remembered.
const MAX_EARLY: usize = 1024;

/// Sums over the streams of a capture.
#[derive(Debug)]
pub struct Scan {
    options: ScanOptions,
    streams: HashMap<StreamKey, Stream, BuildHasherDefault<KeyHasher>>,
    shared: Shared,
    datagrams: u64,
    unfollowed: u64,
    last_arrival: Option<Timestamp>,
}

#[derive(Debug)]
struct Stream {
    state: State,
    packets: u64,
    foreign: u64,
    /// When foreign datagrams came before the stream was decided, the first few.
    early_foreign: Vec<Timestamp>,
    first: Timestamp,
    last: Timestamp,
    payload_len: usize,
    closest: Option<Misfit>,
    position: Option<PositionFacts>,
    /// The last packet that describes a unit.
    metadata: Option<UnitFile>,
    /// Packets that describe a unit, its motion or its state.
    companions: u64,
    /// What of a lidar the last packet beside data was.
    companion: Option<(ModelRef, PacketKind)>,
}

#[derive(Debug)]
enum State {
    Probing(Probe),
    Lidar(Box<Lidar>),
}

impl Scan {
    /// An empty scan.
    pub fn new(options: ScanOptions) -> Self {
        Self {
            options,
            streams: HashMap::default(),
            shared: Shared::default(),
            datagrams: 0,
            unfollowed: 0,
            last_arrival: None,
        }
    }

    /// Takes the next datagram; one that joins packets counts as many.
    pub fn push(&mut self, datagram: &Datagram<'_>) {
        for packet in packets(datagram) {
            self.take_packet(&packet);
        }
    }

    fn take_packet(&mut self, datagram: &Datagram<'_>) {
        self.datagrams += 1;
        self.note_pause(datagram.time);
        let key = self.options.key(datagram);
        if self.streams.len() >= MAX_STREAMS && !self.streams.contains_key(&key) {
            self.unfollowed += 1;
            return;
        }
        let options = &self.options;
        let stream = self.streams.entry(key);
        let stream = stream.or_insert_with(|| Stream::new(options.probe(&key), datagram));
        stream.push(datagram, &mut self.shared);
    }

    fn note_pause(&mut self, arrival: Timestamp) {
        if let Some(last) = self.last_arrival
            && arrival - last > PAUSE_NS
        {
            self.shared.pauses.push(Pause {
                from: last,
                to: arrival,
            });
        }
        self.last_arrival = self.last_arrival.max(Some(arrival));
    }

    /// Judges the whole capture.
    pub fn finish(mut self) -> ScanReport {
        for stream in self.streams.values_mut() {
            stream.finish(&mut self.shared);
        }
        let mut keys: Vec<StreamKey> = self.streams.keys().copied().collect();
        keys.sort_unstable();
        let mut drops = Drops::default();
        drops.add("foreign", self.unfollowed);
        let mut lidars = Vec::new();
        let mut others = Vec::new();
        for key in &keys {
            let stream = &self.streams[key];
            drops.add("companion", stream.companions);
            match &stream.state {
                State::Probing(_) => {
                    let positions = stream.position.as_ref().map_or(0, |facts| facts.packets);
                    drops.add("foreign", stream.packets - positions - stream.companions);
                    drops.add("position", positions);
                    others.push(stream.describe(*key));
                }
                State::Lidar(lidar) => {
                    drops.add("foreign", stream.foreign);
                    lidar.add_drops(&mut drops);
                    let position = self.position_of(key);
                    let info = lidar.describe(*key, stream.foreign, position);
                    lidars.extend(info.map(|info| self.with_unit(info, lidar)));
                }
            }
        }
        others.sort_by_key(|other: &OtherStream| std::cmp::Reverse(other.packets));
        let last = lidars.iter().map(|lidar| lidar.last).max();
        for lidar in &mut lidars {
            lidar.note_silence(last);
        }
        ScanReport {
            first: lidars.iter().map(|lidar| lidar.first).min(),
            last,
            lidars,
            others,
            datagrams: self.datagrams,
            drops,
            pauses: self.shared.pauses,
            options: self.options,
        }
    }

    /// Adds what is known of the unit: the user's files, else what its own packets say.
    fn with_unit(&self, mut info: StreamInfo, lidar: &Lidar) -> StreamInfo {
        let mut files = self.options.unit_files(&info.key);
        let streams = self.streams.iter();
        let same = streams.filter(|(other, _)| other.address == info.key.address);
        files.extend(same.filter_map(|(_, stream)| stream.metadata.clone()));
        files.extend(lidar.gathered());
        files.retain(|file| info.model.takes(file));
        info.calibration = info.model.fit(&files).map(|fitted| fitted.calibration);
        let facts = info.model.describe(&files);
        info.return_mode = facts.return_mode.unwrap_or(info.return_mode);
        info.notes.extend(facts.notes);
        info.unit = files;
        info
    }

    /// Position packets from a lidar's address, to whatever port.
    fn position_of(&self, key: &StreamKey) -> Option<PositionFacts> {
        let same = self
            .streams
            .iter()
            .filter(|(other, _)| other.address == key.address);
        let facts = same.filter_map(|(_, stream)| stream.position.clone());
        facts.max_by_key(|facts| (facts.packets, facts.port))
    }
}

impl Stream {
    fn new(probe: Probe, datagram: &Datagram<'_>) -> Self {
        Self {
            state: State::Probing(probe),
            packets: 0,
            foreign: 0,
            early_foreign: Vec::new(),
            first: datagram.time,
            last: datagram.time,
            payload_len: datagram.payload.len(),
            closest: None,
            position: None,
            metadata: None,
            companions: 0,
            companion: None,
        }
    }

    fn push(&mut self, datagram: &Datagram<'_>, shared: &mut Shared) {
        self.packets += 1;
        self.last = self.last.max(datagram.time);
        let payload = datagram.payload;
        match &mut self.state {
            State::Lidar(lidar) => {
                if lidar.is_data(payload) {
                    lidar.count_port(datagram.source.port());
                    lidar.push(datagram.time, payload, shared);
                } else if !self.take_companion(datagram) {
                    self.foreign += 1;
                    self.note_foreign(datagram.time, shared);
                }
            }
            State::Probing(probe) => {
                if probe.offer(datagram.time, payload) {
                    if probe.is_enough() {
                        self.decide(shared);
                    }
                } else if !self.take_companion(datagram) {
                    self.foreign += 1;
                    if self.early_foreign.len() < MAX_EARLY {
                        self.early_foreign.push(datagram.time);
                    }
                    if self.closest.is_none() {
                        self.closest = closest(payload);
                    }
                }
            }
        }
    }

    /// Takes what is not data and yet of a lidar.
    fn take_companion(&mut self, datagram: &Datagram<'_>) -> bool {
        let found = companion(datagram.payload);
        self.companion = found.or(self.companion);
        let kind = found.map(|(_, kind)| kind);
        let is_counted = !matches!(kind, None | Some(PacketKind::Data | PacketKind::Position));
        self.companions += u64::from(is_counted);
        match kind {
            Some(PacketKind::Position) => self.take_position(datagram),
            Some(PacketKind::Metadata) => {
                let name = format!("packets to port {}", datagram.destination.port());
                self.metadata = Some(UnitFile::new(name, datagram.payload));
                true
            }
            Some(PacketKind::Inertial | PacketKind::Status) => true,
            _ => false,
        }
    }

    fn take_position(&mut self, datagram: &Datagram<'_>) -> bool {
        let Some(position) = Position::new(datagram.payload) else {
            return false;
        };
        let facts = self.position.get_or_insert(PositionFacts {
            packets: 0,
            port: datagram.destination.port(),
            pps: Pps::Absent,
            locked: 0,
            sentence: None,
        });
        facts.packets += 1;
        facts.pps = position.pps();
        facts.locked += u64::from(position.pps() == Pps::Locked && position.has_fix());
        facts.sentence = position.sentence().map(Into::into);
        true
    }

    fn note_foreign(&mut self, arrival: Timestamp, shared: &Shared) {
        if let State::Lidar(lidar) = &mut self.state {
            lidar.second(arrival, shared).foreign += 1;
        }
    }

    /// Turns from probing to following, where a model is found.
    fn decide(&mut self, shared: &mut Shared) {
        let State::Probing(probe) = &mut self.state else {
            return;
        };
        let Some(choice) = probe.decide() else { return };
        let is_named = probe.is_named();
        let probe = std::mem::take(probe);
        let mut lidar = Box::new(Lidar::new(choice, is_named));
        for (arrival, payload) in probe.into_packets() {
            if lidar.is_data(&payload) {
                lidar.push(arrival, &payload, shared);
            } else {
                self.foreign += 1;
            }
        }
        self.state = State::Lidar(lidar);
        for arrival in std::mem::take(&mut self.early_foreign) {
            self.note_foreign(arrival, shared);
        }
    }

    fn finish(&mut self, shared: &mut Shared) {
        self.decide(shared);
        match &mut self.state {
            State::Lidar(lidar) => lidar.finish(shared),
            State::Probing(probe) => {
                if let Some(misfit) = probe.doubt() {
                    self.closest = Some(misfit);
                }
            }
        }
    }

    fn describe(&self, key: StreamKey) -> OtherStream {
        let seconds = self.last.seconds_since(self.first);
        OtherStream {
            key,
            packets: self.packets,
            positions: self.position.as_ref().map_or(0, |facts| facts.packets),
            companions: self.companions,
            payload_len: self.payload_len,
            rate_hz: if seconds > 0.0 {
                (self.packets - 1) as f64 / seconds
            } else {
                0.0
            },
            closest: self.closest.clone().or_else(|| self.beside_data()),
        }
    }

    /// That the stream has something of a lidar, yet no data.
    fn beside_data(&self) -> Option<Misfit> {
        let (model, kind) = self.companion?;
        let vendor = model.title().split(' ').next().unwrap_or_default();
        let why = format!("{} of {vendor}, which carry no points", kind.describe());
        Some(Misfit { why, may_be: None })
    }
}

impl StreamInfo {
    fn note_silence(&mut self, last: Option<Timestamp>) {
        let silent_s = last.map_or(0.0, |last| last.seconds_since(self.last));
        if silent_s > 1.0 {
            self.notes.push(format!(
                "silent for the last {silent_s:.1} s of the capture"
            ));
        }
    }
}
