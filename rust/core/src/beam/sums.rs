//! Sums over the rows of one hold, in two steps.
//!
//! A state moves a contact by way of the two nodes beside it alone. So rows are summed with the six
//! moves of each node in the place of the many unknowns of the state, and the sums are taken to these
//! at the end, once per node instead of once per row. Rows that touch the same unknowns follow each
//! other on a scan line: they are collected in a panel and multiplied together.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView};

use super::blank::blank;
use super::pairs::{Knotted, Pairs};
use super::panel::Panel;

/// Moves of a node: three rotations, three displacements.
pub const MOVES: usize = 6;
/// Moves of both nodes of an element.
pub const BOTH: usize = 2 * MOVES;
/// An unknown that is not summed.
const NOWHERE: usize = usize::MAX;

/// One row: how what is to be explained answers to the nodes of an element and to unknowns.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Inner node of the element.
    pub node: usize,
    /// By its moves and those of the outer node.
    pub moves: [f64; BOTH],
    /// By unknowns that are not of the state.
    pub others: &'a [(usize, f64)],
    /// What is to be explained.
    pub residual: f64,
    /// Inverse variance.
    pub weight: f64,
}

/// Sums of weighted rows of one hold. Place 0 of others is the residual; the others follow by their numbers, and
/// so they have to come in every row.
#[derive(Debug)]
pub struct Sums {
    start: usize,
    /// By unknown, from `start` on.
    places: Vec<usize>,
    /// Unknowns at the places from 1 on.
    others: Vec<usize>,
    /// A node's moves with each other, lower triangle, and below with those of the next node: a column
    /// per move.
    near: DMatrix<f64>,
    /// Others with moves: a column per move.
    cross: DMatrix<f64>,
    /// Others with each other: a column for those that are solved for.
    own: Pairs,
    panel: Panel,
    /// Nodes whose moves are summed.
    nodes: Range<usize>,
    touched: Vec<usize>,
    values: Vec<f64>,
    rows: usize,
}

/// Sums of one hold by its unknowns, as [`super::normal::Normal`] takes them. Place 0 of others is the residual.
#[derive(Debug)]
pub struct Part {
    /// Which unknowns of the state, and which others behind the residual.
    pub state: Vec<usize>,
    /// See `state`; rising.
    pub others: Vec<usize>,
    /// The state with itself.
    pub states: DMatrix<f64>,
    /// Others with the state.
    pub crossed: DMatrix<f64>,
    /// Others with the first of them.
    pub own: Pairs,
    /// Rows.
    pub rows: usize,
}

impl Sums {
    /// Of rows at `nodes` nodes that touch `unknowns`, rising, beside the state; of these the ones in `asked` are
    /// summed, with each other as far as one of both is in `free`, behind which the other ones stand, and of `waves`
    /// those that meet.
    pub fn new(
        nodes: usize,
        unknowns: impl Iterator<Item = usize>,
        asked: &Range<usize>,
        free: &Range<usize>,
        waves: &Knotted,
    ) -> Self {
        let others: Vec<usize> = unknowns.filter(|i| asked.contains(i)).collect();
        let mut places = vec![NOWHERE; asked.len()];
        for (place, unknown) in others.iter().enumerate() {
            places[unknown - asked.start] = place + 1;
        }
        let size = others.len() + 1;
        let columns = others.partition_point(|unknown| *unknown < free.end) + 1;
        Self {
            near: blank(BOTH, MOVES * nodes),
            cross: blank(size, MOVES * nodes),
            own: Pairs::new(size, columns, &waves.within(&others)),
            panel: Panel::default(),
            nodes: nodes..0,
            touched: Vec::new(),
            values: Vec::new(),
            rows: 0,
            start: asked.start,
            places,
            others,
        }
    }

    /// Adds one row.
    pub fn add(&mut self, row: &Row) {
        self.touched.clear();
        self.touched.push(0);
        self.values.clear();
        self.values.push(row.residual);
        for (unknown, slope) in row.others {
            let known = unknown
                .checked_sub(self.start)
                .and_then(|i| self.places.get(i));
            if let Some(place) = known.filter(|place| **place != NOWHERE) {
                self.touched.push(*place);
                self.values.push(*slope);
            }
        }
        debug_assert!(self.touched.is_sorted());
        if !self.panel.suits(row.node, &self.touched) {
            self.flush();
            self.panel.begin(row.node, &self.touched, BOTH);
        }
        let values = row.moves.iter().chain(&self.values).copied();
        self.panel.push(values, row.weight.sqrt());
        self.rows += 1;
    }

    /// Adds the products of the panel where they belong.
    fn flush(&mut self) {
        if self.panel.is_empty() {
            return;
        }
        let mut panel = std::mem::take(&mut self.panel);
        self.nodes = self.nodes.start.min(panel.node)..self.nodes.end.max(panel.node + 2);
        let (first, places) = (MOVES * panel.node, std::mem::take(&mut panel.places));
        let columns = places.partition_point(|place| *place < self.own.len());
        for (i, line) in panel.multiply(BOTH + columns).enumerate() {
            let (moves, others) = line.split_at(BOTH);
            if i < BOTH {
                self.add_move(first + i, i, moves, (&places, others));
            } else {
                self.add_other(i - BOTH, &places, others);
            }
        }
        panel.places = places;
        self.panel = panel;
    }

