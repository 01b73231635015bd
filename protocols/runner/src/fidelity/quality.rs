//! Data quality of a session, assessed by the program when the run ends. A reviewer may change it.

use super::{Fidelity, TargetResult};
use palpate_protocols::engine::{EndingKind, RunOutcome};
use palpate_sessions::edits::DataQuality;

/// More reasons are in the report only.
const REASONS_MAX: usize = 3;

/// A met target with a relative tolerance above this is named. Forces of a newton and more have this tolerance.
const WIDE: f64 = 0.05;

/// Data quality from the ending and the fidelity, with the reason.
///
/// A run that did not finish is suspect, or rejected if nothing was measured.
#[must_use]
pub fn assess_data_quality(outcome: &RunOutcome, fidelity: &Fidelity) -> (DataQuality, String) {
    if outcome.ending != EndingKind::Finish {
        let how = format!("ended by {}: {}", outcome.ending, outcome.reason);
        return match fidelity.measured {
            0 => (DataQuality::Rejected, format!("nothing was measured; {how}")),
            _ => (DataQuality::Suspect, how),
        };
    }
    let mut reasons = Vec::new();
    if fidelity.dropped > 0 {
        reasons.push(format!("{} samples are missing", fidelity.dropped));
    }
    reasons.extend(fidelity.remarks.iter().cloned());
    reasons.extend(fidelity.missed_targets().map(sentence));
    match reasons.len() {
        0 => (
            DataQuality::Valid,
            match fidelity.targets.len() {
                0 => "finished, no sample missing".into(),
                count => {
                    let widest =
                        widest(fidelity).map_or(String::new(), |widest| format!("; {widest}"));
                    format!("finished, {count} targets met, no sample missing{widest}")
                }
            },
        ),
        count => {
            let mut text = reasons[..count.min(REASONS_MAX)].join("; ");
            if count > REASONS_MAX {
                text += &format!("; and {} more", count - REASONS_MAX);
            }
            (DataQuality::Suspect, text)
        }
    }
}

/// The target with the largest relative tolerance, if that is above [`WIDE`].
fn widest(fidelity: &Fidelity) -> Option<String> {
    let share = |one: &TargetResult| one.allowed / one.target.abs();
    let known = fidelity.targets.iter().filter(|one| one.target != 0.0);
    let widest = known.max_by(|one, next| share(one).total_cmp(&share(next)))?;
    // Rounding must not name a force whose tolerance is exactly one in twenty.
    (share(widest) > 1.001 * WIDE).then(|| {
        format!(
            "{} has a wide tolerance of {:.4} {unit} around its target of {:.4} {unit}",
            place(widest),
            widest.allowed,
            widest.target,
            unit = widest.unit
        )
    })
}

fn place(one: &TargetResult) -> String {
    let cycle = match one.cycle {
        0 => String::new(),
        cycle => format!(" of cycle {cycle}"),
    };
    let (number, step) = (one.step_index + 1, one.step);
    format!("step {number} ({step}{cycle}): {}", one.quantity)
}

fn sentence(one: &TargetResult) -> String {
    format!(
        "{} is {:.4} {unit} instead of {:.4} {unit}, beyond the tolerance of {:.4} {unit}",
        place(one),
        one.achieved,
        one.target,
        one.allowed,
        unit = one.unit
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(ending: EndingKind) -> RunOutcome {
        RunOutcome { ending, reason: "because".into() }
    }

    fn target(achieved: f64) -> TargetResult {
        TargetResult {
            step_index: 4,
            step: "ramp",
            cycle: 2,
            quantity: "depth",
            unit: "mm",
            target: 20.0,
            achieved,
            error_percent: None,
            allowed: 0.015,
            is_within: (achieved - 20.0).abs() <= 0.015,
        }
    }

    #[test]
    fn data_quality_follows_ending_and_targets() {
        let fine = Fidelity { targets: vec![target(20.0)], measured: 1, ..Fidelity::default() };
        let of = |ending, fidelity: &Fidelity| assess_data_quality(&outcome(ending), fidelity);
        let (verdict, reason) = of(EndingKind::Finish, &fine);
        assert_eq!(verdict, DataQuality::Valid);
        assert!(reason.contains("1 targets"), "{reason}");
        // What may be off by a quarter of itself is said to be.
        let mut wide = fine.clone();
        wide.targets.push(TargetResult {
            quantity: "force",
            unit: "N",
            target: 0.2,
            allowed: 0.05,
            ..target(20.0)
        });
        let (verdict, reason) = of(EndingKind::Finish, &wide);
        assert_eq!(verdict, DataQuality::Valid);
        for fact in ["step 5", "cycle 2", "0.0500 N around its target of 0.2000 N"] {
            assert!(reason.contains(fact), "{fact}: {reason}");
        }
        for (change, expected) in [
            (Fidelity { dropped: 7, ..fine.clone() }, "7 samples are missing"),
            (Fidelity { targets: vec![target(19.9)], ..fine.clone() }, "19.9000 mm"),
            (Fidelity { remarks: vec!["too warm".into()], ..fine.clone() }, "too warm"),
            (Fidelity { targets: vec![target(1.0); 9], ..fine.clone() }, "6 more"),
        ] {
            let (verdict, reason) = of(EndingKind::Finish, &change);
            assert_eq!(verdict, DataQuality::Suspect);
            assert!(reason.contains(expected), "{reason}");
        }
        for ending in [EndingKind::Stop, EndingKind::Abort, EndingKind::Halt, EndingKind::Interlock]
        {
            let (verdict, reason) = of(ending, &fine);
            assert_eq!(verdict, DataQuality::Suspect);
            assert!(reason.contains(ending.name()) && reason.contains("because"), "{reason}");
            let nothing = Fidelity { measured: 0, ..fine.clone() };
            assert_eq!(of(ending, &nothing).0, DataQuality::Rejected);
        }
    }
}
