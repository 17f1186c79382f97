//! A scene as nested dictionaries in SI units.

use std::sync::Arc;

use lidar_deflect_core::error::InvalidValue;
use lidar_deflect_core::synthetic::ScenePlan;
use lidar_deflect_core::synthetic::blade::{BuildErrors, Orientation};
use lidar_deflect_core::synthetic::echo::Optics;
use lidar_deflect_core::synthetic::lidar::{Clock, Kick, LidarPlan};
use lidar_deflect_core::synthetic::motion::{Schedule, Sway};
use lidar_deflect_core::synthetic::network::NetworkPlan;
use lidar_deflect_core::synthetic::plan::{self, SaddlePlan};
use lidar_deflect_core::synthetic::reference::Stations;
use lidar_deflect_core::synthetic::sensor::Sensor;
use lidar_deflect_core::synthetic::target::Target;
use lidar_deflect_core::synthetic::terrain::{Crate, GroundPlan, Wall};
use lidar_deflect_core::time::Timestamp;
use nalgebra::Vector3;
use pyo3::prelude::*;

/// All of it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SceneIn {
    seed: u64,
    start_ns: i64,
    blade: BladeIn,
    direction: [f64; 3],
    follower: bool,
    saddles: Vec<SaddleIn>,
    show_saddles: bool,
    cable_radius_m: f64,
    levels: Vec<f64>,
    hold_s: f64,
    ramp_s: f64,
    sways: Vec<SwayIn>,
    root_turn_rad: [f64; 3],
    ground: GroundIn,
    wall: Option<WallIn>,
    boxes: Vec<BoxIn>,
    targets: Vec<TargetIn>,
    lidars: Vec<LidarIn>,
    optics: OpticsIn,
    network: NetworkIn,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct BladeIn {
    reference: String,
    length_m: Option<f64>,
    leading_edge: [f64; 3],
    suction_side: [f64; 3],
    chord_u: f64,
    setting_u_rad: f64,
    prebend_u: f64,
    stiffness_u: f64,
    waves_m: f64,
    mould_m: f64,
    drawn: Option<u64>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SaddleIn {
    s_m: f64,
    force_n: f64,
    lever_m: [f64; 2],
    anchor_m: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SwayIn {
    direction: [f64; 3],
    order: u8,
    frequency_hz: f64,
    amplitude_m: f64,
    phase_rad: f64,
    driven_s: Option<(f64, f64)>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct GroundIn {
    height_m: f64,
    slope: [f64; 2],
    roughness_m: f64,
    correlation_m: f64,
    swell_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct WallIn {
    x_m: f64,
    slope: f64,
    z_m: [f64; 2],
    top_m: f64,
    bow_m: f64,
    lean: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct BoxIn {
    middle_m: [f64; 3],
    size_m: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TargetIn {
    middle_m: [f64; 3],
    half_m: f64,
    facing: Option<[f64; 3]>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct KickIn {
    at_s: f64,
    turn_rad: [f64; 3],
    shift_m: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct LidarIn {
    model: String,
    address: [u8; 4],
    port: u16,
    position_m: [f64; 3],
    axes: [[f64; 3]; 3],
    tilt_rad: f64,
    rpm: f64,
    clock_offset_ns: i64,
    clock_drift: f64,
    clock_locked: bool,
    channel_offset_m: f64,
    unit_offset_m: f64,
    elevation_u_rad: f64,
    kick: Option<KickIn>,
    silent_s: Vec<[f64; 2]>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct OpticsIn {
    beam_rad: f64,
    noise_m: f64,
    dropout: f64,
    merge_m: f64,
    range_at_10_percent_m: f64,
    max_range_m: f64,
    grazing_rad: f64,
    incidence_bias_m: f64,
    faint_bias_m: f64,
    retro_bias_m: f64,
    noise_freedom: u32,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct NetworkIn {
    loss: f64,
    bursts_per_s: f64,
    burst_packets: f64,
    duplicates: f64,
    late: f64,
    jitter_s: f64,
    foreign_hz: f64,
    position_hz: f64,
}

impl SceneIn {
    /// The plan of the simulation.
    pub fn plan(self) -> Result<ScenePlan, InvalidValue> {
        let blade = &self.blade;
        Ok(ScenePlan {
            seed: self.seed,
            start: Timestamp(self.start_ns),
            stations: blade.stations()?,
            orientation: Orientation {
                leading_edge: blade.leading_edge.into(),
                suction_side: blade.suction_side.into(),
            },
            errors: BuildErrors {
                chord: blade.chord_u,
                setting_rad: blade.setting_u_rad,
                prebend: blade.prebend_u,
                stiffness: blade.stiffness_u,
                waves_m: blade.waves_m,
                mould_m: blade.mould_m,
            },
            direction: self.direction.into(),
            follower: self.follower,
            saddles: self.saddles.into_iter().map(SaddlePlan::from).collect(),
            show_saddles: self.show_saddles,
            cable_radius_m: self.cable_radius_m,
            schedule: Schedule {
                levels: self.levels,
                hold_s: self.hold_s,
                ramp_s: self.ramp_s,
            },
            sways: self.sways.into_iter().map(Sway::from).collect(),
            root_turn_rad: self.root_turn_rad.into(),
            ground: self.ground.into(),
            wall: self.wall.map(Wall::from),
            boxes: self.boxes.into_iter().map(Crate::from).collect(),
            targets: self.targets.into_iter().map(Target::from).collect(),
            lidars: self
                .lidars
                .into_iter()
                .map(LidarIn::plan)
                .collect::<Result<_, _>>()?,
            optics: self.optics.into(),
            network: self.network.into(),
        })
    }
}

impl BladeIn {
    fn stations(&self) -> Result<Stations, InvalidValue> {
        match (self.drawn, self.length_m) {
            (Some(seed), Some(length_m)) => Ok(Stations::drawn(length_m, seed)),
            _ => Stations::reference(&self.reference, self.length_m),
        }
    }
}

impl From<SaddleIn> for SaddlePlan {
    fn from(given: SaddleIn) -> Self {
        Self {
            s_m: given.s_m,
            force_n: given.force_n,
            lever_m: given.lever_m,
            anchor_m: given.anchor_m.into(),
        }
    }
}

impl From<SwayIn> for Sway {
    fn from(given: SwayIn) -> Self {
        Self {
            direction: given.direction.into(),
            order: given.order,
            frequency_hz: given.frequency_hz,
            amplitude_m: given.amplitude_m,
            phase_rad: given.phase_rad,
            driven: given.driven_s,
        }
    }
}

impl From<GroundIn> for GroundPlan {
    fn from(given: GroundIn) -> Self {
        Self {
            height_m: given.height_m,
            slope: given.slope,
            roughness_m: given.roughness_m,
            correlation_m: given.correlation_m,
            swell_m: given.swell_m,
        }
    }
}

impl From<WallIn> for Wall {
    fn from(given: WallIn) -> Self {
        Self {
            x_m: given.x_m,
            slope: given.slope,
            z_m: given.z_m,
            top_m: given.top_m,
            bow_m: given.bow_m,
            lean: given.lean,
        }
    }
}

impl From<BoxIn> for Crate {
    fn from(given: BoxIn) -> Self {
        Self {
            middle_m: given.middle_m.into(),
            half_m: Vector3::from(given.size_m) * 0.5,
        }
    }
}

impl From<TargetIn> for Target {
    fn from(given: TargetIn) -> Self {
        Self {
            middle_m: given.middle_m.into(),
            half_m: given.half_m,
            facing: given.facing.map(|facing| Vector3::from(facing).normalize()),
        }
    }
}

impl From<KickIn> for Kick {
    fn from(given: KickIn) -> Self {
        Self {
            at_s: given.at_s,
            turn_rad: given.turn_rad.into(),
            shift_m: given.shift_m.into(),
        }
    }
}

impl LidarIn {
    fn plan(self) -> Result<LidarPlan, InvalidValue> {
        Ok(LidarPlan {
            sensor: Arc::new(Sensor::new(&self.model)?),
            address: self.address,
            port: self.port,
            position_m: self.position_m.into(),
            axes: plan::axes(self.axes.map(Vector3::from))?,
            tilt_rad: self.tilt_rad,
            rpm: self.rpm,
            clock: Clock {
                offset_ns: self.clock_offset_ns,
                drift: self.clock_drift,
                locked: self.clock_locked,
            },
            channel_offset_m: self.channel_offset_m,
            unit_offset_m: self.unit_offset_m,
            elevation_u_rad: self.elevation_u_rad,
            kick: self.kick.map(Kick::from),
            silent_s: self.silent_s,
        })
    }
}

impl From<OpticsIn> for Optics {
    fn from(given: OpticsIn) -> Self {
        Self {
            beam_rad: given.beam_rad,
            noise_m: given.noise_m,
            dropout: given.dropout,
            merge_m: given.merge_m,
            range_at_10_percent_m: given.range_at_10_percent_m,
            max_range_m: given.max_range_m,
            grazing_rad: given.grazing_rad,
            incidence_bias_m: given.incidence_bias_m,
            faint_bias_m: given.faint_bias_m,
            retro_bias_m: given.retro_bias_m,
            noise_freedom: given.noise_freedom,
        }
    }
}

impl From<NetworkIn> for NetworkPlan {
    fn from(given: NetworkIn) -> Self {
        Self {
            loss: given.loss,
            bursts_per_s: given.bursts_per_s,
            burst_packets: given.burst_packets,
            duplicates: given.duplicates,
            late: given.late,
            jitter_s: given.jitter_s,
            foreign_hz: given.foreign_hz,
            position_hz: given.position_hz,
        }
    }
}
