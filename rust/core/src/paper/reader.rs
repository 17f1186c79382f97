//! Frames out of datagrams: every lidar's packets, sweeps and shares on a thread of their own.

use super::frames::{Frame, FrameAssembler, Share, ShareEchoes, share_of};
use super::passthrough::PassThrough;
use crate::capture::DatagramBatch;
use crate::error::{InvalidValue, ReadError};
use crate::frame::WorldFromSensor;
use crate::stand::{Move, Stands};
use crate::stream::{Beside, Pair, Reading, ScanReport, SweepOptions, Taker};
use crate::sweep::Sweep;
use crate::time::Timestamp;
use crate::watch::WindowTaker;

/// Sweeps before a frame that its shares may need, and the decoder to have got going.
const RUN_UP_NS: i64 = 2_000_000_000;

/// Which frames to make.
#[derive(Debug, Clone)]
pub struct FramePlan {
    /// Numbers of the lidars within the scan, in the order of the shares.
    pub lidars: Vec<usize>,
    /// Pose of each.
    pub poses: Vec<WorldFromSensor>,
    /// Tripods that were moved, in order of time.
    pub moves: Vec<Move>,
    /// Azimuth at which the sweeps of each are cut.
    pub cut_azimuth_rad: Vec<f64>,
    /// What belongs to the blade's surroundings.
    pub pass: PassThrough,
    /// Middle of the first frame.
    pub first: Timestamp,
    /// From frame to frame, nanoseconds.
    pub period_ns: i64,
    /// Packets before this are left out.
    pub start: Timestamp,
    /// Packets from this on are left out.
    pub stop: Timestamp,
}

impl FramePlan {
    /// The same frames from `first` on, without decoding what stands long before it.
    pub fn from(&self, first: Timestamp) -> Self {
        Self {
            first,
            start: self.start.max(first + -RUN_UP_NS),
            ..self.clone()
        }
    }

    fn options(&self, place: usize, stands: &Stands) -> SweepOptions {
        let lidars = &self.lidars[place..=place];
        let bearings = std::iter::once(self.pass.bearings(stands));
        SweepOptions {
            start: Some(self.start),
            stop: Some(self.stop),
            ..SweepOptions::of(lidars, &self.cut_azimuth_rad[place..=place])
                .towards(lidars, bearings)
        }
    }
}

/// Turns batches of datagrams into frames; the frames do not depend on the number of threads.
pub struct FrameReader<L = Beside<ShareTaker>> {
    lidars: L,
    assembler: FrameAssembler,
}

/// Frames, and beside them windows of the same packets in which tripods are watched.
pub type WatchedReader = FrameReader<Beside<Pair<ShareTaker, WindowTaker>>>;

/// Makes shares of one lidar's sweeps.
pub struct ShareTaker {
    stands: Stands,
    pass: PassThrough,
    shares: Vec<(Timestamp, Share)>,
}

/// Lidars whose sweeps become shares.
pub trait Shares: Reading {
    /// The takers, in the order of the frames' lidars.
    fn shares(&mut self) -> impl Iterator<Item = &mut ShareTaker>;
}

impl Shares for Beside<ShareTaker> {
    fn shares(&mut self) -> impl Iterator<Item = &mut ShareTaker> {
        self.takers()
    }
}

impl<B: Taker> Shares for Beside<Pair<ShareTaker, B>> {
    fn shares(&mut self) -> impl Iterator<Item = &mut ShareTaker> {
        self.takers().map(|pair| &mut pair.first)
    }
}

impl FrameReader {
    /// Prepares for the capture that `report` was made of.
    ///
    /// # Errors
    /// [`ReadError`] where a lidar cannot be decoded or the plan makes no sense.
    pub fn new(report: &ScanReport, plan: &FramePlan) -> Result<Self, ReadError> {
        let takers = takers_of(plan)?;
        Self::of(plan, Beside::new(report, takers)?)
    }
}

impl WatchedReader {
    /// The same beside windows: of every lidar of the plan which turns are watched, and what takes them.
    ///
    /// # Errors
    /// [`ReadError`] where a lidar cannot be decoded or the plan makes no sense.
    pub fn watched(
        report: &ScanReport,
        plan: &FramePlan,
        windows: Vec<(SweepOptions, WindowTaker)>,
    ) -> Result<Self, ReadError> {
        check_length("windows", windows.len(), plan.lidars.len())?;
        let takers = takers_of(plan)?.into_iter().zip(windows);
        let lidars = takers.map(|((options, first), (beside, second))| {
            (options.beside(beside), Pair { first, second })
        });
        Self::of(plan, Beside::new(report, lidars)?)
    }

    /// What takes the windows of each lidar.
    pub fn windows(&mut self) -> impl Iterator<Item = &mut WindowTaker> {
        self.lidars.takers().map(|pair| &mut pair.second)
    }
}

fn takers_of(plan: &FramePlan) -> Result<Vec<(SweepOptions, ShareTaker)>, ReadError> {
    let count = plan.lidars.len();
    check_length("poses", plan.poses.len(), count)?;
    check_length("cut_azimuth_rad", plan.cut_azimuth_rad.len(), count)?;
    let taker = |(place, stands): (usize, Stands)| {
        let options = plan.options(place, &stands);
        let (pass, shares) = (plan.pass, Vec::new());
        (
            options,
            ShareTaker {
                stands,
                pass,
                shares,
            },
        )
    };
    let stands = Stands::of(&plan.poses, &plan.moves)?.into_iter();
    Ok(stands.enumerate().map(taker).collect())
}

impl<L: Shares> FrameReader<L> {
    fn of(plan: &FramePlan, lidars: L) -> Result<Self, ReadError> {
        Ok(Self {
            lidars,
            assembler: FrameAssembler::new(plan.lidars.len(), plan.first, plan.period_ns)?,
        })
    }

    /// The next frame, when no later sweep can be nearer to it.
    pub fn pop(&mut self) -> Option<Frame> {
        self.assembler.pop()
    }

    fn assemble(&mut self) {
        for (place, taker) in self.lidars.shares().enumerate() {
            for (middle, share) in taker.shares.drain(..) {
                self.assembler.push(place, middle, share);
            }
        }
    }
}

impl<L: Shares> Reading for FrameReader<L> {
    fn push(&mut self, batch: &DatagramBatch) {
        self.lidars.push(batch);
        self.assemble();
    }

    fn is_done(&self) -> bool {
        self.lidars.is_done()
    }

    fn finish(&mut self) {
        self.lidars.finish();
        self.assemble();
        self.assembler.finish();
    }
}

impl Taker for ShareTaker {
    type Kept = ShareEchoes;

    fn take(&mut self, sweep: &Sweep<ShareEchoes>) {
        self.shares.push(share_of(sweep, &self.stands, &self.pass));
    }
}

fn check_length(name: &'static str, found: usize, expected: usize) -> Result<(), InvalidValue> {
    if found == expected {
        return Ok(());
    }
    Err(InvalidValue {
        name,
        expected: format!("{expected}, one per lidar"),
        found: found.to_string(),
    })
}
