//! The picture of an analysis of cycles: loops, how peak and place change, and how the force relaxes.

use super::CycleReport;
use crate::report::picture::{LEFT, RIGHT, WIDTH, look, title};
use crate::report::svg::{Anchor, Ink, Panel, Svg};
use crate::report::thin::thin;
use crate::theme::tokens::LIGHT;
use eframe::egui::Color32;
use palpate_model::cycles::CycleSample;
use palpate_model::rig::Phase;

/// Top and bottom of the loops and of the row of panels below, in px.
const LOOPS: [f64; 2] = [66.0, 400.0];
const ROW: [f64; 2] = [480.0, 680.0];
/// Between two panels of the row, for the numbers and the name of an axis.
const GAP: f64 = 84.0;
const HEIGHT: f64 = 740.0;
/// Points of a loop or a hold in a pixel's width are two at most.
const COLUMNS: usize = 860;
/// Room for so many cycles at least: with fewer, marks would stand between whole numbers.
const SLOTS_MIN: usize = 8;

/// The picture of one record. The first cycle is blue, the last vermillion, those between in between.
#[must_use]
pub fn picture(report: &CycleReport) -> String {
    let mut svg = Svg::new(WIDTH);
    let count = report.cycles.len();
    let words = match report.steadiness.steady_from {
        Some(cycle) => format!("{count} cycles, steady from cycle {cycle} on"),
        None => format!("{count} cycles"),
    };
    title(&mut svg, &report.name, &words);
    loops(&mut svg, report);
    let relaxations = relaxations(report);
    let panels = if relaxations.is_empty() { 2 } else { 3 };
    let width = (RIGHT - LEFT - GAP * f64::from(panels - 1)) / f64::from(panels);
    let place = |index: i32| {
        let left = LEFT + f64::from(index) * (width + GAP);
        [left, ROW[0], left + width, ROW[1]]
    };
    let first = report.cycles.first().and_then(|one| one.at_half());
    let peaks = report.cycles.iter().enumerate();
    let peaks = peaks.map(|(i, one)| Some([i as f64 + 1.0, one.force_peak.value.0]));
    by_cycle(
        &mut svg,
        report,
        place(0),
        "peak (N)",
        &peaks.collect::<Vec<_>>(),
    );
    let shifts = report.cycles.iter().enumerate().map(|(i, one)| {
        let shift = one.at_half()?.0 - first?.0;
        Some([i as f64 + 1.0, shift])
    });
    by_cycle(
        &mut svg,
        report,
        place(1),
        "shift from cycle 1 (mm)",
        &shifts.collect::<Vec<_>>(),
    );
    if panels == 3 {
        let curves: Vec<&[[f64; 2]]> = relaxations.iter().map(|(_, curve)| &curve[..]).collect();
        let panel = Panel::around(place(2), [0.0, longest(&curves)], &curves);
        panel.axes(&mut svg, ["time of hold (s)", "force (N)"], look());
        for (index, curve) in &relaxations {
            panel.line(&mut svg, curve, color(*index, count), 1.2);
        }
    }
    svg.finish(HEIGHT, LIGHT.canvas, &format!("Cycles of {}", report.name))
}

fn color(index: usize, count: usize) -> Color32 {
    let share = index as f32 / (count.max(2) - 1) as f32;
    LIGHT.series.lerp_to_gamma(LIGHT.limit, share)
}

fn loops(svg: &mut Svg, report: &CycleReport) {
    let count = report.cycles.len();
    let curves: Vec<Vec<[f64; 2]>> = (0..count).map(|index| one_loop(report, index)).collect();
    let borrowed: Vec<&[[f64; 2]]> = curves.iter().map(Vec::as_slice).collect();
    let depths = || {
        borrowed
            .iter()
            .flat_map(|curve| curve.iter().map(|point| point[0]))
    };
    let (low, high) = (depths().fold(0.0, f64::min), depths().fold(0.0, f64::max));
    let range = [low, if high > low { high } else { low + 1.0 }];
    let panel = Panel::around([LEFT, LOOPS[0], RIGHT, LOOPS[1]], range, &borrowed);
    panel.axes(svg, ["depth (mm)", "force (N)"], look());
    for (index, curve) in curves.iter().enumerate() {
        panel.line(svg, curve, color(index, count), 1.2);
    }
    for (i, index) in [0, count.saturating_sub(1)]
        .into_iter()
        .enumerate()
        .take(count.min(2))
    {
        let (x, y) = (LEFT + 20.0, LOOPS[0] + 20.0 + 20.0 * i as f64);
        svg.line(&[[x, y], [x + 24.0, y]], color(index, count), 2.5);
        let text = format!("cycle {}", report.cycles[index].cycle);
        svg.text(
            [x + 30.0, y + 4.0],
            Ink::plain(LIGHT.text).anchored(Anchor::Start),
            &text,
        );
    }
}

/// Force over depth, thinned one phase after the other, as thinning wants depths in order.
fn one_loop(report: &CycleReport, index: usize) -> Vec<[f64; 2]> {
    let part = |phase: Phase| {
        let point = |one: &CycleSample| [one.depth.0, one.force.0];
        let all = report.samples(index).filter(move |one| one.phase == phase);
        thin(all.map(point), COLUMNS)
    };
    let phases = [Phase::Ramp, Phase::Hold, Phase::Creep, Phase::Unload];
    phases.into_iter().flat_map(part).collect()
}

/// Force over time of every hold, with the index of its cycle.
fn relaxations(report: &CycleReport) -> Vec<(usize, Vec<[f64; 2]>)> {
    let indices = (0..report.cycles.len()).filter(|i| report.cycles[*i].relaxation.is_some());
    let curve = |index: usize| {
        let held = report.samples(index).filter(|one| one.phase == Phase::Hold);
        let start = held.clone().next().map_or(0.0, |one| one.t.0);
        thin(
            held.map(move |one| [one.t.0 - start, one.force.0]),
            COLUMNS / 3,
        )
    };
    indices.map(|index| (index, curve(index))).collect()
}

fn longest(curves: &[&[[f64; 2]]]) -> f64 {
    let ends = curves.iter().filter_map(|curve| curve.last());
    ends.map(|point| point[0]).fold(0.0, f64::max).max(1e-3)
}

/// Dots over the number of the cycle, joined by a line.
fn by_cycle(
    svg: &mut Svg,
    report: &CycleReport,
    place: [f64; 4],
    name: &str,
    points: &[Option<[f64; 2]>],
) {
    let count = report.cycles.len();
    let known: Vec<[f64; 2]> = points.iter().flatten().copied().collect();
    let panel = Panel::around(place, [0.5, count.max(SLOTS_MIN) as f64 + 0.5], &[&known]);
    panel.axes(svg, ["cycle", name], look());
    panel.line(svg, &known, LIGHT.line, 1.0);
    for [x, y] in &known {
        svg.dot(panel.at([*x, *y]), color(*x as usize - 1, count), 3.5);
    }
}
