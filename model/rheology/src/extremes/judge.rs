//! The criterion of a right answer.

use crate::families::{RelaxationTerm, StepError};
use crate::reference::{REFERENCE_DIGITS, Reference, RuleReference};
use palpate_model::units::{Depth, Newtons, Seconds};
use serde::Serialize;

/// Largest error of an exact step, relative to the peak force of the path.
pub const TOLERANCE: f64 = 1e-13;
/// Forces in N below this count as none: the exact step drops what falls below 1e-200 N, and this is
/// that over the tolerance with room for a hundred terms.
const FORCE_MIN: f64 = 1e-180;
/// Forces in N beyond this may be refused, numbers though they are: a sum of terms may not be one.
const FORCE_MAX: f64 = 1e299;

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum ExtremesVerdict {
        Right = "right",
        /// No number, and the reason in words.
        Refused = "refused",
        /// Numbers of a fit, with a warning in words not to rely on them.
        Flagged = "flagged",
        Wrong = "WRONG",
    }
}

/// One case run on one subject.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExtremesRow {
    pub group: &'static str,
    pub case: String,
    /// Family, integrator or fit.
    pub subject: String,
    pub verdict: ExtremesVerdict,
    /// Error of the answer: of a force relative to the peak of the path, of parameters the largest
    /// relative one; null where there is no finite number.
    pub relative_error: Option<f64>,
    pub tolerance: f64,
    /// The refusal or warning; what is wrong; empty where the number is right.
    pub sentence: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpectedAnswer {
    /// A number: a double can hold the answer.
    Number,
    /// A refusal: there is no answer.
    Refusal,
    /// Either: what the case can tell is for the subject to judge.
    Either,
}

/// Answer of a subject to a case.
#[derive(Clone, Debug, PartialEq)]
pub enum SubjectAnswer {
    /// The relative error, and the warnings that came with it.
    Number {
        error: f64,
        warnings: Vec<String>,
    },
    Refused(String),
}

#[must_use]
pub fn judge(
    group: &'static str,
    case: impl Into<String>,
    subject: &str,
    expected: ExpectedAnswer,
    tolerance: f64,
    answer: SubjectAnswer,
) -> ExtremesRow {
    let (verdict, error, sentence) = match answer {
        SubjectAnswer::Refused(reason) if reason.trim().is_empty() => {
            (ExtremesVerdict::Wrong, None, "refused without a reason".to_owned())
        }
        SubjectAnswer::Refused(reason) if expected == ExpectedAnswer::Number => {
            (ExtremesVerdict::Wrong, None, format!("refused although an answer exists: {reason}"))
        }
        SubjectAnswer::Refused(reason) => (ExtremesVerdict::Refused, None, reason),
        SubjectAnswer::Number { error, .. } if !error.is_finite() => {
            (ExtremesVerdict::Wrong, None, "the answer is not a finite number".to_owned())
        }
        SubjectAnswer::Number { error, .. } if expected == ExpectedAnswer::Refusal => (
            ExtremesVerdict::Wrong,
            Some(error),
            "the answer is a number, but no answer exists".to_owned(),
        ),
        SubjectAnswer::Number { error, .. } if error <= tolerance => {
            (ExtremesVerdict::Right, Some(error), String::new())
        }
        SubjectAnswer::Number { error, warnings } if !warnings.is_empty() => {
            (ExtremesVerdict::Flagged, Some(error), warnings.join("; "))
        }
        SubjectAnswer::Number { error, .. } => (
            ExtremesVerdict::Wrong,
            Some(error),
            format!("the error of {error:.1e} exceeds the tolerance of {tolerance:.0e}"),
        ),
    };
    ExtremesRow {
        group,
        case: case.into(),
        subject: subject.to_owned(),
        verdict,
        relative_error: error,
        tolerance,
        sentence,
    }
}

/// Something that turns depth over time into force.
pub trait ExtremesSubject {
    fn name(&self) -> String;

    /// The terms whose exact response it should give; a refusal in words where there are none.
    fn terms(&self) -> Result<Vec<RelaxationTerm>, String>;

    /// The force in N after every step of a path, or a refusal.
    fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String>;

    /// The right forces from rest at `start`, in so many digits.
    fn oracle(&self, start: Depth, digits: usize) -> Result<Oracle, String> {
        let exact = Reference::with_digits(&self.terms()?, start, digits);
        exact.map(Oracle::Exact).map_err(|err| err.to_string())
    }

    /// Largest error allowed, relative to the peak force of the path.
    fn tolerance(&self, _path: &PathCase) -> f64 {
        TOLERANCE
    }

    /// Why it may refuse this path although there is an answer, such as a limit of stability.
    fn may_refuse(&self, _path: &PathCase) -> bool {
        false
    }
}

#[derive(Clone, Debug)]
pub enum Oracle {
    Exact(Reference),
    /// The response of an approximate rule.
    Rule(RuleReference),
}

