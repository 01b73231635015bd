//! The figures of a population: effects, groups, curves and residuals, as plots that window and files draw.

use super::report::{EffectRow, PopulationReport, is_mean};
use super::specimens::{CurveKind, PopulationCurves};
use crate::report::panels::FigurePanels;
use palpate_figures::figure::{
    AxisScale, Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries, PointLabels,
};
use palpate_population::{GroupShift, PopulationFit, normal_scores};

pub(super) const CURVES: &str = "curves";
/// Most rows of a plot that are named; more leave no room for their names.
const NAMED_MAX: usize = 60;
/// Standard errors in half of the interval of a shift.
const HALF: f64 = 1.96;

/// A figure, the stem of its file and what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationFigure {
    pub stem: &'static str,
    pub caption: String,
    pub panels: FigurePanels,
}

/// All figures of a population, that of curves where it was wanted.
#[must_use]
pub fn figures(
    report: &PopulationReport,
    fit: &PopulationFit,
    curves: Option<&PopulationCurves>,
) -> Vec<PopulationFigure> {
    let effects = effects_plot(report).map(|plot| PopulationFigure {
        stem: "effects",
        caption: "Factors by which entries change the median, with their 95 % intervals; without an effect the factor is 1".into(),
        panels: panels("Effects", "factors with 95 % intervals", vec![plot], 1),
    });
    let parameters: Vec<&str> = report.parameters().collect();
    let columns = parameters.len().min(2);
    let outermost = report.levels.first().map_or("", |one| one.level.as_str());
    let groups = (0..parameters.len()).map(|k| groups_plot(report, fit, outermost, k));
    let groups = PopulationFigure {
        stem: "groups",
        caption: format!(
            "Factor from the median to each {outermost}, from the lowest to the highest, with 95 % intervals"
        ),
        panels: panels(
            &format!("Each {outermost}"),
            "factor from the median, with 95 % intervals",
            groups.collect(),
            columns,
        ),
    };
    let curves = curves.map(|curves| PopulationFigure {
        stem: CURVES,
        caption: format!(
            "Measured forces from contact (thin), that of the median specimen (thick), and between which 95 % of specimens lie (band), along the motion of {}",
            curves.motion_of
        ),
        panels: panels(
            "Curves and population",
            "measured, median specimen, and the band of 95 % of specimens",
            curves.kinds.iter().map(curves_plot).collect(),
            curves.kinds.len().min(2),
        ),
    });
    let residuals = report.levels.iter().map(|one| residual_plot(&parameters, fit, &one.level));
    let mut residuals = panels(
        "Residuals by level",
        "shifts over their standard deviation, beside normal ones of the same rank",
        residuals.collect(),
        report.levels.len().min(2),
    );
    let names = parameters.iter().enumerate();
    residuals.legend = names.map(|(k, name)| ((*name).to_owned(), Ink::Session(k))).collect();
    let residuals = PopulationFigure {
        stem: "residuals",
        caption: "Shifts of the groups of each level over their standard deviation, beside what normal shifts of the same rank are; on the line, they are normal".into(),
        panels: residuals,
    };
    effects.into_iter().chain([groups]).chain(curves).chain([residuals]).collect()
}

fn panels(title: &str, words: &str, plots: Vec<Plot>, columns: usize) -> FigurePanels {
    let (title, words) = (title.to_owned(), words.to_owned());
    FigurePanels { title, words, plots, columns, legend: Vec::new() }
}

/// A row of a plot: a name, a value and its interval.
struct Row {
    name: String,
    value: f64,
    ends: [f64; 2],
}

/// Rows from below, each a value on its interval, with its name behind.
fn rows_plot(title: &str, x: &str, rows: &[Row]) -> Plot {
    let at = |k: usize| (k + 1) as f64;
    let intervals = rows.iter().enumerate().map(|(k, row)| {
        PlotSeries::line("", Ink::Quiet, 1.4, row.ends.map(|end| [end, at(k)]).to_vec())
    });
    let points =
        |of: fn(&Row) -> f64| rows.iter().enumerate().map(|(k, row)| [of(row), at(k)]).collect();
    let dots = PlotSeries::dots("", Ink::Series, 4.0, points(|row| row.value));
    let names =
        rows.iter().map(|row| [row.name.clone(), format!("{}: {:.4}", row.name, row.value)]);
    let names = match rows.len() <= NAMED_MAX {
        true => PointLabels::Each(names.collect()),
        false => PointLabels::None,
    };
    let named = PlotSeries::dots("", Ink::Series, 0.0, points(|row| row.ends[1])).labelled(names);
    let low = rows.iter().map(|row| row.ends[0]).fold(1.0, f64::min);
    let high = rows.iter().map(|row| row.ends[1]).fold(1.0, f64::max);
    // A margin on the left, and room for names on the right; rows that are all at one are seen too.
    let (before, behind) = (0.08, 0.6);
    let ratio = (high / low).max(1.1);
    // A logarithmic axis has too few numbers for a narrow range.
    let (axis, ends) = if ratio < 8.0 {
        let width = low * (ratio - 1.0);
        (PlotAxis::linear(x), [low - before * width, high + behind * width])
    } else {
        (PlotAxis::logarithmic(x), [low / ratio.powf(before), high * ratio.powf(behind)])
    };
    let x = axis.with_range(ends).with_visible_values(&ends);
    let rows = [0.0, at(rows.len())];
    let y = PlotAxis { scale: AxisScale::Rows, ..PlotAxis::linear("") };
    let y = y.with_range(rows).with_visible_values(&rows);
    Plot {
        x_levels: vec![PlotLevel { is_dashed: true, ..PlotLevel::plain(1.0, Ink::Quiet) }],
        ..Plot::new(title, x, y).with(intervals.chain([dots, named]))
    }
}

