//! Roughness of a surface: heights at the nodes of a grid, alike over a correlation length.
//!
//! A Matern field of smoothness one as a Gauss-Markov field on the grid: (kappa^2 - Laplace) f is
//! white, so its precision reaches two nodes far (Lindgren, Rue, Lindstrom 2011, eq. 10-12).

use std::f64::consts::PI;

/// How rough a surface is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Standard deviation of what is alike over the correlation length, metres.
    pub sigma_m: f64,
    /// Distance at which the correlation has fallen to 0.14, metres.
    pub correlation_m: f64,
    /// Standard deviation of what differs from point to point, metres.
    pub nugget_m: f64,
}

impl Roughness {
    /// Correlation of the heights of two points, without the nugget.
    pub fn correlation(&self, distance_m: f64) -> f64 {
        matern(self.kappa() * distance_m)
    }

    fn kappa(&self) -> f64 {
        8f64.sqrt() / self.correlation_m
    }
}

/// x K1(x): the Matern correlation of smoothness one.
fn matern(x: f64) -> f64 {
    if x < 1e-6 {
        return 1.0;
    }
    x * bessel_k1(x)
}

/// Modified Bessel function of the second kind, order one, to 1e-7 (Abramowitz and Stegun 9.8.3, 9.8.7, 9.8.8).
fn bessel_k1(x: f64) -> f64 {
    let series =
        |t: f64, coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x > 2.0 {
        const LARGE: [f64; 7] = [
            1.253_314_14,
            0.234_986_19,
            -0.036_556_20,
            0.015_042_68,
            -0.007_803_53,
            0.003_256_14,
            -0.000_682_45,
        ];
        return (-x).exp() / x.sqrt() * series(2.0 / x, &LARGE);
    }
    const I1: [f64; 7] = [
        0.5,
        0.878_905_94,
        0.514_988_69,
        0.150_849_34,
        0.026_587_33,
        0.003_015_32,
        0.000_324_11,
    ];
    const SMALL: [f64; 7] = [
        1.0,
        0.154_431_44,
        -0.672_785_79,
        -0.181_568_97,
        -0.019_194_02,
        -0.001_104_04,
        -0.000_046_86,
    ];
    let i1 = x * series((x / 3.75).powi(2), &I1);
    (x / 2.0).ln() * i1 + series((x / 2.0).powi(2), &SMALL) / x
}

/// A row of a sparse matrix: columns with their weights.
pub type Sparse = Vec<(usize, f64)>;

/// The nodes of a surface that something was measured near.
///
/// A surface has one layer of nodes for all who know where on it they measure, and one more for each who
/// does not: what turns freely sees the same heights elsewhere, and may not be held against the others.
#[derive(Debug, Clone)]
pub struct Field {
    roughness: Roughness,
    layers: Vec<Grid>,
    /// Height of each node, metres.
    pub heights_m: Vec<f64>,
}

/// One layer of nodes.
#[derive(Debug, Clone)]
struct Grid {
    spacing_m: f64,
    corner_m: [f64; 2],
    shape: [usize; 2],
    number: Vec<Option<usize>>,
}

/// The nodes around a place and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Around {
    /// Numbers of the four nodes.
    pub nodes: [usize; 4],
    /// Their weights, of sum one.
    pub weights: [f64; 4],
}

/// Nodes beyond the outermost place, so that the edge of the grid is not felt.
const HALO: usize = 2;
/// Nodes per correlation length.
const NODES_PER_LENGTH: f64 = 3.0;
/// A grid has at most so many places for nodes: coarser where the surface is larger.
const MOST_NODES: f64 = 16_000.0;
/// Share of the roughness that a blend between nodes one correlation length apart does not follow.
const BETWEEN_NODES: f64 = 0.9;

impl Field {
    /// A field at rest whose layers cover the places (u, v), metres.
    pub fn new(roughness: Roughness, layers_m: &[Vec<[f64; 2]>]) -> Self {
        let mut count = 0;
        let grid = |places_m: &Vec<[f64; 2]>| Grid::new(&roughness, places_m, &mut count);
        let layers = layers_m.iter().map(grid).collect();
        Self {
            roughness,
            layers,
            heights_m: vec![0.0; count],
        }
    }

    /// Distance between neighbouring nodes where it is largest, metres.
    pub fn spacing_m(&self) -> f64 {
        let layers = self.layers.iter();
        layers.map(|grid| grid.spacing_m).fold(0.0, f64::max)
    }

