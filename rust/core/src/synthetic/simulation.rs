//! A whole test: from the plan of a scene to packets and truth.

use std::io::{self, Write};

use nalgebra::Vector3;
use rayon::prelude::*;

use super::blade::Blade;
use super::body::Body;
use super::lidar::Lidar;
use super::motion::Motion;
use super::network::{Arrival, Fate};
use super::packets::States;
use super::plan::ScenePlan;
use super::sight::Sight;
use super::solver::Loads;
use super::terrain::{Ground, Terrain};
use super::truth::{self, SectionTruth};
use crate::capture::PcapWriter;
use crate::error::InvalidValue;

/// Distance of the solver's nodes, metres.
const SPACING_M: f64 = 0.25;
/// Time between states of the blade; in between it moves evenly.
const STATE_NS: i64 = 10_000_000;
/// The same where it is driven: 6 m at 1.2 Hz bow by 0.2 mm between states.
const DRIVEN_STATE_NS: i64 = 2_000_000;
/// Scene time of one step of [`Simulation::advance`].
const WINDOW_NS: i64 = 250_000_000;
const GRAVITY_M_S2: f64 = 9.81;

/// A test under way.
#[derive(Debug)]
pub struct Simulation {
    /// The sensors as they stand.
    pub lidars: Vec<Lidar>,
    /// What stands around.
    pub terrain: Terrain,
    /// The blade as built.
    pub blade: Blade,
    pub(super) motion: Motion,
    pub(super) body: Body,
    pub(super) plan: ScenePlan,
    fates: Vec<Vec<Fate>>,
    done_ns: i64,
    sent: Vec<u32>,
    pending: Vec<Arrival>,
}

impl Simulation {
    /// Builds the blade, bends it and puts up the sensors.
    ///
    /// # Errors
    /// [`InvalidValue`] where the blade cannot be clamped or bent as planned, a saddle is not on it,
    /// or nothing lasts.
    pub fn new(plan: ScenePlan) -> Result<Self, InvalidValue> {
        let errors = &plan.errors;
        let blade = Blade::build(plan.stations.clone(), &plan.orientation, errors, plan.seed)?;
        let duration_s = plan.schedule.duration_s();
        if !(0.1..=36_000.0).contains(&duration_s) {
            return Err(InvalidValue {
                name: "load",
                expected: "holds and ramps of 0.1 s to 10 h together".into(),
                found: format!("{duration_s} s"),
            });
        }
        let places: Vec<f64> = plan.saddles.iter().map(|saddle| saddle.s_m).collect();
        let arc_m = blade.grid(SPACING_M, &places);
        let pulls = plan.pulls(&blade, &arc_m)?;
        let loads = Loads {
            pulls: pulls.clone(),
            share: 0.0,
            gravity_m_s2: Vector3::y() * -GRAVITY_M_S2,
        };
        let rod = blade.rod(&arc_m);
        let (schedule, sways) = (plan.schedule.clone(), plan.sways.clone());
        let motion = Motion::new(&rod, &loads, schedule, sways, plan.root_turn_rad)?;
        let body = Body::new(&blade, &arc_m, plan.frames(&blade, &pulls));
        let plans = plan.lidars.iter().cloned().enumerate();
        let lidars: Vec<Lidar> = plans
            .map(|(i, lidar)| Lidar::new(lidar, plan.seed, i, plan.start))
            .collect();
        let duration_ns = (duration_s * 1e9) as i64;
        let fates = lidars.iter().enumerate().map(|(i, lidar)| {
            let packets = lidar.packets(duration_ns);
            let packet_s = lidar.plan.packet_ns() * 1e-9;
            let mut fates = plan.network.fates(plan.seed, i, packets, packet_s);
            for (packet, fate) in fates.iter_mut().enumerate() {
                fate.lost |= lidar.is_silent(lidar.end_ns(packet as u32));
            }
            fates
        });
        Ok(Self {
            fates: fates.collect(),
            sent: vec![0; lidars.len()],
            terrain: Terrain {
                ground: Ground::new(plan.ground, plan.seed),
                wall: plan.wall,
                boxes: plan.boxes.clone(),
                targets: plan.targets.clone(),
            },
            lidars,
            blade,
            motion,
            body,
            plan,
            done_ns: 0,
            pending: Vec::new(),
        })
    }

