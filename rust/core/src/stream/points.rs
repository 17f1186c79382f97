//! Points in the order of arrival, each with its lidar and turn.

use super::reader::{Reader, Sink, SweepOptions};
use crate::cloud::PointCloud;
use crate::frame::Sensor;
use crate::packet::Decoded;
use crate::sweep::{Placed, Turns};

/// Turns datagrams into points.
pub type PointReader = Reader<PointTagger>;

/// Points of several lidars, columns of equal length.
#[derive(Debug, Default)]
pub struct PointBlock {
    /// Returns.
    pub cloud: PointCloud<Sensor>,
    /// Number of the lidar.
    pub lidar: Vec<u16>,
    /// Turn of the lidar since its first packet.
    pub sweep: Vec<u32>,
    /// Frame by the sensor's own count; 0 where it has none.
    pub frame_id: Vec<u32>,
    /// Whether there is such a count.
    pub has_frame_id: Vec<bool>,
}

/// Tells in which turn each return was shot.
#[derive(Debug)]
pub struct PointTagger {
    lidar: u16,
    turns: Turns,
    turn: u32,
}

impl Reader<PointTagger> {
    /// Points that wait to be taken.
    pub fn waiting(&self) -> usize {
        self.out.lidar.len()
    }

    /// Takes all points that wait.
    pub fn take(&mut self) -> PointBlock {
        std::mem::take(&mut self.out)
    }
}

impl Sink for PointTagger {
    type Out = PointBlock;

    fn new(lidar: usize, _visible_rad: f64, options: &SweepOptions) -> Self {
        Self {
            lidar: lidar as u16,
            turns: Turns::new(options.cut_rad(lidar)),
            turn: 0,
        }
    }

    fn skip(&mut self, packet: &Placed) {
        self.turns.follow(packet, self.turns.place(packet));
    }

    fn push(&mut self, packet: &Placed, decoded: &Decoded, out: &mut PointBlock) {
        let start_rad = self.turns.place(packet);
        self.turns.follow(packet, start_rad);
        self.turn = self.turn.max(Turns::turn_of(start_rad));
        let last_turn = Turns::turn_of(start_rad + packet.head.turned_rad.max(0.0));
        let mut from = 0;
        while self.turn < last_turn {
            let cut_rad = Turns::cut_after(self.turn) - start_rad;
            let to = decoded.before(from, &packet.head, cut_rad);
            out.sweep.resize(out.sweep.len() + to - from, self.turn);
            self.turn += 1;
            from = to;
        }
        let rest = decoded.cloud.len() - from;
        out.sweep.resize(out.sweep.len() + rest, self.turn);
        let points = out.sweep.len();
        out.lidar.resize(points, self.lidar);
        out.frame_id.resize(points, packet.frame_id.unwrap_or(0));
        out.has_frame_id.resize(points, packet.frame_id.is_some());
        out.cloud.extend(&decoded.cloud, 0..decoded.cloud.len());
    }

    fn finish(&mut self, _out: &mut PointBlock) {}
}
