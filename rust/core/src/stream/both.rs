//! Two kinds of sweeps of the same packets: cut elsewhere, of other turns and bearings, decoded once.

use super::beside::{Taker, Taking};
use super::reader::{Reader, Sink, SweepOptions};
use crate::angle::Arc;
use crate::packet::Decoded;
use crate::sweep::{Placed, SweepCutter};

/// Hands packets on to two sinks, each with the returns that it wants.
pub struct Both<A, B> {
    first: Asking<A>,
    second: Asking<B>,
    nothing: Decoded,
}

/// A sink, and whether it wants the returns of the packet that comes next.
struct Asking<S> {
    sink: S,
    wants: bool,
}

impl<S: Sink> Asking<S> {
    fn of(sink: S) -> Self {
        Self { sink, wants: true }
    }

    fn wants(&mut self, packet: &Placed, meets: &dyn Fn(Arc) -> bool) -> bool {
        self.wants = self.sink.wants(packet, meets);
        self.wants
    }
}

impl<A: Sink, B: Sink> Sink for Both<A, B> {
    type Out = (A::Out, B::Out);

    const IS_SLIM: bool = A::IS_SLIM && B::IS_SLIM;

    fn new(lidar: usize, visible_rad: f64, options: &SweepOptions) -> Self {
        let other = options.beside.as_deref().unwrap_or(options);
        Self {
            first: Asking::of(A::new(lidar, visible_rad, options)),
            second: Asking::of(B::new(lidar, visible_rad, other)),
            nothing: Decoded::default(),
        }
    }

    fn wants(&mut self, packet: &Placed, meets: &dyn Fn(Arc) -> bool) -> bool {
        let (first, second) = (
            self.first.wants(packet, meets),
            self.second.wants(packet, meets),
        );
        first || second
    }

    fn skip(&mut self, packet: &Placed) {
        self.first.sink.skip(packet);
        self.second.sink.skip(packet);
    }

    fn push(&mut self, packet: &Placed, decoded: &Decoded, out: &mut Self::Out) {
        let Self {
            first,
            second,
            nothing,
        } = self;
        let given = |wants| if wants { decoded } else { &*nothing };
        first.sink.push(packet, given(first.wants), &mut out.0);
        second.sink.push(packet, given(second.wants), &mut out.1);
    }

    fn finish(&mut self, out: &mut Self::Out) {
        self.first.sink.finish(&mut out.0);
        self.second.sink.finish(&mut out.1);
    }
}

/// Two takers of one lidar, each of sweeps of its own: what [`SweepOptions::beside`] asks for is the second's.
pub struct Pair<A, B> {
    /// Takes the sweeps of the options themselves.
    pub first: A,
    /// Takes those that are wanted beside them.
    pub second: B,
}

impl<A: Taker, B: Taker> Taking for Pair<A, B> {
    type Sink = Both<SweepCutter<A::Kept>, SweepCutter<B::Kept>>;

    fn take_from(&mut self, reader: &mut Reader<Self::Sink>) {
        while let Some(sweep) = reader.out.0.pop_front() {
            self.first.take(&sweep);
            if let Some(both) = reader.sink_of(sweep.lidar) {
                both.first.sink.recycle(sweep.cloud);
            }
        }
        while let Some(sweep) = reader.out.1.pop_front() {
            self.second.take(&sweep);
            if let Some(both) = reader.sink_of(sweep.lidar) {
                both.second.sink.recycle(sweep.cloud);
            }
        }
    }
}
