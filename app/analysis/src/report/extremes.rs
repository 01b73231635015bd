//! The extremes as people read them: a summary by group, and the page with all tables.

use super::text::capital;
use palpate_rheology::extremes::{ExtremesRow, ExtremesVerdict};
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupSummary {
    pub group: &'static str,
    /// Rows of each of [`ExtremesVerdict::ALL`].
    pub counts: [usize; 4],
    /// The right row that used most of its tolerance, in words.
    pub tightest: Option<String>,
}

/// Every group in numbers, in the order they were run.
#[must_use]
pub fn summary(rows: &[ExtremesRow]) -> Vec<GroupSummary> {
    grouped(rows, |row| row.group)
        .into_iter()
        .map(|(group, rows)| GroupSummary {
            group,
            counts: ExtremesVerdict::ALL
                .map(|verdict| rows.iter().filter(|row| row.verdict == verdict).count()),
            tightest: tightest(&rows).map(|(row, error)| {
                format!("{error:.1e} of {:.0e}: {}, {}", row.tolerance, row.subject, row.case)
            }),
        })
        .collect()
}

/// Rows by a word of theirs, in the order in which the words come first.
fn grouped<'a, K: PartialEq>(
    rows: impl IntoIterator<Item = &'a ExtremesRow>,
    word: impl Fn(&'a ExtremesRow) -> K,
) -> Vec<(K, Vec<&'a ExtremesRow>)> {
    let mut groups: Vec<(K, Vec<&ExtremesRow>)> = Vec::new();
    for row in rows {
        let key = word(row);
        match groups.iter_mut().find(|(group, _)| *group == key) {
            Some((_, own)) => own.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups
}

/// The right row that used most of its tolerance.
fn tightest<'a>(rows: &[&'a ExtremesRow]) -> Option<(&'a ExtremesRow, f64)> {
    rows.iter()
        .filter(|row| row.verdict == ExtremesVerdict::Right)
        .filter_map(|row| Some((*row, row.relative_error?)))
        .max_by(|(a, x), (b, y)| (x / a.tolerance).total_cmp(&(y / b.tolerance)))
}

/// One line for each group, then every wrong row.
#[must_use]
pub fn text(rows: &[ExtremesRow]) -> String {
    let mut lines = Vec::new();
    for one in summary(rows) {
        let [right, refused, flagged, wrong] = one.counts;
        lines.push(format!(
            "{}: {right} right, {refused} refused, {flagged} flagged, {wrong} WRONG",
            one.group
        ));
        if let Some(tightest) = one.tightest {
            lines.push(format!("  largest error relative to its tolerance: {tightest}"));
        }
    }
    let wrong = rows.iter().filter(|row| row.verdict == ExtremesVerdict::Wrong);
    lines.extend(wrong.map(|row| {
        format!("WRONG {}: {}, {}: {}", row.group, row.subject, row.case, row.sentence)
    }));
    lines.join("\n")
}

#[must_use]
pub fn page(rows: &[ExtremesRow]) -> String {
    let mut page = format!("{PAGE_HEAD}{INTRODUCTION}");
    page += "| group | right | refused | flagged | wrong | largest error relative to its tolerance |\n|---|---|---|---|---|---|\n";
    for one in summary(rows) {
        let [right, refused, flagged, wrong] = one.counts;
        let (group, tightest) = (one.group, one.tightest.unwrap_or_default());
        page += &format!("| {group} | {right} | {refused} | {flagged} | {wrong} | {tightest} |\n");
    }
    for (group, rows) in grouped(rows, |row| row.group) {
        page += &format!("\n## {}\n\n", capital(group));
        page += &match group {
            "relaxation time and step" => by_time_and_step(&rows),
            "integrators, relaxation time and time step" => by_ratio(&rows),
            _ => by_case(&rows),
        };
    }
    page
}

pub const PAGE_HEAD: &str = "\
# Extremes

Written by `palpate extremes --page docs/explanation/extremes.md`; do not edit.
";

const INTRODUCTION: &str = include_str!("extremes.md");

/// Several rows in one short cell: the worst error, or the worst verdict.
fn cell(rows: &[&ExtremesRow]) -> String {
    let worst = rows.iter().max_by(|a, b| {
        let error = |row: &ExtremesRow| row.relative_error.unwrap_or_default();
        a.verdict.cmp(&b.verdict).then(error(a).total_cmp(&error(b)))
    });
    match worst {
        None => String::new(),
        Some(row) if row.verdict == ExtremesVerdict::Right => {
            format!("{:.0e}", row.relative_error.unwrap_or_default())
        }
        Some(row) => row.verdict.name().to_owned(),
    }
}

