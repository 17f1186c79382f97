//! A simulated edgewise test with four VLP-16, in memory: what the benches of whole methods measure.

use lidar_deflect_core::capture::{DatagramReader, PcapWriter};
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport};
use lidar_deflect_core::synthetic::blade::{BuildErrors, Orientation};
use lidar_deflect_core::synthetic::echo::Optics;
use lidar_deflect_core::synthetic::lidar::{Clock, LidarPlan};
use lidar_deflect_core::synthetic::motion::Schedule;
use lidar_deflect_core::synthetic::network::NetworkPlan;
use lidar_deflect_core::synthetic::plan::{SaddlePlan, axes};
use lidar_deflect_core::synthetic::reference::Stations;
use lidar_deflect_core::synthetic::sensor::Sensor;
use lidar_deflect_core::synthetic::terrain::GroundPlan;
use lidar_deflect_core::synthetic::{ScenePlan, Simulation};
use lidar_deflect_core::time::Timestamp;
use nalgebra::Vector3;

/// When it begins.
pub const START: Timestamp = Timestamp(1_718_000_000_000_000_000);
/// Places of the four lidars along the span, metres.
const PLACES_M: [f64; 4] = [86.0, 94.0, 102.0, 109.5];

fn lidar(index: u8, z_m: f64) -> LidarPlan {
    LidarPlan {
        sensor: std::sync::Arc::new(Sensor::new("vlp16").unwrap()),
        kick: None,
        silent_s: Vec::new(),
        address: [192, 168, 1, 201 + index],
        port: 2368,
        position_m: Vector3::new(3.0, -7.0, z_m),
        axes: axes([-Vector3::x(), -Vector3::y(), Vector3::z()]).unwrap(),
        tilt_rad: 0.0,
        rpm: 600.0,
        clock: Clock {
            offset_ns: 0,
            drift: 0.0,
            locked: true,
        },
        channel_offset_m: 0.007,
        unit_offset_m: 0.004,
        elevation_u_rad: 0.0,
    }
}

fn scene() -> ScenePlan {
    ScenePlan {
        seed: 1,
        start: START,
        stations: Stations::reference("iea15-110m", None).unwrap(),
        orientation: Orientation {
            leading_edge: -Vector3::x(),
            suction_side: Vector3::y(),
        },
        errors: BuildErrors {
            waves_m: 0.002,
            ..Default::default()
        },
        direction: Vector3::x(),
        follower: false,
        saddles: vec![SaddlePlan {
            s_m: 95.0,
            force_n: 3e4,
            lever_m: [0.0, 0.0],
            anchor_m: Vector3::new(42.0, -7.0, 95.0),
        }],
        show_saddles: true,
        cable_radius_m: 0.012,
        schedule: Schedule {
            levels: vec![0.0, 1.0],
            hold_s: 1.0,
            ramp_s: 1.0,
        },
        sways: Vec::new(),
        root_turn_rad: Vector3::zeros(),
        ground: GroundPlan {
            height_m: -8.0,
            slope: [0.01, 0.0],
            roughness_m: 0.01,
            correlation_m: 0.8,
            swell_m: 0.0,
        },
        wall: None,
        boxes: Vec::new(),
        targets: Vec::new(),
        lidars: (0..)
            .zip(PLACES_M)
            .map(|(index, z_m)| lidar(index, z_m))
            .collect(),
        optics: Optics {
            beam_rad: 3e-3,
            noise_m: 0.014,
            dropout: 0.01,
            merge_m: 0.45,
            range_at_10_percent_m: 60.0,
            max_range_m: 100.0,
            grazing_rad: 1.5,
            incidence_bias_m: 0.0,
            faint_bias_m: 0.0,
            retro_bias_m: 0.0,
            noise_freedom: 0,
        },
        network: NetworkPlan {
            loss: 0.004,
            jitter_s: 35e-6,
            ..Default::default()
        },
    }
}

/// One second without load, one in which it rises, one under full load.
pub fn simulation() -> Simulation {
    Simulation::new(scene()).unwrap()
}

/// Bytes of the capture and the poses of its lidars.
pub fn capture(mut simulation: Simulation) -> (Vec<u8>, Vec<WorldFromSensor>) {
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    while simulation.advance(&mut writer).unwrap() {}
    let poses = simulation
        .lidars
        .iter()
        .map(|lidar| lidar.world_from_sensor)
        .collect();
    (writer.into_inner(), poses)
}

/// Who sends what in a capture.
pub fn scan(bytes: &[u8]) -> ScanReport {
    let mut reader = DatagramReader::new(bytes).unwrap();
    let mut scan = Scan::new(ScanOptions::default());
    while let Some(datagram) = reader.next().unwrap() {
        scan.push(&datagram);
    }
    scan.finish()
}
