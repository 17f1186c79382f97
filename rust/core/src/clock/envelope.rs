//! Lower envelope of noisy offsets over time, in bounded memory.

use crate::time::{NANOS_PER_SECOND, Timestamp};

/// When there are so many bins, neighbours are joined and bins become twice as wide.
const MAX_BINS: usize = 1024;
/// Drift is not estimated over less than this.
const MIN_SPAN_NS: i64 = 10 * NANOS_PER_SECOND;
/// Bins that lie higher than this above the line beneath all met a stalled host; nanoseconds.
const NEAR_NS: f64 = 2e6;

/// Smallest offset of each bin of time.
#[derive(Debug, Clone)]
pub struct Envelope {
    bins: Vec<Bin>,
    width_ns: i64,
    /// Where the newest bin ends.
    end: Timestamp,
    packets: u64,
}

#[derive(Debug, Clone, Copy)]
struct Bin {
    device: Timestamp,
    offset_ns: i64,
}

/// Offset as a line over device time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub reference: Timestamp,
    pub offset_ns: i64,
    pub slope: f64,
}

impl Default for Envelope {
    fn default() -> Self {
        Self {
            bins: Vec::new(),
            width_ns: NANOS_PER_SECOND,
            end: Timestamp(i64::MIN),
            packets: 0,
        }
    }
}

impl Envelope {
    /// Takes one offset; times may run back a little, which falls into the newest bin.
    pub fn add(&mut self, device: Timestamp, offset_ns: i64) {
        self.packets += 1;
        let bin = Bin { device, offset_ns };
        let first = self.bins.first().map_or(device, |bin| bin.device);
        match self.bins.last_mut() {
            Some(last) if device < self.end => {
                if offset_ns >= last.offset_ns {
                    return;
                }
                // The first bin's time is where all bins are counted from.
                let is_first = last.device == first;
                let device = if is_first { first } else { device };
                *last = Bin { device, offset_ns };
            }
            _ => self.bins.push(bin),
        }
        if self.bins.len() > MAX_BINS {
            self.widen();
        }
        self.end = self.newest_end();
    }

    fn newest_end(&self) -> Timestamp {
        let ends = self.bins.first().zip(self.bins.last());
        ends.map_or(Timestamp(i64::MIN), |(first, last)| {
            let number = (last.device - first.device).max(0) / self.width_ns;
            first.device + number.saturating_add(1).saturating_mul(self.width_ns)
        })
    }

    fn widen(&mut self) {
        self.width_ns = self.width_ns.saturating_mul(2);
        let lower = |pair: &[Bin]| {
            *pair
                .iter()
                .min_by_key(|bin| bin.offset_ns)
                .unwrap_or(&pair[0])
        };
        self.bins = self.bins.chunks(2).map(lower).collect();
    }

    /// Packets taken.
    pub fn packets(&self) -> u64 {
        self.packets
    }

    /// Device time of the first of them.
    pub fn from(&self) -> Timestamp {
        self.bins.first().map_or(Timestamp(0), |bin| bin.device)
    }

    /// Smallest offset of the newest two bins.
    pub fn recent_ns(&self) -> Option<i64> {
        let newest = &self.bins[self.bins.len().saturating_sub(2)..];
        newest.iter().map(|bin| bin.offset_ns).min()
    }

    /// Share of the bins whose smallest offset is within `limit_ns` of 0.
    pub fn share_within(&self, limit_ns: i64) -> f64 {
        let near = self
            .bins
            .iter()
            .filter(|bin| bin.offset_ns.abs() <= limit_ns);
        near.count() as f64 / self.bins.len().max(1) as f64
    }

    /// The line along the lower envelope: least squares through the bins near the line beneath all
    /// of them, then moved down to touch the lowest.
    pub fn line(&self) -> Line {
        let Some((first, last)) = self.bins.first().zip(self.bins.last()) else {
            return Line {
                reference: Timestamp(0),
                offset_ns: 0,
                slope: 0.0,
            };
        };
        let origin = *first;
        let points: Vec<(f64, f64)> = self.bins.iter().map(|bin| relative(bin, &origin)).collect();
        let slope = if last.device - first.device < MIN_SPAN_NS {
            0.0
        } else {
            let beneath = supporting_line(&points);
            let near = points.iter().filter(|p| p.1 - beneath.at(p.0) < NEAR_NS);
            slope_of(near.copied()).unwrap_or(beneath.slope)
        };
        let level = points.iter().map(|(time, offset)| offset - slope * time);
        let lowest = level.fold(f64::INFINITY, f64::min);
        Line {
            reference: origin.device,
            offset_ns: origin.offset_ns.saturating_add(lowest.round() as i64),
            slope,
        }
    }
}

/// Time and offset after the first bin's, nanoseconds: small enough for exact sums.
fn relative(bin: &Bin, origin: &Bin) -> (f64, f64) {
    let offset_ns = bin.offset_ns.saturating_sub(origin.offset_ns);
    ((bin.device - origin.device) as f64, offset_ns as f64)
}

struct Beneath {
    through: (f64, f64),
    slope: f64,
}

impl Beneath {
    fn at(&self, time: f64) -> f64 {
        self.through.1 + self.slope * (time - self.through.0)
    }
}

/// The line beneath all points with the smallest sum of distances: the edge of the lower convex
/// hull over the mean of the times.
fn supporting_line(points: &[(f64, f64)]) -> Beneath {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for point in points {
        while hull.len() >= 2 && !turns_up(hull[hull.len() - 2], hull[hull.len() - 1], *point) {
            hull.pop();
        }
        hull.push(*point);
    }
    let mean = points.iter().map(|point| point.0).sum::<f64>() / points.len() as f64;
    let edge = hull.windows(2).find(|edge| edge[1].0 >= mean);
    let slope = edge.map_or(0.0, |e| (e[1].1 - e[0].1) / (e[1].0 - e[0].0));
    Beneath {
        through: edge.map_or(points[0], |edge| edge[0]),
        slope: if slope.is_finite() { slope } else { 0.0 },
    }
}

fn turns_up(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> bool {
    (b.0 - a.0) * (c.1 - a.1) > (b.1 - a.1) * (c.0 - a.0)
}

/// Slope of the least squares line; `None` for fewer than three points.
fn slope_of(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    let count = points.clone().count();
    let sum = points
        .clone()
        .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    let mean = (sum.0 / count as f64, sum.1 / count as f64);
    let spread: f64 = points.clone().map(|p| (p.0 - mean.0).powi(2)).sum();
    let joint: f64 = points.map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum();
    (count >= 3 && spread > 0.0).then_some(joint / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_stays_bounded_and_the_slope_survives_joining() {
        let mut envelope = Envelope::default();
        for second in 0..10_000_i64 {
            let device = Timestamp(second * NANOS_PER_SECOND);
            envelope.add(device, 5_000_000 + second * 10_000 + 70_000 * (second % 3));
        }
        assert!(envelope.bins.len() <= MAX_BINS);
        let line = envelope.line();
        assert!((line.slope - 1e-5).abs() < 1e-9, "{line:?}");
        assert!((line.offset_ns - 5_000_000).abs() < 20_000, "{line:?}");
    }

    #[test]
    fn short_captures_have_no_drift() {
        let mut envelope = Envelope::default();
        for (second, offset) in (0..).zip([30, 20, 40]) {
            envelope.add(Timestamp(second * NANOS_PER_SECOND), offset);
        }
        let line = envelope.line();
        assert_eq!((line.slope, line.offset_ns), (0.0, 20));
    }
}
