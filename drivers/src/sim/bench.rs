//! The bench before the probe - a specimen, a stiff base behind it - and the weights a person puts on the
//! cell. The rig gives way in between: the probe is not quite where the axis is.

use super::own_cell::OwnWeights;
use super::random::Random;
use super::settings::SimSettings;
use super::tissue::Tissue;
use palpate_model::rig::HandAction;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Newtons, Position, Seconds};

/// Stiffness of the base in N/mm: a steel plate on its mount, which gives way by 1 um/N. At the slowest speed,
/// 0.03 mm/s, its force rises by 30 N/s, which the force-rate interlock lets pass.
const BASE_STIFFNESS: f64 = 1000.0;

/// The probe's position is solved for this closely, in mm: far below what any force resolves.
const SOLVED_MM: f64 = 1e-12;

/// Four to eight steps are usual; a search that takes more is stuck at the rounding of the force.
const SOLVE_STEPS_MAX: usize = 60;

/// Forces at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchForces {
    pub on_probe: Newtons,
    /// Force on the load cell: the probe's and the weights'.
    pub on_cell: Newtons,
}

#[derive(Clone, Debug)]
pub struct SimBench {
    settings: SimSettings,
    specimen: Option<Tissue>,
    base: Position,
    body: ModifiedKelvin,
    weights: Newtons,
    set: OwnWeights,
    probe: Position,
}

impl SimBench {
    /// The bench as the rig is switched on, its own specimen clipped in and the probe far outside.
    pub fn new(settings: &SimSettings, probe: Position) -> Self {
        let specimen = Tissue::new(&mut Random::of_specimen(settings.seed, 0), settings);
        Self {
            settings: *settings,
            base: specimen.surface().moved_by(settings.thickness.mm()),
            body: specimen.body(),
            specimen: Some(specimen),
            weights: Newtons(0.0),
            set: OwnWeights::of(settings),
            probe,
        }
    }

    /// The first surface before the probe: the specimen's, or without a specimen the base.
    pub fn surface(&self) -> Position {
        self.specimen.as_ref().map_or(self.base, Tissue::surface)
    }

    /// True position of the probe's tip.
    pub fn probe(&self) -> Position {
        self.probe
    }

    pub fn base(&self) -> Position {
        self.base
    }

    pub fn body(&self) -> ModifiedKelvin {
        self.body
    }

    /// A person does something. A mass that is none, negative or not finite, changes nothing.
    pub fn apply_hand_action(&mut self, action: HandAction) {
        match action {
            HandAction::LoadCell { mass_g } if mass_g >= 0.0 && mass_g.is_finite() => {
                self.weights = HandAction::weight(self.set.true_mass(mass_g));
            }
            HandAction::LoadCell { .. } => {}
            HandAction::Mount { specimen } => {
                let mut random = Random::of_specimen(self.settings.seed, specimen);
                let tissue = Tissue::new(&mut random, &self.settings).clipped_before(self.probe);
                self.body = tissue.body();
                self.specimen = Some(tissue);
            }
            HandAction::Unmount => self.specimen = None,
        }
    }

    /// The axis has moved straight to a true position in a time step.
    pub fn advance(&mut self, axis: Position, dt: Seconds) -> BenchForces {
        let compliance = self.settings.compliance.thousandths();
        self.probe = if compliance > 0.0 { self.solve_probe(axis, dt, compliance) } else { axis };
        let on_probe = self.push(self.probe, dt);
        BenchForces { on_probe, on_cell: on_probe + self.weights }
    }

    /// Where the force that bends the rig is the force that tissue and base have there:
    /// `probe = axis - compliance F(probe)` at the end of the step. Found by bisection with false-position
    /// steps in the bracket (the Illinois rule, Dowell & Jarratt, BIT 11 (1971) 168-174), for the force
    /// within a step grows with depth.
    fn solve_probe(&self, axis: Position, dt: Seconds, compliance: f64) -> Position {
        let miss = |probe: f64| {
            let force = self.clone().push(Position(probe), dt).0;
            probe + compliance * force - axis.0
        };
        let (mut high, mut high_miss) = (axis.0, miss(axis.0));
        let mut low = axis.0 - high_miss;
        let mut low_miss = miss(low);
        let mut at = low;
        let mut is_high_kept = None;
        for _ in 0..SOLVE_STEPS_MAX {
            let between = (low * high_miss - high * low_miss) / (high_miss - low_miss);
            if !(between > low && between < high) {
                break;
            }
            let here = miss(between);
            at = between;
            if here.abs() <= SOLVED_MM {
                break;
            }
            // An end kept twice counts half, so that the bracket shrinks from both sides.
            let keep_high = here <= 0.0;
            let share = if is_high_kept == Some(keep_high) { 0.5 } else { 1.0 };
            if keep_high {
                (low, low_miss, high_miss) = (between, here, share * high_miss);
            } else {
                (high, high_miss, low_miss) = (between, here, share * low_miss);
            }
            is_high_kept = Some(keep_high);
        }
        Position(at)
    }

    fn push(&mut self, probe: Position, dt: Seconds) -> Newtons {
        let tissue =
            self.specimen.as_mut().map_or(Newtons(0.0), |tissue| tissue.advance(probe, dt));
        let into_base = probe.distance_from(self.base).max(0.0);
        tissue + Newtons(BASE_STIFFNESS * into_base)
    }
}