    /// Scene time from start to end, ns.
    pub fn duration_ns(&self) -> i64 {
        (self.plan.schedule.duration_s() * 1e9) as i64
    }

    /// Scene time that is simulated, ns.
    pub fn done_ns(&self) -> i64 {
        self.done_ns
    }

    /// Packets sent and lost by each sensor over the whole test.
    pub fn packets(&self) -> Vec<(u32, u32)> {
        let count = |fates: &Vec<Fate>| {
            let lost = fates.iter().filter(|fate| fate.lost).count();
            (fates.len() as u32, lost as u32)
        };
        self.fates.iter().map(count).collect()
    }

    /// Truth of the sections at scene times.
    pub fn truth(&self, sections_m: &[f64], times_s: &[f64]) -> Vec<Vec<SectionTruth>> {
        truth::sections(&self.blade, &self.motion, sections_m, times_s)
    }

    /// Share of full load at a scene time.
    pub fn share(&self, time_s: f64) -> f64 {
        self.motion.share(time_s)
    }

    /// Simulates a quarter of a second and writes what has arrived; false when all is written.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn advance<W: Write>(&mut self, writer: &mut PcapWriter<W>) -> io::Result<bool> {
        let from_ns = self.done_ns;
        let to_ns = (from_ns + WINDOW_NS).min(self.duration_ns());
        let mut arrivals = std::mem::take(&mut self.pending);
        arrivals.extend(self.window(from_ns, to_ns));
        let start = self.plan.start;
        let network = &self.plan.network;
        arrivals.extend(network.other(&self.lidars, start, from_ns, to_ns));
        arrivals.sort_by_key(|arrival| (arrival.time, arrival.order));
        let ended = to_ns == self.duration_ns();
        // Later windows send nothing that arrives before their start.
        let ripe = arrivals.partition_point(|arrival| ended || arrival.time < start + to_ns);
        self.pending = arrivals.split_off(ripe);
        for arrival in &arrivals {
            writer.write_udp(
                arrival.time,
                arrival.source,
                arrival.destination,
                &arrival.payload,
            )?;
        }
        self.done_ns = to_ns;
        Ok(!ended)
    }

    /// Packets whose last shot falls into a window, as they arrive.
    fn window(&mut self, from_ns: i64, to_ns: i64) -> Vec<Arrival> {
        let packet_ns = self.lidars.iter().map(|lidar| lidar.plan.packet_ns());
        let before_ns = 2 * packet_ns.fold(0.0, f64::max) as i64;
        let states = self.states(from_ns - before_ns, to_ns);
        let mut tasks = Vec::new();
        for (index, lidar) in self.lidars.iter().enumerate() {
            let sight = Sight::new(lidar, &self.body, states.nodes(), self.plan.optics.beam_rad);
            let last = self.fates[index].len() as u32;
            let first = self.sent[index];
            let ends = |k: &u32| lidar.end_ns(*k) <= to_ns as f64;
            let next = (first..last).find(|k| !ends(k)).unwrap_or(last);
            tasks.extend((first..next).map(|packet| (index, packet, sight)));
            self.sent[index] = next;
        }
        let arrivals: Vec<Vec<Arrival>> = tasks
            .par_iter()
            .map(|(index, packet, sight)| self.send(*index, *packet, sight, &states))
            .collect();
        arrivals.into_iter().flatten().collect()
    }

    pub(super) fn states(&self, from_ns: i64, to_ns: i64) -> States {
        let step_ns = if self.motion.is_driven() {
            DRIVEN_STATE_NS
        } else {
            STATE_NS
        };
        let first = from_ns.div_euclid(step_ns);
        let last = to_ns.div_euclid(step_ns) + 1;
        let node = |state: i64| self.motion.nodes((state * step_ns) as f64 * 1e-9);
        let nodes = (first..=last).into_par_iter().map(node).collect();
        States::new(first, step_ns, nodes)
    }

    fn send(&self, index: usize, packet: u32, sight: &Sight, states: &States) -> Vec<Arrival> {
        let fate = self.fates[index][packet as usize];
        if fate.lost {
            return Vec::new();
        }
        let lidar = &self.lidars[index];
        let sent_ns = lidar.end_ns(packet) as i64;
        let arrival = Arrival {
            time: self.plan.start + sent_ns + fate.delay_ns,
            order: 64 + (u64::from(packet) << 8) + index as u64,
            source: lidar.source(),
            destination: lidar.destination(lidar.plan.port),
            payload: (lidar.plan.sensor.writer).write(&self.shots(index, packet, sight, states)),
        };
        if fate.doubled {
            let again = Arrival {
                time: arrival.time + 9_000,
                ..arrival.clone()
            };
            return vec![arrival, again];
        }
        vec![arrival]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::blade::{BuildErrors, Orientation};
    use super::super::echo::{Optics, View};
    use super::super::lidar::{Clock, LidarPlan};
    use super::super::motion::Schedule;
    use super::super::network::NetworkPlan;
    use super::super::plan::{SaddlePlan, axes};
    use super::super::random::{Stream, Subject};
    use super::super::reference::Stations;
    use super::super::rod::Node;
    use super::super::sensor::Sensor;
    use super::super::terrain::GroundPlan;
    use super::*;
    use crate::capture::DatagramReader;
    use crate::time::Timestamp;
    use rayon::ThreadPoolBuilder;
    use std::sync::Arc;

    fn lidar(index: u8, z_m: f64) -> LidarPlan {
        LidarPlan {
            sensor: Arc::new(Sensor::new("vlp16").unwrap()),
            address: [192, 168, 1, 201 + index],
            port: 2368,
            position_m: Vector3::new(3.0, -7.0, z_m),
            axes: axes([-Vector3::x(), -Vector3::y(), Vector3::z()]).unwrap(),
            tilt_rad: 0.03,
            rpm: 600.0,
            clock: Clock {
                offset_ns: i64::from(index) * 5_000_000_000,
                drift: 2e-5,
                locked: false,
            },
            channel_offset_m: 0.005,
            unit_offset_m: 0.005,
            elevation_u_rad: 0.0,
            kick: None,
            silent_s: Vec::new(),
        }
    }

    pub(in super::super) fn plan() -> ScenePlan {
        let saddle = SaddlePlan {
            s_m: 95.0,
            force_n: 1e5,
            lever_m: [0.0, 0.0],
            anchor_m: Vector3::new(40.0, -7.0, 95.0),
        };
        ScenePlan {
            seed: 4,
            start: Timestamp(1_718_000_000_000_000_000),
            stations: Stations::reference("iea15-110m", None).unwrap(),
            orientation: Orientation {
                leading_edge: -Vector3::x(),
                suction_side: -Vector3::y(),
            },
            errors: BuildErrors {
                waves_m: 0.002,
                ..Default::default()
            },
            direction: Vector3::x(),
            follower: false,
            saddles: vec![saddle],
            show_saddles: true,
            cable_radius_m: 0.012,
            schedule: Schedule {
                levels: vec![0.0, 1.0],
                hold_s: 0.2,
                ramp_s: 0.2,
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
            lidars: vec![lidar(0, 90.0), lidar(1, 104.0)],
            optics: Optics {
                beam_rad: 1e-3,
                noise_m: 0.01,
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
                loss: 0.02,
                duplicates: 0.02,
                late: 0.02,
                jitter_s: 35e-6,
                foreign_hz: 10.0,
                position_hz: 10.0,
                ..Default::default()
            },
        }
    }

    fn capture(plan: ScenePlan, threads: usize) -> (Vec<u8>, Vec<(u32, u32)>) {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut simulation = Simulation::new(plan).unwrap();
            let mut writer = PcapWriter::new(Vec::new()).unwrap();
            while simulation.advance(&mut writer).unwrap() {}
            (writer.into_inner(), simulation.packets())
        })
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_for_any_number_of_threads() {
        let (one, _) = capture(plan(), 1);
        assert!(one == capture(plan(), 2).0);
        assert!(one != capture(ScenePlan { seed: 5, ..plan() }, 2).0);
    }

    #[test]
    fn what_is_sent_and_not_lost_arrives_in_order_of_time() {
        let (bytes, packets) = capture(plan(), 2);
        let mut reader = DatagramReader::new(bytes.as_slice()).unwrap();
        let (mut arrived, mut last) = ([0, 0], Timestamp(0));
        let mut seen = std::collections::HashSet::new();
        while let Some(datagram) = reader.next().unwrap() {
            assert!(datagram.time >= last);
            last = datagram.time;
            if datagram.payload.len() == 1206 && seen.insert(datagram.payload.to_vec()) {
                arrived[usize::from(datagram.source.to_string().starts_with("192.168.1.202"))] += 1;
            }
        }
        let (sent, lost) = packets[0];
        assert!((450..=452).contains(&sent) && lost > 0); // 0.6 s of 1.327 ms
        assert_eq!(
            arrived,
            [packets[0], packets[1]].map(|(sent, lost)| sent - lost)
        );
    }

    #[test]
    fn unloaded_echoes_lie_on_the_skin_of_the_blade() {
        let mut still = plan();
        still.schedule = Schedule {
            levels: vec![0.0],
            hold_s: 0.2,
            ramp_s: 0.1,
        };
        still.optics.noise_m = 0.0;
        for lidar in &mut still.lidars {
            (lidar.channel_offset_m, lidar.unit_offset_m) = (0.0, 0.0);
        }
        let simulation = Simulation::new(still).unwrap();
        let states = simulation.states(0, 200_000_000);
        let lidar = &simulation.lidars[1];
        let shot = lidar.plan.sensor.shots[0][7].unwrap();
        let sight = Sight::new(lidar, &simulation.body, states.nodes(), 1e-3);
        let mut stream = Stream::new(1, Subject::Packet, [0, 0]);
        let mut hits = 0;
        for step in 0..3600 {
            let azimuth = f64::from(step) * std::f64::consts::TAU / 3600.0;
            let ray = lidar.ray_at(&shot, 0.0, azimuth);
            let view = View {
                terrain: &simulation.terrain,
                body: &simulation.body,
                pose: states.at(0.0),
                nodes: sight.nodes(azimuth),
            };
            let echo = simulation.plan.optics.shoot(&view, &ray, 0.0, &mut stream);
            let at = ray.at(echo.range_m);
            if echo.range_m > 0.0 && at.y > -4.0 {
                hits += 1;
                assert!(
                    simulation.skin_distance_m(&states.nodes()[0], &at) < 0.012,
                    "{at}"
                );
            }
        }
        // The chord of 1.9 m at 9 m seen in steps of 0.1 degree.
        assert!((80..150).contains(&hits), "{hits}");
    }

    impl Simulation {
        /// Distance of a point from the skin at the nearest node, found by brute force.
        fn skin_distance_m(&self, nodes: &[Node], at: &Vector3<f64>) -> f64 {
            let distances: Vec<(usize, f64)> = nodes
                .iter()
                .map(|node| (node.rotation.inverse() * (at - node.position_m)).z.abs())
                .enumerate()
                .collect();
            let nearest = distances.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let node = &nodes[nearest.0];
            let local = (node.rotation.inverse() * (at - node.position_m)).xy();
            let skin = self.blade.skin(self.motion.arc_m[nearest.0]);
            let sides = (0..skin.len()).map(|i| {
                let (a, b) = (skin[i], skin[(i + 1) % skin.len()]);
                let along = ((local - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (local - a - (b - a) * along).norm()
            });
            sides.fold(f64::MAX, f64::min)
        }
    }
}
