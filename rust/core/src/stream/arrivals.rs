//! The data packets of one lidar as they arrive: unrolled in time, put in order, gaps measured.

use super::report::Pause;
use crate::angle::{Arc, wrap_half_turn};
use crate::clock::Unroller;
use crate::loss::cycle::{Cycle, Restarts};
use crate::loss::order::{Order, Passed, Stamp, Strays, Verdict};
use crate::loss::view::FieldOfView;
use crate::packet::{Head, ModelRef};
use crate::time::Timestamp;

/// Weight of the newest packet in the mean rotation rate.
const RATE_WEIGHT: f64 = 1.0 / 64.0;

/// What is kept of a packet beside its payload.
#[derive(Debug, Clone, Copy)]
pub struct Ticket {
    pub arrival: Timestamp,
    /// Device time without roll-over.
    pub device: Timestamp,
    pub head: Head,
    /// Number among the stream's data packets in the order of arrival.
    pub packet: u32,
    pub mean_rate_rad_per_ns: f64,
}

/// A packet in its place.
#[derive(Debug, Clone, Copy)]
pub struct Ordered {
    pub ticket: Ticket,
    pub gap: Option<Gap>,
    pub is_late: bool,
    pub is_jump: bool,
    /// Jumps of the clock before it.
    pub segment: usize,
}

impl Ordered {
    /// Whether nothing is missing before it.
    pub fn follows(&self) -> bool {
        self.gap.is_none() && !self.is_jump
    }
}

/// Packets missing before one.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    pub lost: u64,
    /// Device time where the first of them began.
    pub from: Timestamp,
    /// Time of one packet.
    pub period_ns: i64,
    /// What they would have seen.
    pub arc: Arc,
    /// Sequence numbers tell that they were sent.
    pub is_numbered: bool,
    /// Host time around them.
    pub arrivals: (Timestamp, Timestamp),
}

impl Gap {
    /// Packets that were sent and are missing: not those outside of the field of view, and none for
    /// pauses of the recording.
    pub fn lost_in(&self, view: &FieldOfView, pauses: &[Pause]) -> u64 {
        let (before, after) = self.arrivals;
        let is_pause = |pause: &Pause| pause.from >= before && pause.to <= after;
        if pauses.iter().rev().any(is_pause) {
            return 0;
        }
        if self.is_numbered {
            return self.lost;
        }
        (self.lost as f64 * view.visible_share(self.arc)).round() as u64
    }
}

/// What became of a packet on arrival.
#[derive(Debug, Clone, Copy)]
pub enum Arrival {
    Next(Ordered),
    Held,
    Duplicate,
    TooLate { was_lost: bool },
    Clash,
}

/// The state of one lidar's stream; `T` is kept with packets that wait.
#[derive(Debug)]
pub struct Arrivals<T> {
    model: ModelRef,
    clock: Unroller,
    sequence: Option<Unroller>,
    cycle: Option<Cycle>,
    /// Device and host time of the last packet whose number was told.
    numbered: Option<(Timestamp, Timestamp)>,
    order: Option<Order<(Ticket, T)>>,
    period_ns: i64,
    packets: u32,
    segment: usize,
    last: Option<Last>,
    mean_rate_rad_per_ns: f64,
}

/// Where the last passed packet ended.
#[derive(Debug, Clone, Copy)]
struct Last {
    start: Timestamp,
    start_rad: f64,
    end: Timestamp,
    azimuth_rad: f64,
    arrival: Timestamp,
}

/// A packet within so many durations of another tells the rate of the rotor.
const NEIGHBOUR: i64 = 8;
/// Numbered packets whose clock goes off the host's by more than this have had it set; 0.5 s.
const CLOCK_SET_NS: i64 = 500_000_000;

impl<T> Arrivals<T> {
    pub fn new(model: ModelRef) -> Self {
        let counting = model.counting();
        Self {
            model,
            clock: Unroller::new(counting.clock_wrap_ns),
            sequence: model.sequence_wrap().map(|wrap| Unroller::new(Some(wrap))),
            cycle: None,
            numbered: None,
            order: None,
            period_ns: 1,
            packets: 0,
            segment: 0,
            last: None,
            mean_rate_rad_per_ns: 0.0,
        }
    }

