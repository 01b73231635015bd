//! The bank of relaxation times: filters stepped exactly, products of their columns summed.
//!
//! Samples wait until a few can be taken together, so that each node's filters and sums are loaded
//! and stored once for all of them. Nodes lie side by side in chunks: the same operation on eight
//! neighbours is what a compiler turns into vector instructions on any machine.

use crate::vectors::run_wide;
use palpate_model::viscoelastic::{ContactPieces, NEGLIGIBLE, psi_all};

/// Relaxation times in the bank unless asked otherwise: on the protocol of the thesis twice as many are no
/// more exact and half as many leave tau off by 2e-6 (`palpate trade`).
pub(super) const NODES: usize = 64;
/// Fewest: a factor of two between neighbours. Most: what a sample at 1 kHz leaves time for.
const NODES_MIN: usize = 16;
const NODES_MAX: usize = 512;
/// Their range in s: soft tissue from a tap to a creep test.
const TAU_RANGE: [f64; 2] = [0.01, 1000.0];
/// Columns: three orthogonal depth terms, the viscous one, initial force, offset.
pub(super) const COLUMNS: usize = 6;
/// Columns that differ between nodes: all but the offset.
pub(super) const FILTERED: usize = COLUMNS - 1;
/// Samples taken together. Their rows and sums of one chunk stay in a first-level cache.
pub(super) const BATCH: usize = 16;

const WIDTH: usize = 8;
/// Products of filtered columns with each other.
const PAIRS: usize = FILTERED * (FILTERED + 1) / 2;

type Lane = [f64; WIDTH];

/// One straight piece of depth with the sample at its end, ready for every node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Piece {
    /// Forcing of the three depth columns by `psi_0 ..= psi_3`.
    drive: [[f64; 4]; 3],
    /// Forcing of the viscous column by `psi_0, psi_1`.
    viscous: [f64; 2],
    /// Root of the weight; zero if the piece ends without a force.
    root: f64,
    root_force: f64,
}

impl Piece {
    /// From scaled depth `from` on by `d` within `dt`. The depth columns are the orthogonal
    /// `u, u(2u-1), u(6u^2-6u+1)`: what multiplies psi in the powers of depth, so combined.
    fn new(from: f64, d: f64, dt: f64) -> Self {
        let (from2, d2) = (from * from, d * d);
        let one = [from, d, 0.0, 0.0];
        let two = [from2, 2.0 * from * d, d2, 0.0];
        let three = [from2 * from, 3.0 * from2 * d, 3.0 * from * d2, d2 * d];
        let speed = if d == 0.0 { 0.0 } else { d / dt };
        Self {
            drive: [
                one,
                std::array::from_fn(|j| 2.0 * two[j] - one[j]),
                std::array::from_fn(|j| 6.0 * (three[j] - two[j]) + one[j]),
            ],
            viscous: [speed * from, speed * d],
            root: 0.0,
            root_force: 0.0,
        }
    }
}

/// Eight neighbouring nodes.
#[derive(Clone, Debug, PartialEq)]
struct Chunk {
    taus: Lane,
    /// `psi_0 ..= psi_3` of the present step length.
    psi: [Lane; 4],
    /// The three depth columns, the viscous one, the decay of the initial force.
    states: [Lane; FILTERED],
    /// Products of the filtered columns, the lower triangle row by row.
    pairs: [Lane; PAIRS],
    /// Their products with the offset column, and with the force.
    with_one: [Lane; FILTERED],
    with_force: [Lane; FILTERED],
}

/// All nodes with everything summed so far.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bank {
    grid: Grid,
    chunks: Vec<Chunk>,
    waiting: Vec<Piece>,
    /// Step length that psi belongs to, in s.
    dt: f64,
    /// Sums of weight, weight times force, weight times squared force: the same for every node.
    shared: [f64; 3],
}

/// Relaxation times evenly placed by their logarithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// How many: a whole number of chunks.
    pub nodes: usize,
}

impl Grid {
    /// The grid of so many relaxation times, if a bank can have it.
    pub fn of(nodes: usize) -> Option<Self> {
        let is_whole = nodes.is_multiple_of(WIDTH);
        (is_whole && (NODES_MIN..=NODES_MAX).contains(&nodes)).then_some(Self { nodes })
    }

