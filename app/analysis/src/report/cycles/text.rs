//! The tables of an analysis of cycles.

use super::CycleReport;
use crate::report::text::table;
use palpate_figures::uncertain::{plain, with_error};
use palpate_model::units::{Depth, Newtons};
use palpate_rheology::cycles::{CycleAnalysis, CyclePrediction, Estimate, Sinusoid};

/// Everything found in one record, in words.
#[must_use]
pub fn cycles_text(report: &CycleReport) -> String {
    let mut parts = vec![report.name.clone()];
    if !report.cycles.is_empty() {
        parts.push(loops(report));
        parts.push(steady(report));
    }
    let sections = [relaxation(report), creep(report), prediction(report), sines(report)];
    parts.extend(sections.into_iter().flatten());
    let remarks = report.sines.iter().flatten().filter_map(Sinusoid::remark);
    parts.extend(remarks.map(|remark| format!("- {remark}")));
    parts.extend(report.source.notes.iter().map(|note| format!("- {note}")));
    parts.join("\n")
}

const NONE: &str = "-";

fn estimate<T: Copy>(one: Option<Estimate<T>>, number: impl Fn(T) -> f64) -> String {
    one.map_or(NONE.into(), |one| with_error(number(one.value), number(one.std_error)))
}

fn newtons(one: Estimate<Newtons>) -> String {
    estimate(Some(one), Newtons::get)
}

fn number(one: Estimate<f64>) -> String {
    estimate(Some(one), |number| number)
}

fn maybe(number: Option<f64>, decimals: usize) -> String {
    number.map_or(NONE.into(), |number| format!("{number:.decimals$}"))
}

/// A table under its title, if it has rows.
fn section(title: &str, head: &str, rows: Vec<Vec<String>>) -> Option<String> {
    (!rows.is_empty()).then(|| format!("{title}\n{}", table(head, rows)))
}

fn loops(report: &CycleReport) -> String {
    let at = report.cycles.iter().find_map(|one| one.stiffness);
    let at = at.map_or(String::new(), |one| format!(" at {:.2} mm", one.depth.0));
    let head = format!(
        "cycle | speed (mm/s) | depth (mm) | start (N) | peak (N) | change (%) | shift (mm) | loading (N·mm) | loop (N·mm) | lost (%) | stiffness (N/mm){at}"
    );
    let row = |(index, one): (usize, &CycleAnalysis)| {
        let change = index.checked_sub(1).map(|before| report.steadiness.changes[before]);
        let shift = change.and_then(|change| change.shift);
        vec![
            one.cycle.to_string(),
            plain(one.speed.0),
            format!("{:.3}", one.depth_peak.0),
            estimate(one.force_start, Newtons::get),
            newtons(one.force_peak),
            change.map_or(NONE.into(), |change| format!("{:+.2}", change.peak_percent)),
            shift.map_or(NONE.into(), |shift| format!("{:+.3}", shift.0)),
            format!("{:.3}", one.work_loading),
            maybe(one.work_loop, 3),
            maybe(one.loss_share().map(|share| 100.0 * share), 1),
            estimate(one.stiffness.map(|one| one.slope), |slope| slope),
        ]
    };
    table(&head, report.cycles.iter().enumerate().map(row))
}

fn steady(report: &CycleReport) -> String {
    let (percent, row) = (report.rule.percent, report.rule.in_a_row);
    let criterion = format!(
        "from one cycle to the next the peak force changes by less than {percent} % and the loop shifts by less than {percent} % of the depth, {row} times in a row"
    );
    match (report.steadiness.steady_from, report.cycles.len()) {
        (Some(cycle), _) => format!("steady from cycle {cycle} on: {criterion}"),
        (None, count) if count <= row => {
            format!(
                "too few cycles to judge whether they are steady: at least {} are needed",
                row + 1
            )
        }
        (None, _) => format!("not steady by the end of the record; the criterion is: {criterion}"),
    }
}

fn relaxation(report: &CycleReport) -> Option<String> {
    let row = |one: &CycleAnalysis| {
        let relaxation = one.relaxation.as_ref()?;
        Some(vec![
            one.cycle.to_string(),
            format!("{:.1}", relaxation.duration.0),
            newtons(one.force_peak),
            newtons(relaxation.force_end),
            number(relaxation.percent),
            maybe(relaxation.half_time.map(|time| time.0), 3),
            number(relaxation.rate_end),
            estimate(relaxation.equilibrium, Newtons::get),
        ])
    };
    let head = "cycle | hold (s) | peak (N) | end (N) | relaxed (%) | half-time (s) | rate at the end (N/s) | equilibrium (N)";
    section("relaxation at constant depth", head, report.cycles.iter().filter_map(row).collect())
}

fn creep(report: &CycleReport) -> Option<String> {
    let all = report.cycles.iter().flat_map(|one| one.creep.iter().map(|creep| (one.cycle, creep)));
    let rows = all.map(|(cycle, creep)| {
        vec![
            cycle.to_string(),
            format!("{:.1}", creep.duration.0),
            plain(creep.force.0),
            plain(creep.force_sd.0),
            format!("{:.3}", creep.depth_start.0),
            estimate(Some(creep.depth_end), Depth::get),
            format!("{:.2}", creep.percent),
            number(creep.rate_end),
        ]
    });
    let head = "cycle | hold (s) | force (N) | sd (N) | from (mm) | to (mm) | added (%) | rate at the end (mm/s)";
    section("creep at constant force", head, rows.collect())
}

fn prediction(report: &CycleReport) -> Option<String> {
    let all = report.cycles.iter().zip(&report.predictions);
    let rows = all.map(|(one, result)| match result {
        Ok(found) => predicted(one, found),
        Err(err) => vec![one.cycle.to_string(), err.to_string()],
    });
    let title = "prediction minus measurement, percent of the measured peak";
    let head = "cycle | rms (N) | rms (%) | mean (N) | sd (%) | worst (N) | worst (%) | time of worst (s) | at peak (N) | at peak (%) | at end (N) | at end (%)";
    section(title, head, rows.collect())
}

fn predicted(one: &CycleAnalysis, found: &CyclePrediction) -> Vec<String> {
    let percent = |error: Newtons| format!("{:+.2}", found.percent(error));
    vec![
        one.cycle.to_string(),
        format!("{:.4}", found.rms.0),
        format!("{:.2}", found.percent(found.rms)),
        format!("{:+.4}", found.mean.0),
        format!("{:.2}", found.percent(found.sd)),
        format!("{:+.4}", found.worst.0.0),
        percent(found.worst.0),
        format!("{:.1}", found.worst.1.0 - one.start.0),
        newtons(found.at_peak),
        percent(found.at_peak.value),
        estimate(found.at_end, Newtons::get),
        found.at_end.map_or(NONE.into(), |end| percent(end.value)),
    ]
}

fn sines(report: &CycleReport) -> Option<String> {
    let rows = report.sines.iter().map(|result| match result {
        Ok(one) => vec![
            plain(one.frequency),
            one.cycles.to_string(),
            format!("{:.3}", one.depth_mean.0),
            format!("{:.4}", one.depth_amplitude.0),
            plain(one.force_mean.0),
            newtons(one.force_amplitude),
            number(one.phase_degrees),
            number(one.storage),
            number(one.loss),
            format!("{:.2}", one.distortion_percent),
        ],
        Err(err) => vec![NONE.into(), err.to_string()],
    });
    let head = "frequency (Hz) | cycles | depth (mm) | depth amplitude (mm) | force (N) | force amplitude (N) | phase (°) | storage (N/mm) | loss (N/mm) | distortion (%)";
    section("sine", head, rows.collect())
}
