//! A calibration as one picture: the curve with its readings, what it misses, its slope, and the uncertainty
//! of a force with every term.

use super::calibration::Told;
use super::picture::{LEFT, LINE, RIGHT, WIDTH, look, sentence_lines, title};
use ecolor::Color32;
use palpate_figures::drawing::{Drawing, Ink, Panel, Svg};
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::{Calibration, CalibrationError, Direction, Term};
use palpate_model::units::{Newtons, Volts};

/// Places along the force axis: more than a pixel has.
const PLACES: u32 = 900;
/// The axis goes on beyond the heaviest weight by this share.
const BEYOND: f64 = 0.08;

/// The axis of forces, from lowest to highest.
#[derive(Clone, Copy)]
struct Axis([f64; 2]);

impl Axis {
    /// A function of force as a line.
    fn along(self, value: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let [low, high] = self.0;
        let places = (0..=PLACES).map(|i| low + (high - low) * f64::from(i) / f64::from(PLACES));
        places.map(|force| [force, value(force)]).collect()
    }
}

/// Everything a picture of a calibration draws over force in N.
#[derive(Clone, Debug)]
pub struct Curves {
    /// Lowest and highest force drawn.
    pub x: [f64; 2],
    /// Signal in V up to the heaviest weight.
    pub signal: Vec<[f64; 2]>,
    /// Signal in V beyond it, where the curve only goes on.
    pub beyond: Vec<[f64; 2]>,
    /// Readings in V of loading and of unloading.
    pub readings: [Vec<[f64; 2]>; 2],
    /// What the curve misses of each reading, in mN.
    pub misses: [Vec<[f64; 2]>; 2],
    /// Local sensitivity in V/N.
    pub slope: Vec<[f64; 2]>,
    /// Standard uncertainty of a force in mN; zero where nothing is stated.
    pub sigma: Vec<[f64; 2]>,
    /// Ends of the flat stretches in N.
    pub flat: Vec<[f64; 2]>,
}

impl Curves {
    /// The curves of a calibration that has been told of.
    pub fn of(calibration: &Calibration, told: &Told) -> Result<Self, CalibrationError> {
        let (curve, points) = (calibration.curve()?, calibration.points()?);
        let (first, last) = curve.force_range();
        let x = [first.0, last.0 + BEYOND * (last.0 - first.0)];
        let axis = Axis(x);
        let zero = points
            .first()
            .filter(|point| point.newtons.0 == 0.0)
            .map_or(0.0, |point| {
                point.volts.0 - curve.volts_from_newtons(Newtons(0.0)).0
            });
        let signal = axis.along(|force| curve.volts_from_newtons(Newtons(force)).0 + zero);
        let (signal, beyond) = signal.into_iter().partition(|point| point[0] <= last.0);
        let mut readings = [Vec::new(), Vec::new()];
        let mut misses = [Vec::new(), Vec::new()];
        for point in &points {
            for reading in &point.readings {
                let k = usize::from(reading.direction == Direction::Unloading);
                let force = curve.newtons_from_volts(Volts(reading.volts.0 - zero));
                readings[k].push([point.newtons.0, reading.volts.0]);
                misses[k].push([point.newtons.0, (force.0 - point.newtons.0) * 1e3]);
            }
        }
        let flat = told.quality.flat.iter();
        Ok(Self {
            x,
            signal,
            beyond,
            readings,
            misses,
            slope: axis.along(|force| curve.sensitivity_at(Newtons(force))),
            sigma: axis.along(|force| in_mn(told.uncertainty.sigma(Newtons(force)))),
            flat: flat.map(|flat| [flat.from_n, flat.to_n]).collect(),
        })
    }
}

fn in_mn(sigma: Option<Newtons>) -> f64 {
    sigma.map_or(0.0, |sigma| sigma.0 * 1e3)
}

fn shade(svg: &mut Svg, panel: &Panel, flat: &[[f64; 2]]) {
    for ends in flat {
        panel.shade(svg, *ends, LIGHT.line);
    }
}

/// The picture of a calibration that has been told of.
#[must_use]
pub fn picture(calibration: &Calibration, told: &Told) -> String {
    drawing(calibration, told).svg()
}