    /// Logarithm of the distance between neighbouring nodes.
    pub fn spacing(self) -> f64 {
        (TAU_RANGE[1] / TAU_RANGE[0]).ln() / (self.nodes - 1) as f64
    }

    /// Relaxation time in s at a place between nodes, counted in nodes.
    pub fn tau_at(self, place: f64) -> f64 {
        TAU_RANGE[0] * (self.spacing() * place).exp()
    }

    /// The inverse of [`Self::tau_at`].
    pub fn place_of(self, tau: f64) -> f64 {
        (tau / TAU_RANGE[0]).ln() / self.spacing()
    }
}

impl Bank {
    pub fn new(grid: Grid) -> Self {
        let chunk = |index: usize| Chunk {
            taus: std::array::from_fn(|lane| grid.tau_at((index * WIDTH + lane) as f64)),
            psi: [[0.0; WIDTH]; 4],
            states: std::array::from_fn(|k| [if k == FILTERED - 1 { 1.0 } else { 0.0 }; WIDTH]),
            pairs: [[0.0; WIDTH]; PAIRS],
            with_one: [[0.0; WIDTH]; FILTERED],
            with_force: [[0.0; WIDTH]; FILTERED],
        };
        Self {
            grid,
            chunks: (0..grid.nodes / WIDTH).map(chunk).collect(),
            waiting: Vec::with_capacity(BATCH),
            dt: 0.0,
            shared: [0.0; 3],
        }
    }

    /// Moves straight from scaled depth `from` to `to` within `dt` seconds.
    pub fn advance(&mut self, from: f64, to: f64, dt: f64) {
        match ContactPieces::of(from, to) {
            ContactPieces::Inside => self.push_piece(from, to - from, dt),
            ContactPieces::Outside => self.push_piece(0.0, 0.0, dt),
            ContactPieces::Entering([outside, inside]) => {
                self.push_piece(0.0, 0.0, dt * outside);
                self.push_piece(0.0, to, dt * inside);
            }
            ContactPieces::Leaving([inside, outside]) => {
                self.push_piece(from, -from, dt * inside);
                self.push_piece(0.0, 0.0, dt * outside);
            }
        }
    }

    /// Counts the force at the end of the newest piece.
    pub fn weigh(&mut self, force: f64, weight: f64) {
        if self.waiting.is_empty() {
            self.waiting.push(Piece::default());
            self.use_step(0.0);
        }
        if let Some(piece) = self.waiting.last_mut() {
            piece.root = weight.sqrt();
            piece.root_force = piece.root * force;
        }
        let [weights, firsts, seconds] = &mut self.shared;
        *weights += weight;
        *firsts += weight * force;
        *seconds += weight * force * force;
    }

    fn push_piece(&mut self, from: f64, d: f64, dt: f64) {
        // Times are multiples of a tick rounded to doubles; a billionth of the interval is that.
        if (self.dt - dt).abs() > 1e-9 * dt {
            self.flush();
            self.use_step(dt);
        } else if self.waiting.len() == BATCH {
            self.flush();
        }
        self.waiting.push(Piece::new(from, d, dt));
    }

    fn use_step(&mut self, dt: f64) {
        self.dt = dt;
        for chunk in &mut self.chunks {
            for (lane, tau) in chunk.taus.iter().enumerate() {
                let all = psi_all(dt / tau);
                for (psi, value) in chunk.psi.iter_mut().zip(all) {
                    psi[lane] = value;
                }
            }
        }
    }

    /// Takes the samples that wait.
    pub fn flush(&mut self) {
        let (chunks, waiting) = (&mut self.chunks, &self.waiting);
        run_wide(
            #[inline(always)]
            || {
                for chunk in chunks.iter_mut() {
                    chunk.consume(waiting);
                }
            },
        );
        self.waiting.clear();
    }

