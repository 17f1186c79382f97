//! From the sensors to the recording: loss, duplicates, delays, other traffic.

use std::net::SocketAddr;

use super::lidar::Lidar;
use super::random::{Stream, Subject};
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// What the network does to packets.
#[derive(Debug, Clone, Copy, Default)]
pub struct NetworkPlan {
    /// Probability that a packet is lost by itself.
    pub loss: f64,
    /// Bursts of loss per second and sensor.
    pub bursts_per_s: f64,
    /// Mean number of packets in a burst.
    pub burst_packets: f64,
    /// Probability that a packet arrives twice.
    pub duplicates: f64,
    /// Probability that a packet arrives late, behind its successors.
    pub late: f64,
    /// Mean of the random part of the delay of every packet, seconds.
    pub jitter_s: f64,
    /// Foreign datagrams per second, of each kind.
    pub foreign_hz: f64,
    /// Position packets per second and sensor.
    pub position_hz: f64,
}

/// What happens to one packet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fate {
    /// It never arrives.
    pub lost: bool,
    /// It arrives twice.
    pub doubled: bool,
    /// Time on the way, ns.
    pub delay_ns: i64,
}

/// A datagram as the host receives it.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// When.
    pub time: Timestamp,
    /// Number that orders arrivals of equal time.
    pub order: u64,
    /// From where.
    pub source: SocketAddr,
    /// To where.
    pub destination: SocketAddr,
    /// What.
    pub payload: Vec<u8>,
}

const SHORTEST_DELAY_NS: f64 = 120e3;
/// Late packets arrive within this, less than a receiver's patience of 50 ms.
const LATEST_S: f64 = 0.03;
/// First and last packets that always arrive: without a neighbour, a loss leaves no trace.
const SPARED: usize = 3;

impl NetworkPlan {
    /// Fates of the `packets` of sensor `index`, in the order of sending.
    pub fn fates(&self, seed: u64, index: usize, packets: u32, packet_s: f64) -> Vec<Fate> {
        let mut stream = Stream::new(seed, Subject::Network, [index as u64, 0]);
        let mut burst_left = 0.0;
        let mut fates: Vec<Fate> = (0..packets)
            .map(|_| self.fate(&mut stream, &mut burst_left, packet_s))
            .collect();
        let count = fates.len();
        for (i, fate) in fates.iter_mut().enumerate() {
            fate.lost &= i >= SPARED && i + SPARED < count;
        }
        fates
    }

    fn fate(&self, stream: &mut Stream, burst_left: &mut f64, packet_s: f64) -> Fate {
        if stream.happens(self.bursts_per_s * packet_s) {
            *burst_left = 1.0 + (stream.exponential() * self.burst_packets).floor();
        }
        let in_burst = *burst_left >= 1.0;
        *burst_left -= 1.0;
        let lost = stream.happens(self.loss) || in_burst;
        let jitter_ns = self.jitter_s * 1e9 * stream.exponential();
        let late_s = stream.between(0.003, LATEST_S);
        let late_ns = if stream.happens(self.late) {
            late_s * 1e9
        } else {
            0.0
        };
        Fate {
            lost,
            doubled: stream.happens(self.duplicates) && !lost,
            delay_ns: (SHORTEST_DELAY_NS + jitter_ns + late_ns) as i64,
        }
    }

    /// Foreign datagrams and position packets from `from_ns` to `to_ns` of scene time.
    pub fn other(
        &self,
        lidars: &[Lidar],
        start: Timestamp,
        from_ns: i64,
        to_ns: i64,
    ) -> Vec<Arrival> {
        let mut arrivals = Vec::new();
        for number in ticks(self.foreign_hz, from_ns, to_ns) {
            let time = start + tick_ns(self.foreign_hz, number);
            let neighbour = SocketAddr::from(([192, 168, 1, 50], 1900));
            let group = SocketAddr::from(([239, 255, 255, 250], 1900));
            arrivals.push(arrival(
                time,
                0,
                neighbour,
                group,
                b"M-SEARCH * HTTP/1.1\r\n".to_vec(),
            ));
            if let Some(lidar) = lidars.first() {
                let payload = vec![(number % 251) as u8; 40];
                let (source, host) = (lidar.source(), lidar.destination(lidar.plan.port));
                arrivals.push(arrival(time + 7_000, 1, source, host, payload));
            }
        }
        let told = lidars.iter().enumerate();
        for (index, lidar) in told.filter(|(_, lidar)| lidar.plan.sensor.writer.has_position()) {
            for number in ticks(self.position_hz, from_ns, to_ns) {
                let scene_ns = tick_ns(self.position_hz, number) + 41_000 * (index as i64 + 1);
                let order = 2 + index as u64;
                let payload = position(lidar, start, scene_ns);
                let (source, host) = (lidar.source(), lidar.destination(8308));
                arrivals.push(arrival(start + scene_ns, order, source, host, payload));
            }
        }
        arrivals
    }
}

