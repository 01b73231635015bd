//! The picture of an analysis of cycles: loops, how peak and place change, and how the force relaxes.

use super::CycleReport;
use crate::report::picture::{LEFT, RIGHT, band, titled};
use palpate_figures::figure::{self, AxisNames, Ink, Plot, PlotAxis, PlotBand, PlotSeries};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::ForceUncertainty;
use palpate_model::rig::Phase;
use palpate_rheology::cycles::{CycleAnalysis, CycleSample};

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

/// The picture of one record. The first cycle is blue, the last vermilion, those between in between. Around forces lies
/// the band of twice their calibration's standard uncertainty, where that is stated: of loops and holds around the
/// first and the last, as more would hide each other.
#[must_use]
pub fn picture(report: &CycleReport) -> String {
    let count = report.cycles.len();
    let words = match report.steadiness.steady_from {
        Some(cycle) => format!("{count} cycles, steady from cycle {cycle} on"),
        None => format!("{count} cycles"),
    };
    let mut svg = titled(&report.name, &words);
    let calibration = report.source.calibration.as_ref();
    let uncertainty = calibration.and_then(|one| ForceUncertainty::of(one).ok());
    let loops = loops(report, uncertainty.as_ref());
    figure::legend(&mut svg, [RIGHT, 46.0], &loops);
    loops.draw(&mut svg, [LEFT, LOOPS[0], RIGHT, LOOPS[1]], AxisNames::Both);
    let panels = panels(report, uncertainty.as_ref());
    let width = (RIGHT - LEFT - GAP * (panels.len() - 1) as f64) / panels.len() as f64;
    for (index, panel) in panels.iter().enumerate() {
        let left = LEFT + index as f64 * (width + GAP);
        panel.draw(&mut svg, [left, ROW[0], left + width, ROW[1]], AxisNames::Both);
    }
    svg.finish(HEIGHT, LIGHT.canvas, &format!("Cycles of {}", report.name))
}

/// Peak and place of every cycle and, where a force was held, how it relaxed.
fn panels(report: &CycleReport, uncertainty: Option<&ForceUncertainty>) -> Vec<Plot> {
    let numbered = || (1..).map(f64::from).zip(&report.cycles);
    let peaks = numbered().map(|(number, one)| [number, one.force_peak.value.0]).collect();
    let first = report.cycles.first().and_then(|one| one.depth_at_half_peak());
    let shift = |(number, one): (f64, &CycleAnalysis)| {
        Some([number, one.depth_at_half_peak()?.0 - first?.0])
    };
    let mut panels = vec![
        by_cycle(report, "peak (N)", peaks, uncertainty),
        by_cycle(report, "shift from cycle 1 (mm)", numbered().filter_map(shift).collect(), None),
    ];
    let relaxations = relaxations(report);
    if !relaxations.is_empty() {
        let ends = relaxations.iter().filter_map(|(_, curve)| curve[0].last());
        let longest = ends.map(|point| point[0]).fold(0.0, f64::max).max(1e-3);
        let time = PlotAxis::linear("time of hold (s)").with_range([0.0, longest]);
        panels.push(faded(report, time, &relaxations, uncertainty));
    }
    panels
}

fn ink(index: usize, count: usize) -> Ink {
    Ink::Between((255 * index / (count.max(2) - 1)) as u8)
}

/// A curve of forces in the parts in which it was thinned, with the index of its cycle.
type Curve = (usize, Vec<Vec<[f64; 2]>>);

