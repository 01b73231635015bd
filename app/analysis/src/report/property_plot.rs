//! Properties of a press as plots: force over depth with what was fitted, moduli over time or frequency.

use crate::dynamic::{DynamicModuli, DynamicReport};
use crate::press_modulus::{FittedPoint, PressModulus};
use crate::property::PropertyReport;
use crate::relaxation::{RelaxationReport, UncertainNumber};
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries, PlotStretch};
use palpate_figures::thin::thin;

/// Columns in which samples that lie above each other are drawn as two.
const COLUMNS: usize = 800;

/// Units by the largest value that is drawn, with how many there are of each in a mm or a N.
const LENGTHS: [(f64, &str, f64); 2] = [(0.1, "µm", 1e3), (f64::INFINITY, "mm", 1.0)];
const FORCES: [(f64, &str, f64); 3] =
    [(1e-4, "µN", 1e6), (0.1, "mN", 1e3), (f64::INFINITY, "N", 1.0)];

const KPA_PER_MPA: f64 = 1e3;

/// Two plots over the same abscissa, each with its title.
#[must_use]
pub fn property_plots(report: &PropertyReport) -> [Plot; 2] {
    match report {
        PropertyReport::Modulus(report) => {
            let names = ["Loading and law", "loading", "law"];
            press_plots(&report.press, names, &[])
        }
        PropertyReport::Unloading(report) => {
            let names = ["Unloading and power of the depth", "fitted part", "power of the depth"];
            press_plots(&report.press, names, &report.unloading)
        }
        PropertyReport::Relaxation(report) => relaxation_plots(report),
        PropertyReport::Dynamic(report) => dynamic_plots(report),
    }
}

/// Force over depth, and residuals over depth between lines at the noise, where that is known. `whole` is a curve in mm and N
/// of which the fitted points are a part.
fn press_plots(
    press: &PressModulus,
    [title, measured, fitted]: [&str; 3],
    whole: &[[f64; 2]],
) -> [Plot; 2] {
    let mut curve = press.curve.clone();
    curve.sort_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm));
    let most = |of: fn(&FittedPoint) -> f64| curve.iter().map(of).fold(0.0, f64::max);
    let (length, per_mm) = unit(&LENGTHS, most(|one| one.depth_mm));
    let (force, per_n) = unit(&FORCES, most(|one| one.force_n));
    let (small, small_per_n) = unit(&FORCES, most(|one| (one.force_n - one.law_n).abs()));
    let points = |scale: f64, of: fn(&FittedPoint) -> f64| {
        thin(curve.iter().map(|one| [per_mm * one.depth_mm, scale * of(one)]), COLUMNS)
    };
    let mut whole: Vec<[f64; 2]> =
        whole.iter().map(|[depth, force]| [per_mm * depth, per_n * force]).collect();
    whole.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let rest = PlotSeries::dots("rest", Ink::Quiet, 1.4, thin(whole.iter().copied(), COLUMNS));
    // Both plots show the same depths, whichever part was fitted.
    let ends: Vec<f64> = whole.first().into_iter().chain(whole.last()).map(|one| one[0]).collect();
    let depth =
        || PlotAxis::linear(&format!("depth from contact ({length})")).with_visible_values(&ends);
    let series = [
        PlotSeries::dots(measured, Ink::Series, 1.6, points(per_n, |one| one.force_n)),
        PlotSeries::line(fitted, Ink::Limit, 1.8, points(per_n, |one| one.law_n)),
    ];
    let rest = (!whole.is_empty()).then_some(rest);
    let force = Plot::new(title, depth(), PlotAxis::linear(&format!("force ({force})")))
        .with(rest.into_iter().chain(series));
    let residual = points(small_per_n, |one| one.force_n - one.law_n);
    let noise = press.noise_n.iter().flat_map(|noise| [-noise, *noise]);
    let level = |at: f64| PlotLevel::plain(small_per_n * at, Ink::Quiet);
    let title = match press.noise_n {
        Some(_) => "residuals, with lines at the noise of the force",
        None => "residuals",
    };
    let residuals = Plot {
        levels: noise.chain([0.0]).map(level).collect(),
        ..Plot::new(title, depth(), PlotAxis::linear(&format!("residual ({small})")))
    };
    [force, residuals.with([PlotSeries::dots("residual", Ink::Series, 1.4, residual)])]
}

