//! Where around a sensor the blade can be: most shots pass it by far and are told so cheaply.

use super::body::Body;
use super::lidar::Lidar;
use super::rod::Node;
use crate::angle::wrap_half_turn;

/// Azimuths and nodes of the blade that one sensor can see during some states.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    middle_rad: f64,
    half_rad: f64,
    nodes: (usize, usize),
}

/// Added to all sides, for movement between states and tilted sections, metres.
const MARGIN_M: f64 = 0.3;

impl Sight {
    /// What `lidar` sees of `body` in the first, middle and last of `states`.
    pub fn new(lidar: &Lidar, body: &Body, states: &[Vec<Node>], beam_rad: f64) -> Self {
        let mut sight: Option<Self> = None;
        for state in [0, states.len() / 2, states.len() - 1] {
            for (node, at) in states[state].iter().enumerate() {
                let place = lidar.sensor_from_world(&at.position_m);
                let reach_m = body.reach_m(node) + MARGIN_M;
                let level_m = place.xy().norm();
                let highest_m = (level_m + reach_m) * (lidar.reach_rad() + beam_rad).tan();
                if place.z.abs() < highest_m + reach_m {
                    let azimuth = (-place.y).atan2(place.x);
                    let half = if reach_m < level_m {
                        (reach_m / level_m).asin()
                    } else {
                        4.0
                    };
                    sight = Some(Self::widened(sight, node, azimuth, half));
                }
            }
        }
        sight.unwrap_or(Self {
            middle_rad: 0.0,
            half_rad: -1.0,
            nodes: (0, 0),
        })
    }

    fn widened(sight: Option<Self>, node: usize, azimuth: f64, half: f64) -> Self {
        let Some(sight) = sight else {
            return Self {
                middle_rad: azimuth,
                half_rad: half,
                nodes: (node, node),
            };
        };
        let away = wrap_half_turn(azimuth - sight.middle_rad);
        let (low, high) = (
            (away - half).min(-sight.half_rad),
            (away + half).max(sight.half_rad),
        );
        Self {
            middle_rad: sight.middle_rad + 0.5 * (low + high),
            half_rad: 0.5 * (high - low),
            nodes: (sight.nodes.0.min(node), sight.nodes.1.max(node)),
        }
    }

    /// The nodes to look at for a shot at this azimuth; `None` where it passes the blade by far.
    pub fn nodes(&self, azimuth_rad: f64) -> Option<(usize, usize)> {
        let away = wrap_half_turn(azimuth_rad - self.middle_rad);
        (away.abs() <= self.half_rad).then_some(self.nodes)
    }
}
