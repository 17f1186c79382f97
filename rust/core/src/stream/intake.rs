//! The data packets of the lidars of a capture that was scanned, each put in its place and on one clock.

use super::arrivals::{Arrival, Arrivals, Ordered, mark};
use super::reader::SweepOptions;
use super::report::{Pause, ScanReport, StreamInfo};
use super::{ScanOptions, StreamKey, is_data, packets};
use crate::capture::Datagram;
use crate::clock::ClockModel;
use crate::error::InvalidValue;
use crate::loss::view::FieldOfView;
use crate::packet::split::Following;
use crate::packet::{Decoded, Decoder, ModelRef, Place};
use crate::sweep::Placed;
use crate::time::Timestamp;

/// A packet whose turn to be decoded has come.
pub struct Ready<'a> {
    /// Its times and angles, and what is missing before it.
    pub placed: Placed,
    /// What decoding needs of its place.
    pub place: Place,
    pub payload: &'a [u8],
    /// The packet in which its last firing goes on.
    pub following: Option<Following<'a>>,
    /// It was sent before the stretch of time that is wanted.
    pub is_early: bool,
}

impl Ready<'_> {
    /// Appends its returns.
    pub fn decode(&self, decoder: &mut dyn Decoder, out: &mut Decoded) {
        decoder.decode_before(self.payload, self.following, self.place, out);
    }
}

/// The lidars that are wanted.
pub struct Intakes {
    options: ScanOptions,
    intakes: Vec<Intake>, // few: looked through for every datagram
    course: Course,
}

/// What all lidars have in common.
struct Course {
    start: Option<Timestamp>,
    stop: Option<Timestamp>,
    pauses: Vec<Pause>,
}

/// One lidar.
struct Intake {
    key: StreamKey,
    number: usize,
    model: ModelRef,
    is_named: bool,
    arrivals: Arrivals<Vec<u8>>,
    clock: ClockModel,
    view: FieldOfView,
    spare: Vec<Vec<u8>>,
    /// A packet whose last firing may go on in the next one.
    held: Option<(Ordered, Vec<u8>)>,
    is_done: bool,
}

impl Intakes {
    /// Prepares for the capture that `report` was made of.
    ///
    /// # Errors
    /// [`InvalidValue`] for a lidar that the report does not have.
    pub fn new(report: &ScanReport, options: &SweepOptions) -> Result<Self, InvalidValue> {
        let all: Vec<usize> = (0..report.lidars.len()).collect();
        let mut intakes: Vec<Intake> = Vec::new();
        for number in options.lidars.as_ref().unwrap_or(&all) {
            let info = report.lidars.get(*number).ok_or_else(|| InvalidValue {
                name: "lidar",
                expected: format!("a number below {}", report.lidars.len()),
                found: number.to_string(),
            })?;
            if intakes.iter().all(|intake| intake.number != *number) {
                intakes.push(Intake::new(*number, info));
            }
        }
        Ok(Self {
            options: report.options.clone(),
            intakes,
            course: Course {
                start: options.start,
                stop: options.stop,
                pauses: report.pauses.clone(),
            },
        })
    }

    /// Numbers of the lidars in the report, in the order in which they are counted here.
    pub fn numbers(&self) -> impl Iterator<Item = usize> {
        self.intakes.iter().map(|intake| intake.number)
    }

    /// Their places here, in the order of their numbers.
    pub fn places(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.intakes.len()).collect();
        places.sort_by_key(|place| self.intakes[*place].number);
        places
    }

    /// Takes the next datagram; `give` gets place of the lidar and packet for all whose turn has come.
    pub fn push(&mut self, datagram: &Datagram<'_>, mut give: impl FnMut(usize, &Ready<'_>)) {
        let key = self.options.key(datagram);
        let Some(place) = self.intakes.iter().position(|intake| intake.key == key) else {
            return;
        };
        let intake = &mut self.intakes[place];
        for packet in packets(datagram) {
            if !intake.is_done && is_data(intake.model, intake.is_named, packet.payload) {
                intake.push(&packet, &self.course, &mut |ready| give(place, ready));
            }
        }
    }

    /// Whether all lidars have passed the end that was asked for, so that reading on is no use.
    pub fn is_done(&self) -> bool {
        self.intakes.iter().all(|intake| intake.is_done)
    }

    /// The capture has ended: packets of the lidar at `place` that wait come out.
    pub fn finish(&mut self, place: usize, mut give: impl FnMut(&Ready<'_>)) {
        self.intakes[place].finish(&self.course, &mut give);
    }
}

