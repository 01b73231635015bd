//! A run as text: its ending, data quality, samples, time use and targets.

use super::catalog::one_line;
use super::text::table;
use palpate_runner::fidelity::{Fidelity, TargetResult};
use palpate_sessions::{DataQuality, EndRecord, Manifest};
use std::fmt;

/// Rigs that report every tick of a millisecond are never further apart, in s, unless a sample is missing.
const GAP_USUAL_S: f64 = 1.1e-3;

/// What a person calls a session, in parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionNameParts {
    pub specimen: String,
    pub protocol: String,
    /// Day and second at which it began, in UTC.
    pub day: String,
    pub time: String,
}

impl SessionNameParts {
    #[must_use]
    pub fn of(manifest: &Manifest) -> Self {
        let specimen = match one_line(&manifest.specimen) {
            text if text.is_empty() => "no specimen".to_owned(),
            text => text,
        };
        let protocol = match (&manifest.imported, manifest.plan["name"].as_str()) {
            (None, Some(name)) => one_line(name),
            (Some(_), _) => "imported".to_owned(),
            (None, None) => "no protocol".to_owned(),
        };
        let at = |format: &str| manifest.started_at.format(format).to_string();
        Self { specimen, protocol, day: at("%Y-%m-%d"), time: at("%H:%M:%S UTC") }
    }
}

impl fmt::Display for SessionNameParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, {} {}", self.specimen, self.protocol, self.day, self.time)
    }
}

/// What a person calls a session: specimen, protocol and when it began.
#[must_use]
pub fn session_name(manifest: &Manifest) -> String {
    SessionNameParts::of(manifest).to_string()
}

#[must_use]
pub fn fidelity_text(
    found: &Fidelity,
    end: Option<&EndRecord>,
    verdict: Option<(DataQuality, &str)>,
) -> String {
    let mut lines = vec![match end {
        Some(end) => format!("ending     {}: {}", end.outcome, end.reason),
        None => "ending     none: the recording was interrupted".into(),
    }];
    lines.push(match verdict {
        Some((verdict, reason)) => format!("verdict    {verdict}: {reason}"),
        None => "verdict    none".into(),
    });
    let late = lateness(found);
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
    let missed = found.missed_targets().count();
    lines.push(match (found.targets.len(), missed) {
        (0, _) => "targets    none: no step with a target was completed".into(),
        (count, 0) => format!("targets    {count}, all met"),
        (count, missed) => format!("targets    {count}, {missed} missed"),
    });
    if !found.targets.is_empty() {
        lines.push(targets(&found.targets));
    }
    lines.join("\n")
}

/// Cycle, quantity, target, achieved value and error of a target.
pub(super) fn target_cells(one: &TargetResult) -> [String; 5] {
    let cycle = if one.cycle == 0 { String::new() } else { one.cycle.to_string() };
    let error = one.error_percent.map_or_else(
        || format!("{:+.4} {}", one.achieved - one.target, one.unit),
        |percent| format!("{percent:+.3} %"),
    );
    let with_unit = |value: f64| format!("{value:.4} {}", one.unit);
    [cycle, one.quantity.to_owned(), with_unit(one.target), with_unit(one.achieved), error]
}

pub(super) fn lateness(found: &Fidelity) -> String {
    match found.late {
        0 => "none late".to_owned(),
        late => format!("{late} late, by up to {:.0} ms", found.late_worst_s * 1e3),
    }
}

fn targets(targets: &[TargetResult]) -> String {
    let rows = targets.iter().map(|one| {
        let mut row = vec![(one.step_index + 1).to_string(), one.step.into()];
        row.extend(target_cells(one));
        row.push(if one.is_within { "" } else { "missed" }.into());
        row
    });
    table("step | | cycle | quantity | target | achieved | error | ", rows)
}
