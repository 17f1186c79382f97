//! What is decoded of each model and how that was proven: the one table that the page of sensors is made of.

mod hesai;
mod leishen;
mod livox;
mod ouster;
mod robosense;
mod velodyne;

/// How well the points of a model are known to be right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// Points of real packets agree with an independent decoder's; says which packets and decoder.
    RealPackets(&'static str),
    /// Real packets of a sibling with the same layout and timing; only the angles are the model's own.
    Sibling(&'static str),
    /// Numbers that the manual works out for one point come out; the rest is round trip.
    WorkedExample(&'static str),
    /// What is written is read again; layout and tables come from manuals and the maker's programs.
    RoundTrip,
}

impl Proof {
    /// For the page.
    pub fn describe(self) -> String {
        match self {
            Self::RealPackets(what) => {
                format!("real packets against an independent decoder: {what}")
            }
            Self::Sibling(id) => format!(
                "round trip only; real packets of `{id}`, whose layout and timing it shares"
            ),
            Self::WorkedExample(what) => {
                format!("worked example of the manual: {what}; else round trip only")
            }
            Self::RoundTrip => "round trip only".into(),
        }
    }
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Model.
    pub id: &'static str,
    /// How its packets are told from others.
    pub recognised: &'static str,
    /// Returns that are told apart.
    pub returns: &'static str,
    /// Files of a unit that are taken, and what happens without them.
    pub unit: &'static str,
    /// How it was proven.
    pub proof: Proof,
}

const fn row(
    id: &'static str,
    recognised: &'static str,
    returns: &'static str,
    unit: &'static str,
    proof: Proof,
) -> Row {
    Row {
        id,
        recognised,
        returns,
        unit,
        proof,
    }
}

/// Clouds that come without packets.
static CLOUDS: &[Row] = &[row(
    "points",
    "clouds of a bag with a time per point; the project's own magic",
    "one",
    "none",
    Proof::RoundTrip,
)];

/// All models, family by family.
pub fn rows() -> impl Iterator<Item = &'static Row> {
    let families = [
        velodyne::ROWS,
        hesai::ROWS,
        ouster::ROWS,
        robosense::ROWS,
        leishen::ROWS,
        livox::ROWS,
        CLOUDS,
    ];
    families.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::MODELS;

    #[test]
    fn every_model_has_one_row_and_every_row_a_model() {
        for model in MODELS {
            let rows = rows().filter(|row| row.id == model.id());
            assert_eq!(rows.count(), 1, "{}", model.id());
        }
        assert_eq!(rows().count(), MODELS.len());
    }

    #[test]
    fn siblings_are_proven_on_real_packets() {
        for row in rows() {
            if let Proof::Sibling(id) = row.proof {
                let sibling = rows().find(|row| row.id == id).unwrap();
                assert!(matches!(sibling.proof, Proof::RealPackets(_)), "{id}");
            }
        }
    }
}