    /// Standard deviation of what a blend between nodes does not follow, metres.
    pub fn between_m(&self) -> f64 {
        let apart = self.spacing_m() / self.roughness.correlation_m;
        (BETWEEN_NODES * apart).min(1.0) * self.roughness.sigma_m
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.heights_m.len()
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.heights_m.is_empty()
    }

    /// How rough the surface is taken to be.
    pub fn roughness(&self) -> &Roughness {
        &self.roughness
    }

    /// The nodes of a layer around a place, None where one of them is not there.
    pub fn around(&self, layer: usize, place_m: &[f64; 2]) -> Option<Around> {
        self.layers.get(layer)?.around(place_m)
    }

    /// Rows W of the prior: the precision of the heights is W^T W.
    pub fn prior(&self) -> Vec<Sparse> {
        let layers = self.layers.iter();
        layers
            .flat_map(|grid| grid.prior(&self.roughness))
            .collect()
    }
}

impl Grid {
    /// Nodes near the places, numbered from `count` on.
    fn new(roughness: &Roughness, places_m: &[[f64; 2]], count: &mut usize) -> Self {
        let [low, high] = bounds(places_m);
        let area = (high[0] - low[0] + 1.0) * (high[1] - low[1] + 1.0);
        let spacing_m =
            (roughness.correlation_m / NODES_PER_LENGTH).max((area / MOST_NODES).sqrt());
        let corner_m = [0, 1].map(|k| low[k] - HALO as f64 * spacing_m);
        let shape = [0, 1].map(|k| ((high[k] - low[k]) / spacing_m) as usize + 2 + 2 * HALO);
        let mut grid = Self {
            spacing_m,
            corner_m,
            shape,
            number: vec![None; shape[0] * shape[1]],
        };
        grid.activate(places_m, count);
        grid
    }

    fn activate(&mut self, places_m: &[[f64; 2]], count: &mut usize) {
        let mut active = vec![false; self.number.len()];
        for place in places_m {
            let [i, j] = self.cell(place).map(|c| c.0);
            for a in (i + 1).saturating_sub(HALO)..(i + 1 + HALO).min(self.shape[0]) {
                for b in (j + 1).saturating_sub(HALO)..(j + 1 + HALO).min(self.shape[1]) {
                    active[self.place(a, b)] = true;
                }
            }
        }
        for (number, _) in self.number.iter_mut().zip(active).filter(|n| n.1) {
            *number = Some(*count);
            *count += 1;
        }
    }

    /// Nodes run along the shorter side first, which keeps neighbours close in number.
    fn place(&self, i: usize, j: usize) -> usize {
        match self.shape[0] >= self.shape[1] {
            true => i * self.shape[1] + j,
            false => j * self.shape[0] + i,
        }
    }

    /// Cell of a place and how far into it, in spacings, along both directions.
    fn cell(&self, place_m: &[f64; 2]) -> [(usize, f64); 2] {
        [0, 1].map(|k| {
            let t = (place_m[k] - self.corner_m[k]) / self.spacing_m;
            let cell = t.floor().clamp(0.0, (self.shape[k] - 2) as f64);
            (cell as usize, t - cell)
        })
    }

    fn around(&self, place_m: &[f64; 2]) -> Option<Around> {
        let [(i, a), (j, b)] = self.cell(place_m);
        if !(0.0..=1.0).contains(&a) || !(0.0..=1.0).contains(&b) {
            return None;
        }
        let node = |i, j| self.number[self.place(i, j)];
        let nodes = [
            node(i, j)?,
            node(i + 1, j)?,
            node(i, j + 1)?,
            node(i + 1, j + 1)?,
        ];
        Some(Around {
            nodes,
            weights: [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b],
        })
    }

    fn prior(&self, roughness: &Roughness) -> Vec<Sparse> {
        let (h2, kappa2) = (self.spacing_m.powi(2), roughness.kappa().powi(2));
        let scale = (h2 / (4.0 * PI * kappa2)).sqrt() / roughness.sigma_m;
        let mut rows = Vec::new();
        for i in 0..self.shape[0] {
            for j in 0..self.shape[1] {
                let Some(node) = self.number[self.place(i, j)] else {
                    continue;
                };
                let neighbours: Sparse = self.neighbours(i, j).map(|n| (n, -scale / h2)).collect();
                let own = scale * (kappa2 + neighbours.len() as f64 / h2);
                rows.push([vec![(node, own)], neighbours].concat());
            }
        }
        rows
    }