    /// Sums of weighted products at one node, with the force as the last column; full when
    /// nothing waits.
    pub fn gram(&self, node: usize) -> [[f64; COLUMNS + 1]; COLUMNS + 1] {
        let (chunk, lane) = (&self.chunks[node / WIDTH], node % WIDTH);
        let [weights, firsts, seconds] = self.shared;
        let mut gram = [[0.0; COLUMNS + 1]; COLUMNS + 1];
        let mut pairs = chunk.pairs.iter();
        for i in 0..FILTERED {
            for (j, sum) in (0..=i).zip(&mut pairs) {
                gram[i][j] = sum[lane];
                gram[j][i] = sum[lane];
            }
            for (j, sums) in [(FILTERED, &chunk.with_one), (COLUMNS, &chunk.with_force)] {
                gram[i][j] = sums[i][lane];
                gram[j][i] = sums[i][lane];
            }
        }
        gram[FILTERED][FILTERED] = weights;
        gram[FILTERED][COLUMNS] = firsts;
        gram[COLUMNS][FILTERED] = firsts;
        gram[COLUMNS][COLUMNS] = seconds;
        gram
    }

    /// Weighted sums of the filtered columns at every node.
    pub fn sums(&self) -> Vec<[f64; FILTERED]> {
        let node = |chunk: &Chunk, lane| std::array::from_fn(|k| chunk.with_one[k][lane]);
        let chunks = self.chunks.iter();
        chunks.flat_map(|chunk| (0..WIDTH).map(move |lane| node(chunk, lane))).collect()
    }

    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Sums of weight, weight times force, weight times squared force.
    pub fn shared(&self) -> [f64; 3] {
        self.shared
    }
}

impl Chunk {
    #[inline(always)]
    fn consume(&mut self, pieces: &[Piece]) {
        let mut rows = [[[0.0; WIDTH]; BATCH]; FILTERED];
        for (slot, piece) in pieces.iter().enumerate() {
            self.step(piece);
            for (row, state) in rows.iter_mut().zip(&self.states) {
                for (value, state) in row[slot].iter_mut().zip(state) {
                    *value = piece.root * state;
                }
            }
        }
        self.fold(&rows, pieces);
        // A filter left alone decays for ever; below the smallest normal number every operation
        // on it would take a hundred times as long and still mean nothing.
        for state in self.states.as_flattened_mut() {
            if state.abs() < NEGLIGIBLE {
                *state = 0.0;
            }
        }
    }

    #[inline(always)]
    fn step(&mut self, piece: &Piece) {
        let [p0, p1, p2, p3] = &self.psi;
        let [q1, q2, q3, g, e] = &mut self.states;
        let [a1, a2, a3] = &piece.drive;
        let v = &piece.viscous;
        if a1[1] == 0.0 {
            for i in 0..WIDTH {
                q1[i] += (a1[0] - q1[i]) * p0[i];
                q2[i] += (a2[0] - q2[i]) * p0[i];
                q3[i] += (a3[0] - q3[i]) * p0[i];
                g[i] -= g[i] * p0[i];
                e[i] -= e[i] * p0[i];
            }
        } else {
            for i in 0..WIDTH {
                q1[i] += (a1[0] - q1[i]) * p0[i] + a1[1] * p1[i];
                q2[i] += (a2[0] - q2[i]) * p0[i] + (a2[1] * p1[i] + a2[2] * p2[i]);
                q3[i] += (a3[0] - q3[i]) * p0[i] + (a3[1] * p1[i] + a3[2] * p2[i]) + a3[3] * p3[i];
                g[i] += (v[0] - g[i]) * p0[i] + v[1] * p1[i];
                e[i] -= e[i] * p0[i];
            }
        }
    }

    /// Adds the products of a batch of rows.
    #[inline(always)]
    fn fold(&mut self, rows: &[[Lane; BATCH]; FILTERED], pieces: &[Piece]) {
        let mut pairs = self.pairs.iter_mut();
        for i in 0..FILTERED {
            for (j, sum) in (0..=i).zip(&mut pairs) {
                add_products(sum, &rows[i], &rows[j]);
            }
            let (mut one, mut force) = (self.with_one[i], self.with_force[i]);
            for (a, piece) in rows[i].iter().zip(pieces) {
                for lane in 0..WIDTH {
                    one[lane] += a[lane] * piece.root;
                    force[lane] += a[lane] * piece.root_force;
                }
            }
            (self.with_one[i], self.with_force[i]) = (one, force);
        }
    }
}

#[inline(always)]
fn add_products(sum: &mut Lane, a: &[Lane; BATCH], b: &[Lane; BATCH]) {
    let mut sums = *sum;
    for (a, b) in a.iter().zip(b) {
        for lane in 0..WIDTH {
            sums[lane] += a[lane] * b[lane];
        }
    }
    *sum = sums;
}
