//! The trade as a picture: error over time, both by powers of ten, a panel for each table.

use super::text::plain;
use palpate_figures::drawing::{Svg, TextStyle as TextInk};
use palpate_figures::figure::{AxisNames, Ink, Plot, PlotAxis, PlotSeries, PointLabels};
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

struct Group {
    name: String,
    ink: Ink,
    points: Vec<Point>,
}

struct Point {
    /// Cost and error.
    at: [f64; 2],
    front: bool,
}

impl Point {
    fn new(cost: f64, error: f64, front: bool) -> Self {
        Self { at: [cost, error.max(LEAST)], front }
    }
}

impl Group {
    /// A front through points that have their names elsewhere.
    fn nameless(points: Vec<Point>) -> Self {
        Self { name: String::new(), ink: Ink::Series, points }
    }

    /// Its name at the end of a thin line through all, a line through what nothing undercuts, and the points.
    fn series(&self) -> [PlotSeries; 4] {
        let points = |is_taken: &dyn Fn(&Point) -> bool| {
            let taken = self.points.iter().filter(|one| is_taken(one));
            let mut points: Vec<[f64; 2]> = taken.map(|one| one.at).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points
        };
        let front = points(&|one| one.front);
        let labels = if self.name.is_empty() { PointLabels::None } else { PointLabels::AtEnd };
        [
            PlotSeries::line(&self.name, Ink::Line, 1.0, points(&|_| true)).labelled(labels),
            PlotSeries::line("", self.ink, 2.0, front.clone()),
            PlotSeries::dots("", self.ink, 4.0, front),
            PlotSeries::dots("", self.ink, 2.5, points(&|one| !one.front)),
        ]
    }
}

#[must_use]
pub fn svg(curves: &TradeCurves) -> String {
    let mut svg = Svg::new(WIDTH);
    let heading = TextInk { size: 16.0, ..TextInk::plain(LIGHT.text) };
    let title = format!("Error against time on {}", curves.machine.words());
    svg.text([LEFT, 28.0], heading, &title);
    let legend = "line: no other point is both cheaper and more exact; blue: f64, orange: f32";
    svg.text([LEFT, 48.0], TextInk::plain(LIGHT.text_quiet), legend);
    let force = "error of the peak force";
    let tables = [
        (
            "integrators of the modified Kelvin body",
            ["ns per second of simulated time", force],
            integrators(curves),
        ),
        ("families by terms", ["ns per step", force], families(curves)),
        ("the fit by samples per second", ["ns per fit", "error of tau"], fits(curves)),
    ];
    let mut top = 48.0 + ABOVE;
    for (title, axes, series) in tables {
        let place = [LEFT, top, WIDTH - RIGHT, top + PANEL_HEIGHT];
        svg.text([LEFT, top - 10.0], TextInk::plain(LIGHT.text), title);
        let [x, y] = axes.map(PlotAxis::logarithmic);
        let plot = Plot::new(title, x, y).with(series.iter().flat_map(Group::series));
        plot.draw(&mut svg, place, AxisNames::Both);
        top += PANEL_HEIGHT + BELOW + ABOVE;
    }
    svg.finish(top - ABOVE + 20.0, LIGHT.canvas, &title)
}

fn integrators(curves: &TradeCurves) -> Vec<Group> {
    let of = |scheme: Scheme, precision: Precision| {
        let rows = curves.integrators.iter();
        let rows = rows.filter(|row| (row.scheme, row.precision) == (scheme, precision));
        let points = rows.filter_map(|row| {
            let error = row.error?.share_of(&curves.peak);
            Some(Point::new(row.second_ns, error, row.front))
        });
        Group {
            name: format!("{}, {}", scheme.name(), precision.name()),
            ink: match precision {
                Precision::F64 => Ink::Series,
                Precision::F32 => Ink::Limit,
            },
            points: points.collect(),
        }
    };
    let both = |scheme| [of(scheme, Precision::F64), of(scheme, Precision::F32)];
    Scheme::ALL.into_iter().flat_map(both).filter(|series| !series.points.is_empty()).collect()
}

/// A series for each family, so that each has its name, and the front of each target.
fn families(curves: &TradeCurves) -> Vec<Group> {
    let rows = || curves.families.iter();
    let mut all: Vec<Group> = Vec::new();
    for row in rows() {
        let is_known = rows()
            .take_while(|other| !std::ptr::eq(*other, row))
            .any(|other| other.target == row.target);
        if !is_known {
            let best = rows().filter(|other| other.front && other.target == row.target);
            let error = |row: &FamilyRow| row.error_n / row.peak_n;
            let points = best.map(|row| Point::new(row.cost.ns, error(row), true));
            all.push(Group::nameless(points.collect()));
        }
        all.push(Group {
            name: row.family.clone(),
            ink: Ink::Series,
            points: vec![Point::new(row.cost.ns, row.error_n / row.peak_n, row.front)],
        });
    }
    all
}

fn fits(curves: &TradeCurves) -> Vec<Group> {
    let point = |row: &FitRow| Point::new(row.cost.ns, row.tau_error, row.front);
    let best = curves.fit.iter().filter(|row| row.front);
    let front = Group::nameless(best.map(point).collect());
    let named = curves.fit.iter().map(|row| Group {
        name: format!("{} Hz", plain(row.rate_hz)),
        ink: Ink::Series,
        points: vec![point(row)],
    });
    std::iter::once(front).chain(named).collect()
}
