//! The drawing of a blade as the estimator uses it: checked once, then asked at any arc length.

use nalgebra::{Matrix3, Vector3};

use super::table;
use crate::error::InvalidValue;

/// Columns of the drawing by station, SI, as in the file of the nominal geometry.
#[derive(Debug, Clone, Default)]
pub struct Stations {
    /// Arc length from the root along the neutral axis, metres, rising.
    pub s_m: Vec<f64>,
    /// Chord, metres.
    pub chord_m: Vec<f64>,
    /// Twist, rad; positive turns the trailing edge towards the suction side.
    pub twist_rad: Vec<f64>,
    /// Offset of the stress-free axis towards the suction side, metres.
    pub prebend_m: Vec<f64>,
    /// Where the axis crosses the chord, from the leading edge.
    pub axis_fraction: Vec<f64>,
    /// Bending stiffness in the plane of the chord, N m^2.
    pub ei_edge_nm2: Vec<f64>,
    /// Bending stiffness across the chord, N m^2.
    pub ei_flap_nm2: Vec<f64>,
    /// Torsional stiffness, N m^2.
    pub gj_nm2: Vec<f64>,
}

/// Outlines of sections, from the leading edge over the suction side and back, chord lengths.
#[derive(Debug, Clone, Default)]
pub struct Outlines {
    /// Arc lengths of the outlines, metres, rising.
    pub s_m: Vec<f64>,
    /// Points per outline, each `[x_c, y_c]`; the same number at every station.
    pub points: Vec<Vec<[f64; 2]>>,
}

/// A checked drawing and how the blade is clamped.
#[derive(Debug, Clone)]
pub struct Design {
    stations: Stations,
    outlines: Outlines,
    lean: Vec<f64>,
    /// World directions of the clamp: towards the trailing edge, across, along the span.
    pub clamp: Matrix3<f64>,
    /// 1 where the suction side lies on the side of the clamp's second direction, else -1.
    pub hand: f64,
}

impl Design {
    /// Checks a drawing; `leading_edge` and `suction_side` are world directions at zero twist.
    ///
    /// # Errors
    /// [`InvalidValue`] naming the column that cannot be used.
    pub fn new(
        stations: Stations,
        outlines: Outlines,
        leading_edge: &Vector3<f64>,
        suction_side: &Vector3<f64>,
    ) -> Result<Self, InvalidValue> {
        check_stations(&stations)?;
        check_outlines(&outlines)?;
        let chord = -leading_edge.normalize();
        let across = Vector3::z().cross(&chord);
        let hand = across.dot(suction_side);
        if !(hand.abs() > 0.9 && chord.z.abs() < 0.2) {
            return Err(InvalidValue {
                name: "suction_side",
                expected: "at right angles to leading_edge, both across z".into(),
                found: format!("{suction_side:?} and {leading_edge:?}"),
            });
        }
        let lean = table::slopes(&stations.s_m, &stations.prebend_m);
        Ok(Self {
            lean,
            stations,
            outlines,
            clamp: Matrix3::from_columns(&[chord, across, Vector3::z()]),
            hand: hand.signum(),
        })
    }

    /// Arc length of the tip, metres.
    pub fn length_m(&self) -> f64 {
        self.stations.s_m[self.stations.s_m.len() - 1]
    }

    /// The stations.
    pub fn stations(&self) -> &Stations {
        &self.stations
    }

    /// Number of points of an outline.
    pub fn outline_len(&self) -> usize {
        self.outlines.points[0].len()
    }

    /// Chord at an arc length, metres.
    pub fn chord_m(&self, s_m: f64) -> f64 {
        table::linear(&self.stations.s_m, &self.stations.chord_m, s_m)
    }

    /// Twist at an arc length, rad, as the drawing counts it.
    pub fn twist_rad(&self, s_m: f64) -> f64 {
        table::linear(&self.stations.s_m, &self.stations.twist_rad, s_m)
    }

    /// Chord fraction of the neutral axis at an arc length.
    pub fn axis_fraction(&self, s_m: f64) -> f64 {
        table::linear(&self.stations.s_m, &self.stations.axis_fraction, s_m)
    }