impl Oracle {
    fn step(&mut self, depth: Depth, dt: Seconds) -> Result<Newtons, StepError> {
        match self {
            Self::Exact(reference) => reference.step(depth, dt),
            Self::Rule(reference) => reference.step(depth, dt),
        }
    }

    fn force(&self) -> Newtons {
        match self {
            Self::Exact(reference) => reference.force(),
            Self::Rule(reference) => reference.force(),
        }
    }

    fn error_of(&self, force: Newtons) -> f64 {
        match self {
            Self::Exact(reference) => reference.error_of(force),
            Self::Rule(reference) => reference.error_of(force),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct PathCase {
    pub group: &'static str,
    pub case: String,
    /// Depth in mm at which the body is at rest at first.
    pub start: f64,
    /// Duration in s and depth in mm of every step.
    pub steps: Vec<(f64, f64)>,
}

impl PathCase {
    pub(super) fn new(
        group: &'static str,
        case: impl Into<String>,
        start: f64,
        steps: Vec<(f64, f64)>,
    ) -> Self {
        Self { group, case: case.into(), start, steps }
    }

    /// Puts the path to a subject.
    pub fn run_on(&self, subject: &dyn ExtremesSubject) -> ExtremesRow {
        let forces = subject.forces(self);
        let truth = self.truth(subject, forces.as_deref().unwrap_or_default());
        let expected = match truth {
            // Without a true force there is no answer.
            Err(_) => ExpectedAnswer::Refusal,
            Ok(truth)
                if truth.peak > FORCE_MAX || subject.may_refuse(self) || self.is_too_fast() =>
            {
                ExpectedAnswer::Either
            }
            Ok(_) => ExpectedAnswer::Number,
        };
        let answer = match (forces, truth) {
            (Err(reason), _) => SubjectAnswer::Refused(reason),
            (Ok(_), Ok(truth)) => SubjectAnswer::Number {
                error: truth.error / truth.peak.max(FORCE_MIN),
                warnings: Vec::new(),
            },
            // Judged as a number where there is none.
            (Ok(_), Err(_)) => SubjectAnswer::Number { error: 0.0, warnings: Vec::new() },
        };
        let (name, tolerance) = (subject.name(), subject.tolerance(self));
        judge(self.group, self.case.as_str(), &name, expected, tolerance, answer)
    }

    /// Whether a speed of this path is beyond the largest number.
    fn is_too_fast(&self) -> bool {
        let mut from = self.start;
        self.steps.iter().any(|&(dt, to)| {
            let speed = (to - std::mem::replace(&mut from, to)) / dt;
            dt > 0.0 && !speed.is_finite()
        })
    }

    /// The exact force, as far as forces are given compared with them.
    fn truth(&self, subject: &dyn ExtremesSubject, forces: &[f64]) -> Result<TrueForces, String> {
        let terms = subject.terms()?;
        let mut reference = subject.oracle(Depth(self.start), self.digits(&terms))?;
        let mut truth = TrueForces {
            peak: reference.force().0.abs(),
            error: if forces.is_empty() || forces.len() == self.steps.len() {
                0.0
            } else {
                f64::INFINITY
            },
        };
        for (index, &(dt, depth)) in self.steps.iter().enumerate() {
            let exact = reference.step(Depth(depth), Seconds(dt)).map_err(|err| err.to_string())?;
            truth.peak = truth.peak.max(exact.0.abs());
            if let Some(&force) = forces.get(index) {
                let miss = reference.error_of(Newtons(force)).abs();
                // A NaN must not get lost in the maximum.
                let is_worse = force.is_nan() || miss > truth.error;
                truth.error = match (force.is_finite(), is_worse) {
                    (false, _) => f64::INFINITY,
                    (true, true) => miss,
                    (true, false) => truth.error,
                };
            }
        }
        Ok(truth)
    }

    /// Digits the reference needs: its closed forms lose those between the smallest number and one,
    /// twice.
    fn digits(&self, terms: &[RelaxationTerm]) -> usize {
        let drives = terms.iter().flat_map(|term| [term.elastic, term.rate]);
        let coefficients = drives.flat_map(|drive| {
            let (amplitude, b) = drive.exponential.unwrap_or_default();
            drive.powers.into_iter().chain([amplitude, b])
        });
        let steps = self.steps.iter().flat_map(|&(dt, depth)| [dt, depth]);
        let smallest = steps
            .chain(terms.iter().map(|term| term.tau))
            .chain(coefficients)
            .filter(|value| *value != 0.0)
            .fold(1.0f64, |least, value| least.min(value.abs()));
        REFERENCE_DIGITS + 2 * (-smallest.log10()).max(0.0) as usize
    }
}

/// Peak force of a path and largest error, in N.
#[derive(Clone, Copy, Debug)]
struct TrueForces {
    peak: f64,
    error: f64,
}
