//! What is told of a fit whose family was named: its equation, its loop of force over depth, what it cannot represent.

use super::band::{self, Band};
use super::fit_json::Overlay;
use super::picture::{LEFT, LINE, RIGHT, WIDTH, legend, look, sentence_lines, span, table, title};
use super::text::quality;
use palpate_figures::drawing::{Ink, Panel, Svg};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::ForceUncertainty;
use palpate_rheology::families::{Family, Live};
use palpate_rheology::fit::{FitReport, FitSample};

/// What energy went in and how far the fit is off at worst.
#[must_use]
pub fn energy(overlay: &Overlay) -> String {
    format!(
        "energy {:.3} N·mm measured, {:.3} fitted; at worst {:.1} mN off",
        overlay.work_measured_n_mm,
        overlay.work_fitted_n_mm,
        overlay.worst_n * 1e3
    )
}

/// Lines of a report with the equation under its first line.
#[must_use]
pub fn with_equation(family: &dyn Family, lines: &str) -> String {
    lines.replacen('\n', &format!("\n  {}\n", family.equation()), 1)
}

/// What the family cannot do.
#[must_use]
pub fn limits(family: &dyn Family) -> [String; 2] {
    let limits = format!("it cannot represent {}", family.cannot_represent());
    let live = match family.live() {
        Live::Yes => "it can be fitted while a run goes on".to_owned(),
        Live::No(reason) => format!("it cannot be fitted while a run goes on: {reason}"),
    };
    [limits, live]
}

/// The picture of a fit to one record: force over time, force over depth, parameters and sentences. Around the fitted
/// force lies the band of twice its calibration's standard uncertainty, where that is stated.
#[must_use]
pub fn picture(
    source: &str,
    family: &dyn Family,
    (samples, overlay): (&[FitSample], &Overlay),
    report: &FitReport,
    uncertainty: Option<&ForceUncertainty>,
) -> String {
    let start = samples.first().map_or(0.0, |sample| sample.t.0);
    let columns = (RIGHT - LEFT) as usize;
    let pairs = || samples.iter().zip(&overlay.forces);
    // Where the force is not known the fit is not drawn over depth: the probe may have left the tissue.
    let known = || pairs().filter(|(one, _)| one.is_measured());
    let over_time = [
        thin(known().map(|(one, _)| [one.t.0 - start, one.force.0]), columns),
        thin(known().map(|(one, fit)| [one.t.0 - start, fit.0]), columns),
    ];
    let over_depth = [
        thin(known().map(|(one, _)| [one.depth.0, one.force.0]), columns),
        thin(known().map(|(one, fit)| [one.depth.0, fit.0]), columns),
    ];
    let deepest = known().fold(0.0f64, |deepest, (one, _)| deepest.max(one.depth.0));
    let mut svg = Svg::new(WIDTH);
    title(&mut svg, source, &quality(report));
    legend(&mut svg);
    band::legend(&mut svg, uncertainty);
    for (bottom, x, x_name, [measured, fitted]) in [
        (300.0, span(samples), "time (s)", &over_time),
        (690.0, [0.0, deepest], "depth (mm)", &over_depth),
    ] {
        let top = if bottom < 400.0 { 66.0 } else { 360.0 };
        let band = Band::around(fitted, uncertainty);
        let [above, below] = band.edges();
        let panel = Panel::around([LEFT, top, RIGHT, bottom], x, &[measured, fitted, above, below]);
        panel.axes(&mut svg, [x_name, "force (N)"], look());
        band.draw(&mut svg, &panel, LIGHT.series);
        panel.line(&mut svg, measured, LIGHT.series, 2.6);
        panel.line(&mut svg, fitted, LIGHT.limit, 1.4);
    }
    let mut y = 760.0;
    for text in [&family.name(), family.equation()] {
        svg.text([LEFT, y], Ink::plain(LIGHT.text), text);
        y += LINE;
    }
    svg.text([LEFT, y], Ink::plain(LIGHT.text), &energy(overlay));
    y = table(&mut svg, report, y + LINE);
    let sentences = report.sentences().map(str::to_owned);
    for sentence in sentences.chain(limits(family)) {
        y = sentence_lines(&mut svg, y, Ink::plain(LIGHT.text), &sentence);
    }
    svg.finish(y, LIGHT.canvas, &format!("Fit of {source}"))
}