fn tick_ns(rate_hz: f64, number: u64) -> i64 {
    (number as f64 / rate_hz * 1e9) as i64
}

/// Numbers of the ticks of a rate within a span.
fn ticks(rate_hz: f64, from_ns: i64, to_ns: i64) -> std::ops::Range<u64> {
    let count = |ns: i64| (ns as f64 * 1e-9 * rate_hz).ceil() as u64;
    count(from_ns)..count(to_ns)
}

fn arrival(
    time: Timestamp,
    order: u64,
    source: SocketAddr,
    destination: SocketAddr,
    payload: Vec<u8>,
) -> Arrival {
    Arrival {
        time,
        order,
        source,
        destination,
        payload,
    }
}

impl Lidar {
    /// Where its packets come from.
    pub fn source(&self) -> SocketAddr {
        SocketAddr::from((self.plan.address, 2368))
    }

    /// Where its packets go to: the recording host.
    pub fn destination(&self, port: u16) -> SocketAddr {
        SocketAddr::from(([192, 168, 1, 100], port))
    }
}

/// A position packet; a locked clock comes with a sentence of its receiver.
fn position(lidar: &Lidar, start: Timestamp, scene_ns: i64) -> Vec<u8> {
    let mut bytes = vec![0; 512];
    let clock = &lidar.plan.clock;
    let device_ns = (scene_ns as f64 * (1.0 + clock.drift)) as i64 + clock.offset_ns;
    let micros = ((start + device_ns).0 / 1000).rem_euclid(3_600_000_000) as u32;
    bytes[198..202].copy_from_slice(&micros.to_le_bytes());
    if clock.locked {
        bytes[202] = 2;
        let day_s = (start + device_ns).0 / NANOS_PER_SECOND % 86_400;
        let (hour, minute, second) = (day_s / 3600, day_s / 60 % 60, day_s % 60);
        let body = format!(
            "GPRMC,{hour:02}{minute:02}{second:02},A,5500.000,N,01200.000,E,000.0,000.0,100624,000.0,E"
        );
        let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        let sentence = format!("${body}*{sum:02X}\r\n");
        bytes[206..206 + sentence.len()].copy_from_slice(sentence.as_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::velodyne::position::{Position, Pps};

    #[test]
    fn loss_comes_at_its_rate_and_in_bursts() {
        let plan = NetworkPlan {
            loss: 0.002,
            bursts_per_s: 0.5,
            burst_packets: 6.0,
            duplicates: 0.001,
            late: 0.001,
            jitter_s: 35e-6,
            ..Default::default()
        };
        let fates = plan.fates(1, 0, 100_000, 1.327e-3);
        let lost = fates.iter().filter(|fate| fate.lost).count();
        // 200 alone and 66 bursts of 1 + floor(Exp) = 6.5 packets: 630, give or take three sigma.
        assert!((450..830).contains(&lost), "{lost}");
        assert!(fates.windows(5).any(|run| run.iter().all(|fate| fate.lost)));
        let doubled = fates.iter().filter(|fate| fate.doubled).count();
        assert!((60..145).contains(&doubled), "{doubled}");
        assert!(!fates[0].lost && !fates[99_999].lost);
    }

    #[test]
    fn position_packets_are_read_as_such() {
        let mut lidar = super::super::lidar::tests::lidar(Default::default());
        lidar.plan.clock.locked = true;
        let bytes = position(&lidar, Timestamp(1_718_000_000_000_000_000), 0);
        let position = Position::new(&bytes).unwrap();
        assert!(position.pps() == Pps::Locked && position.has_fix());
        assert_eq!(position.timestamp_us(), 800_000_000);
    }

    #[test]
    fn ticks_of_neighbouring_spans_join() {
        let all: Vec<u64> = ticks(7.5, 0, 2_000_000_000).collect();
        let halves = ticks(7.5, 0, 777_777_777).chain(ticks(7.5, 777_777_777, 2_000_000_000));
        assert_eq!(all, halves.collect::<Vec<_>>());
    }
}
