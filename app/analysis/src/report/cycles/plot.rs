//! The picture of an analysis of cycles: loops, how peak and place change, and how the force relaxes.

use super::CycleReport;
use crate::report::band::{self, Band};
use crate::report::picture::{LEFT, RIGHT, WIDTH, look, title};
use ecolor::Color32;
use palpate_figures::drawing::{Anchor, Ink, Panel, Svg};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::ForceUncertainty;
use palpate_model::rig::Phase;
use palpate_rheology::cycles::CycleSample;

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

/// The picture of one record. The first cycle is blue, the last vermillion, those between in between. Around forces lies
/// the band of twice their calibration's standard uncertainty, where that is stated: of loops and holds around the
/// first and the last, as more would hide each other.
#[must_use]
pub fn picture(report: &CycleReport) -> String {
    let mut svg = Svg::new(WIDTH);
    let count = report.cycles.len();
    let words = match report.steadiness.steady_from {
        Some(cycle) => format!("{count} cycles, steady from cycle {cycle} on"),
        None => format!("{count} cycles"),
    };
    title(&mut svg, &report.name, &words);
    let calibration = report.source.calibration.as_ref();
    let uncertainty = calibration.and_then(|one| ForceUncertainty::of(one).ok());
    let uncertainty = uncertainty.as_ref();
    band::legend(&mut svg, uncertainty);
    loops(&mut svg, report, uncertainty);
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
    by_cycle(&mut svg, report, place(0), "peak (N)", &peaks.collect::<Vec<_>>(), uncertainty);
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
        None,
    );
    if panels == 3 {
        let curves: Vec<&[[f64; 2]]> = relaxations.iter().map(|(_, curve)| &curve[..]).collect();
        let ends = first_and_last(relaxations.len()).map(|i| &relaxations[i]);
        let bands: Vec<(usize, Band)> =
            ends.map(|(index, curve)| (*index, Band::around(curve, uncertainty))).collect();
        let mut inside = curves.clone();
        inside.extend(bands.iter().flat_map(|(_, band)| band.edges()));
        let panel = Panel::around(place(2), [0.0, longest(&curves)], &inside);
        panel.axes(&mut svg, ["time of hold (s)", "force (N)"], look());
        for (index, band) in &bands {
            band.draw(&mut svg, &panel, color(*index, count));
        }
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

/// Indices of the first and the last of so many, each once.
fn first_and_last(count: usize) -> impl Iterator<Item = usize> {
    let last = count.checked_sub(1);
    let first = last.filter(|last| *last > 0).map(|_| 0);
    first.into_iter().chain(last)
}

fn loops(svg: &mut Svg, report: &CycleReport, uncertainty: Option<&ForceUncertainty>) {
    let count = report.cycles.len();
    let curves: Vec<Vec<[f64; 2]>> =
        (0..count).map(|index| one_loop(report, index).concat()).collect();
    let bands: Vec<(usize, Band)> = first_and_last(count)
        .flat_map(|index| one_loop(report, index).map(|part| (index, part)))
        .map(|(index, part)| (index, Band::around(&part, uncertainty)))
        .collect();
    let mut borrowed: Vec<&[[f64; 2]]> = curves.iter().map(Vec::as_slice).collect();
    borrowed.extend(bands.iter().flat_map(|(_, band)| band.edges()));
    let depths = || borrowed.iter().flat_map(|curve| curve.iter().map(|point| point[0]));
    let (low, high) = (depths().fold(0.0, f64::min), depths().fold(0.0, f64::max));
    let range = [low, if high > low { high } else { low + 1.0 }];
    let panel = Panel::around([LEFT, LOOPS[0], RIGHT, LOOPS[1]], range, &borrowed);
    panel.axes(svg, ["depth (mm)", "force (N)"], look());
    for (index, band) in &bands {
        band.draw(svg, &panel, color(*index, count));
    }
    for (index, curve) in curves.iter().enumerate() {
        panel.line(svg, curve, color(index, count), 1.2);
    }
    for (i, index) in [0, count.saturating_sub(1)].into_iter().enumerate().take(count.min(2)) {
        let (x, y) = (LEFT + 20.0, LOOPS[0] + 20.0 + 20.0 * i as f64);
        svg.line(&[[x, y], [x + 24.0, y]], color(index, count), 2.5);
        let text = format!("cycle {}", report.cycles[index].cycle);
        svg.text([x + 30.0, y + 4.0], Ink::plain(LIGHT.text).anchored(Anchor::Start), &text);
    }
}

/// Force over depth, thinned one phase after the other, as thinning wants depths in order.
fn one_loop(report: &CycleReport, index: usize) -> [Vec<[f64; 2]>; 4] {
    let part = |phase: Phase| {
        let point = |one: &CycleSample| [one.depth.0, one.force.0];
        let all = report.samples(index).filter(move |one| one.phase == phase);
        thin(all.map(point), COLUMNS)
    };
    [Phase::Ramp, Phase::Hold, Phase::Creep, Phase::Unload].map(part)
}

/// Force over time of every hold, with the index of its cycle.
fn relaxations(report: &CycleReport) -> Vec<(usize, Vec<[f64; 2]>)> {
    let indices = (0..report.cycles.len()).filter(|i| report.cycles[*i].relaxation.is_some());
    let curve = |index: usize| {
        let held = report.samples(index).filter(|one| one.phase == Phase::Hold);
        let start = held.clone().next().map_or(0.0, |one| one.t.0);
        thin(held.map(move |one| [one.t.0 - start, one.force.0]), COLUMNS / 3)
    };
    indices.map(|index| (index, curve(index))).collect()
}

fn longest(curves: &[&[[f64; 2]]]) -> f64 {
    let ends = curves.iter().filter_map(|curve| curve.last());
    ends.map(|point| point[0]).fold(0.0, f64::max).max(1e-3)
}

/// Dots over the number of the cycle, joined by a line; with a band where they are forces whose uncertainty is stated.
fn by_cycle(
    svg: &mut Svg,
    report: &CycleReport,
    place: [f64; 4],
    name: &str,
    points: &[Option<[f64; 2]>],
    uncertainty: Option<&ForceUncertainty>,
) {
    let count = report.cycles.len();
    let known: Vec<[f64; 2]> = points.iter().flatten().copied().collect();
    let band = Band::around(&known, uncertainty);
    let [above, below] = band.edges();
    let range = [0.5, count.max(SLOTS_MIN) as f64 + 0.5];
    let panel = Panel::around(place, range, &[&known, above, below]);
    panel.axes(svg, ["cycle", name], look());
    band.draw(svg, &panel, LIGHT.series);
    panel.line(svg, &known, LIGHT.line, 1.0);
    for [x, y] in &known {
        svg.dot(panel.at([*x, *y]), color(*x as usize - 1, count), 3.5);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::CycleSource;
    use crate::report::cycles::Question;
    use palpate_model::calibration::Calibration;
    use palpate_model::units::{Depth, Newtons, Seconds, Volts};

    /// Three cycles of a way in, a hold whose force falls, and a way back.
    fn source(calibration: Option<Calibration>) -> CycleSource {
        let one = |cycle: u32| {
            (0..300u32).map(move |i| {
                let share = f64::from(i % 100) / 100.0;
                let (phase, depth, force) = match i / 100 {
                    0 => (Phase::Ramp, 10.0 * share, 3.0 * share),
                    1 => (Phase::Hold, 10.0, 3.0 - 0.5 * share),
                    _ => (Phase::Unload, 10.0 * (1.0 - share), 2.5 * (1.0 - share)),
                };
                CycleSample {
                    t: Seconds(0.02 * f64::from(300 * cycle + i)),
                    depth: Depth(depth),
                    force: Newtons(force),
                    phase,
                    cycle,
                    step: i / 100,
                }
            })
        };
        CycleSource {
            samples: (1..=3).flat_map(one).collect(),
            calibration,
            ..CycleSource::default()
        }
    }

    /// Upper and lower edge at the left end of each band, in px.
    fn bands(picture: &str) -> Vec<[f64; 2]> {
        let lists = picture.split("<polygon points=\"").skip(1);
        let lists = lists.filter_map(|rest| rest.split('"').next());
        let height = |point: &str| point.split(',').nth(1).unwrap().parse::<f64>().unwrap();
        lists
            .map(|list| {
                let points: Vec<&str> = list.split(' ').collect();
                [height(points[0]), height(points[points.len() - 1])]
            })
            .collect()
    }

    #[test]
    fn forces_carry_the_band_of_their_calibration() {
        let drawn = |calibration| {
            let report = CycleReport::of("S".into(), source(calibration), &Question::default());
            assert_eq!(report.cycles.len(), 3);
            picture(&report)
        };
        let banded = drawn(Some(Calibration::thesis()));
        // The legend; the four phases of the first loop and of the last, of which one was not run; the peaks; two holds.
        let bands = bands(&banded);
        assert_eq!(bands.len(), 1 + 2 * 3 + 1 + 2, "{banded}");
        assert!(banded.contains("calibration, \u{b1} 2u") && !banded.contains("NaN"));
        // 3 N is in the flat stretch: at their left end peaks and holds are unsure by 0.1 N and more of some 3.
        for [above, below] in &bands[7..] {
            assert!(below - above > 5.0, "{bands:?}");
        }
        let straight = Calibration::linear("line", Volts(1.28), 0.15, Newtons(50.0));
        for unstated in [None, Some(straight)] {
            let plain = drawn(unstated);
            assert!(!plain.contains("<polygon") && !plain.contains("2u"));
        }
    }
}