    /// Edgewise, flapwise and torsional stiffness at an arc length, N m^2.
    pub fn stiffness_nm2(&self, s_m: f64) -> [f64; 3] {
        let at = |column: &[f64]| table::logarithmic(&self.stations.s_m, column, s_m);
        [
            at(&self.stations.ei_edge_nm2),
            at(&self.stations.ei_flap_nm2),
            at(&self.stations.gj_nm2),
        ]
    }

    /// Slope of the stress-free axis towards the suction side at an arc length.
    pub fn lean(&self, s_m: f64) -> f64 {
        table::linear(&self.stations.s_m, &self.lean, s_m)
    }

    /// Chord direction (to the trailing edge) and its normal (to the suction side) in the
    /// directions of the clamp.
    pub fn directions(&self, s_m: f64) -> [Vector3<f64>; 2] {
        let (sin, cos) = self.twist_rad(s_m).sin_cos();
        [
            Vector3::new(cos, self.hand * sin, 0.0),
            Vector3::new(-sin, self.hand * cos, 0.0),
        ]
    }

    /// Outline about the axis in the directions of the clamp, metres, and the place of each of its
    /// points along the chord.
    pub fn outline(&self, s_m: f64) -> Vec<[f64; 2]> {
        let (chord_m, fraction) = (self.chord_m(s_m), self.axis_fraction(s_m));
        let [along, normal] = self.directions(s_m);
        let place = |[x_c, y_c]: [f64; 2]| {
            let point = (along * (x_c - fraction) + normal * y_c) * chord_m;
            [point.x, point.y]
        };
        self.contour(s_m).into_iter().map(place).collect()
    }

    /// Outline in chord lengths.
    pub fn contour(&self, s_m: f64) -> Vec<[f64; 2]> {
        let (index, share) = table::interval(&self.outlines.s_m, s_m);
        let (a, b) = (
            &self.outlines.points[index],
            &self.outlines.points[index + 1],
        );
        let blend = |i: usize| [0, 1].map(|k| a[i][k] * (1.0 - share) + b[i][k] * share);
        (0..a.len()).map(blend).collect()
    }
}

fn check_stations(stations: &Stations) -> Result<(), InvalidValue> {
    let columns: [(&'static str, &[f64]); 7] = [
        ("chord_m", &stations.chord_m),
        ("twist_deg", &stations.twist_rad),
        ("prebend_m", &stations.prebend_m),
        ("axis_fraction", &stations.axis_fraction),
        ("ei_edge_nm2", &stations.ei_edge_nm2),
        ("ei_flap_nm2", &stations.ei_flap_nm2),
        ("gj_nm2", &stations.gj_nm2),
    ];
    check_rising("s_m", &stations.s_m)?;
    let rows = stations.s_m.len();
    for (place, (name, column)) in columns.into_iter().enumerate() {
        let is_positive = place == 0 || place > 3;
        let is_good = |value: &f64| value.is_finite() && (!is_positive || *value > 0.0);
        if column.len() != rows || !column.iter().all(is_good) {
            return Err(InvalidValue {
                name,
                expected: format!(
                    "{rows} numbers{}",
                    if is_positive { " above 0" } else { "" }
                ),
                found: format!("{} numbers", column.len()),
            });
        }
    }
    Ok(())
}

fn check_outlines(outlines: &Outlines) -> Result<(), InvalidValue> {
    check_rising("contours.s_m", &outlines.s_m)?;
    let count = outlines.points.first().map_or(0, Vec::len);
    let is_good = |outline: &Vec<[f64; 2]>| {
        outline.len() == count && outline.iter().flatten().all(|value| value.is_finite())
    };
    if count < 4
        || outlines.points.len() != outlines.s_m.len()
        || !outlines.points.iter().all(is_good)
    {
        return Err(InvalidValue {
            name: "contours",
            expected: "outlines of one number of points, at least 4, at every station".into(),
            found: format!(
                "{} outlines at {} stations",
                outlines.points.len(),
                outlines.s_m.len()
            ),
        });
    }
    Ok(())
}

fn check_rising(name: &'static str, s_m: &[f64]) -> Result<(), InvalidValue> {
    let is_rising = s_m.windows(2).all(|pair| pair[1] > pair[0]);
    if s_m.len() < 2 || !is_rising || !s_m.iter().all(|s| s.is_finite()) {
        return Err(InvalidValue {
            name,
            expected: "two or more rising numbers".into(),
            found: format!("{} numbers", s_m.len()),
        });
    }
    Ok(())
}
