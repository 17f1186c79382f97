//! Returns on their way into the columns of a cloud. Each column is filled in one go: pushing every return
//! into all of them at once takes longer.

use super::Decoded;
use crate::cloud::Return;

/// Returns of one packet.
#[derive(Debug, Default)]
pub struct Batch {
    returns: Vec<Return>,
    encoder_rad: Vec<f32>,
}

impl Batch {
    /// Adds a return, with the encoder's azimuth.
    #[inline]
    pub fn push(&mut self, echo: Return, encoder_rad: f32) {
        self.returns.push(echo);
        self.encoder_rad.push(encoder_rad);
    }

    /// Appends the returns to the columns and keeps the room for those of the next packet.
    pub fn flush(&mut self, out: &mut Decoded) {
        let (cloud, returns) = (&mut out.cloud, || self.returns.iter());
        out.encoder_rad.extend_from_slice(&self.encoder_rad);
        cloud.xyz_m.extend(returns().map(|echo| echo.xyz_m));
        cloud.time_ns.extend(returns().map(|echo| echo.time.0));
        cloud.range_m.extend(returns().map(|echo| echo.range_m));
        cloud
            .azimuth_rad
            .extend(returns().map(|echo| echo.azimuth_rad));
        cloud.ring.extend(returns().map(|echo| echo.ring));
        cloud.intensity.extend(returns().map(|echo| echo.intensity));
        cloud
            .return_index
            .extend(returns().map(|echo| echo.return_index));
        cloud
            .return_kind
            .extend(returns().map(|echo| echo.return_kind));
        cloud.packet.extend(returns().map(|echo| echo.packet));
        cloud.block.extend(returns().map(|echo| echo.block));
        self.returns.clear();
        self.encoder_rad.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::ReturnKind;
    use crate::time::Timestamp;

    fn echo(number: u8) -> Return {
        Return {
            xyz_m: [f32::from(number), 1.0, 2.0],
            time: Timestamp(10 + i64::from(number)),
            range_m: 20.0 + f32::from(number),
            azimuth_rad: 0.1 * f32::from(number),
            ring: 30 + u16::from(number),
            intensity: 40 + u16::from(number),
            return_index: number,
            return_kind: ReturnKind::Last,
            packet: 50 + u32::from(number),
            block: 60 + u16::from(number),
        }
    }

    #[test]
    fn a_batch_keeps_every_column_of_every_return() {
        let mut out = Decoded::default();
        let mut batch = Batch::default();
        for numbers in [0..3, 3..5] {
            numbers.for_each(|number| batch.push(echo(number), f32::from(number)));
            batch.flush(&mut out);
        }
        let all: Vec<Return> = out.cloud.iter().collect();
        assert_eq!(all, (0..5).map(echo).collect::<Vec<_>>());
        assert_eq!(out.encoder_rad, [0.0, 1.0, 2.0, 3.0, 4.0]);
    }
}
