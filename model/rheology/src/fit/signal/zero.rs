//! The load cell's slowly changing zero, eliminated from a least-squares problem row by row.
//!
//! The zero is straight between nodes; from node to node it takes a random step on top of a steady trend. Rows are
//! rotated into the triangle of the present two nodes, the trend and the problem's own columns. A node that time
//! has passed is dropped: its row of the triangle is all that the past knows of it (square-root information
//! filter: Bierman 1977, ISBN 0-12-097350-2, chapter V). So the cost grows with the number of nodes and not with
//! its cube.

use super::super::triangle::{Factor, Triangle};

/// Columns in front of the problem's own: the nodes before and after a row, and the trend.
const OWN: usize = 3;

/// Where the nodes are, and how far the zero wanders from one to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct ZeroNodes {
    /// Time of the first node in s.
    pub start: f64,
    /// Time between nodes in s.
    pub spacing: f64,
    /// One over the standard deviation of the step between nodes, in the weights of the rows.
    pub step_weight: f64,
}

/// Rows so far, with every node that time has passed eliminated.
pub(in super::super) struct ZeroFilter {
    nodes: ZeroNodes,
    triangle: Triangle,
    row: Vec<f64>,
    /// The node before the present rows.
    present: usize,
    /// Rows of the nodes that were eliminated.
    passed: Vec<Vec<f64>>,
}

/// The problem without the zero.
pub(in super::super) struct ZeroSolution {
    nodes: ZeroNodes,
    /// The problem's own columns and right side.
    pub factor: Factor,
    /// For each of these columns, the zero at each node that explains it best.
    values: Vec<Vec<f64>>,
    /// Sum of the logarithms of the pivots of nodes and trend.
    pub logs: f64,
    pub steps: usize,
}

impl ZeroFilter {
    /// A filter of rows with so many columns of the problem's own, the right side included.
    pub fn new(nodes: ZeroNodes, columns: usize) -> Self {
        let width = OWN + columns;
        let mut filter = Self {
            nodes,
            triangle: Triangle::new(width),
            row: vec![0.0; width],
            present: 0,
            passed: Vec::new(),
        };
        filter.push_step();
        filter
    }

    fn push_step(&mut self) {
        self.row.fill(0.0);
        self.row[..OWN].copy_from_slice(&[-1.0, 1.0, -self.nodes.spacing]);
        self.triangle.push(&self.row, self.nodes.step_weight);
    }

    /// A row at a time not before that of the row before it.
    pub fn push(&mut self, t: f64, columns: &[f64], weight: f64) {
        let place = (t - self.nodes.start) / self.nodes.spacing;
        while place > (self.present + 1) as f64 {
            self.pass_node();
        }
        let share = place - self.present as f64;
        self.row[..OWN].copy_from_slice(&[1.0 - share, share, 0.0]);
        self.row[OWN..].copy_from_slice(columns);
        self.triangle.push(&self.row, weight);
    }

    fn pass_node(&mut self) {
        self.passed.push(self.triangle.pass_first());
        self.present += 1;
        self.push_step();
    }

    pub fn finish(self) -> ZeroSolution {
        let width = self.row.len();
        let columns = width - OWN;
        let factor = self.triangle.finish();
        let mut own = Triangle::new(columns);
        (OWN..width).for_each(|i| own.push(&factor.row(i)[OWN..], 1.0));
        // Back substitution, each column of the problem taken as the right side.
        let of = |row: &[f64], known: &[(usize, f64)], column: usize| {
            known.iter().fold(row[OWN + column], |sum, (k, value)| sum - row[*k] * value)
        };
        let steps = self.passed.len() + 1;
        let zero_of = |column: usize| {
            let trend = of(factor.row(2), &[], column) / factor.row(2)[2];
            let last = of(factor.row(1), &[(2, trend)], column) / factor.row(1)[1];
            let before = of(factor.row(0), &[(1, last), (2, trend)], column) / factor.row(0)[0];
            let mut values = vec![last, before];
            for row in self.passed.iter().rev() {
                let next = values[values.len() - 1];
                values.push(of(row, &[(1, next), (2, trend)], column) / row[0]);
            }
            values.reverse();
            values
        };
        let values = (0..columns).map(zero_of).collect();
        let pivots = self.passed.iter().map(|row| row[0]);
        let pivots = pivots.chain((0..OWN).map(|k| factor.row(k)[k]));
        ZeroSolution {
            nodes: self.nodes,
            factor: own.finish(),
            values,
            logs: pivots.map(|pivot| pivot.abs().ln()).sum(),
            steps,
        }
    }
}

impl ZeroSolution {
    /// The part of each column that the zero explains at a time.
    pub fn explained(&self, t: f64, column: usize) -> f64 {
        let place = (t - self.nodes.start) / self.nodes.spacing;
        let values = &self.values[column];
        let node = (place.max(0.0) as usize).min(values.len() - 2);
        let share = place - node as f64;
        values[node] + share * (values[node + 1] - values[node])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line through a wandering zero: the same as solving for all nodes at once.
    #[test]
    fn filter_gives_what_all_nodes_at_once_give() {
        let nodes = ZeroNodes { start: 0.0, spacing: 1.0, step_weight: 3.0 };
        let count = 6;
        let mut filter = ZeroFilter::new(nodes, 2);
        // Nodes, trend, one column, right side.
        let mut whole = Triangle::new(count + 1 + 2);
        for k in 0..count - 1 {
            let mut row = vec![0.0; count + 3];
            (row[k], row[k + 1], row[count]) = (-1.0, 1.0, -1.0);
            whole.push(&row, 3.0);
        }
        for i in 0..=50 {
            let t = 0.1 * f64::from(i);
            let (column, value) = ((0.7 * t).sin(), f64::from(i * i * 37 % 101) / 50.0);
            filter.push(t, &[column, value], 2.0);
            let node = (t.ceil() as usize).clamp(1, count - 1) - 1;
            let share = t - node as f64;
            let mut row = vec![0.0; count + 3];
            (row[node], row[node + 1]) = (1.0 - share, share);
            (row[count + 1], row[count + 2]) = (column, value);
            whole.push(&row, 2.0);
        }
        let (found, whole) = (filter.finish(), whole.finish());
        assert_eq!(found.steps, count - 1);
        let all = whole.solve(count + 2);
        let slope = found.factor.solve(1)[0];
        assert!((slope - all[count + 1]).abs() < 1e-12, "{slope} {all:?}");
        let left = found.factor.residual_sum(1);
        assert!((left - whole.residual_sum(count + 2)).abs() < 1e-10);
        // The zero of the right side less the zero of what the column explains is the zero.
        for (node, expected) in all[..count].iter().enumerate() {
            let zero = |column| found.explained(node as f64, column);
            let value = zero(1) - slope * zero(0);
            assert!((value - expected).abs() < 1e-11, "node {node}: {value} {expected}");
        }
    }
}