    fn neighbours(&self, i: usize, j: usize) -> impl Iterator<Item = usize> + '_ {
        let steps = [(-1isize, 0isize), (1, 0), (0, -1), (0, 1)];
        steps.into_iter().filter_map(move |(di, dj)| {
            let (a, b) = (i.checked_add_signed(di)?, j.checked_add_signed(dj)?);
            let inside = a < self.shape[0] && b < self.shape[1];
            inside.then(|| self.number[self.place(a, b)]).flatten()
        })
    }
}

fn bounds(places_m: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let fold = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
        places_m.iter().map(|p| p[k]).fold(start, pick)
    };
    if places_m.is_empty() {
        return [[0.0; 2]; 2];
    }
    [
        [0, 1].map(|k| fold(k, f64::min, f64::INFINITY)),
        [0, 1].map(|k| fold(k, f64::max, f64::NEG_INFINITY)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn rough() -> Roughness {
        Roughness {
            sigma_m: 0.009,
            correlation_m: 1.5,
            nugget_m: 0.001,
        }
    }

    #[test]
    fn the_bessel_function_has_the_tables_values() {
        // Abramowitz and Stegun, table 9.8.
        for (x, k1) in [
            (0.1, 9.853_844_8),
            (1.0, 0.601_907_23),
            (2.0, 0.139_865_88),
            (5.0, 0.004_044_6),
        ] {
            assert!(
                (bessel_k1(x) / k1 - 1.0).abs() < 1e-5,
                "{x}: {}",
                bessel_k1(x)
            );
        }
    }

    #[test]
    fn the_precision_is_that_of_the_stated_variance_and_correlation() {
        let places: Vec<_> = (0..14)
            .flat_map(|i| (0..14).map(move |j| [0.5 * f64::from(i), 0.5 * f64::from(j)]))
            .collect();
        let field = Field::new(rough(), &[places]);
        let mut precision: DMatrix<f64> = DMatrix::zeros(field.len(), field.len());
        for row in field.prior() {
            for (i, a) in &row {
                for (j, b) in &row {
                    precision[(*i, *j)] += a * b;
                }
            }
        }
        let covariance = precision.cholesky().unwrap().inverse();
        let node = |p: [f64; 2]| field.around(0, &p).unwrap().nodes[0];
        let (a, b) = (node([3.0, 3.0]), node([3.5, 3.0]));
        let sigma_m = covariance[(a, a)].sqrt();
        // Three nodes per correlation length: the grid itself costs some percent.
        assert!((sigma_m / 0.009 - 1.0).abs() < 0.15, "{sigma_m}");
        let correlation = covariance[(a, b)] / covariance[(a, a)];
        assert!(
            (correlation - rough().correlation(0.5)).abs() < 0.06,
            "{correlation}"
        );
    }

    #[test]
    fn heights_between_nodes_are_blended() {
        let mut field = Field::new(rough(), &[vec![[0.0, 0.0], [4.0, 1.0]]]);
        assert!(field.around(0, &[2.0, 0.5]).is_none()); // nothing was measured there
        let around = field.around(0, &[0.1, 0.2]).unwrap();
        for (k, node) in around.nodes.into_iter().enumerate() {
            field.heights_m[node] = [1.0, 2.0, 4.0, 5.0][k]; // 1 + 1 a + 3 b
        }
        let blended: f64 = (0..4)
            .map(|k| around.weights[k] * field.heights_m[around.nodes[k]])
            .sum();
        assert!((blended - (1.0 + 0.1 / 0.5 + 3.0 * 0.2 / 0.5)).abs() < 1e-12);
    }

    #[test]
    fn layers_have_nodes_of_their_own() {
        let one = vec![[0.0, 0.0]];
        let first = Field::new(rough(), std::slice::from_ref(&one)).len();
        let field = Field::new(rough(), &[one, vec![[0.0, 0.0], [9.0, 0.0]]]);
        let nodes = |layer| field.around(layer, &[0.1, 0.1]).unwrap().nodes;
        assert!(nodes(0).iter().all(|node| *node < first));
        assert!(nodes(1).iter().all(|node| *node >= first));
        assert!(field.around(0, &[9.0, 0.0]).is_none() && field.around(2, &[0.0, 0.0]).is_none());
        // No row of the prior ties one layer to the other.
        let in_first = |row: &Sparse| row.iter().filter(|e| e.0 < first).count();
        let mut rows = field.prior().into_iter();
        assert!(rows.all(|row| [0, row.len()].contains(&in_first(&row))));
    }
}