/// Exponents of a case called `tau 1e3 s, step 1e-6 s`.
fn exponents(case: &str) -> Option<(i32, i32)> {
    let (tau, step) = case.split_once(" s, step 1e")?;
    let tau = tau.strip_prefix("tau 1e")?.parse().ok()?;
    Some((tau, step.strip_suffix(" s")?.parse().ok()?))
}

fn by_time_and_step(rows: &[&ExtremesRow]) -> String {
    let mut cells: BTreeMap<i32, BTreeMap<i32, Vec<&ExtremesRow>>> = BTreeMap::new();
    for row in rows {
        if let Some((tau, step)) = exponents(&row.case) {
            cells.entry(tau).or_default().entry(step).or_default().push(row);
        }
    }
    let steps: Vec<i32> =
        cells.values().next().map_or(Vec::new(), |row| row.keys().copied().collect());
    let mut table = "Worst error of any family, relative to the peak force, by relaxation time (rows) and step\n(columns). The path loads, holds, unloads halfway, leaves the surface and loads again in 20 steps.\n\n".to_owned();
    table += &header("tau \\ step", steps.iter().map(|step| format!("1e{step} s")));
    for (tau, row) in &cells {
        let line = row.values().map(|rows| cell(rows)).collect();
        table += &line_of(&format!("1e{tau} s"), line);
    }
    table
}

fn by_ratio(rows: &[&ExtremesRow]) -> String {
    let of_ratio = |row: &&&ExtremesRow| exponents(&row.case).is_some();
    let subjects = grouped(rows.iter().filter(of_ratio).copied(), |row| row.subject.as_str());
    let mut cells: BTreeMap<i32, BTreeMap<&str, Vec<&ExtremesRow>>> = BTreeMap::new();
    for row in rows {
        if let Some((tau, step)) = exponents(&row.case) {
            cells.entry(step - tau).or_default().entry(&row.subject).or_default().push(row);
        }
    }
    let mut table = "Worst error, relative to the peak force, by the ratio of step to relaxation time. The path loads to\n20 mm, holds and unloads halfway, in 20 steps each. Unstable integrators are refused.\n\n".to_owned();
    table += &header("step / tau", subjects.iter().map(|(name, _)| (*name).to_owned()));
    for (ratio, row) in &cells {
        let own = |name: &&str| row.get(name).map_or(String::new(), |rows| cell(rows));
        let line = subjects.iter().map(|(name, _)| own(name));
        table += &line_of(&format!("1e{ratio}"), line.collect());
    }
    table
}

fn by_case(rows: &[&ExtremesRow]) -> String {
    let names = ["what", "worst error", "the first sentence"];
    let mut table = header("case", names.into_iter().map(str::to_owned));
    for (case, rows) in grouped(rows.iter().copied(), |row| row.case.as_str()) {
        let error = tightest(&rows).map_or(String::new(), |(_, error)| format!("{error:.0e}"));
        let sentence = rows.iter().find(|row| !row.sentence.is_empty());
        let sentence = sentence.map_or(String::new(), |row| row.sentence.replace('|', "/"));
        table += &line_of(case, vec![verdicts(&rows), error, sentence]);
    }
    table
}

/// Subjects by verdict: `all right`, or `right but for refused: voigt + fung`, the most first.
fn verdicts(rows: &[&ExtremesRow]) -> String {
    let mut named: [(ExtremesVerdict, Vec<&str>); 4] = ExtremesVerdict::ALL.map(|verdict| {
        let own = rows.iter().filter(|row| row.verdict == verdict);
        (verdict, own.map(|row| row.subject.as_str()).collect())
    });
    named.sort_by_key(|(_, subjects)| std::cmp::Reverse(subjects.len()));
    let others = named[1..].iter().filter(|(_, subjects)| !subjects.is_empty());
    let others: Vec<String> = others
        .map(|(verdict, subjects)| format!("{}: {}", verdict.name(), subjects.join(" + ")))
        .collect();
    let most = named[0].0.name();
    match others.as_slice() {
        [] => format!("all {most}"),
        others => format!("{most} but for {}", others.join("; ")),
    }
}

fn header(first: &str, others: impl Iterator<Item = String>) -> String {
    let others: Vec<String> = others.collect();
    let rule = "|---".repeat(others.len() + 1);
    format!("{}{rule}|\n", line_of(first, others))
}

fn line_of(first: &str, others: Vec<String>) -> String {
    format!("| {first} | {} |\n", others.join(" | "))
}
