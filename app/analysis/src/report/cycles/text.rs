//! The tables of an analysis of cycles.

use super::CycleReport;
use crate::report::text::in_columns;
use palpate_figures::uncertain::{plain, with_error};
use palpate_model::units::{Depth, Newtons};
use palpate_rheology::cycles::{CycleAnalysis, Estimate, Prediction, Sinusoid};

/// Everything found in one record, in words.
#[must_use]
pub fn whole(report: &CycleReport) -> String {
    let mut parts = vec![report.name.clone()];
    if !report.cycles.is_empty() {
        parts.push(in_columns(&loops(report)));
        parts.push(steady(report));
    }
    let sections = [relaxation(report), creep(report), prediction(report), sines(report)];
    for (title, lines) in sections.into_iter().filter(|(_, lines)| lines.len() > 1) {
        parts.push(title.to_owned());
        parts.push(in_columns(&lines));
    }
    let remarks = report.sines.iter().flatten().filter_map(Sinusoid::remark);
    parts.extend(remarks.map(|remark| format!("- {remark}")));
    parts.extend(report.source.notes.iter().map(|note| format!("- {note}")));
    parts.join("\n")
}

const NONE: &str = "-";

fn estimate<T: Copy>(one: Option<Estimate<T>>, number: impl Fn(T) -> f64) -> String {
    one.map_or(NONE.into(), |one| with_error(number(one.value), number(one.std_error)))
}

fn maybe(number: Option<f64>, decimals: usize) -> String {
    number.map_or(NONE.into(), |number| format!("{number:.decimals$}"))
}

fn line<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

fn loops(report: &CycleReport) -> Vec<Vec<String>> {
    let at = report.cycles.iter().find_map(|one| one.stiffness);
    let at = at.map_or(String::new(), |one| format!(" at {:.2} mm", one.depth.0));
    let stiffness = format!("N/mm{at}");
    let mut lines = vec![line([
        "cycle",
        "mm/s",
        "depth mm",
        "start N",
        "peak N",
        "change %",
        "shift mm",
        "loading N·mm",
        "loop N·mm",
        "lost %",
        &stiffness,
    ])];
    for (index, one) in report.cycles.iter().enumerate() {
        let change = index.checked_sub(1).map(|before| report.steadiness.changes[before]);
        lines.push(vec![
            one.cycle.to_string(),
            plain(one.speed.0),
            format!("{:.3}", one.depth_peak.0),
            estimate(one.force_start, Newtons::get),
            estimate(Some(one.force_peak), Newtons::get),
            change.map_or(NONE.into(), |change| format!("{:+.2}", change.peak_percent)),
            change
                .and_then(|change| change.shift)
                .map_or(NONE.into(), |shift| format!("{:+.3}", shift.0)),
            format!("{:.3}", one.work_loading),
            maybe(one.work_loop, 3),
            maybe(one.loss_share().map(|share| 100.0 * share), 1),
            estimate(one.stiffness.map(|one| one.slope), |slope| slope),
        ]);
    }
    lines
}

fn steady(report: &CycleReport) -> String {
    let (percent, row) = (report.rule.percent, report.rule.in_a_row);
    let criterion = format!(
        "peak and shift change by less than {percent} % (of the peak, of the depth), {row} times in a row"
    );
    match (report.steadiness.steady_from, report.cycles.len()) {
        (Some(cycle), _) => format!("steady from cycle {cycle} on: {criterion}"),
        (None, count) if count <= row => {
            format!("too few cycles to call them steady: {} are needed", row + 1)
        }
        (None, _) => format!("not steady: never to the end of the record did {criterion}"),
    }
}

