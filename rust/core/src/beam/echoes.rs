//! What the lidars saw of the blade: rays with a range, and the ends of their scan lines.

use nalgebra::Vector3;

/// One echo as a ray of its sensor.
#[derive(Debug, Clone, Copy)]
pub struct Echo {
    /// Instant of the shot, nanoseconds since 1970 UTC.
    pub time_ns: i64,
    /// Number of the lidar.
    pub lidar: usize,
    /// Number of the beam.
    pub ring: usize,
    /// Direction in the sensor frame, unit length.
    pub direction: Vector3<f64>,
    /// Measured range, metres.
    pub range_m: f64,
    /// Echoes between this one and the nearer end of its run: those at the very ends are mixed.
    pub from_end: u32,
}

/// The end of a run of echoes on a scan line.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Instant of the last hit, nanoseconds since 1970 UTC.
    pub time_ns: i64,
    /// Number of the lidar.
    pub lidar: usize,
    /// Number of the beam.
    pub ring: usize,
    /// Direction of the last hit, sensor frame, unit length.
    pub hit: Vector3<f64>,
    /// Direction of the first miss, sensor frame, unit length.
    pub miss: Vector3<f64>,
    /// Range of an echo a little inside, metres.
    pub range_m: f64,
}

/// What was seen in a stretch of time.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// Rays with echoes.
    pub echoes: Vec<Echo>,
    /// Ends of runs.
    pub edges: Vec<Edge>,
}

impl Seen {
    /// Adds what another lidar saw.
    pub fn append(&mut self, other: Self) {
        self.echoes.extend(other.echoes);
        self.edges.extend(other.edges);
    }

    /// Brings what a beam saw in one sweep after the other together, and the ends of each side: they meet the same
    /// part of the blade, and sums over it stay where they are at hand.
    pub fn sort(&mut self) {
        self.echoes
            .sort_by_key(|echo| (echo.lidar, echo.ring, echo.time_ns));
        self.edges
            .sort_by_key(|edge| (edge.lidar, edge.ring, edge.turns_left(), edge.time_ns));
    }
}

impl Edge {
    /// Whether the miss lies to the left of the hit, as the sensor stands.
    fn turns_left(&self) -> bool {
        self.hit.x * self.miss.y > self.hit.y * self.miss.x
    }
}

/// Echoes of a run that is too short to have edges.
const SHORT_RUN: usize = 5;
/// Neighbours in a run are not farther apart in range, metres.
const JUMP_M: f64 = 0.5;
/// Shots without an echo that a run bridges.
const MISSED_SHOTS: f64 = 3.6;
/// Echoes over which the turn from shot to shot is averaged.
const TURN_ECHOES: usize = 8;

/// One echo of a scan line, in the order of the shots.
#[derive(Debug, Clone, Copy)]
pub struct LineEcho {
    /// Instant of the shot, nanoseconds.
    pub time_ns: i64,
    /// Point in the sensor frame, metres.
    pub xyz_m: Vector3<f64>,
}

/// Splits a scan line into runs and adds their echoes and ends; `is_gap` tells whether packets are
/// missing between two instants, `period_ns` is the time from shot to shot of the beam.
pub fn add_line(
    seen: &mut Seen,
    lidar: usize,
    ring: usize,
    line: &[LineEcho],
    period_ns: f64,
    is_gap: impl Fn(i64, i64) -> bool,
) {
    let joins = |a: &LineEcho, b: &LineEcho| {
        let near = (a.xyz_m.norm() - b.xyz_m.norm()).abs() < JUMP_M;
        near && ((b.time_ns - a.time_ns) as f64) < MISSED_SHOTS * period_ns
    };
    for run in line.chunk_by(joins) {
        add_echoes(seen, lidar, ring, run);
        if run.len() < SHORT_RUN {
            continue;
        }
        let edges = [end(run, period_ns, true), end(run, period_ns, false)];
        for (edge, reach_ns) in edges.into_iter().zip([2.0 * period_ns, -2.0 * period_ns]) {
            let beyond = edge.time_ns + reach_ns as i64;
            if !is_gap(edge.time_ns.min(beyond), edge.time_ns.max(beyond)) {
                seen.edges.push(Edge {
                    lidar,
                    ring,
                    ..edge
                });
            }
        }
    }
}

fn add_echoes(seen: &mut Seen, lidar: usize, ring: usize, run: &[LineEcho]) {
    for (place, echo) in run.iter().enumerate() {
        let range_m = echo.xyz_m.norm();
        seen.echoes.push(Echo {
            time_ns: echo.time_ns,
            lidar,
            ring,
            direction: echo.xyz_m / range_m,
            range_m,
            from_end: place.min(run.len() - 1 - place) as u32,
        });
    }
}

fn end(run: &[LineEcho], period_ns: f64, is_last: bool) -> Edge {
    let at = |from_end: usize| match is_last {
        true => run[run.len() - 1 - from_end],
        false => run[from_end],
    };
    let (last, inner) = (at(0), at(TURN_ECHOES.min(run.len() - 1)));
    let shots = ((last.time_ns - inner.time_ns).abs() as f64 / period_ns)
        .round()
        .max(1.0);
    let (hit, before) = (last.xyz_m.normalize(), inner.xyz_m.normalize());
    Edge {
        time_ns: last.time_ns,
        lidar: 0,
        ring: 0,
        hit,
        miss: (hit + (hit - before) / shots).normalize(),
        range_m: at(2).xyz_m.norm(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_of_a_beam_and_ends_of_a_side_come_together() {
        let line = |time_ns: i64| -> Vec<LineEcho> {
            let at = |k: i64| LineEcho {
                time_ns: time_ns + k,
                xyz_m: Vector3::new(0.01 * k as f64, 20.0, 0.0),
            };
            (0..6).map(at).collect()
        };
        let mut seen = Seen::default();
        for (ring, time_ns) in [(1, 0), (0, 100), (1, 200)] {
            add_line(&mut seen, 0, ring, &line(time_ns), 1.0, |_, _| false);
        }
        seen.sort();
        let rings: Vec<usize> = seen.echoes.iter().map(|echo| echo.ring).collect();
        assert_eq!(rings, [[0; 6], [1; 6], [1; 6]].concat());
        let times: Vec<i64> = seen.edges.iter().map(|edge| edge.time_ns).collect();
        assert_eq!(times, [105, 100, 5, 205, 0, 200]);
    }
}
