//! The plan as a picture: three panels side by side, in SVG written by hand.

use crate::plan::PlanReport;
use ecolor::Color32;
use palpate_figures::tokens::LIGHT;
use palpate_figures::uncertain::{shortest as plain, significant as digits};
use palpate_rheology::expected::{Curve, Family, PARAMETER_NAMES};
use std::fmt::Write;

/// Pixels of a panel's plot area, of the picture and of the space around panels.
const PANEL: [f64; 2] = [300.0, 300.0];
const LEFT: f64 = 70.0;
const RIGHT: f64 = 90.0;
const TOP: f64 = 80.0;
const BOTTOM: f64 = 70.0;
/// Of a line of text at the end of a curve.
const LABEL_HEIGHT: f64 = 16.0;
/// More than this many percent is no knowledge worth a place on the axis.
const PERCENT_MAX: f64 = 100.0;

/// One curve of a panel.
struct Line {
    label: String,
    points: Vec<(f64, f64)>,
    /// 1 for the fastest speed, less for slower ones.
    opacity: f64,
}

struct Panel {
    title: String,
    axis: &'static str,
    lines: Vec<Line>,
    /// The proposal of this kind.
    mark: Option<(f64, f64)>,
}

/// The picture as SVG.
#[must_use]
pub fn picture(report: &PlanReport) -> String {
    let target = &report.targets[0];
    let k = PARAMETER_NAMES
        .iter()
        .position(|name| *name == target.parameter)
        .unwrap_or(0);
    let panels = panels(report, k);
    let values = || {
        let points = panels.iter().flat_map(|panel| &panel.lines);
        points.flat_map(|line| line.points.iter().map(|point| point.1))
    };
    let lowest = values().fold(target.percent, f64::min);
    let highest = values().fold(target.percent, f64::max);
    let percents = Scale {
        from: 0.8 * lowest,
        to: 1.25 * highest,
    };
    let step = LEFT + PANEL[0] + RIGHT;
    let (width, height) = (step * panels.len() as f64, TOP + PANEL[1] + BOTTOM);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"{}\">\n\
         <title>Expected 95 % interval of {}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"{}\"/>",
        hex(LIGHT.text),
        target.parameter,
        hex(LIGHT.canvas)
    );
    text(&mut out, LEFT, 28.0, "start", 16, &heading(report));
    for (index, panel) in panels.iter().enumerate() {
        let left = LEFT + step * index as f64;
        draw(&mut out, panel, left, percents, target.percent);
    }
    out.push_str("</svg>\n");
    out
}

fn heading(report: &PlanReport) -> String {
    let slow = report.noise.memory.map_or(String::new(), |memory| {
        let sd = plain(memory.sd.0 * 1e3);
        format!(" and {sd} mN over {} s", plain(memory.time.0))
    });
    format!(
        "95 % interval of {} in percent: noise of {} mN{slow}, {} mm deep; dashed: wanted, dot: proposed",
        report.targets[0].parameter,
        digits(report.noise.white.0 * 1e3, 3),
        plain(report.rig.depth.0)
    )
}

fn panels(report: &PlanReport, k: usize) -> Vec<Panel> {
    let curves = &report.curves;
    let by_speed = |curves: &[Curve]| {
        let faint = |index: usize| 1.0 - 0.2 * index as f64;
        let lines = curves.iter().enumerate();
        lines
            .map(|(index, curve)| Line {
                label: format!("{} mm/s", plain(curve.speed.0)),
                points: points(curve, k),
                opacity: faint(index),
            })
            .collect()
    };
    let proposed = report.proposals.iter().find_map(|offer| {
        let percent = offer.proposal.expected.parameters[k].percent?;
        match offer.proposal.family {
            Family::RampHold { hold, .. } => Some((hold.0, percent)),
            _ => None,
        }
    });
    let rate = report.rig.sample_rate_hz;
    let [top, bottom] = curves.between;
    vec![
        Panel {
            title: "ramp and hold".into(),
            axis: "hold in s",
            lines: by_speed(&curves.hold),
            mark: proposed,
        },
        Panel {
            title: format!("cycles from {} to {} mm", plain(top.0), plain(bottom.0)),
            axis: "number of cycles",
            lines: by_speed(&curves.cycles),
            mark: None,
        },
        Panel {
            title: format!("ramp and hold of {} s", plain(curves.rate_hold.0)),
            axis: "samples per second",
            lines: by_speed(std::slice::from_ref(&curves.rate)),
            mark: proposed.map(|(_, percent)| (rate, percent)),
        },
    ]
}

