//! What the specimen is expected to answer: the thesis body, and how far others are from it.

use crate::plans::{LoadTo, Sine};
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};

/// Softest and stiffest specimen expected, as multiples of the thesis body. Specimens of one
/// organ differ in level by tens of percent; the band must not be narrower than that.
const STIFFNESS_BAND: [f64; 2] = [0.7, 1.35];

/// Machine compliance on a stiff base, in mm/N: a slide and a load cell of the thesis's size, to an order of magnitude.
/// Only the outline of a plan and its duration use it.
const RIG_COMPLIANCE: f64 = 0.03;

/// Points of one move: the exact step has no error of its own, so this is for the picture and for how well
/// the depth at a force is known.
const MOVE_POINTS: u32 = 48;

/// Points of a wait and of one cycle of a sine.
const WAIT_POINTS: u32 = 12;

/// Cycles of a sine that are followed one by one; later ones repeat the last.
const SINE_CYCLES_MAX: u32 = 20;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlinePoint {
    pub t: Seconds,
    /// Depth from contact.
    pub depth: Depth,
    pub force: Newtons,
    /// Whether the plan or a base sets the force, and not the specimen.
    pub is_force_set: bool,
    pub phase: Phase,
}

impl OutlinePoint {
    /// Force of the softest and the stiffest specimen expected.
    pub fn force_band(&self) -> [Newtons; 2] {
        match self.is_force_set {
            true => [self.force; 2],
            false => STIFFNESS_BAND.map(|factor| Newtons(factor * self.force.0)),
        }
    }
}

/// The expected specimen on its way through the plan.
pub(crate) struct ExpectedSpecimen {
    state: KelvinState,
    /// The probe stands before a stiff base instead of tissue.
    is_base: bool,
    depth: f64,
    t: f64,
    force: f64,
    /// Lowest force since a sine began; below zero where the tissue would have to pull.
    lowest: f64,
    /// Highest force of the thesis body under a prescribed depth, and highest force prescribed.
    peak_of_depth: f64,
    peak_of_force: f64,
    has_outline: bool,
    pub outline: Vec<OutlinePoint>,
}

impl ExpectedSpecimen {
    pub fn new(has_outline: bool) -> Self {
        Self {
            state: KelvinState::at_rest(),
            is_base: false,
            depth: 0.0,
            t: 0.0,
            force: 0.0,
            lowest: 0.0,
            peak_of_depth: 0.0,
            peak_of_force: 0.0,
            has_outline,
            outline: Vec::new(),
        }
    }

    pub fn depth(&self) -> f64 {
        self.depth
    }

    pub fn place(&mut self, depth: f64) {
        self.state = KelvinState::at_rest();
        self.is_base = false;
        (self.depth, self.force) = (depth, 0.0);
    }

    pub fn place_on_base(&mut self) {
        self.place(0.0);
        self.is_base = true;
    }

    fn advance(&mut self, phase: Phase, depth: f64, secs: f64) {
        let force = if self.is_base {
            depth / RIG_COMPLIANCE
        } else {
            let body = &ModifiedKelvin::THESIS;
            self.state.step(body, Depth(depth), Seconds(secs)).0
        };
        self.lowest = self.lowest.min(force);
        self.force = force.max(0.0);
        self.depth = depth;
        self.t += secs;
        if self.has_outline {
            self.outline.push(OutlinePoint {
                t: Seconds(self.t),
                depth: Depth(depth),
                force: Newtons(self.force),
                is_force_set: self.is_base,
                phase,
            });
        }
    }

    pub fn go(&mut self, phase: Phase, depth: f64, secs: f64) {
        let from = self.depth;
        for i in 1..=MOVE_POINTS {
            let share = f64::from(i) / f64::from(MOVE_POINTS);
            self.advance(phase, from + share * (depth - from), secs / f64::from(MOVE_POINTS));
            self.peak_of_depth = self.peak_of_depth.max(self.force);
        }
    }

    pub fn stay(&mut self, phase: Phase, secs: f64) {
        for _ in 0..WAIT_POINTS {
            self.advance(phase, self.depth, secs / f64::from(WAIT_POINTS));
        }
    }

    /// The force is kept; how far the tissue creeps is not predicted.
    pub fn keep(&mut self, phase: Phase, secs: f64) {
        let force = self.force;
        self.stay(phase, secs);
        for point in self.outline.iter_mut().rev().take(WAIT_POINTS as usize) {
            point.force = Newtons(force);
            point.is_force_set = true;
        }
        self.force = force;
    }

    /// Indents until the force is reached; the time it takes, in s.
    pub fn load(&mut self, phase: Phase, load: &LoadTo) -> f64 {
        self.peak_of_force = self.peak_of_force.max(load.force.0);
        let (begun, from, first) = (self.t, self.depth, self.outline.len());
        let piece = (load.depth_max.0 - from) / f64::from(4 * MOVE_POINTS);
        while self.force < load.force.0 && self.depth + piece <= load.depth_max.0 && piece > 0.0 {
            self.advance(phase, self.depth + piece, piece / load.speed.0);
        }
        for point in &mut self.outline[first..] {
            point.is_force_set = true;
        }
        self.t - begun
    }

    /// Swings; the lowest force on the way, below zero where the tissue would have to pull.
    pub fn oscillate(&mut self, phase: Phase, sine: &Sine) -> Newtons {
        self.lowest = f64::INFINITY;
        let (from, period) = (self.depth, 1.0 / sine.frequency_hz);
        let followed = sine.cycles.min(SINE_CYCLES_MAX);
        for i in 1..=followed * MOVE_POINTS {
            let turn = std::f64::consts::TAU * f64::from(i) / f64::from(MOVE_POINTS);
            let depth = from + sine.amplitude_mm * (1.0 - turn.cos());
            self.advance(phase, depth, period / f64::from(MOVE_POINTS));
            self.peak_of_depth = self.peak_of_depth.max(self.force);
        }
        self.t += period * f64::from(sine.cycles - followed);
        Newtons(self.lowest)
    }

    /// Peak force of the softest and the stiffest expected specimen.
    pub fn force_band(&self) -> [Newtons; 2] {
        STIFFNESS_BAND.map(|factor| Newtons((factor * self.peak_of_depth).max(self.peak_of_force)))
    }
}