/// The same, not yet in any format.
#[must_use]
pub fn drawing(calibration: &Calibration, told: &Told) -> Drawing {
    let mut svg = Svg::new(WIDTH);
    let line = format!("{}; {}", calibration.curve, calibration.source);
    title(&mut svg, &calibration.name, &line);
    let Ok(curves) = Curves::of(calibration, told) else {
        // Only what has a curve and points was told of.
        return svg.drawing(70.0, LIGHT.canvas, &calibration.name);
    };
    let Curves {
        x,
        signal,
        beyond,
        readings,
        misses,
        slope,
        flat,
        ..
    } = &curves;
    let x = *x;
    let place = |top: f64, bottom: f64| [LEFT, top, RIGHT, bottom];

    let upper = Panel::around(
        place(84.0, 320.0),
        x,
        &[signal, beyond, &readings[0], &readings[1]],
    );
    shade(&mut svg, &upper, flat);
    upper.axes(&mut svg, ["", "signal (V)"], look());
    upper.line(&mut svg, signal, LIGHT.text, 1.4);
    upper.line(&mut svg, beyond, LIGHT.text_quiet, 0.8);
    dots(&mut svg, &upper, readings);
    let mut legend = vec![("loading", LIGHT.series)];
    if !readings[1].is_empty() {
        legend.push(("unloading", LIGHT.limit));
    }
    if !told.quality.flat.is_empty() {
        legend.push(("flat stretch", LIGHT.line));
    }
    names(&mut svg, 70.0, &legend);

    let missed = Panel::around(
        place(356.0, 450.0),
        x,
        &[&misses[0], &misses[1], &[[0.0, -1.0], [0.0, 1.0]]],
    );
    shade(&mut svg, &missed, flat);
    missed.axes(&mut svg, ["", "residual (mN)"], look());
    missed.line(&mut svg, &[[x[0], 0.0], [x[1], 0.0]], LIGHT.text_quiet, 0.8);
    dots(&mut svg, &missed, misses);

    let middle = Panel::around(place(486.0, 600.0), x, &[slope, &[[0.0, 0.0]]]);
    shade(&mut svg, &middle, flat);
    middle.axes(&mut svg, ["", "slope (V/N)"], look());
    middle.line(&mut svg, slope, LIGHT.text, 1.4);

    let y = uncertainty(&mut svg, told, &curves);
    let mut y = y + 2.0 * LINE + 30.0;
    for finding in &told.quality.findings {
        y = sentence_lines(&mut svg, y, Ink::plain(LIGHT.text), finding);
    }
    svg.drawing(
        y,
        LIGHT.canvas,
        &format!("Calibration {}", calibration.name),
    )
}

/// The lowest panel; returns where it ends.
fn uncertainty(svg: &mut Svg, told: &Told, curves: &Curves) -> f64 {
    let (top, bottom) = (654.0, 820.0);
    let own = &told.uncertainty;
    let axis = Axis(curves.x);
    let panel = Panel::around(
        [LEFT, top, RIGHT, bottom],
        axis.0,
        &[&curves.sigma, &[[0.0, 0.0], [0.0, 1.0]]],
    );
    shade(svg, &panel, &curves.flat);
    panel.axes(svg, ["force (N)", "u (mN)"], look());
    if !own.is_stated() {
        let ink = Ink::plain(LIGHT.text_quiet);
        svg.text(
            [LEFT + 12.0, top + 24.0],
            ink,
            "the calibration states nothing of its errors",
        );
        return bottom;
    }
    let inks = [
        LIGHT.series,
        LIGHT.text_quiet,
        LIGHT.notice_fill,
        LIGHT.alarm_text,
        LIGHT.active_fill,
        LIGHT.limit,
    ];
    let mut legend = vec![("all terms", LIGHT.text)];
    for (term, ink) in Term::ALL.into_iter().zip(inks) {
        if own.errors().any(|one| one == term) {
            let line = axis.along(|force| in_mn(own.term_sigma(term, Newtons(force))));
            panel.line(svg, &line, ink, 1.2);
            legend.push((term.word(), ink));
        }
    }
    panel.line(svg, &curves.sigma, LIGHT.text, 2.2);
    names(svg, top - 14.0, &legend);
    bottom
}

fn dots(svg: &mut Svg, panel: &Panel, [loading, unloading]: &[Vec<[f64; 2]>; 2]) {
    for (points, ink, radius) in [(loading, LIGHT.series, 3.6), (unloading, LIGHT.limit, 2.6)] {
        for point in points {
            svg.dot(panel.at(*point), ink, radius);
        }
    }
}

/// Names and their inks in one line, from the right.
fn names(svg: &mut Svg, y: f64, legend: &[(&str, Color32)]) {
    let mut x = RIGHT;
    for (name, ink) in legend.iter().rev() {
        // Letters of this size are about 7 px wide.
        x -= 7.0 * name.chars().count() as f64 + 12.0;
        svg.text([x, y + 4.0], Ink::plain(LIGHT.text), name);
        svg.line(&[[x - 26.0, y], [x - 6.0, y]], *ink, 2.5);
        x -= 34.0;
    }
}
