//! The loading of a modulus over depth with the law that was fitted to it, and what the law misses.

use crate::material::{LoadingPoint, MaterialReport};
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotLevel, PlotSeries};
use palpate_figures::thin::thin;

/// Columns in which samples that lie above each other are drawn as two.
const COLUMNS: usize = 800;

/// Units by the largest value that is drawn, with how many there are of each in a mm or a N.
const LENGTHS: [(f64, &str, f64); 2] = [(0.1, "µm", 1e3), (f64::INFINITY, "mm", 1.0)];
const FORCES: [(f64, &str, f64); 3] =
    [(1e-4, "µN", 1e6), (0.1, "mN", 1e3), (f64::INFINITY, "N", 1.0)];

/// Force over depth, and residuals over depth between lines at the noise, where that is known.
#[must_use]
pub fn material_plots(report: &MaterialReport) -> [Plot; 2] {
    let mut curve = report.curve.clone();
    curve.sort_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm));
    let most = |of: fn(&LoadingPoint) -> f64| curve.iter().map(of).fold(0.0, f64::max);
    let (length, per_mm) = unit(&LENGTHS, most(|one| one.depth_mm));
    let (force, per_n) = unit(&FORCES, most(|one| one.force_n));
    let (small, small_per_n) = unit(&FORCES, most(|one| (one.force_n - one.law_n).abs()));
    let points = |scale: f64, of: fn(&LoadingPoint) -> f64| {
        thin(curve.iter().map(|one| [per_mm * one.depth_mm, scale * of(one)]), COLUMNS)
    };
    let depth = || PlotAxis::linear(&format!("depth from contact ({length})"));
    let loading = Plot::new("", depth(), PlotAxis::linear(&format!("force ({force})"))).with([
        PlotSeries::dots("loading", Ink::Series, 1.6, points(per_n, |one| one.force_n)),
        PlotSeries::line("law", Ink::Limit, 1.8, points(per_n, |one| one.law_n)),
    ]);
    let residual = points(small_per_n, |one| one.force_n - one.law_n);
    let noise = report.noise_n.iter().flat_map(|noise| [-noise, *noise]);
    let level = |at: f64| PlotLevel::plain(small_per_n * at, Ink::Quiet);
    let residuals = Plot {
        levels: noise.chain([0.0]).map(level).collect(),
        ..Plot::new("", depth(), PlotAxis::linear(&format!("residual ({small})")))
    };
    [loading, residuals.with([PlotSeries::dots("residual", Ink::Series, 1.4, residual)])]
}

/// The first unit whose values stay below their bound.
fn unit(units: &[(f64, &'static str, f64)], largest: f64) -> (&'static str, f64) {
    let found = units.iter().find(|(bound, ..)| largest < *bound);
    found.map_or(("", 1.0), |(_, name, scale)| (name, *scale))
}