/// Curves of cycles, with bands around those of the first and the last.
fn faded(
    report: &CycleReport,
    x: PlotAxis,
    curves: &[Curve],
    uncertainty: Option<&ForceUncertainty>,
) -> Plot {
    let count = report.cycles.len();
    let ends = [curves.first(), curves.last()].map(|end| end.map(|(index, _)| *index));
    let banded = curves.iter().filter(|(index, _)| ends.contains(&Some(*index)));
    let parts = banded.flat_map(|(index, parts)| parts.iter().map(move |part| (index, part)));
    let bands = parts.filter_map(|(index, part)| {
        Some(PlotBand { ink: ink(*index, count), ..band(part, uncertainty)? })
    });
    let bands = bands.collect();
    let lines = curves.iter().map(|(index, parts)| {
        let name = match ends.contains(&Some(*index)) {
            true => format!("cycle {}", report.cycles[*index].cycle),
            false => String::new(),
        };
        PlotSeries::line(&name, ink(*index, count), 1.2, parts.concat())
    });
    Plot { bands, ..Plot::new("", x, PlotAxis::linear("force (N)")).with(lines) }
}

fn loops(report: &CycleReport, uncertainty: Option<&ForceUncertainty>) -> Plot {
    let curve = |index: usize| (index, Vec::from(one_loop(report, index)));
    let curves: Vec<Curve> = (0..report.cycles.len()).map(curve).collect();
    let points = || curves.iter().flat_map(|(_, parts)| parts.iter().flatten());
    let depths = || points().map(|point| point[0]);
    let (low, high) = (depths().fold(0.0, f64::min), depths().fold(0.0, f64::max));
    let range = [low, if high > low { high } else { low + 1.0 }];
    faded(report, PlotAxis::linear("depth (mm)").with_range(range), &curves, uncertainty)
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
fn relaxations(report: &CycleReport) -> Vec<Curve> {
    let indices = (0..report.cycles.len()).filter(|i| report.cycles[*i].relaxation.is_some());
    let curve = |index: usize| {
        let held = report.samples(index).filter(|one| one.phase == Phase::Hold);
        let start = held.clone().next().map_or(0.0, |one| one.t.0);
        thin(held.map(move |one| [one.t.0 - start, one.force.0]), COLUMNS / 3)
    };
    indices.map(|index| (index, vec![curve(index)])).collect()
}

/// Dots over the number of the cycle, joined by a line; with a band where they are forces whose uncertainty is stated.
fn by_cycle(
    report: &CycleReport,
    name: &str,
    points: Vec<[f64; 2]>,
    uncertainty: Option<&ForceUncertainty>,
) -> Plot {
    let count = report.cycles.len();
    let range = [0.5, count.max(SLOTS_MIN) as f64 + 0.5];
    let dots = points.iter().map(|at| {
        let ink = ink(at[0] as usize - 1, count);
        PlotSeries::dots("", ink, 3.5, vec![*at])
    });
    let dots: Vec<PlotSeries> = dots.collect();
    Plot {
        bands: band(&points, uncertainty).into_iter().collect(),
        ..Plot::new("", PlotAxis::linear("cycle").with_range(range), PlotAxis::linear(name))
            .with(std::iter::once(PlotSeries::line("", Ink::Line, 1.0, points)).chain(dots))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::CycleSource;
    use crate::report::cycles::CycleSettings;
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
            let report =
                CycleReport::of("S".into(), source(calibration), &CycleSettings::default());
            assert_eq!(report.cycles.len(), 3);
            picture(&report)
        };
        let banded = drawn(Some(Calibration::thesis()));
        // The four phases of the first loop and of the last, of which one was not run; the peaks; two holds.
        let bands = bands(&banded);
        assert_eq!(bands.len(), 2 * 3 + 1 + 2, "{banded}");
        assert!(banded.contains("calibration, \u{b1} 2u") && !banded.contains("NaN"));
        // 3 N is in the flat stretch: at their left end peaks and holds are unsure by 0.1 N and more of some 3.
        for [above, below] in &bands[6..] {
            assert!(below - above > 5.0, "{bands:?}");
        }
        let straight = Calibration::linear("line", Volts(1.28), 0.15, Newtons(50.0));
        for unstated in [None, Some(straight)] {
            let plain = drawn(unstated);
            assert!(!plain.contains("<polygon") && !plain.contains("2u"));
        }
    }
}
