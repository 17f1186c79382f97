//! The packets of one sensor: what it shoots at while the blade moves, row by row.

use super::body::Pose;
use super::echo::View;
use super::lidar::Lidar;
use super::random::{Stream, Subject};
use super::rod::Node;
use super::sensor::Shot;
use super::sight::Sight;
use super::simulation::Simulation;
use crate::packet::writer::{Echo, Row, Shots};

impl Simulation {
    /// What a sensor measures in one packet.
    pub(super) fn shots(&self, index: usize, packet: u32, sight: &Sight, states: &States) -> Shots {
        let lidar = &self.lidars[index];
        let part = [index as u64, u64::from(packet)];
        let mut stream = Stream::new(self.plan.seed, Subject::Packet, part);
        let sensor = &lidar.plan.sensor;
        let first_ns = lidar.row_ns(packet, 0);
        let azimuth_ns = sensor.writer.azimuth_ns() as f64;
        let rows = sensor.shots.iter().enumerate().map(|(number, shots)| {
            let row_ns = lidar.row_ns(packet, number);
            let shoot = |shot: &Option<Shot>| {
                let shot = shot.as_ref();
                shot.map_or(Echo::default(), |shot| {
                    self.shoot(lidar, shot, row_ns, sight, states, &mut stream)
                })
            };
            Row {
                after_ns: (row_ns - first_ns).round() as i64,
                azimuth_rad: lidar.azimuth_rad(lidar.scene_ns(row_ns + azimuth_ns)),
                echoes: shots.iter().map(shoot).collect(),
            }
        });
        Shots {
            rows: rows.collect(),
            time: lidar.device(first_ns),
            sequence: lidar.sequence(packet),
            rate_rad_per_ns: lidar.rate_rad_per_ns(),
        }
    }

    fn shoot(
        &self,
        lidar: &Lidar,
        shot: &Shot,
        row_ns: f64,
        sight: &Sight,
        states: &States,
        stream: &mut Stream,
    ) -> Echo {
        let scene_ns = lidar.scene_ns(row_ns + shot.after_ns as f64);
        let azimuth = lidar.azimuth_rad(scene_ns);
        let view = View {
            terrain: &self.terrain,
            body: &self.body,
            pose: states.at(scene_ns),
            nodes: sight.nodes(azimuth + shot.azimuth_rad),
        };
        let ray = lidar.ray_at(shot, scene_ns, azimuth);
        let offset_m = lidar.range_offset_m[usize::from(shot.ring)];
        self.plan.optics.shoot(&view, &ray, offset_m, stream)
    }
}

/// The blade at even steps of scene time.
#[derive(Debug)]
pub struct States {
    first: i64,
    step_ns: i64,
    nodes: Vec<Vec<Node>>,
}

impl States {
    /// `nodes` of the states from number `first` on, `step_ns` apart.
    pub fn new(first: i64, step_ns: i64, nodes: Vec<Vec<Node>>) -> Self {
        Self {
            first,
            step_ns,
            nodes,
        }
    }

    /// All states.
    pub fn nodes(&self) -> &[Vec<Node>] {
        &self.nodes
    }

