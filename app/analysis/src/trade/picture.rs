//! The trade as a picture: error over time, both by powers of ten, a panel for each table.

use super::text::plain;
use ecolor::Color32;
use palpate_figures::drawing::{Anchor, FONT, Ink, Look, Panel, Svg};
use palpate_figures::tokens::LIGHT;
use palpate_rheology::integrators::{Precision, Scheme};
use palpate_rheology::trade::{FamilyRow, FitRow, TradeCurves};

/// Size of the picture and of the space around a panel, in px.
const WIDTH: f64 = 1080.0;
const PANEL_HEIGHT: f64 = 440.0;
const LEFT: f64 = 90.0;
/// Room for the names of curves.
const RIGHT: f64 = 250.0;
const ABOVE: f64 = 50.0;
const BELOW: f64 = 50.0;
/// Errors below this share of the force are its last digits.
const LEAST: f64 = 1e-17;

/// Points that belong together.
struct Series {
    name: String,
    color: Color32,
    points: Vec<Point>,
}

struct Point {
    /// Logarithms of cost and of error.
    at: [f64; 2],
    front: bool,
}

impl Point {
    fn new(cost: f64, error: f64, front: bool) -> Self {
        Self {
            at: [cost.log10(), error.max(LEAST).log10()],
            front,
        }
    }
}

impl Series {
    /// A front through points that have their names elsewhere.
    fn nameless(points: Vec<Point>) -> Self {
        Self {
            name: String::new(),
            color: LIGHT.series,
            points,
        }
    }
}

/// The picture as text.
#[must_use]
pub fn svg(curves: &TradeCurves) -> String {
    let mut svg = Svg::new(WIDTH);
    let heading = Ink {
        size: 16.0,
        ..Ink::plain(LIGHT.text)
    };
    let title = format!("Error against time on {}", curves.machine.words());
    svg.text([LEFT, 28.0], heading, &title);
    let legend = "line: nothing is cheaper and more exact; blue: f64, orange: f32";
    svg.text([LEFT, 48.0], Ink::plain(LIGHT.text_quiet), legend);
    let force = "error of the peak force";
    let tables = [
        (
            "integrators of the modified Kelvin body",
            ["ns per second of simulated time", force],
            integrators(curves),
        ),
        (
            "families by terms",
            ["ns per step", force],
            families(curves),
        ),
        (
            "the fit by samples per second",
            ["ns per fit", "error of tau"],
            fits(curves),
        ),
    ];
    let mut top = 48.0 + ABOVE;
    for (title, axes, series) in tables {
        let place = [LEFT, top, WIDTH - RIGHT, top + PANEL_HEIGHT];
        svg.text([LEFT, top - 10.0], Ink::plain(LIGHT.text), title);
        panel(&mut svg, place, axes, &series);
        top += PANEL_HEIGHT + BELOW + ABOVE;
    }
    svg.finish(top - ABOVE + 20.0, LIGHT.canvas, &title)
}

fn panel(svg: &mut Svg, place: [f64; 4], axes: [&str; 2], series: &[Series]) {
    let all = || series.iter().flat_map(|one| &one.points);
    let places: Vec<[f64; 2]> = all().map(|point| point.at).collect();
    let panel = Panel::around_logarithms(place, &places);
    let look = Look {
        text: LIGHT.text_quiet,
        grid: LIGHT.line,
    };
    panel.log_axes(svg, axes, look);
    let mut names: Vec<([f64; 2], &str)> = Vec::new();
    for one in series {
        let mut points: Vec<[f64; 2]> = one.points.iter().map(|point| point.at).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        panel.line(svg, &points, LIGHT.line, 1.0);
        let mut front: Vec<&Point> = one.points.iter().filter(|point| point.front).collect();
        front.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
        let front: Vec<[f64; 2]> = front.iter().map(|point| point.at).collect();
        if front.len() > 1 {
            panel.line(svg, &front, one.color, 2.0);
        }
        for point in &one.points {
            svg.dot(
                panel.at(point.at),
                one.color,
                if point.front { 4.0 } else { 2.5 },
            );
        }
        if let Some(last) = points.last().filter(|_| !one.name.is_empty()) {
            names.push((panel.at(*last), &one.name));
        }
    }
    label(svg, place, names);
}

/// Names at the right, in the order of their curves' ends and none over another.
fn label(svg: &mut Svg, [_, top, right, bottom]: [f64; 4], mut names: Vec<([f64; 2], &str)>) {
    const HEIGHT: f64 = FONT + 2.0;
    names.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
    let mut places: Vec<f64> = Vec::new();
    let mut free = top;
    for ([_, y], _) in &names {
        places.push(y.max(free));
        free = y.max(free) + HEIGHT;
    }
    let mut free = bottom;
    for place in places.iter_mut().rev() {
        *place = place.min(free);
        free = *place - HEIGHT;
    }
    for (([x, y], name), at) in names.into_iter().zip(places) {
        svg.line(&[[x, y], [right + 14.0, at]], LIGHT.line, 0.6);
        let ink = Ink::plain(LIGHT.text).anchored(Anchor::Start);
        svg.text([right + 18.0, at + 0.35 * FONT], ink, name);
    }
}

fn integrators(curves: &TradeCurves) -> Vec<Series> {
    let of = |scheme: Scheme, precision: Precision| {
        let rows = curves.integrators.iter();
        let rows = rows.filter(|row| (row.scheme, row.precision) == (scheme, precision));
        let points = rows.filter_map(|row| {
            let error = row.error?.share_of(&curves.peak);
            Some(Point::new(row.second_ns, error, row.front))
        });
        Series {
            name: format!("{}, {}", scheme.name(), precision.name()),
            color: match precision {
                Precision::F64 => LIGHT.series,
                Precision::F32 => LIGHT.limit,
            },
            points: points.collect(),
        }
    };
    let both = |scheme| [of(scheme, Precision::F64), of(scheme, Precision::F32)];
    let all = Scheme::ALL.into_iter().flat_map(both);
    all.filter(|series| !series.points.is_empty()).collect()
}

/// A series for each family, so that each has its name, and the front of each target.
fn families(curves: &TradeCurves) -> Vec<Series> {
    let rows = || curves.families.iter();
    let mut all: Vec<Series> = Vec::new();
    for row in rows() {
        let is_known = rows()
            .take_while(|other| !std::ptr::eq(*other, row))
            .any(|other| other.target == row.target);
        if !is_known {
            let best = rows().filter(|other| other.front && other.target == row.target);
            let error = |row: &FamilyRow| row.error_n / row.peak_n;
            let points = best.map(|row| Point::new(row.cost.ns, error(row), true));
            all.push(Series::nameless(points.collect()));
        }
        all.push(Series {
            name: row.family.clone(),
            color: LIGHT.series,
            points: vec![Point::new(row.cost.ns, row.error_n / row.peak_n, row.front)],
        });
    }
    all
}

fn fits(curves: &TradeCurves) -> Vec<Series> {
    let point = |row: &FitRow| Point::new(row.cost.ns, row.tau_error, row.front);
    let best = curves.fit.iter().filter(|row| row.front);
    let front = Series::nameless(best.map(point).collect());
    let named = curves.fit.iter().map(|row| Series {
        name: format!("{} Hz", plain(row.rate_hz)),
        color: LIGHT.series,
        points: vec![point(row)],
    });
    std::iter::once(front).chain(named).collect()
}