fn relaxation(report: &CycleReport) -> (&'static str, Vec<Vec<String>>) {
    let mut lines = vec![line([
        "cycle",
        "held s",
        "peak N",
        "end N",
        "relaxed %",
        "half-time s",
        "end rate N/s",
        "equilibrium N",
    ])];
    for one in &report.cycles {
        let Some(relaxation) = &one.relaxation else {
            continue;
        };
        lines.push(vec![
            one.cycle.to_string(),
            format!("{:.1}", relaxation.duration.0),
            estimate(Some(one.force_peak), Newtons::get),
            estimate(Some(relaxation.force_end), Newtons::get),
            estimate(Some(relaxation.percent), |percent| percent),
            maybe(relaxation.half_time.map(|time| time.0), 3),
            estimate(Some(relaxation.rate_end), |rate| rate),
            estimate(relaxation.equilibrium, Newtons::get),
        ]);
    }
    ("relaxation at constant depth", lines)
}

fn creep(report: &CycleReport) -> (&'static str, Vec<Vec<String>>) {
    let mut lines = vec![line([
        "cycle",
        "held s",
        "force N",
        "sd N",
        "from mm",
        "to mm",
        "added %",
        "end rate mm/s",
    ])];
    let all = report.cycles.iter();
    let all = all.flat_map(|one| one.creep.iter().map(|creep| (one.cycle, creep)));
    for (cycle, creep) in all {
        lines.push(vec![
            cycle.to_string(),
            format!("{:.1}", creep.duration.0),
            plain(creep.force.0),
            plain(creep.force_sd.0),
            format!("{:.3}", creep.depth_start.0),
            estimate(Some(creep.depth_end), Depth::get),
            format!("{:.2}", creep.percent),
            estimate(Some(creep.rate_end), |rate| rate),
        ]);
    }
    ("creep at constant force", lines)
}

fn prediction(report: &CycleReport) -> (&'static str, Vec<Vec<String>>) {
    let mut lines = vec![line([
        "cycle",
        "rms N",
        "rms %",
        "mean N",
        "sd %",
        "worst N",
        "worst %",
        "at s",
        "at peak N",
        "at peak %",
        "at end N",
        "at end %",
    ])];
    for (one, result) in report.cycles.iter().zip(&report.predictions) {
        lines.push(match result {
            Ok(found) => predicted(one, found),
            Err(err) => vec![one.cycle.to_string(), err.to_string()],
        });
    }
    ("prediction minus measurement, percent of the measured peak", lines)
}

fn predicted(one: &CycleAnalysis, found: &Prediction) -> Vec<String> {
    let percent = |error: Newtons| format!("{:+.2}", found.percent(error));
    let end = found.at_end;
    vec![
        one.cycle.to_string(),
        format!("{:.4}", found.rms.0),
        format!("{:.2}", found.percent(found.rms)),
        format!("{:+.4}", found.mean.0),
        format!("{:.2}", found.percent(found.sd)),
        format!("{:+.4}", found.worst.0.0),
        percent(found.worst.0),
        format!("{:.1}", found.worst.1.0 - one.start.0),
        estimate(Some(found.at_peak), Newtons::get),
        percent(found.at_peak.value),
        estimate(end, Newtons::get),
        end.map_or(NONE.into(), |end| percent(end.value)),
    ]
}

fn sines(report: &CycleReport) -> (&'static str, Vec<Vec<String>>) {
    let mut lines = vec![line([
        "Hz",
        "cycles",
        "depth mm",
        "± mm",
        "force N",
        "± N",
        "phase °",
        "storage N/mm",
        "loss N/mm",
        "distortion %",
    ])];
    for result in &report.sines {
        lines.push(match result {
            Ok(one) => sine(one),
            Err(err) => vec![NONE.into(), err.to_string()],
        });
    }
    ("sine", lines)
}

fn sine(one: &Sinusoid) -> Vec<String> {
    vec![
        plain(one.frequency),
        one.cycles.to_string(),
        format!("{:.3}", one.depth_mean.0),
        format!("{:.4}", one.depth_amplitude.0),
        plain(one.force_mean.0),
        estimate(Some(one.force_amplitude), Newtons::get),
        estimate(Some(one.phase_degrees), |phase| phase),
        estimate(Some(one.storage), |stiffness| stiffness),
        estimate(Some(one.loss), |stiffness| stiffness),
        format!("{:.2}", one.distortion_percent),
    ]
}
