//! A population for a paper: tables, a paragraph, figures and a page, each a file of a new folder.

use super::figures::{CURVES, PopulationFigure};
use super::report::{
    COMPARISON_HEAD, ComparisonRow, DEVIATION_HEAD, DeviationRow, EFFECT_HEAD, EffectRow,
    PopulationReport, is_mean, probability,
};
use super::{MEAN_AT, Population, PopulationMethod};
use crate::report::text::counted;
use palpate_figures::page::{HtmlBody, document};
use palpate_figures::uncertain::significant;
use palpate_population::Evidence;
use palpate_rheology::families::find_family;
use palpate_sessions::atomic;
use std::io;
use std::path::Path;

/// Writes all files of a population into a new folder.
///
/// # Errors
/// The folder exists already, or a file cannot be written.
pub fn write_results(population: &Population, folder: &Path) -> io::Result<()> {
    std::fs::create_dir(folder)?;
    let figures = population.figures();
    let texts = [
        ("effects.csv", effects_csv(&population.report)),
        ("deviations.csv", deviations_csv(&population.report)),
        ("sessions.csv", sessions_csv(population)),
        ("table.tex", latex(&population.report)),
        ("paragraph.txt", format!("{}\n", paragraph(&population.report))),
        ("population.html", page(&population.report, &figures)),
    ];
    for (name, text) in texts {
        atomic::create(&folder.join(name), text.as_bytes())?;
    }
    for figure in &figures {
        let svg = figure.panels.drawing().svg();
        atomic::create(&folder.join(format!("{}.svg", figure.stem)), svg.as_bytes())?;
    }
    Ok(())
}

fn csv(head: &[String], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let cell = |text: &String| match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.clone(),
    };
    let line = |cells: &[String]| cells.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    let rows = rows.into_iter().map(|row| line(&row));
    std::iter::once(line(head)).chain(rows).collect()
}

/// A text that a spreadsheet does not run as a formula.
fn harmless(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() }
}

fn names<const N: usize>(names: [&str; N]) -> Vec<String> {
    names.map(str::to_owned).to_vec()
}