/// All effects; none without any.
fn effects_plot(report: &PopulationReport) -> Option<Plot> {
    let comparisons = report.comparisons.iter().map(|one| &one.difference);
    // Those of an entry with three or more values are among its comparisons.
    let compared = |row: &EffectRow| {
        let mut entries = report.comparisons.iter().map(|one| one.difference.effect.as_str());
        entries.any(|name| entry_of(name) == entry_of(&row.effect))
    };
    let own = report.effects.iter().filter(|one| !is_mean(&one.effect) && !compared(one));
    let row = |one: &EffectRow| Row {
        // The value alone: there is little room.
        name: format!("{}: {}", one.parameter, value_of(&one.effect)),
        value: one.factor,
        ends: one.factor_interval,
    };
    let mut rows: Vec<Row> = own.chain(comparisons).map(row).collect();
    rows.reverse();
    (!rows.is_empty()).then(|| rows_plot("", "factor", &rows))
}

/// An effect of a text is `entry = value`; entries have no equals sign.
fn entry_of(effect: &str) -> &str {
    effect.split_once(" = ").map_or(effect, |(entry, _)| entry)
}

fn value_of(effect: &str) -> &str {
    effect.split_once(" = ").map_or(effect, |(_, value)| value)
}

fn groups_plot(
    report: &PopulationReport,
    fit: &PopulationFit,
    level: &str,
    parameter: usize,
) -> Plot {
    let row = |one: &GroupShift| {
        let half = HALF * one.std_errors[parameter];
        let ends = [-half, half].map(|away| (one.shifts[parameter] + away).exp());
        Row { name: one.group.clone(), value: one.shifts[parameter].exp(), ends }
    };
    let mut rows: Vec<Row> = fit.groups.iter().filter(|one| one.level == level).map(row).collect();
    rows.sort_by(|a, b| a.value.total_cmp(&b.value));
    let title = report.parameters().nth(parameter).unwrap_or_default();
    rows_plot(title, "factor from the median", &rows)
}

fn curves_plot(kind: &CurveKind) -> Plot {
    let measured = kind.curves.iter().map(|curve| PlotSeries {
        opacity: 0.5,
        ..PlotSeries::line("", Ink::Quiet, 0.8, curve.clone())
    });
    let median = PlotSeries::line("median specimen", Ink::Limit, 2.2, kind.median.clone());
    let band =
        PlotBand { name: "95 % of specimens".into(), ink: Ink::Limit, edges: kind.band.clone() };
    let axes = [PlotAxis::linear("time from contact (s)"), PlotAxis::linear("force (N)")];
    let [x, y] = axes;
    Plot { bands: vec![band], ..Plot::new(&kind.name, x, y).with(measured.chain([median])) }
}

fn residual_plot(parameters: &[&str], fit: &PopulationFit, level: &str) -> Plot {
    let mut ends = [0.0f64; 2];
    let dots = parameters.iter().enumerate().map(|(k, name)| {
        let scores = normal_scores(fit, level, k);
        let points: Vec<[f64; 2]> = scores.iter().map(|one| [one.expected, one.found]).collect();
        for [x, _] in &points {
            ends = [ends[0].min(*x), ends[1].max(*x)];
        }
        PlotSeries::dots(name, Ink::Session(k), 2.6, points)
    });
    let dots: Vec<PlotSeries> = dots.collect();
    let line = PlotSeries::line("", Ink::Quiet, 1.0, ends.map(|end| [end, end]).to_vec());
    let is_empty = dots.iter().all(|one| one.points.is_empty());
    let x = PlotAxis::linear("normal shift of the same rank");
    Plot {
        remark: is_empty.then(|| "no differences are seen".to_owned()),
        ..Plot::new(level, x, PlotAxis::linear("shift")).with([line].into_iter().chain(dots))
    }
}
