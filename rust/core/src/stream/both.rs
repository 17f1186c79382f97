//! Two kinds of sweeps of the same packets: cut elsewhere, of other turns and bearings, decoded once.

use rayon::prelude::*;

use super::beside::{Reading, Taker};
use super::reader::{Reader, Sink, SweepOptions};
use super::report::ScanReport;
use crate::angle::Arc;
use crate::capture::DatagramBatch;
use crate::error::ReadError;
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

type BothCutters<A, B> = Both<SweepCutter<<A as Taker>::Kept>, SweepCutter<<B as Taker>::Kept>>;

/// Lidars side by side as in [`super::Beside`], each with two takers of its sweeps.
pub struct BothBeside<A: Taker, B: Taker> {
    lanes: Vec<Lane<A, B>>,
}

struct Lane<A: Taker, B: Taker> {
    lidar: usize,
    reader: Reader<BothCutters<A, B>>,
    takers: (A, B),
}

impl<A: Taker, B: Taker> BothBeside<A, B> {
    /// Prepares for the capture that `report` was made of: number, options and takers of each lidar.
    /// The first options say from when to when packets are read.
    ///
    /// # Errors
    /// [`ReadError`] where a lidar cannot be decoded.
    pub fn new(
        report: &ScanReport,
        lidars: impl IntoIterator<Item = (usize, (SweepOptions, A), (SweepOptions, B))>,
    ) -> Result<Self, ReadError> {
        let lane = |(lidar, (options, first), (beside, second))| {
            let options: SweepOptions = options;
            let reader = Reader::new(report, &options.beside(beside))?;
            Ok(Lane {
                lidar,
                reader,
                takers: (first, second),
            })
        };
        let lanes = lidars.into_iter().map(lane);
        Ok(Self {
            lanes: lanes.collect::<Result<_, ReadError>>()?,
        })
    }

    /// The takers of each lidar, in the order in which they were given.
    pub fn takers(&mut self) -> impl Iterator<Item = &mut (A, B)> {
        self.lanes.iter_mut().map(|lane| &mut lane.takers)
    }
}

impl<A: Taker, B: Taker> Reading for BothBeside<A, B> {
    fn push(&mut self, batch: &DatagramBatch) {
        self.lanes.par_iter_mut().for_each(|lane| {
            for datagram in batch.iter() {
                lane.reader.push(&datagram);
                lane.take();
            }
        });
    }

    fn is_done(&self) -> bool {
        self.lanes.iter().all(|lane| lane.reader.is_done())
    }

    fn finish(&mut self) {
        self.lanes.par_iter_mut().for_each(|lane| {
            lane.reader.finish();
            lane.take();
        });
    }
}

impl<A: Taker, B: Taker> Lane<A, B> {
    fn take(&mut self) {
        while let Some(sweep) = self.reader.out.0.pop_front() {
            self.takers.0.take(&sweep);
            if let Some(sink) = self.reader.sink_of(self.lidar) {
                sink.first.sink.recycle(sweep.cloud);
            }
        }
        while let Some(sweep) = self.reader.out.1.pop_front() {
            self.takers.1.take(&sweep);
            if let Some(sink) = self.reader.sink_of(self.lidar) {
                sink.second.sink.recycle(sweep.cloud);
            }
        }
    }
}