fn optional(value: Option<f64>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// Means, effects and comparisons in full precision, logarithms first.
fn effects_csv(report: &PopulationReport) -> String {
    let head = names([
        "parameter",
        "effect",
        "unit",
        "log",
        "std_error",
        "log_low",
        "log_high",
        "degrees_of_freedom",
        "factor",
        "factor_low",
        "factor_high",
        "p",
        "p_holm",
        "effect_size",
    ]);
    let row = |one: &EffectRow, adjusted: Option<f64>| {
        let numbers = [one.value, one.std_error, one.interval[0], one.interval[1], one.freedom];
        let factors = [one.factor, one.factor_interval[0], one.factor_interval[1]];
        let mut row =
            vec![one.parameter.clone(), one.effect.clone(), one.unit.clone().unwrap_or_default()];
        row.extend(numbers.iter().chain(&factors).map(f64::to_string));
        row.extend([one.p_value, adjusted, one.effect_size].map(optional));
        row
    };
    let effects = report.effects.iter().map(|one| row(one, None));
    let comparisons = report.comparisons.iter();
    let comparisons = comparisons.map(|one| row(&one.difference, Some(one.adjusted_p)));
    csv(&head, effects.chain(comparisons))
}

fn deviations_csv(report: &PopulationReport) -> String {
    let head = names([
        "parameter",
        "level",
        "standard_deviation",
        "low",
        "high",
        "share",
        "intraclass_correlation",
        "coefficient_of_variation",
        "pair_factor",
    ]);
    let row = |one: &DeviationRow| {
        let estimate = &one.estimate;
        let numbers = [
            Some(estimate.value),
            estimate.interval[0],
            estimate.interval[1],
            Some(estimate.share),
            one.intraclass_correlation,
            Some(one.coefficient_of_variation),
            Some(one.pair_factor),
        ];
        let words = [estimate.parameter.clone(), estimate.level.clone()];
        words.into_iter().chain(numbers.map(optional)).collect()
    };
    csv(&head, report.standard_deviations.iter().map(row))
}

/// What each session says: its groups, its columns of the design, the logarithms of its parameters and their covariance.
fn sessions_csv(population: &Population) -> String {
    let study = &population.study;
    let parameters = &study.parameters;
    let pairs: Vec<(usize, usize)> =
        (0..parameters.len()).flat_map(|a| (0..=a).map(move |b| (a, b))).collect();
    let outer = &study.levels[..study.levels.len() - 1];
    let head = std::iter::once("session".to_owned())
        .chain(outer.iter().cloned())
        .chain(study.effects.iter().cloned())
        .chain(parameters.iter().map(|name| format!("log {name}")))
        .chain(pairs.iter().map(|(a, b)| format!("cov {} {}", parameters[*a], parameters[*b])));
    let rows = study.sessions.iter().map(|one| {
        let covariance = match &one.evidence {
            Evidence::Exact => None,
            Evidence::Information(information) => information.clone().try_inverse(),
        };
        // A covariance that does not exist, since a curve does not depend on a parameter, is left empty.
        let covariances =
            pairs.iter().map(|pair| optional(covariance.as_ref().map(|all| all[*pair])));
        let numbers = one.design.iter().chain(&one.values).map(f64::to_string);
        let words = std::iter::once(&one.name).chain(&one.groups).map(|text| harmless(text));
        words.chain(numbers).chain(covariances).collect()
    });
    csv(&head.collect::<Vec<_>>(), rows)
}

/// The tables for LaTeX, without a package.
fn latex(report: &PopulationReport) -> String {
    let table = |head: &str, rows: Vec<Vec<String>>| {
        let columns = head.split(" | ").count();
        let line = |cells: Vec<String>| {
            let cells: Vec<String> = cells.iter().map(|cell| latex_text(cell)).collect();
            format!("{} \\\\\n", cells.join(" & "))
        };
        let head = line(head.split(" | ").map(str::to_owned).collect());
        let rows: String = rows.into_iter().map(line).collect();
        let align = "l".repeat(columns);
        format!(
            "\\begin{{tabular}}{{{align}}}\n\\hline\n{head}\\hline\n{rows}\\hline\n\\end{{tabular}}\n"
        )
    };
    let effects = report.effects.iter().map(EffectRow::cells).collect();
    let deviations = report.standard_deviations.iter().map(DeviationRow::cells).collect();
    let mut tables = vec![table(EFFECT_HEAD, effects), table(DEVIATION_HEAD, deviations)];
    if !report.comparisons.is_empty() {
        let comparisons = report.comparisons.iter().map(ComparisonRow::cells).collect();
        tables.insert(1, table(COMPARISON_HEAD, comparisons));
    }
    tables.join("\n")
}

fn latex_text(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '\\' => out += "\\textbackslash{}",
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            '<' => out += "$<$",
            '>' => out += "$>$",
            '|' => out += "\\textbar{}",
            '"' => out += "''",
            '·' => out += "$\\cdot$",
            '²' => out += "$^2$",
            '³' => out += "$^3$",
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', letter]),
            _ => out.push(letter),
        }
    }
    out
}

/// What was done and found, as methods and results of a paper say it.
#[must_use]
pub fn paragraph(report: &PopulationReport) -> String {
    let groups: Vec<String> =
        report.levels.iter().rev().map(|one| counted(one.groups, &one.level)).collect();
    let entered = match report.method {
        PopulationMethod::Curves => "each curve with its own likelihood (Lindstrom & Bates 1990)",
        PopulationMethod::TwoStage | PopulationMethod::Stored => {
            "from the best values of each session and their covariance"
        }
    };
    let version = env!("CARGO_PKG_VERSION");
    let mut text = format!(
        "We recorded {}. The force was described by {}, and the logarithms of its parameters by a linear mixed model with random intercepts nested in this order, {entered}, by restricted maximum likelihood (palpate {version}). Intervals are of 95 %: of medians and factors by Student's t with Satterthwaite's degrees of freedom, of standard deviations by the profile of the likelihood.",
        groups.join(" of "),
        find_family(&report.model).map_or_else(|_| report.model.clone(), |one| one.name()),
    );
    let reference: Vec<&str> =
        report.notes.iter().filter_map(|note| note.strip_prefix(MEAN_AT)).collect();
    if !reference.is_empty() {
        text += &format!(" Medians are those at {}.", reference.join(", "));
    }
    for one in report.effects.iter().filter(|one| is_mean(&one.effect)) {
        text += &parameter_sentences(report, one);
    }
    text
}