impl Intake {
    fn new(number: usize, info: &StreamInfo) -> Self {
        Self {
            key: info.key,
            number,
            model: info.model,
            is_named: info.is_named,
            arrivals: Arrivals::new(info.model),
            clock: info.clock.clone(),
            view: info.view.clone(),
            spare: Vec::new(),
            held: None,
            is_done: false,
        }
    }

    fn push(
        &mut self,
        datagram: &Datagram<'_>,
        course: &Course,
        give: &mut impl FnMut(&Ready<'_>),
    ) {
        let payload = datagram.payload;
        let Some(head) = self.model.head(payload) else {
            return;
        };
        let spare = &mut self.spare;
        let keep = || copied(spare, payload);
        let (_, what) = self
            .arrivals
            .offer(datagram.time, &head, mark(payload), keep);
        if let Arrival::Next(ordered) = what {
            self.take(&ordered, payload, course, give);
        }
        self.drain(course, give);
    }

    fn drain(&mut self, course: &Course, give: &mut impl FnMut(&Ready<'_>)) {
        while let Some((ordered, payload)) = self.arrivals.pop() {
            self.take(&ordered, &payload, course, give);
            self.spare.push(payload);
        }
    }

    fn take(
        &mut self,
        ordered: &Ordered,
        payload: &[u8],
        course: &Course,
        give: &mut impl FnMut(&Ready<'_>),
    ) {
        if !self.model.is_splitting() {
            return self.place(ordered, payload, None, course, give);
        }
        let copy = copied(&mut self.spare, payload);
        if let Some((before, earlier)) = self.held.replace((*ordered, copy)) {
            let packet = ordered.ticket.packet;
            let following = ordered.follows().then_some(Following { payload, packet });
            self.place(&before, &earlier, following, course, give);
            self.spare.push(earlier);
        }
    }

    fn place(
        &mut self,
        ordered: &Ordered,
        payload: &[u8],
        following: Option<Following<'_>>,
        course: &Course,
        give: &mut impl FnMut(&Ready<'_>),
    ) {
        let ticket = &ordered.ticket;
        let time = self.clock.utc(ordered.segment, ticket.device);
        if self.is_done || course.stop.is_some_and(|stop| time >= stop) {
            // The clock only goes back at a jump; a packet behind it would be of another time.
            self.is_done = true;
            return;
        }
        let gap = ordered.gap.as_ref();
        give(&Ready {
            placed: Placed {
                time,
                head: ticket.head,
                frame_id: self.model.frame_id(payload),
                lost: gap.map_or(0, |gap| gap.lost_in(&self.view, &course.pauses)),
                is_jump: ordered.is_jump,
            },
            place: Place {
                time,
                packet: ticket.packet,
                mean_rate_rad_per_ns: ticket.mean_rate_rad_per_ns,
            },
            payload,
            following,
            is_early: course.start.is_some_and(|start| time < start),
        });
    }

    fn finish(&mut self, course: &Course, give: &mut impl FnMut(&Ready<'_>)) {
        self.arrivals.flush();
        self.drain(course, give);
        if let Some((last, payload)) = self.held.take() {
            self.place(&last, &payload, None, course, give);
        }
    }
}

/// A copy of a payload in memory that was used before.
fn copied(spare: &mut Vec<Vec<u8>>, payload: &[u8]) -> Vec<u8> {
    let mut copy = spare.pop().unwrap_or_default();
    copy.clear();
    copy.extend_from_slice(payload);
    copy
}
