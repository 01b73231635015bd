//! What was true on a simulated rig, as a file.

use palpate_drivers::Rig;
use palpate_drivers::sim::{RigWithTruth, SimRig};
use palpate_model::Newtons;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;

/// Places at which the true curve is written down.
const CURVE_POINTS: u32 = 100;

/// The rig, which writes its truth when it is switched off. A file that cannot be written costs no run: the program's
/// log says so.
pub(super) fn write_at_end(rig: SimRig, mut file: File) -> RigWithTruth {
    RigWithTruth::new(
        rig,
        Box::new(move |rig| {
            if let Err(err) = writeln!(file, "{:#}", truth(rig)) {
                tracing::warn!("the truth of the simulated rig cannot be written ({err})");
            }
        }),
    )
}

fn truth(rig: &SimRig) -> serde_json::Value {
    let (truth, curve) = (rig.truth(), rig.true_curve());
    let (from, to) = curve.force_range();
    let points = (0..=CURVE_POINTS).map(|k| {
        let force = from.0 + (to.0 - from.0) * f64::from(k) / f64::from(CURVE_POINTS);
        [force, curve.volts_from_newtons(Newtons(force)).0]
    });
    serde_json::json!({
        "settings": rig.description().settings,
        "parameters": BTreeMap::from(truth.body.named()),
        // As a session counts positions once the axis is homed.
        "contact_mm": truth.surface_counted().0,
        "curve_newtons_volts": points.collect::<Vec<_>>(),
    })
}