fn parameter_sentences(report: &PopulationReport, mean: &EffectRow) -> String {
    let ends =
        |[low, high]: [f64; 2]| format!("{} to {}", significant(low, 3), significant(high, 3));
    let unit = mean.unit_in_print();
    let median = format!("{} {unit}", significant(mean.factor, 3));
    let parameter = &mean.parameter;
    let mut text = format!(
        " The median of {parameter} was {} ({}).",
        median.trim_end(),
        ends(mean.factor_interval)
    );
    let own = |one: &&EffectRow| one.parameter == *parameter;
    for one in report.effects.iter().filter(own) {
        if let Some(p) = one.p_value {
            let p = match probability(p) {
                small if small.starts_with('<') => format!("p {small}"),
                p => format!("p = {p}"),
            };
            // A number has an effect for each unit, a text for each of its values.
            let with = match one.effect.contains(" = ") {
                true => format!("With {}", one.effect),
                false => format!("For each unit of {}", one.effect),
            };
            text += &format!(
                " {with} it was {} times that ({}; {:.1} degrees of freedom; {p}).",
                significant(one.factor, 3),
                ends(one.factor_interval),
                one.freedom,
            );
        }
    }
    let own = |one: &&DeviationRow| one.estimate.parameter == *parameter;
    let mut rows = report.standard_deviations.iter().filter(own);
    let percent = |value: f64| format!("{:.1}", 100.0 * value);
    let between = rows.clone().map(|one| {
        let open = |end: Option<f64>| end.map_or("open".to_owned(), percent);
        let [low, high] = one.estimate.interval.map(open);
        let value = percent(one.estimate.value);
        format!("{value} % between {}s ({low} to {high} %)", one.estimate.level)
    });
    text += &format!(
        " Its logarithm had standard deviations of {}",
        between.collect::<Vec<_>>().join(", ")
    );
    text += &match rows.next_back() {
        Some(last) => {
            let place = rows.next_back().map(|outer| format!(" of one {}", outer.estimate.level));
            format!(
                "; without the noise of their curves 95 % of pairs of {}s{} are within a factor of {}.",
                last.estimate.level,
                place.unwrap_or_default(),
                significant(last.pair_factor, 3)
            )
        }
        None => ".".to_owned(),
    };
    text
}

/// One page with the paragraph, the tables, the figures and what is to be said of them.
fn page(report: &PopulationReport, figures: &[PopulationFigure]) -> String {
    let mut body = HtmlBody::default();
    body.heading(1, "Population");
    body.paragraph(&paragraph(report));
    let mut table = |caption: &str, head: &str, rows: Vec<Vec<String>>| {
        let heads: Vec<&str> = head.split(" | ").collect();
        body.table(caption, &heads, &rows);
    };
    let cells = report.effects.iter().map(EffectRow::cells).collect();
    table("Means and effects", EFFECT_HEAD, cells);
    if !report.comparisons.is_empty() {
        let cells = report.comparisons.iter().map(ComparisonRow::cells).collect();
        table("Comparisons", COMPARISON_HEAD, cells);
    }
    let cells = report.standard_deviations.iter().map(DeviationRow::cells).collect();
    table("Standard deviations", DEVIATION_HEAD, cells);
    let remarks = report.remarks();
    body.list(remarks.iter().map(String::as_str));
    for part in [report.influence_text(), report.plan_text()].into_iter().flatten() {
        body.pre(&part);
    }
    for figure in figures {
        body.figure(&figure.panels.drawing().svg(), &figure.caption);
    }
    if figures.iter().all(|one| one.stem != CURVES) {
        body.paragraph("Curves are drawn where all parameters of the model are in the population, and the model describes most of its specimens.");
    }
    document("Population", body)
}
