//! What prevents a calibration, one sentence each.

use thiserror::Error;

/// A document makes no calibration.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CalibrationError {
    /// One point or none.
    #[error(
        "the calibration has {count} weight step(s); take at least two, the first without a weight"
    )]
    TooFewSteps { count: usize },
    /// NaN, infinite, or a negative mass.
    #[error(
        "weight step {step} has mass {mass_g} g and signal {volts} V; both must be finite and the mass must not be negative, so take this step again"
    )]
    NotANumber {
        /// Step, counted from 1.
        step: usize,
        mass_g: f64,
        volts: f64,
    },
    /// A number other than a reading.
    #[error(
        "the {what} of the calibration is {value}, which is not possible; correct or remove this value"
    )]
    Fact { what: &'static str, value: f64 },
    #[error(
        "weight step {step} has {mass_g} g after {before_g} g; masses must increase from step to step, so remove or reorder this step"
    )]
    MassNotIncreasing {
        /// Step, counted from 1.
        step: usize,
        mass_g: f64,
        /// The mass of the step before in g.
        before_g: f64,
    },
    /// More mass did not give more volts.
    #[error(
        "weight step {step} reads {volts} V after {before_volts} V; the signal must rise with every weight, so check the wiring and take this step again"
    )]
    VoltsNotIncreasing {
        /// Step, counted from 1 in order of mass.
        step: usize,
        volts: f64,
        /// The signal of the step before in V.
        before_volts: f64,
    },
    /// A series falls where weight is added, by more than repeats differ.
    #[error(
        "under {mass_g} g the load cell reads {volts} V during {way}, less than {before_volts} V under {before_g} g; the signal must rise with every weight, so check the wiring and take the weights again"
    )]
    SignalFalls {
        mass_g: f64,
        /// Mean signal there in V.
        volts: f64,
        /// The next smaller mass of the same direction in g.
        before_g: f64,
        /// Mean signal there in V.
        before_volts: f64,
        /// Loading or unloading.
        way: &'static str,
    },
    /// Next to no rise between two weights.
    #[error(
        "between two of the weights the signal hardly rises (by less than a millionth of the uncertainty of this rise), so forces between them cannot be determined; leave out one of the two weights or measure both again"
    )]
    TooFlat,
    /// Written by a later version.
    #[error(
        "the calibration has format {format}, which is newer than this program can read; use the version that wrote the calibration"
    )]
    NewerFormat { format: u32 },
    /// A step names a weight that the document does not list.
    #[error(
        "weight step {step} uses the weight \"{name}\", which is not in the list of weights; add the weight to the list"
    )]
    UnknownWeight {
        /// Step, counted from 1.
        step: usize,
        name: String,
    },
    /// The mass of a step is not that of its weights.
    #[error(
        "weight step {step} has {mass_g} g but its weights add up to {sum_g} g; correct the mass or the weights"
    )]
    WeightsDisagree {
        /// Step, counted from 1.
        step: usize,
        mass_g: f64,
        /// The sum of its weights in g.
        sum_g: f64,
    },
    /// A tolerance that is none.
    #[error("a tolerance of {tolerance_g} g is not possible; give 0 or more")]
    Tolerance { tolerance_g: f64 },
    /// Straight segments through masses that were not taken.
    #[error(
        "straight segments through {} are not possible; begin at the first weight, end at the last, and use only masses of the calibration, in increasing order", grams(.through_g)
    )]
    NoSuchBreak { through_g: Vec<f64> },
    /// A polynomial that turns back or that the points do not determine.
    #[error(
        "a polynomial of degree {degree} through {points} weights does not rise everywhere between them; choose another degree, or the monotone curve"
    )]
    NotRising {
        degree: usize,
        /// Masses taken.
        points: usize,
    },
}

fn grams(masses: &[f64]) -> String {
    let words: Vec<String> = masses.iter().map(|mass| format!("{mass} g")).collect();
    words.join(", ")
}
