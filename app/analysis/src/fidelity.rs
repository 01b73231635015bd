//! Targets of a recorded session, and the values it achieved.

use crate::source::{SourceError, decisions};
use palpate_protocols::plans::Plan;
use palpate_runner::fidelity::{Fidelity, FidelityMeter};
use palpate_sessions::log::Session;

pub fn of_session(session: &Session) -> Result<Fidelity, SourceError> {
    let rig = match (&session.manifest.imported, &session.manifest.rig) {
        (None, Some(rig)) => rig,
        (imported, _) => {
            let file = imported.as_ref().map(|from| from.file.clone()).unwrap_or_default();
            return Err(SourceError::Imported { file });
        }
    };
    let plan: Plan = serde_json::from_value(session.manifest.plan.clone())
        .map_err(|err| SourceError::Plan { detail: err.to_string() })?;
    let decisions = decisions(session)?;
    let mut meter = FidelityMeter::new(&plan, rig);
    let mut next = decisions.iter().peekable();
    for (index, row) in session.rows.iter().enumerate() {
        while let Some((_, effect)) = next.next_if(|(after, _)| *after <= index as u64 + 1) {
            meter.push_effect(effect);
        }
        meter.push_row(row);
    }
    next.for_each(|(_, effect)| meter.push_effect(effect));
    Ok(meter.into_fidelity())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::rig::Phase;
    use palpate_runner::fidelity::TargetResult;
    use palpate_sessions::record::SampleRow;
    use std::path::Path;

    fn recorded() -> Session {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        Session::open(&sessions.join("ramp-hold-lab")).unwrap()
    }

    fn of(found: &Fidelity, step: &str, quantity: &str) -> TargetResult {
        let is_it = |one: &&TargetResult| (one.step, one.quantity) == (step, quantity);
        found.targets.iter().find(is_it).cloned().unwrap_or_else(|| panic!("{found:?}"))
    }

    #[test]
    fn a_sound_run_met_its_targets() {
        let session = recorded();
        let found = of_session(&session).unwrap();
        assert_eq!(found.samples, session.rows.len() as u64);
        assert_eq!((found.dropped, found.late, found.missed_targets().count()), (0, 0, 0));
        for quantity in ["speed", "speed by pulses", "depth"] {
            of(&found, "ramp", quantity);
        }
        // The hold is exact to the sample.
        let hold = of(&found, "hold", "duration");
        assert!((hold.achieved - hold.target).abs() < 1e-9, "{hold:?}");
        let last = session.rows.last().unwrap().host.seconds().0;
        assert!((found.time_use.total_s() - last).abs() < 1e-6);
    }

    #[test]
    fn what_is_missing_late_or_short_is_found() {
        let mut session = recorded();
        let phase = |phase| move |row: &SampleRow| row.phase == phase;
        let ramp = session.rows.iter().position(phase(Phase::Ramp)).unwrap();
        let hold = session.rows.iter().position(phase(Phase::Hold)).unwrap();
        let depth = of(&of_session(&session).unwrap(), "ramp", "depth").achieved;
        // 50 ms late, and on time again at the next sample.
        session.rows[hold + 100].host.0 += 50_000_000;
        // A speed that is 3 % low, so the ramp ends short.
        for row in &mut session.rows[ramp..hold] {
            row.depth = row.depth.map(|depth| 0.97 * depth);
        }
        for entry in &mut session.entries {
            entry.after_sample -= 3 * u64::from(entry.after_sample > hold as u64 + 503);
        }
        session.rows.drain(hold + 500..hold + 503);
        let found = of_session(&session).unwrap();
        assert_eq!((found.dropped, found.late), (3, 1));
        // Arrival itself varies by half a millisecond.
        assert!((found.late_worst_s - 0.05).abs() < 1e-3, "{}", found.late_worst_s);
        // A ramp that ends short takes some of its braking for cruise.
        let speed = of(&found, "ramp", "speed");
        assert!(!speed.is_within && (speed.error_percent.unwrap() + 3.0).abs() < 0.05, "{speed:?}");
        assert!(of(&found, "ramp", "speed by pulses").is_within);
        let short = of(&found, "ramp", "depth");
        assert!(!short.is_within && (short.achieved - 0.97 * depth).abs() < 1e-9);
        // Time goes by the controller's clock, missing samples or not.
        assert!(of(&found, "hold", "duration").is_within);
    }
}
