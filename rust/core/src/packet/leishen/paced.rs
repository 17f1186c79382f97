//! Models as single units send them: each kind once, for as long as the program runs.

use std::sync::Mutex;

/// More of them than there are paces and models.
const MOST: usize = 200_000;

/// The units of one series whose pace or clock is not the usual one.
pub struct Units<M: 'static>(Mutex<Vec<&'static M>>);

impl<M: PartialEq> Units<M> {
    /// None yet.
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The one like `model`, which becomes it where there is none; `None` where there are too many.
    pub fn like(&self, model: M) -> Option<&'static M> {
        let mut known = self.0.lock().ok()?;
        if let Some(same) = known.iter().find(|other| ***other == model) {
            return Some(same);
        }
        (known.len() < MOST).then(|| {
            let leaked: &'static M = Box::leak(Box::new(model));
            known.push(leaked);
            leaked
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_units_are_one() {
        static UNITS: Units<u32> = Units::new();
        let (one, other) = (UNITS.like(7).unwrap(), UNITS.like(8).unwrap());
        assert!(std::ptr::eq(one, UNITS.like(7).unwrap()));
        assert_eq!((*one, *other), (7, 8));
    }
}
