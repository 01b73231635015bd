//! The plan as a picture: intervals against hold, cycles and sampling rate, three plots side by side.

use crate::plan::PlanReport;
use palpate_figures::drawing::{Svg, TextStyle as TextInk};
use palpate_figures::figure::{AxisNames, Ink, Plot, PlotAxis, PlotLevel, PlotSeries, PointLabels};
use palpate_figures::tokens::LIGHT;
use palpate_figures::uncertain::{shortest as plain, significant as digits};
use palpate_rheology::expected::{PARAMETER_NAMES, PrecisionCurve, ProtocolFamily};

/// Pixels of a plot, of the picture and of the space around plots.
const PLOT: [f64; 2] = [300.0, 300.0];
const LEFT: f64 = 86.0;
const RIGHT: f64 = 100.0;
const TOP: f64 = 80.0;
const BOTTOM: f64 = 70.0;
/// More than this many percent is no knowledge worth a place on the axis.
const PERCENT_MAX: f64 = 100.0;

#[must_use]
pub fn picture(report: &PlanReport) -> String {
    let plots = plots(report);
    let step = LEFT + PLOT[0] + RIGHT;
    let mut svg = Svg::new(step * plots.len() as f64);
    let head = TextInk { size: 16.0, ..TextInk::plain(LIGHT.text) };
    svg.text([LEFT, 28.0], head, &heading(report));
    for (index, plot) in plots.iter().enumerate() {
        let left = LEFT + step * index as f64;
        let name = TextInk::plain(LIGHT.text);
        svg.text([left, TOP - 16.0], name, &plot.title);
        let place = [left, TOP, left + PLOT[0], TOP + PLOT[1]];
        plot.draw(&mut svg, place, AxisNames::Both);
    }
    let title = format!("Expected 95 % interval of {}", report.targets[0].parameter);
    svg.finish(TOP + PLOT[1] + BOTTOM, LIGHT.canvas, &title)
}

fn heading(report: &PlanReport) -> String {
    let slow = report.noise.memory.map_or(String::new(), |memory| {
        let sd = plain(memory.sd.0 * 1e3);
        format!(" and {sd} mN over {} s", plain(memory.time.0))
    });
    format!(
        "95 % interval of {} in percent: noise of {} mN{slow}, {} mm deep; dashed: target, dot: proposed",
        report.targets[0].parameter,
        digits(report.noise.white.0 * 1e3, 3),
        plain(report.rig.depth.0)
    )
}

/// Intervals of the first parameter wanted, all over one range of percents.
#[must_use]
pub fn plots(report: &PlanReport) -> [Plot; 3] {
    let target = &report.targets[0];
    let mut names = PARAMETER_NAMES.iter();
    let k = names.position(|name| *name == target.parameter).unwrap_or(0);
    let curves = &report.curves;
    let proposed = report.proposals.iter().find_map(|offer| {
        let percent = offer.proposal.expected.parameters[k].percent?;
        match offer.proposal.family {
            ProtocolFamily::RampHold { hold, .. } => Some([hold.0, percent]),
            _ => None,
        }
    });
    let rate = report.rig.sample_rate_hz;
    let [top, bottom] = curves.between;
    let mut plots = [
        plot("ramp and hold", "hold in s", &curves.hold, k, proposed),
        plot(
            &format!("cycles from {} to {} mm", plain(top.0), plain(bottom.0)),
            "number of cycles",
            &curves.cycles,
            k,
            None,
        ),
        plot(
            &format!("ramp and hold of {} s", plain(curves.rate_hold.0)),
            "samples per second",
            std::slice::from_ref(&curves.rate),
            k,
            proposed.map(|[_, percent]| [rate, percent]),
        ),
    ];
    let percents = |start: f64, of: fn(f64, f64) -> f64| {
        let points = plots.iter().flat_map(|plot| &plot.series).flat_map(|one| &one.points);
        points.map(|point| point[1]).fold(start, of)
    };
    let lowest = percents(target.percent, f64::min);
    let highest = percents(target.percent, f64::max);
    for plot in &mut plots {
        plot.y.range = Some([0.8 * lowest, 1.25 * highest]);
        let level = PlotLevel::plain(target.percent, Ink::Limit);
        plot.levels.push(PlotLevel { is_dashed: true, ..level });
    }
    plots
}

/// A curve for each speed, the fastest strongest, and the proposal of this kind.
fn plot(title: &str, x: &str, curves: &[PrecisionCurve], k: usize, mark: Option<[f64; 2]>) -> Plot {
    let lines = curves.iter().enumerate().map(|(index, curve)| {
        let name = format!("{} mm/s", plain(curve.speed.0));
        PlotSeries {
            opacity: 1.0 - 0.2 * index as f64,
            ..PlotSeries::line(&name, Ink::Series, 2.5, points(curve, k))
                .labelled(PointLabels::AtEnd)
        }
    });
    let mark = mark.map(|at| PlotSeries::dots("proposed", Ink::Limit, 6.0, vec![at]));
    let y = PlotAxis::logarithmic("95 % interval (%)");
    let plot = Plot::new(title, PlotAxis::logarithmic(x), y).with(lines.chain(mark));
    let is_known = plot.series.iter().any(|one| !one.points.is_empty());
    Plot { remark: (!is_known).then(|| "not identifiable".to_owned()), ..plot }
}

fn points(curve: &PrecisionCurve, k: usize) -> Vec<[f64; 2]> {
    let pairs = curve.x.iter().zip(&curve.percent);
    pairs
        .filter_map(|(&x, percent)| Some([x, percent[k]?]))
        .filter(|[_, percent]| *percent <= PERCENT_MAX)
        .collect()
}
