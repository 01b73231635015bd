//! What happened in a run, as text: how it ended, what it is worth, what was kept, what the time went to.

use super::text::in_columns;
use palpate_runner::fidelity::{Achieved, Fidelity};
use palpate_sessions::{EndRecord, Verdict};

/// Rigs that report every tick of a millisecond are never further apart, in s, unless a sample is missing.
const GAP_USUAL_S: f64 = 1.1e-3;

/// The lines of a session's fidelity.
#[must_use]
pub fn fidelity_text(
    found: &Fidelity,
    end: Option<&EndRecord>,
    verdict: Option<(Verdict, &str)>,
) -> String {
    let mut lines = vec![match end {
        Some(end) => format!("ending     {}: {}", end.outcome, end.reason),
        None => "ending     none: the recording was interrupted".into(),
    }];
    lines.push(match verdict {
        Some((verdict, reason)) => format!("verdict    {verdict}: {reason}"),
        None => "verdict    none".into(),
    });
    let late = match found.late {
        0 => "none late".into(),
        late => format!("{late} late, by up to {:.0} ms", found.late_worst_s * 1e3),
    };
    // A rig that is asked for its samples over a link gives them as it can.
    let apart = match found.longest_gap_s {
        gap if gap > GAP_USUAL_S => format!(", at most {:.1} ms apart", gap * 1e3),
        _ => String::new(),
    };
    lines.push(format!("samples    {}, {} missing, {late}{apart}", found.samples, found.dropped));
    let time = &found.time_use;
    let whole = time.total_s().max(f64::MIN_POSITIVE);
    let parts = [
        ("set-up", time.set_up_s),
        ("motion", time.motion_s),
        ("hold", time.hold_s),
        ("waiting", time.waiting_s),
    ];
    let parts =
        parts.map(|(name, secs)| format!("{name} {secs:.1} s ({:.0} %)", 100.0 * secs / whole));
    lines.push(format!("time       {}", parts.join(", ")));
    lines.extend(found.remarks.iter().map(|remark| format!("remark     {remark}")));
    let missed = found.missed().count();
    lines.push(match (found.targets.len(), missed) {
        (0, _) => "targets    none: no step with a target was completed".into(),
        (count, 0) => format!("targets    {count}, all met"),
        (count, missed) => format!("targets    {count}, {missed} missed"),
    });
    if !found.targets.is_empty() {
        lines.push(table(&found.targets));
    }
    lines.join("\n")
}

fn table(targets: &[Achieved]) -> String {
    let head = ["step", "", "cycle", "quantity", "target", "achieved", "error", ""];
    let mut rows = vec![head.map(String::from).to_vec()];
    rows.extend(targets.iter().map(|one| {
        let cycle = match one.cycle {
            0 => String::new(),
            cycle => cycle.to_string(),
        };
        let error = one.error_percent.map_or_else(
            || format!("{:+.4} {}", one.achieved - one.target, one.unit),
            |percent| format!("{percent:+.3} %"),
        );
        vec![
            (one.step_index + 1).to_string(),
            one.step.into(),
            cycle,
            one.quantity.into(),
            format!("{:.4} {}", one.target, one.unit),
            format!("{:.4} {}", one.achieved, one.unit),
            error,
            if one.is_within { "" } else { "missed" }.into(),
        ]
    }));
    in_columns(&rows)
}
