//! A load cell and a set of weights as a seed draws them: near what their documents say, and not the same.

use super::random::{Random, RandomStream};
use super::settings::{SimCell, SimSettings};
use palpate_model::Newtons;
use palpate_model::calibration::{Calibration, CalibrationCurve, HysteresisLoop, WeightStep};
use palpate_model::rig::HandAction;

/// Standard deviation of the cell's sensitivity from its document's: what a cell changes by in a year or two.
const SENSITIVITY_SPREAD: f64 = 0.005;
/// Standard deviation of its non-linearity as a share of the range: of a half wave over the range, and of each shorter
/// wave in proportion to its length. The shortest are no longer than the distance of two weights.
const BEND_SPREAD: f64 = 0.001;
const WAVES: u32 = 9;
/// Standard deviation of half the distance between loading and unloading in N, in the middle of the range: 0.02 % of the
/// range. Both ways meet at its ends.
const HYSTERESIS_SPREAD: f64 = 0.002;
/// Force over which the cell goes from one side of its loop to the other, in N.
const TURN: f64 = 0.2;
/// Half-width in g of the errors of weights, evenly spread: class M3 of OIML R 111-1 for 100 g.
const WEIGHT_TOLERANCE_G: f64 = 0.05;
/// Weights in the set: a platform, then pieces of equal mass, put on in order.
const PLATFORM_G: f64 = 140.0;
const PIECE_G: f64 = 100.0;
const PIECES: usize = 20;
/// Points of the drawn curve: far closer together than weights, so that no curve through weights is this one.
const POINTS: u32 = 120;

/// What differs from the documents.
#[derive(Clone, Debug)]
pub(super) struct OwnCell {
    pub curve: CalibrationCurve,
    hysteresis: HysteresisLoop,
    /// Side of the loop, -1 in unloading to 1 in loading.
    side: f64,
    force: f64,
}

impl OwnCell {
    /// `None` where the cell is the document's.
    pub fn of(settings: &SimSettings, document: &CalibrationCurve) -> Option<Self> {
        if settings.cell == SimCell::Document {
            return None;
        }
        let mut random = Random::new(settings.seed, RandomStream::Cell);
        let sensitivity = SENSITIVITY_SPREAD * random.normal();
        let waves: Vec<(f64, f64)> = (1..=WAVES)
            .map(f64::from)
            .map(|half_waves| (half_waves, BEND_SPREAD / half_waves * random.normal()))
            .collect();
        let half = Newtons((HYSTERESIS_SPREAD * random.normal()).abs());
        let (from, to) = document.force_range();
        let span = to.0 - from.0;
        let [low, high] = [from, to].map(|force| document.volts_from_newtons(force).0);
        let steps = (0..=POINTS).map(|k| {
            let share = f64::from(k) / f64::from(POINTS);
            let angle = std::f64::consts::PI * share;
            let wave = |(half_waves, size): &(f64, f64)| size * (half_waves * angle).sin();
            let error = sensitivity * share + waves.iter().map(wave).sum::<f64>();
            let force = Newtons(from.0 + share * span);
            let volts = document.volts_from_newtons(force).0 + error * (high - low);
            let mass_g = force.0 / HandAction::weight(1.0).0;
            WeightStep { mass_g, volts: palpate_model::Volts(volts) }
        });
        let drawn =
            Calibration { name: "drawn".into(), steps: steps.collect(), ..Calibration::default() };
        let curve = drawn.curve().expect("errors of a percent leave a curve that rises");
        let hysteresis = HysteresisLoop { half, std_error: Newtons(0.0), range: (from.0, to.0) };
        Some(Self { curve, hysteresis, side: 0.0, force: 0.0 })
    }

    /// The force that the cell's signal stands for under a force: it lags behind.
    pub fn lagged(&mut self, force: Newtons) -> Newtons {
        self.side = (self.side + 2.0 * (force.0 - self.force) / TURN).clamp(-1.0, 1.0);
        self.force = force.0;
        let half = self.hysteresis.half.0 * self.hysteresis.share_at(force.0);
        Newtons(force.0 - half * self.side)
    }
}

/// Errors of the set of weights in g: of the platform and of each piece.
#[derive(Clone, Debug)]
pub(super) struct OwnWeights(Vec<f64>);

impl OwnWeights {
    /// None where weights are what is engraved on them.
    pub fn of(settings: &SimSettings) -> Self {
        // Behind the cell's own numbers.
        let mut random = Random::new(settings.seed ^ 1, RandomStream::Cell);
        let count = match settings.cell {
            SimCell::Document => 0,
            SimCell::Own => 1 + PIECES,
        };
        let error = |_| random.between(-WEIGHT_TOLERANCE_G, WEIGHT_TOLERANCE_G);
        Self((0..count).map(error).collect())
    }

    /// True mass in g of a stack that should have one.
    pub fn true_mass(&self, mass_g: f64) -> f64 {
        let pieces = ((mass_g - PLATFORM_G) / PIECE_G).floor();
        let on = if pieces < 0.0 { 0 } else { 1 + pieces as usize };
        mass_g + self.0.iter().take(on).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::load_cell::calibration;

    fn settings(seed: u64) -> SimSettings {
        SimSettings { seed, cell: SimCell::Own, ..SimSettings::default() }
    }

    #[test]
    fn seeds_have_cells_of_their_own_near_the_document() {
        let document = calibration(settings(0).profile).curve().unwrap();
        assert!(OwnCell::of(&SimSettings::default(), &document).is_none());
        let volts = |seed: u64, force: f64| {
            let own = OwnCell::of(&settings(seed), &document).unwrap();
            own.curve.volts_from_newtons(Newtons(force)).0
        };
        let known = document.volts_from_newtons(Newtons(8.0)).0;
        let apart: Vec<f64> = (0..20).map(|seed| volts(seed, 8.0) - known).collect();
        // Half a percent of 1.4 V, and no more than four times that.
        assert!(apart.iter().all(|one| one.abs() < 0.03), "{apart:?}");
        assert!(apart.iter().any(|one| one.abs() > 0.003), "{apart:?}");
    }

    #[test]
    fn force_lags_on_the_way_back() {
        let document = calibration(settings(0).profile).curve().unwrap();
        let mut own = OwnCell::of(&settings(3), &document).unwrap();
        let up = own.lagged(Newtons(5.0)).0;
        own.lagged(Newtons(8.0));
        let down = own.lagged(Newtons(5.0)).0;
        let half = own.hysteresis.half.0 * own.hysteresis.share_at(5.0);
        assert!((down - up - 2.0 * half).abs() < 1e-12 && half > 0.0, "{up} {down}");
        assert_eq!(own.lagged(Newtons(0.0)).0, 0.0);
    }

    #[test]
    fn errors_of_weights_add_up_piece_by_piece() {
        let own = OwnWeights::of(&settings(4));
        assert_eq!(own.true_mass(0.0), 0.0);
        let platform = own.true_mass(140.0) - 140.0;
        assert!(platform != 0.0 && platform.abs() <= WEIGHT_TOLERANCE_G);
        let both = own.true_mass(240.0) - 240.0;
        assert!((both - platform - own.0[1]).abs() < 1e-12);
        assert_eq!(OwnWeights::of(&SimSettings::default()).true_mass(240.0), 240.0);
    }
}
