//! What the targets of single families share.

use lidar_deflect_core::packet::{Decoded, MODELS, Place, closest, companion};
use lidar_deflect_core::time::Timestamp;

/// Asks every model of a maker everything about a payload.
pub fn family(maker: &str, payload: &[u8]) {
    let _ = (closest(payload), companion(payload));
    let mut out = Decoded::default();
    for model in MODELS
        .iter()
        .filter(|model| model.title().starts_with(maker))
    {
        let _ = (
            model.recognise(payload),
            model.fits(payload),
            model.misfit(payload),
        );
        let _ = (
            model.is_sure(payload),
            model.suits(&[payload]),
            model.remarks(payload),
        );
        let tally = model.tally(payload);
        if let Some(head) = model.head(payload) {
            let _ = (
                head.paced(1e-8),
                head.arcs().count(),
                head.next_azimuth_rad(),
            );
        }
        let Ok(mut fitted) = model.fit(&[]) else {
            continue; // means nothing without the unit's own angles
        };
        out.clear();
        let place = Place {
            time: Timestamp(i64::MAX - 5),
            packet: u32::MAX,
            mean_rate_rad_per_ns: 1e-8,
        };
        fitted.decoder.decode(payload, place, &mut out);
        assert!(out.cloud.len() <= 1 << 16);
        // Of an encoder outside of all fields of an AT128 its decoder alone knows.
        assert!(out.cloud.len() <= tally.points as usize);
    }
}
