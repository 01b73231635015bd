//! Rows of the table of parameters that state a group: mean, standard deviation, and the difference of two groups.

use super::groups::SessionGroup;
use super::parameters::{Parameters, fixed};
use crate::widgets::{Emphasis, TableCell, TableLine};
use palpate_analysis::group_statistics::{GroupStatistics, MeanDifference, mean_difference};
use palpate_analysis::report::text;

/// What the rows mean.
pub(super) const GROUPS_MEANING: &str = "Mean and standard deviation (SD) of the values of a group, and the difference of the means of two groups with half of its 95 % interval (Welch). Presses on one specimen repeat a measurement of it: the interval is that of the specimens shown, not of all specimens of their kind.";

/// Standard deviations from zero of a mean of which a difference is stated in percent.
const FAR: f64 = 3.0;

/// Rows for the groups with a session that is fitted; none where no group has two.
pub(super) fn group_lines(found: &Parameters, groups: &[SessionGroup]) -> Vec<TableLine> {
    let statistics = |group: &SessionGroup| {
        let of = |number: usize| {
            let rows = found.rows.iter().filter(|row| group.members.contains(&row.index));
            GroupStatistics::of(&rows.filter_map(|row| row.finding(number)).collect::<Vec<_>>())
        };
        (0..found.names.len()).map(of).collect::<Vec<_>>()
    };
    let all: Vec<(&str, Vec<Option<GroupStatistics>>)> =
        groups.iter().map(|group| (group.name.as_str(), statistics(group))).collect();
    let has_scatter = |one: &Option<GroupStatistics>| one.is_some_and(|one| one.std_dev.is_some());
    if !all.iter().any(|(_, own)| own.iter().any(has_scatter)) {
        return Vec::new();
    }
    let mut lines = Vec::new();
    for (name, own) in &all {
        let count = own.iter().flatten().map(|one| one.count).max().unwrap_or(0);
        if count == 0 {
            continue;
        }
        let mean = own.iter().map(|one| Some(one.as_ref()?.mean)).collect();
        lines.push(line(found, [name, &format!("mean of {count}")], mean, Emphasis::Marked));
        let std_dev = own.iter().map(|one| one.as_ref()?.std_dev).collect();
        lines.push(line(found, [name, "SD"], std_dev, Emphasis::Plain));
    }
    if let [(first, a), (second, b)] = all.as_slice() {
        let differences = a.iter().zip(b);
        let differences: Vec<Option<MeanDifference>> =
            differences.map(|(a, b)| mean_difference(a.as_ref()?, b.as_ref()?)).collect();
        if differences.iter().any(Option::is_some) {
            let of = format!("{second} \u{2212} {first}");
            let value = differences.iter().map(|one| Some(one.as_ref()?.value)).collect();
            lines.push(line(found, ["difference", &of], value, Emphasis::Marked));
            let half = differences.iter().map(|one| Some(one.as_ref()?.half_width)).collect();
            lines.push(line(found, ["difference", "± 95 %"], half, Emphasis::Plain));
            let share =
                |(difference, first): (&Option<MeanDifference>, &Option<GroupStatistics>)| {
                    let (difference, first) = (difference.as_ref()?, first.as_ref()?);
                    // A share of a mean that may be zero says nothing.
                    let is_far = first.mean.abs() > FAR * first.std_dev?;
                    is_far.then(|| format!("{:+.1}", 100.0 * difference.value / first.mean))
                };
            let shares: Vec<Option<String>> = differences.iter().zip(a).map(share).collect();
            let of = format!("% of {first}");
            lines.push(text_line(found, ["difference", &of], &shares, Emphasis::Plain));
        }
    }
    lines
}

fn line(
    found: &Parameters,
    [group, what]: [&str; 2],
    values: Vec<Option<f64>>,
    emphasis: Emphasis,
) -> TableLine {
    let decimals = found.decimals.iter();
    let texts = values.iter().zip(decimals);
    let texts: Vec<_> =
        texts.map(|(value, decimals)| value.map(|value| fixed(value, *decimals))).collect();
    text_line(found, [group, what], &texts, emphasis)
}

fn text_line(
    found: &Parameters,
    [group, what]: [&str; 2],
    texts: &[Option<String>],
    emphasis: Emphasis,
) -> TableLine {
    let mut words = format!("{group}, {what}");
    let cell = |text: String| TableCell { text, emphasis, ..TableCell::default() };
    let mut cells = vec![cell(group.to_owned()), cell(what.to_owned())];
    for (text, parameter) in texts.iter().zip(&found.names) {
        if let Some(text) = text {
            words += &format!("; {} {text}", text::parameter_head(parameter));
        }
        cells.push(cell(text.clone().unwrap_or_default()));
    }
    // The residual is no property of a specimen.
    cells.push(TableCell::default());
    TableLine { name: words, cells }
}