    /// Takes a data packet; `mark` stands for its content.
    pub fn offer(
        &mut self,
        arrival: Timestamp,
        head: &Head,
        mark: u64,
        keep: impl FnOnce() -> T,
    ) -> (Ticket, Arrival) {
        let ticket = Ticket {
            arrival,
            device: self.clock.unroll(arrival, head.device_ns),
            head: head.paced(self.follow_rate(head)),
            packet: self.packets,
            mean_rate_rad_per_ns: self.mean_rate_rad_per_ns,
        };
        let ticket = self.complete(ticket);
        self.packets = self.packets.wrapping_add(1);
        let stamp = self.stamp(&ticket, mark);
        let ticket = self.framed(ticket);
        let period_ns = self.model.period_ns(head.return_mode).max(1);
        let is_numbered = self.sequence.is_some() || self.model.restarts().is_some();
        let step = if is_numbered && head.sequence.is_some() {
            1
        } else {
            period_ns
        };
        self.period_ns = period_ns;
        let order = self
            .order
            .get_or_insert_with(|| Order::new(step, period_ns));
        order.set_step(step, period_ns);
        let verdict = order.offer(arrival, stamp, || (ticket, keep()));
        let arrival = match verdict {
            Verdict::Next { is_late } => Arrival::Next(self.pass(ticket, 0, is_late, false)),
            Verdict::Held => Arrival::Held,
            Verdict::Duplicate => Arrival::Duplicate,
            Verdict::TooLate { was_lost } => Arrival::TooLate { was_lost },
            Verdict::Clash => Arrival::Clash,
        };
        (ticket, arrival)
    }

    /// The next packet that has waited and whose turn has come.
    pub fn pop(&mut self) -> Option<(Ordered, T)> {
        let Passed {
            item: (ticket, item),
            lost,
            is_late,
            is_jump,
        } = self.order.as_mut()?.pop()?;
        Some((self.pass(ticket, lost, is_late, is_jump), item))
    }

    /// Jumps of the clock so far.
    pub fn segment(&self) -> usize {
        self.segment
    }

    /// The stream has ended.
    pub fn flush(&mut self) {
        if let Some(order) = &mut self.order {
            order.flush();
        }
    }

    /// What was given up since the last call.
    pub fn take_strays(&mut self) -> Strays {
        self.order
            .as_mut()
            .map_or_else(Strays::default, Order::take_strays)
    }

    /// Whether the device clock was set while the sequence number went on.
    fn is_clock_set(&self, ticket: &Ticket) -> bool {
        self.last
            .filter(|_| ticket.head.sequence.is_some())
            .is_some_and(|last| {
                let device_ns = ticket.device - last.start;
                let host_ns = ticket.arrival - last.arrival;
                device_ns.saturating_sub(host_ns).saturating_abs() > CLOCK_SET_NS
            })
    }

    /// Tells how fast the rotor turns from the packet before, where one packet alone cannot.
    fn complete(&self, mut ticket: Ticket) -> Ticket {
        let head = &mut ticket.head;
        let Some(last) = self.last.filter(|_| head.rate_rad_per_ns == 0.0) else {
            return ticket;
        };
        let elapsed_ns = ticket.device - last.start;
        let turned_rad = wrap_half_turn(head.azimuth_rad - last.start_rad);
        if turned_rad > 0.0 && (1..NEIGHBOUR * head.duration_ns.max(1)).contains(&elapsed_ns) {
            head.rate_rad_per_ns = turned_rad / elapsed_ns as f64;
            head.turned_rad = head.rate_rad_per_ns * head.duration_ns as f64;
        }
        ticket
    }

    /// Mean rotation rate over the last hundred packets or so.
    fn follow_rate(&mut self, head: &Head) -> f64 {
        if head.left_out.is_none() && head.rate_rad_per_ns > 0.0 {
            let change = head.rate_rad_per_ns - self.mean_rate_rad_per_ns;
            let weight = if self.mean_rate_rad_per_ns > 0.0 {
                RATE_WEIGHT
            } else {
                1.0
            };
            self.mean_rate_rad_per_ns += weight * change;
        }
        self.mean_rate_rad_per_ns
    }

    /// Tells the place of a packet in its frame, where frames have another length than the maker states.
    fn framed(&self, mut ticket: Ticket) -> Ticket {
        let number = ticket.head.sequence;
        let place = self.cycle.as_ref().zip(number);
        if let Some((place, len)) = place.and_then(|(cycle, number)| cycle.place(number)) {
            ticket.head = ticket.head.in_frame(place, len);
        }
        ticket
    }