    /// The blade at a scene time.
    pub fn at(&self, scene_ns: f64) -> Pose<'_> {
        let place = scene_ns / self.step_ns as f64 - self.first as f64;
        let before = (place.max(0.0) as usize).min(self.nodes.len() - 2);
        Pose {
            before: &self.nodes[before],
            after: &self.nodes[before + 1],
            share: place - before as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Vector3;

    use super::super::plan::ScenePlan;
    use super::super::sensor::Sensor;
    use super::super::simulation::tests::plan;
    use super::*;
    use crate::cloud::Return;
    use crate::packet::writer::{WRITERS, WriterRef};
    use crate::packet::{Decoded, Place};

    /// Two lidars of one model; noise counts as measured.
    fn of_model(writer: WriterRef) -> ScenePlan {
        let mut plan = plan();
        plan.optics.dropout = 0.0;
        for lidar in &mut plan.lidars {
            (lidar.channel_offset_m, lidar.unit_offset_m) = (0.0, 0.0);
            lidar.sensor = Arc::new(Sensor::new(writer.id()).unwrap());
        }
        plan
    }

    fn decode(writer: WriterRef, packets: &[Shots]) -> Vec<Return> {
        let mut fitted = writer.model().fit(&writer.files()).unwrap();
        let mut out = Decoded::default();
        for (number, shots) in packets.iter().enumerate() {
            let payload = writer.write(shots);
            let head = writer.model().head(&payload).unwrap();
            // Microseconds are the finest that any of them writes.
            let hour_ns = writer.model().counting().clock_wrap_ns.unwrap_or(i64::MAX);
            let late_ns = shots.time.0 % hour_ns - head.device_ns % hour_ns;
            assert!((-600..1000).contains(&late_ns), "{} {late_ns}", writer.id());
            let place = Place {
                time: shots.time,
                packet: number as u32,
                mean_rate_rad_per_ns: shots.rate_rad_per_ns,
            };
            fitted.decoder.decode(&payload, place, &mut out);
        }
        out.cloud.iter().collect()
    }

    #[test]
    fn decoding_gives_back_what_every_sensor_measured() {
        for writer in WRITERS {
            let simulation = Simulation::new(of_model(*writer)).unwrap();
            let lidar = &simulation.lidars[0];
            let states = simulation.states(0, 200_000_000);
            let sight = Sight::new(lidar, &simulation.body, states.nodes(), 1e-3);
            let packets: Vec<Shots> = (20..60)
                .map(|packet| simulation.shots(0, packet, &sight, &states))
                .collect();
            let returns = decode(*writer, &packets);
            let echoes = packets.iter().flat_map(|shots| &shots.rows);
            let sent = echoes
                .flat_map(|row| &row.echoes)
                .filter(|echo| echo.range_m > 0.0);
            let sent = sent.count();
            assert_eq!(returns.len(), sent, "{}", writer.id());
            assert!(sent > 200, "{} {sent}", writer.id());
            let mut worst = (0.0_f64, 0.0_f64);
            for (number, shots) in packets.iter().enumerate() {
                let own: Vec<&Return> = returns
                    .iter()
                    .filter(|r| r.packet == number as u32)
                    .collect();
                for (row, measured) in shots.rows.iter().enumerate() {
                    let slots = lidar.plan.sensor.shots[row].iter().flatten();
                    for (shot, echo) in slots.zip(&measured.echoes) {
                        if echo.range_m == 0.0 {
                            continue;
                        }
                        let time = shots.time + (measured.after_ns + shot.after_ns);
                        let back = own
                            .iter()
                            .find(|r| r.ring == shot.ring && (r.time - time).abs() < 20_000);
                        let back = back.unwrap_or_else(|| panic!("{} row {row}", writer.id()));
                        let row_ns = lidar.row_ns(20 + number as u32, row);
                        let scene_ns = lidar.scene_ns(row_ns + shot.after_ns as f64);
                        let ray = lidar.ray(shot, scene_ns);
                        let at = lidar.sensor_from_world(&ray.at(back.range_m.into()));
                        let seen = Vector3::from(back.xyz_m.map(f64::from));
                        worst.0 = worst.0.max((f64::from(back.range_m) - echo.range_m).abs());
                        worst.1 = worst.1.max((seen - at).norm() / echo.range_m.max(5.0));
                    }
                }
            }
            // Half a unit of 5 mm; azimuths are whole hundredths of a degree, once or twice rounded.
            assert!(worst.0 < 0.002_51, "{} {worst:?}", writer.id());
            assert!(worst.1 < 2.5e-4, "{} {worst:?}", writer.id());
            eprintln!("{} {sent} {worst:?}", writer.id());
        }
    }
}
