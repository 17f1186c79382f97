//! The pace of a stream: the maker does not state how fast all models send, so that the packets tell.

use crate::packet::Model;

/// A pace within this share of the usual one is the usual one.
const USUAL: f64 = 0.02;
/// Paces are told apart in steps of this factor, so that there are not too many of them.
const STEP: f64 = 1.002;
/// Paces beyond this factor are none.
const MOST: f64 = 64.0;
/// Steps of time that tell a pace.
const ENOUGH: usize = 3;

/// How much slower than usual the packets of a stream follow each other: the median over them; `None`
/// where they do not tell, or come at the usual pace.
pub fn factor(model: &dyn Model, packets: &[&[u8]]) -> Option<f64> {
    let heads: Vec<_> = packets.iter().filter_map(|p| model.head(p)).collect();
    let usual_ns = model.period_ns(heads.first()?.return_mode) as f64;
    let steps = heads
        .windows(2)
        .map(|pair| pair[1].device_ns.saturating_sub(pair[0].device_ns));
    let mut steps: Vec<i64> = steps.filter(|step| *step > 0).collect();
    steps.sort_unstable();
    let median_ns = *steps.get(steps.len() / 2)? as f64;
    let factor = median_ns / usual_ns;
    let is_told = steps.len() >= ENOUGH && (MOST.recip()..MOST).contains(&factor);
    (is_told && (factor - 1.0).abs() > USUAL).then(|| STEP.powf((factor.ln() / STEP.ln()).round()))
}
