//! A calibration as one picture: the curve with its readings, what it misses, its slope, and the uncertainty
//! of a force with every term.

use super::calibration::CalibrationDetails;
use super::picture::{LEFT, LINE, RIGHT, sentence_lines, titled};
use palpate_figures::drawing::{Drawing, TextStyle as TextInk};
use palpate_figures::figure::{self, AxisNames, Ink, Plot, PlotLevel, PlotSeries, PlotStretch};
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::{
    Calibration, CalibrationError, Direction, FlatStretch, UncertaintyTerm,
};
use palpate_model::units::{Newtons, Volts};

/// Name of a stretch where the signal says little of the force.
pub const FLAT_STRETCH: &str = "flat stretch";
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

/// The plots of a calibration over force in N: signal, residual, slope and uncertainty.
pub fn plots(
    calibration: &Calibration,
    details: &CalibrationDetails,
) -> Result<[Plot; 4], CalibrationError> {
    let (curve, points) = (calibration.curve()?, calibration.points()?);
    let (first, last) = curve.force_range();
    let axis = Axis([first.0, last.0 + BEYOND * (last.0 - first.0)]);
    let zero = points
        .first()
        .filter(|point| point.newtons.0 == 0.0)
        .map_or(0.0, |point| point.volts.0 - curve.volts_from_newtons(Newtons(0.0)).0);
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
    let slope = axis.along(|force| curve.sensitivity_at(Newtons(force)));
    let plot = |title: &str, y: figure::PlotAxis| Plot {
        stretches: details.quality.flat.iter().map(flat).collect(),
        ..Plot::new(title, figure::PlotAxis::linear("force (N)").with_range(axis.0), y)
    };
    let upright = figure::PlotAxis::linear;
    let lines = [
        PlotSeries::line("", Ink::Text, 1.4, signal),
        // Beyond the heaviest weight nothing was measured.
        PlotSeries::dashed("", Ink::Quiet, 1.0, beyond),
    ];
    let zero = PlotLevel::plain(0.0, Ink::Quiet);
    Ok([
        plot("signal (V)", upright("signal (V)")).with(lines.into_iter().chain(dots(readings))),
        Plot {
            levels: vec![zero],
            ..plot("residual (mN)", upright("residual (mN)").with_visible_values(&[-1.0, 1.0]))
                .with(dots(misses))
        },
        plot("slope (V/N)", upright("slope (V/N)").with_visible_values(&[0.0]))
            .with([PlotSeries::line("", Ink::Text, 1.4, slope)]),
        Plot {
            remark: (!details.uncertainty.is_stated())
                .then(|| "the calibration states no uncertainty".to_owned()),
            ..plot("uncertainty (mN)", upright("u (mN)").with_visible_values(&[0.0, 1.0]))
                .with(uncertainties(details, axis))
        },
    ])
}

fn flat(one: &FlatStretch) -> PlotStretch {
    PlotStretch {
        name: FLAT_STRETCH.to_owned(),
        ends: [one.from_n, one.to_n],
        ink: Some(Ink::Line),
    }
}

fn dots([loading, unloading]: [Vec<[f64; 2]>; 2]) -> impl Iterator<Item = PlotSeries> {
    let both = [
        PlotSeries::dots("loading", Ink::Series, 3.6, loading),
        PlotSeries::dots("unloading", Ink::Limit, 2.6, unloading),
    ];
    both.into_iter().filter(|one| !one.points.is_empty())
}

/// Every term that is stated, and all of them together.
fn uncertainties(details: &CalibrationDetails, axis: Axis) -> Vec<PlotSeries> {
    let own = &details.uncertainty;
    if !own.is_stated() {
        return Vec::new();
    }
    // The sixth session is in the ink of all terms together.
    let inks = [0, 1, 2, 3, 4, 6].map(Ink::Session);
    let terms = UncertaintyTerm::ALL.into_iter().zip(inks);
    let stated = terms.filter(|(term, _)| own.errors().any(|one| one == *term));
    let mut series: Vec<PlotSeries> = stated
        .map(|(term, ink)| {
            let line = axis.along(|force| in_mn(own.term_sigma(term, Newtons(force))));
            PlotSeries::line(term.name(), ink, 1.2, line)
        })
        .collect();
    let all = axis.along(|force| in_mn(own.sigma(Newtons(force))));
    series.push(PlotSeries::line("all terms", Ink::Text, 2.2, all));
    series
}

fn in_mn(sigma: Option<Newtons>) -> f64 {
    sigma.map_or(0.0, |sigma| sigma.0 * 1e3)
}

#[must_use]
pub fn picture(calibration: &Calibration, details: &CalibrationDetails) -> String {
    drawing(calibration, details).svg()
}

/// Upper and lower edges of the plots in px.
const PLACES_PX: [[f64; 2]; 4] = [[84.0, 320.0], [356.0, 450.0], [486.0, 600.0], [654.0, 820.0]];

#[must_use]
pub fn drawing(calibration: &Calibration, details: &CalibrationDetails) -> Drawing {
    let line = format!("{}; {}", calibration.curve, calibration.source);
    let mut svg = titled(&calibration.name, &line);
    let Ok(plots) = plots(calibration, details) else {
        // A calibration with details has a curve and points.
        return svg.drawing(70.0, LIGHT.canvas, &calibration.name);
    };
    for (index, (plot, [top, bottom])) in plots.iter().zip(PLACES_PX).enumerate() {
        let names = match index {
            3 => AxisNames::Both,
            _ => AxisNames::Upright,
        };
        plot.draw(&mut svg, [LEFT, top, RIGHT, bottom], names);
        if index == 0 || index == 3 {
            figure::legend(&mut svg, [RIGHT, top - 14.0], plot);
        }
    }
    let mut y = PLACES_PX[3][1] + 2.0 * LINE + 30.0;
    for finding in &details.quality.findings {
        y = sentence_lines(&mut svg, y, TextInk::plain(LIGHT.text), finding);
    }
    svg.drawing(y, LIGHT.canvas, &format!("Calibration {}", calibration.name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_term_of_the_uncertainty_has_a_colour_of_its_own() {
        let calibration = Calibration::thesis();
        let details = CalibrationDetails::of(&calibration).unwrap();
        let [.., uncertainty] = plots(&calibration, &details).unwrap();
        assert!(uncertainty.series.len() >= 3, "{}", uncertainty.series.len());
        let color = |one: &PlotSeries| one.ink.of(&LIGHT).to_array();
        let colors: BTreeSet<[u8; 4]> = uncertainty.series.iter().map(color).collect();
        assert_eq!(colors.len(), uncertainty.series.len());
        // Greys next to the ink of the text are not distinct.
        let dark = colors.iter().filter(|color| color[..3].iter().all(|one| *one < 0x60));
        assert_eq!(dark.count(), 1, "{colors:?}");
    }
}
