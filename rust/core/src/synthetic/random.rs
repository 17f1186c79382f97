//! Seeded streams of random numbers, one per subject, so that no thread's pace changes a number.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What a stream of random numbers is for; streams of different subjects are independent.
#[derive(Debug, Clone, Copy)]
#[repr(u64)]
pub enum Subject {
    /// How the built blade differs from the drawing.
    Blade = 1,
    /// Heights of the ground.
    Ground = 2,
    /// Tilts, clocks and offsets of the sensors.
    Lidar = 3,
    /// Noise of the shots of one packet.
    Packet = 4,
    /// Loss, duplication and delay of packets.
    Network = 5,
    /// Survey and channels.
    Survey = 6,
    /// A drawing that nobody published.
    Drawing = 7,
}

/// Random numbers of one subject and its part (such as lidar and packet).
#[derive(Debug, Clone)]
pub struct Stream {
    source: ChaCha8Rng,
    spare: Option<f64>,
}

impl Stream {
    /// The stream of `subject` and `part` under `seed`.
    pub fn new(seed: u64, subject: Subject, part: [u64; 2]) -> Self {
        let mut key = [0; 32];
        let words = [seed, subject as u64, part[0], part[1]];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Self {
            source: ChaCha8Rng::from_seed(key),
            spare: None,
        }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.source.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        if let Some(value) = self.spare.take() {
            return value;
        }
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Exponential with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.uniform()).ln()
    }

    /// Whether something of this probability happens.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ_by_part() {
        let draw = |part| Stream::new(7, Subject::Packet, part).uniform();
        assert_eq!(draw([1, 2]), draw([1, 2]));
        assert_ne!(draw([1, 2]), draw([2, 1]));
    }

    #[test]
    fn normal_numbers_have_unit_variance() {
        let mut stream = Stream::new(1, Subject::Survey, [0, 0]);
        let values: Vec<f64> = (0..20_000).map(|_| stream.normal()).collect();
        let mean = values.iter().sum::<f64>() / 2e4;
        let variance = values.iter().map(|v| v * v).sum::<f64>() / 2e4;
        // Standard errors: 0.007 of the mean, 0.010 of the variance; four of each.
        assert!(
            mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04,
            "{mean} {variance}"
        );
    }
}
