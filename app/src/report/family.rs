//! The fit of any model family as people read it: lines of text, and a picture with its loop of force over
//! depth.

use super::band::{self, Band};
use super::picture::{LEFT, LINE, RIGHT, WIDTH, legend, look, sentence_lines, span, title};
use super::svg::{Ink, Panel, Svg};
use super::text::{systematic, typeset};
use super::thin::thin;
use crate::theme::tokens::LIGHT;
use crate::widgets::uncertain::{plain, with_error};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::families::{Family, Live};
use palpate_model::fit::{FamilyFit, FamilyParameter, FitSample};
use palpate_model::units::Newtons;

/// One record of a fit, with what the report says of it.
#[derive(Clone, Copy, Debug)]
pub struct FittedRecord<'a> {
    /// Its samples.
    pub samples: &'a [FitSample],
    /// The fitted force at each.
    pub forces: &'a [Newtons],
    /// Coefficient of determination.
    pub r2: f64,
    /// Energy in N*mm put into the tissue along the path, measured and fitted.
    pub work: [f64; 2],
}

/// Name, value and unit of every parameter.
fn cells(parameters: &[FamilyParameter]) -> Vec<[String; 3]> {
    let cells = parameters.iter().map(|one| {
        let value = match one.std_error {
            Some(error) => with_error(one.value, error),
            None => plain(one.value),
        };
        let unit = format!("{}{}", typeset(&one.unit), systematic(one.systematic_error));
        [one.name.clone(), value, unit]
    });
    cells.collect()
}

/// The parameters, one line each.
#[must_use]
pub fn parameter_lines(parameters: &[FamilyParameter]) -> Vec<String> {
    let cells = cells(parameters);
    let width = cells.iter().map(|[_, value, _]| value.chars().count());
    let width = width.max().unwrap_or(0);
    let lines = cells.iter().map(|[name, value, unit]| {
        let line = format!("  {name:<12} {value:<width$}  {unit}");
        line.trim_end().to_owned()
    });
    lines.collect()
}

/// How well a record is explained and what energy went in.
#[must_use]
pub fn quality(fit: &FamilyFit, index: usize, record: &FittedRecord<'_>) -> String {
    let [measured, fitted] = record.work;
    format!(
        "R² {:.6}, rmse {:.3} mN; energy {measured:.3} N·mm measured, {fitted:.3} fitted",
        record.r2,
        fit.records[index].rms * 1e3,
    )
}

/// A whole report: the family, its parameters, every record, every sentence.
#[must_use]
pub fn whole(family: &dyn Family, fit: &FamilyFit, records: &[FittedRecord<'_>]) -> String {
    let mut lines = vec![family.name(), format!("  {}", family.equation())];
    lines.extend(parameter_lines(&fit.parameters));
    for (index, record) in records.iter().enumerate() {
        let own = &fit.records[index];
        if records.len() > 1 {
            lines.push(own.name.clone());
        }
        lines.push(format!(
            "{}; {} samples, at worst {:.1} mN off",
            quality(fit, index, record),
            own.samples,
            own.worst * 1e3
        ));
    }
    lines.extend(sentences(family, fit).map(|sentence| format!("- {sentence}")));
    lines.join("\n")
}

fn sentences(family: &dyn Family, fit: &FamilyFit) -> impl Iterator<Item = String> {
    let limits = format!("it cannot represent {}", family.cannot_represent());
    let live = match family.live() {
        Live::Yes => "it can be fitted while a run goes on".to_owned(),
        Live::No(reason) => format!("it cannot be fitted while a run goes on: {reason}"),
    };
    fit.warnings.iter().cloned().chain([limits, live])
}

/// The picture of a fit to one record: force over time, force over depth, parameters and sentences. Around the fitted
/// force lies the band of twice its calibration's standard uncertainty, where that is stated.
#[must_use]
pub fn picture(
    source: &str,
    family: &dyn Family,
    fit: &FamilyFit,
    record: &FittedRecord<'_>,
    uncertainty: Option<&ForceUncertainty>,
) -> String {
    let samples = record.samples;
    let start = samples.first().map_or(0.0, |sample| sample.t.0);
    let columns = (RIGHT - LEFT) as usize;
    let pairs = || samples.iter().zip(record.forces);
    // Where the force is not known the fit is not drawn over depth: the probe may have left the tissue.
    let known = || pairs().filter(|(one, _)| one.is_measured());
    let over_time = [
        thin(
            known().map(|(one, _)| [one.t.0 - start, one.force.0]),
            columns,
        ),
        thin(known().map(|(one, fit)| [one.t.0 - start, fit.0]), columns),
    ];
    let over_depth = [
        thin(known().map(|(one, _)| [one.depth.0, one.force.0]), columns),
        thin(known().map(|(one, fit)| [one.depth.0, fit.0]), columns),
    ];
    let deepest = known().fold(0.0f64, |deepest, (one, _)| deepest.max(one.depth.0));
    let mut svg = Svg::new(WIDTH);
    title(&mut svg, source, &quality(fit, 0, record));
    legend(&mut svg);
    band::legend(&mut svg, uncertainty);
    for (bottom, x, x_name, [measured, fitted]) in [
        (300.0, span(samples), "time (s)", &over_time),
        (690.0, [0.0, deepest], "depth (mm)", &over_depth),
    ] {
        let top = if bottom < 400.0 { 66.0 } else { 360.0 };
        let band = Band::around(fitted, uncertainty);
        let [above, below] = band.edges();
        let panel = Panel::around(
            [LEFT, top, RIGHT, bottom],
            x,
            &[measured, fitted, above, below],
        );
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
    for row in cells(&fit.parameters) {
        for (x, cell) in [LEFT, 180.0, 420.0].into_iter().zip(&row) {
            svg.text([x, y], Ink::plain(LIGHT.text), cell);
        }
        y += LINE;
    }
    y += LINE;
    for sentence in sentences(family, fit) {
        y = sentence_lines(&mut svg, y, Ink::plain(LIGHT.text), &sentence);
    }
    svg.finish(y, LIGHT.canvas, &format!("Fit of {source}"))
}