fn points(curve: &Curve, k: usize) -> Vec<(f64, f64)> {
    let pairs = curve.x.iter().zip(&curve.percent);
    pairs
        .filter_map(|(&x, percent)| Some((x, percent[k]?)))
        .filter(|(_, percent)| *percent <= PERCENT_MAX)
        .collect()
}

/// A logarithmic axis.
#[derive(Clone, Copy)]
struct Scale {
    from: f64,
    to: f64,
}

impl Scale {
    /// 0 at the start, 1 at the end.
    fn share(self, value: f64) -> f64 {
        (value / self.from).ln() / (self.to / self.from).ln()
    }

    /// 1, 2 and 5 of every decade over less than two of them, else the decades.
    fn ticks(self) -> Vec<f64> {
        let steps: &[f64] = if self.to / self.from < 100.0 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let decades = self.from.log10().floor() as i32..=self.to.log10().ceil() as i32;
        decades
            .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)))
            .filter(|tick| (0.0..=1.0).contains(&self.share(*tick)))
            .collect()
    }
}

fn draw(out: &mut String, panel: &Panel, left: f64, percents: Scale, wanted: f64) {
    let [width, height] = PANEL;
    let (right, bottom) = (left + width, TOP + height);
    let xs = || panel.lines.iter().flat_map(|line| line.points.iter());
    let across = Scale {
        from: xs().map(|point| point.0).fold(f64::INFINITY, f64::min),
        to: xs().map(|point| point.0).fold(0.0, f64::max),
    };
    text(out, left, TOP - 16.0, "start", 14, &panel.title);
    text(
        out,
        left + 0.5 * width,
        bottom + 46.0,
        "middle",
        13,
        panel.axis,
    );
    if across.to <= across.from {
        let words = "cannot be told";
        text(
            out,
            left + 0.5 * width,
            TOP + 0.5 * height,
            "middle",
            13,
            words,
        );
        return;
    }
    let x = |value: f64| left + width * across.share(value);
    let y = |value: f64| bottom - height * percents.share(value);
    for tick in across.ticks() {
        stroke(out, (x(tick), TOP), (x(tick), bottom), LIGHT.line, "");
        text(out, x(tick), bottom + 20.0, "middle", 13, &plain(tick));
    }
    for tick in percents.ticks() {
        stroke(out, (left, y(tick)), (right, y(tick)), LIGHT.line, "");
        let label = format!("{} %", plain(tick));
        text(out, left - 8.0, y(tick) + 4.0, "end", 13, &label);
    }
    let at = y(wanted);
    let dashes = " stroke-dasharray=\"6 4\" stroke-width=\"2\"";
    stroke(out, (left, at), (right, at), LIGHT.limit, dashes);
    for line in &panel.lines {
        let path: Vec<String> = line
            .points
            .iter()
            .map(|point| format!("{:.1},{:.1}", x(point.0), y(point.1)))
            .collect();
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2.5\" opacity=\"{}\"/>",
            path.join(" "),
            hex(LIGHT.series),
            line.opacity
        );
    }
    for (line, at) in panel.lines.iter().zip(label_heights(&panel.lines, y)) {
        text(out, right + 6.0, at + 4.0, "start", 13, &line.label);
    }
    if let Some((at, percent)) = panel.mark {
        let _ = writeln!(
            out,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"6\" fill=\"{}\" stroke=\"{}\" stroke-width=\"2\"><title>proposed</title></circle>",
            x(at),
            y(percent),
            hex(LIGHT.limit),
            hex(LIGHT.canvas)
        );
    }
}

/// Where the labels go: beside the ends of their curves, pushed apart where those are close.
fn label_heights(lines: &[Line], y: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut order: Vec<(usize, f64)> = lines
        .iter()
        .enumerate()
        .map(|(index, line)| (index, line.points.last().map_or(TOP, |point| y(point.1))))
        .collect();
    order.sort_by(|one, other| one.1.total_cmp(&other.1));
    let mut heights = vec![0.0; lines.len()];
    let mut above = f64::NEG_INFINITY;
    for (index, wanted) in order {
        above = (above + LABEL_HEIGHT).max(wanted);
        heights[index] = above;
    }
    heights
}

fn text(out: &mut String, x: f64, y: f64, anchor: &str, size: u32, words: &str) {
    let words = words.replace('&', "&amp;").replace('<', "&lt;");
    let _ = writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\">{words}</text>"
    );
}

fn stroke(out: &mut String, from: (f64, f64), to: (f64, f64), colour: Color32, more: &str) {
    let _ = writeln!(
        out,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{}\"{more}/>",
        from.0,
        from.1,
        to.0,
        to.1,
        hex(colour)
    );
}

fn hex(colour: Color32) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.r(), colour.g(), colour.b())
}