    /// Number of a packet whose numbers start again with every frame.
    fn cycle_key(&mut self, ticket: &Ticket, restarts: Restarts, number: u32) -> i64 {
        let (head, now) = (&ticket.head, (ticket.device, ticket.arrival));
        let (device, arrival) = self.numbered.replace(now).unwrap_or(now);
        let (device_ns, host_ns) = (now.0 - device, now.1 - arrival);
        // The device clock is the better one unless it was set.
        let is_set = device_ns.saturating_sub(host_ns).saturating_abs() > CLOCK_SET_NS;
        let elapsed_ns = if is_set { host_ns } else { device_ns };
        let period_ns = head.duration_ns.max(1);
        let cycle = self.cycle.get_or_insert_with(|| match restarts {
            Restarts::EveryFrame => {
                Cycle::new(restarts, head.first_number(number), head.frame_len())
            }
            Restarts::Perhaps => Cycle::new(restarts, 0, 1 << 16),
        });
        cycle.key(number, elapsed_ns as f64 / period_ns as f64)
    }

    fn stamp(&mut self, ticket: &Ticket, mark: u64) -> Stamp {
        if let (Some(restarts), Some(number)) = (self.model.restarts(), ticket.head.sequence) {
            let key = self.cycle_key(ticket, restarts, number);
            return Stamp { key, span: 1, mark };
        }
        let sequence = self.sequence.as_mut().zip(ticket.head.sequence);
        match sequence {
            Some((unroller, number)) => {
                let key = unroller.unroll(Timestamp(0), i64::from(number));
                unroller.follow(Timestamp(0), key);
                Stamp {
                    key: key.0,
                    span: 1,
                    mark,
                }
            }
            None => Stamp {
                key: ticket.device.0,
                span: ticket.head.duration_ns,
                mark,
            },
        }
    }

    fn pass(&mut self, ticket: Ticket, lost: u64, is_late: bool, is_jump: bool) -> Ordered {
        let is_jump = is_jump || self.is_clock_set(&ticket);
        self.segment += usize::from(is_jump);
        self.clock.follow(ticket.arrival, ticket.device);
        let gap = self.last.filter(|_| lost > 0).map(|last| {
            let missing_ns = (ticket.device - last.end).max(0);
            Gap {
                lost,
                from: if is_jump { ticket.device } else { last.end },
                period_ns: self.period_ns,
                arc: Arc {
                    from_rad: last.azimuth_rad,
                    width_rad: missing_ns as f64 * ticket.head.rate_rad_per_ns.max(0.0),
                },
                is_numbered: ticket.head.sequence.is_some(),
                arrivals: (last.arrival, ticket.arrival),
            }
        });
        self.last = Some(Last {
            start: ticket.device,
            start_rad: ticket.head.azimuth_rad,
            end: ticket.device + ticket.head.duration_ns,
            azimuth_rad: ticket.head.next_azimuth_rad(),
            arrival: ticket.arrival,
        });
        Ordered {
            ticket,
            gap,
            is_late,
            is_jump,
            segment: self.segment,
        }
    }
}

/// A short digest of a payload, to tell a repeated packet from another one of the same time.
pub fn mark(payload: &[u8]) -> u64 {
    // The first bytes and every 64th, eight to a word: one multiplication after the other is what takes time.
    let count = payload.len().min(16);
    let mut first = [0; 16];
    first[..count].copy_from_slice(&payload[..count]);
    let (wholes, rest) = payload.as_chunks::<512>();
    let spread = |whole: &[u8; 512]| u64::from_le_bytes(std::array::from_fn(|k| whole[64 * k]));
    let last = rest.chunks(64);
    let last = last.fold(0, |word, chunk| word << 8 | u64::from(chunk[0]));
    let sizes = (payload.len().div_ceil(64) << 8 | count) as u64;
    let mark = wholes.iter().map(spread).fold(mix(sizes, last), mix);
    let (words, _) = first.as_chunks::<8>();
    words
        .iter()
        .copied()
        .map(u64::from_le_bytes)
        .fold(mark, mix)
}

fn mix(mark: u64, word: u64) -> u64 {
    let mixed = (mark.rotate_left(26) ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed ^ mixed >> 32
}