    /// Adds the products of one move, the `i`-th of both nodes, with those after it and with others.
    fn add_move(&mut self, column: usize, i: usize, moves: &[f64], others: (&[usize], &[f64])) {
        // The outer node has columns of its own.
        let own = if i < MOVES { 0 } else { MOVES };
        let near = &mut self.near.as_mut_slice()[column * BOTH..][i - own..BOTH];
        near.iter_mut()
            .zip(&moves[i..])
            .for_each(|(sum, product)| *sum += product);
        scatter(&mut self.cross, column, others.0, others.1);
    }

    /// Adds the products of the `i`-th other with those after it.
    fn add_other(&mut self, i: usize, places: &[usize], products: &[f64]) {
        self.own.add(places[i], &places[i..], &products[i..]);
    }

    /// The sums by unknowns: `state` are those of the state, each with a column of `moves` that says what
    /// it does to every move.
    pub fn part(mut self, state: Vec<usize>, moves: &DMatrix<f64>) -> Part {
        self.flush();
        let first = MOVES * self.nodes.start.min(self.nodes.end);
        let count = MOVES * self.nodes.len();
        let moves = moves.rows(first, count);
        Part {
            states: moves.tr_mul(&self.near_times(&moves, first)),
            crossed: self.cross.columns(first, count) * moves,
            own: self.own,
            rows: self.rows,
            state,
            others: self.others,
        }
    }

    /// The products of moves from the `from`-th on, times `moves`.
    fn near_times(&self, moves: &DMatrixView<'_, f64>, from: usize) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(moves.nrows(), moves.ncols());
        for first in (0..moves.nrows()).step_by(MOVES) {
            let mut own = self
                .near
                .fixed_view::<MOVES, MOVES>(0, from + first)
                .into_owned();
            own.fill_upper_triangle_with_lower_triangle();
            let here = moves.rows(first, MOVES);
            let mut at = product.rows_mut(first, MOVES);
            at += own * here;
            if first + MOVES < moves.nrows() {
                let next = self.near.fixed_view::<MOVES, MOVES>(MOVES, from + first);
                at += next.transpose() * moves.rows(first + MOVES, MOVES);
                let mut beyond = product.rows_mut(first + MOVES, MOVES);
                beyond += next * here;
            }
        }
        product
    }
}

/// Adds products to some rows of a column.
fn scatter(sums: &mut DMatrix<f64>, column: usize, rows: &[usize], products: &[f64]) {
    let count = sums.nrows();
    let sums = &mut sums.as_mut_slice()[column * count..][..count];
    for (row, product) in rows.iter().zip(products) {
        sums[*row] += product;
    }
}

#[cfg(test)]
mod tests {
    use super::super::normal::Normal;
    use super::*;

    const STATE: [usize; 3] = [1, 2, 7];

    /// Any numbers, evenly spread over (-1, 1).
    fn number(place: usize) -> f64 {
        (place as f64 * 0.618_034).fract() * 2.0 - 1.0
    }

    #[test]
    fn sums_by_way_of_nodes_are_those_of_whole_rows() {
        let free = 1..20;
        let moves = DMatrix::from_fn(MOVES * 4, STATE.len(), |i, j| number(31 * i + 7 * j));
        let mut sums = Sums::new(4, 8..20, &free, &free, &Knotted::NONE);
        let mut expected = DMatrix::<f64>::zeros(20, 20);
        let mut right = [0.0; 20];
        for k in 0..200 {
            let others: Vec<(usize, f64)> = [9, 10 + k / 40, 19, 25]
                .map(|i| (i, number(k + 13 * i)))
                .into();
            let row = Row {
                node: (k / 50).min(2),
                moves: std::array::from_fn(|i| number(11 * k + i)),
                others: &others,
                residual: number(3 * k),
                weight: 1.0 + number(5 * k).abs(),
            };
            sums.add(&row);
            let mut whole = vec![0.0; 26];
            for (j, unknown) in STATE.into_iter().enumerate() {
                let of = |i: usize| row.moves[i] * moves[(MOVES * row.node + i, j)];
                whole[unknown] = (0..BOTH).map(of).sum();
            }
            others.iter().for_each(|(i, slope)| whole[*i] += slope);
            for i in 0..20 {
                right[i] += row.weight * whole[i] * row.residual;
                (0..20).for_each(|j| expected[(i, j)] += row.weight * whole[i] * whole[j]);
            }
        }
        let mut normal = Normal::new(&free, &free);
        normal.join(&sums.part(STATE.to_vec(), &moves));
        assert_eq!(normal.rows, 200);
        for one in (1..20).filter(|one| STATE.contains(one) || *one >= 8) {
            assert!((normal.right[one - 1] - right[one]).abs() < 1e-9, "{one}");
            for two in 1..=one {
                let error = normal.matrix[(one - 1, two - 1)] - expected[(one, two)];
                assert!(error.abs() < 1e-9, "{one} {two}");
            }
        }
    }
}
