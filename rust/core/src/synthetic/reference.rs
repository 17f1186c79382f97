//! Published reference blades: geometry, stiffness and mass by station.

use super::interpolate::{linear, logarithmic};
use crate::error::InvalidValue;

/// A blade by station, as its drawing gives it; columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stations {
    /// Arc length from the root along the axis, metres.
    pub s_m: Vec<f64>,
    /// Chord, metres.
    pub chord_m: Vec<f64>,
    /// Twist, rad; positive turns the trailing edge towards the suction side.
    pub twist_rad: Vec<f64>,
    /// Thickness over chord.
    pub rel_thickness: Vec<f64>,
    /// Offset of the stress-free axis towards the suction side, metres.
    pub prebend_m: Vec<f64>,
    /// Where the axis crosses the chord, from the leading edge.
    pub axis_fraction: Vec<f64>,
    /// Bending stiffness in the plane of the chord, N m^2.
    pub ei_edge_nm2: Vec<f64>,
    /// Bending stiffness across the chord, N m^2.
    pub ei_flap_nm2: Vec<f64>,
    /// Coupling of both bendings, N m^2: moment about the chord per curvature about its normal.
    pub ei_cross_nm2: Vec<f64>,
    /// Torsional stiffness, N m^2.
    pub gj_nm2: Vec<f64>,
    /// Mass per length, kg/m.
    pub mass_kg_m: Vec<f64>,
}

/// Names of the reference blades with their tables.
const TABLES: [(&str, &str); 5] = [
    ("iea15-110m", include_str!("data/iea15_110m.csv")),
    ("iea15-117m", include_str!("data/iea15_117m.csv")),
    ("iea22-138m", include_str!("data/iea22_138m.csv")),
    ("bar-usc-100m", include_str!("data/bar_usc_100m.csv")),
    ("nrel5-61m", include_str!("data/nrel5_61m.csv")),
];

/// Names that [`Stations::reference`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    TABLES.iter().map(|(name, _)| *name)
}

/// Numbers of a table of this module: comments, one header line, rows of commas.
pub(super) fn numbers(table: &str) -> Vec<Vec<f64>> {
    let lines = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines
        .map(|line| {
            line.split(',')
                .filter_map(|cell| cell.parse().ok())
                .collect()
        })
        .collect()
}

impl Stations {
    /// The reference blade of this name, stretched to `length_m` where one is given.
    ///
    /// # Errors
    /// [`InvalidValue`] for an unknown name or a length that is not positive.
    pub fn reference(name: &str, length_m: Option<f64>) -> Result<Self, InvalidValue> {
        let table = TABLES.iter().find(|(known, _)| *known == name);
        let (_, table) = table.ok_or_else(|| InvalidValue {
            name: "blade.reference",
            expected: names().collect::<Vec<_>>().join(", "),
            found: name.into(),
        })?;
        let own = Self::parse(table);
        match length_m {
            None => Ok(own),
            Some(length) if length > 10.0 && length < 300.0 => {
                let scale = length / own.length_m();
                Ok(own.stretched(scale))
            }
            Some(length) => Err(InvalidValue {
                name: "blade.length_m",
                expected: "between 10 and 300 m".into(),
                found: length.to_string(),
            }),
        }
    }

    fn parse(table: &str) -> Self {
        let mut stations = Self::default();
        for row in numbers(table) {
            for (column, value) in stations.columns().into_iter().zip(row) {
                column.push(value);
            }
        }
        for twist in &mut stations.twist_rad {
            *twist = twist.to_radians();
        }
        stations
    }

    fn columns(&mut self) -> [&mut Vec<f64>; 11] {
        [
            &mut self.s_m,
            &mut self.chord_m,
            &mut self.twist_rad,
            &mut self.rel_thickness,
            &mut self.prebend_m,
            &mut self.axis_fraction,
            &mut self.ei_edge_nm2,
            &mut self.ei_flap_nm2,
            &mut self.ei_cross_nm2,
            &mut self.gj_nm2,
            &mut self.mass_kg_m,
        ]
    }

    /// The geometrically similar blade: stiffness grows with the fourth power, mass with the second.
    fn stretched(mut self, scale: f64) -> Self {
        let powers = [1, 1, 0, 0, 1, 0, 4, 4, 4, 4, 2];
        for (column, power) in self.columns().into_iter().zip(powers) {
            for value in column {
                *value *= scale.powi(power);
            }
        }
        self
    }

    /// Arc length from root to tip, metres.
    pub fn length_m(&self) -> f64 {
        self.s_m.last().copied().unwrap_or(0.0)
    }

    /// A column at arc length `s_m`, linear between stations.
    pub fn at(&self, column: &[f64], s_m: f64) -> f64 {
        linear(&self.s_m, column, s_m)
    }

    /// A stiffness or mass at arc length `s_m`, linear in its logarithm.
    pub fn strength(&self, column: &[f64], s_m: f64) -> f64 {
        logarithmic(&self.s_m, column, s_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reference_blade_is_complete() {
        for name in names() {
            let mut blade = Stations::reference(name, None).unwrap();
            let rows = blade.s_m.len();
            assert!(rows > 25, "{name}");
            assert!(blade.columns().iter().all(|column| column.len() == rows));
            assert!(blade.s_m.windows(2).all(|pair| pair[1] > pair[0]), "{name}");
            assert!(blade.ei_flap_nm2.iter().all(|value| *value > 0.0));
        }
    }

    #[test]
    fn a_stretched_blade_keeps_its_proportions() {
        let own = Stations::reference("iea15-117m", None).unwrap();
        let longer = Stations::reference("iea15-117m", Some(2.0 * own.length_m())).unwrap();
        assert!((longer.chord_m[3] / own.chord_m[3] - 2.0).abs() < 1e-12);
        assert!((longer.gj_nm2[3] / own.gj_nm2[3] - 16.0).abs() < 1e-9);
        assert_eq!(longer.twist_rad, own.twist_rad);
        assert!(Stations::reference("iea15", None).is_err());
    }
}