/// The first unit whose values stay below their bound.
fn unit(units: &[(f64, &'static str, f64)], largest: f64) -> (&'static str, f64) {
    let found = units.iter().find(|(bound, ..)| largest < *bound);
    found.map_or(("", 1.0), |(_, name, scale)| (name, *scale))
}

/// Modulus and creep compliance from where they are seen, with their 95 % intervals and the ramp.
fn relaxation_plots(report: &RelaxationReport) -> [Plot; 2] {
    let modulus = report.modulus_curve.iter().map(|one| (one.t_s, one.mpa.scaled(KPA_PER_MPA)));
    let creep = report.creep_curve.iter();
    let creep = creep.map(|one| (one.t_s, one.per_mpa.scaled(1.0 / KPA_PER_MPA)));
    // A part of the ramp is in sight, wherever the curve begins.
    let first = report.seen_from_s.min(0.1 * report.ramp_s);
    let plot = |title, y: &str, name: &str, curve: Vec<(f64, UncertainNumber)>| {
        let edge =
            |side: usize| curve.iter().map(|(t, number)| [*t, number.total95[side]]).collect();
        let points = curve.iter().map(|(t, number)| [*t, number.value]).collect();
        let x = PlotAxis::logarithmic("time after a step (s)");
        let x = x.with_visible_values(&[first, report.record_s]);
        let y = PlotAxis::linear(y).with_visible_values(&[0.0]);
        Plot {
            stretches: vec![PlotStretch {
                name: "ramp".into(),
                ends: [first, report.ramp_s],
                ink: Some(Ink::Line),
            }],
            bands: vec![PlotBand {
                name: "95 % interval".into(),
                ink: Ink::Limit,
                edges: [edge(0), edge(1)],
            }],
            ..Plot::new(title, x, y).with([PlotSeries::line(name, Ink::Limit, 1.8, points)])
        }
    };
    [
        plot("Relaxation modulus", "G (kPa)", "relaxation modulus", modulus.collect()),
        plot(
            "Creep compliance of the same solid",
            "J (1/kPa)",
            "creep compliance",
            creep.collect(),
        ),
    ]
}

/// Shear moduli, with those that the relaxation before predicts, and tan delta over the frequency.
fn dynamic_plots(report: &DynamicReport) -> [Plot; 2] {
    let axes = |title, y: &str| {
        let frequencies = || report.sines.iter().map(|sine| sine.frequency_hz);
        let ends = [frequencies().fold(f64::INFINITY, f64::min), frequencies().fold(0.0, f64::max)];
        // One frequency alone has room on both sides.
        let [low, high] = [0.8 * ends[0], 1.25 * ends[1]];
        let x = PlotAxis::logarithmic("frequency (Hz)").with_visible_values(&[low, high]);
        Plot::new(title, x, PlotAxis::linear(y))
    };
    let with_intervals = |name: &str, ink: Ink, of: &dyn Fn(&DynamicModuli) -> UncertainNumber| {
        let value = |sine: &DynamicModuli| [sine.frequency_hz, of(sine).value];
        let interval = |sine: &DynamicModuli| {
            let ends = of(sine).total95.map(|end| [sine.frequency_hz, end]);
            PlotSeries::line("", ink, 1.4, ends.into())
        };
        let dots = PlotSeries::dots(name, ink, 3.0, report.sines.iter().map(value).collect());
        report.sines.iter().map(interval).chain([dots]).collect::<Vec<_>>()
    };
    let predicted = |name: &str, ink: Ink, part: usize| {
        let point = |sine: &DynamicModuli| {
            Some([sine.frequency_hz, KPA_PER_MPA * sine.predicted_shear_mpa?[part]])
        };
        let points: Vec<_> = report.sines.iter().filter_map(point).collect();
        (!points.is_empty()).then(|| PlotSeries::rings(name, ink, 4.5, points))
    };
    let [storage, loss, ratio] = [Ink::Session(0), Ink::Session(1), Ink::Session(2)];
    let shear = [
        with_intervals("G'", storage, &|sine| sine.shear_storage_mpa.scaled(KPA_PER_MPA)),
        with_intervals("G''", loss, &|sine| sine.shear_loss_mpa.scaled(KPA_PER_MPA)),
    ];
    let predicted = [predicted("G' predicted", storage, 0), predicted("G'' predicted", loss, 1)];
    let moduli = shear.into_iter().flatten().chain(predicted.into_iter().flatten());
    [
        from_zero(axes("Shear storage and loss modulus", "modulus (kPa)").with(moduli)),
        from_zero(axes("Loss over storage modulus", "tan delta").with(with_intervals(
            "tan delta",
            ratio,
            &|sine| sine.tan_delta,
        ))),
    ]
}

/// With zero in sight, and room above the highest point.
fn from_zero(plot: Plot) -> Plot {
    let heights = plot.series.iter().flat_map(|one| &one.points).map(|point| point[1]);
    let highest = heights.fold(0.0, f64::max);
    Plot { y: plot.y.clone().with_visible_values(&[0.0, 1.1 * highest]), ..plot }
}

#[cfg(test)]
#[path = "property_plot_tests.rs"]
mod tests;
