//! Checks of a session that measured a calibration.

use crate::daily::DAILY_CHECK;
use palpate_model::assessment::QualityCheck;
use palpate_model::rig::Limits;
use palpate_protocols::plans::RampHold;
use palpate_protocols::preview::preview;
use palpate_runner::programme::calibration_from_session;
use palpate_sessions::Session;

/// None where the session measured no calibration.
pub(super) fn calibration_checks(session: &Session) -> Vec<QualityCheck> {
    // A daily check weighs too, and has a judgement of its own.
    let is_check = session.manifest.plan["name"] == DAILY_CHECK;
    let found = (!is_check).then(|| calibration_from_session(session, "measured").ok()).flatten();
    let checks = found.and_then(|calibration| {
        let curve = calibration.curve().ok()?;
        // The protocol that is most often run with a new calibration.
        let next = RampHold::default().plan();
        let rig = session.manifest.rig.as_ref();
        let expected = rig.map(|rig| {
            preview(&next, rig, &Limits::for_travel(rig.travel), &curve, true).force_band[1]
        });
        Some(calibration.assess(expected).ok()?.checks)
    });
    checks.unwrap_or_default()
}
