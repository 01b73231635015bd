//! The parameters of every session's fit: how each is distributed, and a table that sorts by any of them.

use super::ReviewScreen;
use super::deviation::{Deviation, deviations, median};
use super::group_rows::{GROUPS_MEANING, group_lines};
use super::groups::{Grouping, SessionGroup, groups};
use super::session_list::{color_of, doubt_of};
use super::subject::ReviewSubject;
use crate::plots::distribution::{
    DistributionDot, DistributionLane, distribution_ui, height, lane_height, line_height,
};
use crate::screens::parameters::symbol_job;
use crate::theme::Tokens;
use crate::widgets::{
    ChoiceTable, Column, Emphasis, Glyph, ScrollPosition, TableAction, TableCell, TableLine,
    alarm_ui, quiet_ui, tokens_of,
};
use eframe::egui::{
    Align2, Galley, Id, Label, Pos2, Rect, RichText, ScrollArea, Sense, TextStyle, Ui, UiBuilder,
    pos2, vec2,
};
use palpate_analysis::report::text;
use palpate_model::estimate::FittedParameter;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::sync::Arc;

/// A tint is full at so many robust standard deviations.
const FULL: f64 = 5.0;
/// What tint, triangle and ring mean.
const MEANING: &str = "A dot stands in its statistical 95 % interval: errors of a calibration move all sessions that it reads alike. The distance from the median of the group is in robust standard deviations, 1.4826 times the median absolute deviation together with the value's own standard uncertainty. A tint is full at 5. A triangle in the cell and a ring around the dot mark an outlier: so far from the others is a value in one of twenty groups by chance (8.0 in a group of five, 4.6 in one of ten). Groups of fewer than four sessions have no tint.";
/// Least width of the strip of a parameter, and most of the names of groups, in points.
const STRIP_MIN: f32 = 130.0;
const LANE_NAME_MAX: f32 = 120.0;
const STRIP_HEAD: f32 = 22.0;

/// The column by which the table is sorted, and how far it is scrolled.
#[derive(Default)]
pub(super) struct ParameterTable {
    /// None: by group, then in the order in which sessions were added.
    sorted: Option<(usize, bool)>,
    scrolled: ScrollPosition,
}

/// A parameter of a session.
struct Value {
    parameter: FittedParameter,
    /// From the median of its group.
    deviation: Option<Deviation>,
}

impl Value {
    /// The statistical interval: errors of a calibration move all sessions that it reads alike.
    fn ends(&self) -> Option<[f64; 2]> {
        self.parameter.ci95.or(self.parameter.total95)
    }

    /// How far it is, in words; empty where it is near.
    fn deviation_words(&self) -> String {
        match self.deviation {
            Some(Deviation { distance: far, is_outlier: true }) => {
                let side = if far > 0.0 { "above" } else { "below" };
                format!(", {:.1} robust standard deviations {side} the median", far.abs())
            }
            _ => String::new(),
        }
    }

    fn is_outlier(&self) -> bool {
        self.deviation.is_some_and(|deviation| deviation.is_outlier)
    }

    fn cell(&self, decimals: usize, tokens: &Tokens) -> TableCell {
        let text = fixed(self.parameter.value, decimals);
        let Some(Deviation { distance: far, .. }) = self.deviation else {
            return TableCell::text(text);
        };
        let emphasis = Emphasis::Tinted(tokens.deviation((far / FULL) as f32));
        let mark = if far > 0.0 { Glyph::Up } else { Glyph::Down };
        let glyph = self.is_outlier().then_some(mark);
        TableCell { glyph, text, emphasis }
    }
}

/// A number with so many decimals; zero has no sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if !rest.contains(|digit: char| ('1'..='9').contains(&digit)) => rest.to_owned(),
        _ => text,
    }
}

/// A session of the table.
pub(super) struct Row {
    /// Among the sessions shown.
    pub index: usize,
    group: String,
    /// What of its name the others of the group do not have.
    short: String,
    values: Vec<Option<Value>>,
    rmse_mn: f64,
}

impl Row {
    /// The value of a parameter, if its fit has found it.
    pub fn finding(&self, number: usize) -> Option<f64> {
        let parameter = &self.values.get(number)?.as_ref()?.parameter;
        is_finding(parameter).then_some(parameter.value)
    }
}

/// What was kept at a value is not a finding.
fn is_finding(parameter: &FittedParameter) -> bool {
    !parameter.is_fixed && parameter.value.is_finite()
}

/// The sessions that are fitted, group by group, and the parameters of the first.
pub(super) struct Parameters {
    pub names: Vec<FittedParameter>,
    /// Of each, so that two digits of the smallest standard error are seen.
    pub decimals: Vec<usize>,
    pub rows: Vec<Row>,
}

impl Parameters {
    fn of(subjects: &[ReviewSubject], groups: &[SessionGroup]) -> Option<Self> {
        let order = groups.iter().flat_map(|group| &group.members);
        let first = order.clone().find_map(|index| subjects[*index].fitted())?;
        let all = || subjects.iter().filter_map(ReviewSubject::fitted);
        let mut names = first.report.parameters.clone();
        // What is kept at a value in all of them is none of their findings.
        names.retain(|one| all().filter_map(|fit| fit.report.parameter(&one.name)).any(is_finding));
        let decimals = names.iter().map(|one| {
            let errors = all().filter_map(|fit| fit.report.parameter(&one.name)?.std_error);
            let least = errors.filter(|error| *error > 0.0).fold(f64::INFINITY, f64::min);
            if least.is_finite() {
                (1.0 - least.log10().floor()).clamp(0.0, 8.0) as usize
            } else {
                4
            }
        });
        let decimals = decimals.collect();
        let mut rows = Vec::new();
        for group in groups {
            let short = group.members.iter().copied().zip(group.short_names(subjects));
            let short: HashMap<usize, String> = short.collect();
            let own = group.members.iter();
            let fitted = own.filter_map(|index| Some((*index, &subjects[*index].fitted()?.report)));
            let fitted: Vec<_> = fitted.collect();
            let mut columns: Vec<Vec<Option<Value>>> = Vec::new();
            for name in &names {
                let found: Vec<Option<&FittedParameter>> =
                    fitted.iter().map(|(_, report)| report.parameter(&name.name)).collect();
                let known = |one: &&FittedParameter| is_finding(one);
                let values: Vec<(f64, f64)> = found
                    .iter()
                    .flatten()
                    .copied()
                    .filter(known)
                    .map(|one| (one.value, one.std_error.unwrap_or(0.0)))
                    .collect();
                let mut far = deviations(&values).unwrap_or_default().into_iter();
                let value = |one: Option<&FittedParameter>| {
                    let one = one?;
                    let deviation = if known(&one) { far.next() } else { None };
                    Some(Value { parameter: one.clone(), deviation })
                };
                columns.push(found.into_iter().map(value).collect());
            }
            let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
            for (index, report) in fitted {
                rows.push(Row {
                    index,
                    group: group.name.clone(),
                    short: short[&index].clone(),
                    values: columns.iter_mut().map(|column| column.next().flatten()).collect(),
                    rmse_mn: report.rmse_n * 1e3,
                });
            }
        }
        Some(Self { names, decimals, rows })
    }

    /// The rows sorted by a column; those without a value there come last either way.
    fn sort(&mut self, subjects: &[ReviewSubject], by: Option<(usize, bool)>) {
        let last = self.names.len() + 2;
        // The fits of another model may have fewer parameters.
        let Some((column, is_reversed)) = by.filter(|(column, _)| *column <= last) else { return };
        let order = |order: Ordering| if is_reversed { order.reverse() } else { order };
        self.rows.sort_by(|a, b| match column {
            0 => order(a.group.cmp(&b.group)),
            1 => order(subjects[a.index].name.cmp(&subjects[b.index].name)),
            column if column == last => order(a.rmse_mn.total_cmp(&b.rmse_mn)),
            column => {
                let value = |row: &Row| Some(row.values.get(column - 2)?.as_ref()?.parameter.value);
                match (value(a), value(b)) {
                    (Some(a), Some(b)) => order(a.total_cmp(&b)),
                    (a, b) => b.is_some().cmp(&a.is_some()),
                }
            }
        });
    }
}

impl ReviewScreen {
    pub(super) fn parameters_ui(&mut self, ui: &mut Ui) {
        let groups = groups(&self.subjects, self.grouping);
        refusals_ui(ui, &self.subjects);
        let Some(mut found) = Parameters::of(&self.subjects, &groups) else {
            return match self.fits.state() {
                Some(state) => quiet_ui(ui, format!("fitting the sessions shown: {}", state.what)),
                None => quiet_ui(
                    ui,
                    "none of the sessions shown is fitted yet; press 'Fit the sessions shown'",
                ),
            };
        };
        // The table has at least half of the height.
        let strips = ScrollArea::vertical().id_salt("strips").auto_shrink([false, true]);
        let room = 0.5 * ui.available_height();
        let strips = strips.max_height(room);
        let mut chosen = strips.show(ui, |ui| self.strips_ui(ui, room, &groups, &found)).inner;
        let words = "bars: 95 % intervals; tint: blue below the median, orange above; red ring: outlier; black: in front";
        let words = RichText::new(words).color(tokens_of(ui).text_quiet).small();
        ui.add(Label::new(words).truncate()).on_hover_text(format!("{MEANING}\n{GROUPS_MEANING}"));
        found.sort(&self.subjects, self.parameter_table.sorted);
        chosen = chosen.or(self.parameter_table_ui(ui, &found, &group_lines(&found, &groups)));
        if let Some(index) = chosen {
            self.bring_to_front(index);
        }
    }

    /// Draws a strip for each parameter, so low that they fill a height where their dots allow that; returns the session whose dot was clicked.
    fn strips_ui(
        &self,
        ui: &mut Ui,
        room: f32,
        groups: &[SessionGroup],
        found: &Parameters,
    ) -> Option<usize> {
        let tokens = tokens_of(ui);
        let has_names = self.grouping != Grouping::None;
        let names = groups.iter().map(|group| group.name.clone());
        let names = names.map(|name| name_galley(ui, name).size().x + 10.0);
        let left = if has_names { names.fold(0.0, f32::max).min(LANE_NAME_MAX) } else { 0.0 };
        let lanes: Vec<Vec<&Row>> = groups
            .iter()
            .map(|group| {
                found.rows.iter().filter(|row| group.members.contains(&row.index)).collect()
            })
            .filter(|rows: &Vec<&Row>| !rows.is_empty())
            .collect();
        // What no fit has found is not distributed.
        let is_found = |number: &usize| {
            let mut values = found.rows.iter().filter_map(|row| row.values[*number].as_ref());
            values.any(|value| !value.parameter.is_fixed)
        };
        let shown: Vec<usize> = (0..found.names.len()).filter(is_found).collect();
        let width = ui.available_width();
        let columns = (((width - left) / STRIP_MIN) as usize).clamp(1, shown.len().max(1));
        // Rows of equal length.
        let count = shown.len().div_ceil(columns).max(1);
        let columns = shown.len().div_ceil(count).max(1);
        let counts = || lanes.iter().map(Vec::len);
        let dot_line = line_height(counts(), room / count as f32 - STRIP_HEAD);
        let high = height(counts(), dot_line) + STRIP_HEAD;
        let own = (width - left) / columns as f32;
        let (whole, _) = ui.allocate_exact_size(vec2(width, high * count as f32), Sense::hover());
        let mut chosen = None;
        for (place, number) in shown.into_iter().enumerate() {
            let name = &found.names[number];
            let (row, column) = (place / columns, place % columns);
            let corner = vec2(left + own * column as f32, high * row as f32);
            let place = Rect::from_min_size(whole.min + corner, vec2(own - 6.0, high));
            if column == 0 && has_names {
                let names = pos2(whole.left(), place.top() + STRIP_HEAD);
                lane_names_ui(ui, names, left, dot_line, &lanes);
            }
            let head = Rect::from_min_size(place.min, vec2(place.width(), STRIP_HEAD));
            let mut line = ui.new_child(UiBuilder::new().max_rect(head));
            let symbol = symbol_job(ui, &name.name, &name.unit);
            line.horizontal(|ui| {
                ui.add_space(8.0);
                ui.add(Label::new(symbol).truncate());
            });
            let values: Vec<DistributionLane> = lanes
                .iter()
                .map(|rows| {
                    let known = rows.iter().filter_map(|row| row.finding(number));
                    let known: Vec<f64> = known.collect();
                    let median = median(&known).filter(|_| known.len() > 2);
                    let dots = rows.iter().map(|row| self.dot(row, number, tokens)).collect();
                    DistributionLane { dots, median }
                })
                .collect();
            let strip = Rect::from_min_max(pos2(place.left(), head.bottom()), place.max);
            let id = Id::unique(("distribution", name.name.as_str()));
            if let Some([lane, dot]) = distribution_ui(ui, id, strip, dot_line, &values) {
                chosen = Some(lanes[lane][dot].index);
            }
        }
        chosen
    }

    /// A dot without a place where the session has no such parameter.
    fn dot(&self, row: &Row, number: usize, tokens: &Tokens) -> DistributionDot {
        let subject = &self.subjects[row.index];
        let value = row.values[number].as_ref();
        let words = value.map_or_else(String::new, |value| {
            let cell = text::cell(&value.parameter);
            let head = text::parameter_head(&value.parameter);
            format!("{head} of {}: {cell}{}", subject.name, value.deviation_words())
        });
        DistributionDot {
            value: value.map_or(f64::NAN, |one| one.parameter.value),
            ends: value.and_then(Value::ends),
            color: color_of(tokens, subject),
            is_front: row.index == 0,
            is_outlier: value.is_some_and(Value::is_outlier),
            words,
        }
    }

    /// Draws the table, groups before sessions; returns the session that was chosen in it.
    fn parameter_table_ui(
        &mut self,
        ui: &mut Ui,
        found: &Parameters,
        groups: &[TableLine],
    ) -> Option<usize> {
        let tokens = tokens_of(ui);
        let group = match self.grouping {
            Grouping::None => "group",
            by => by.name(),
        };
        let mut columns = vec![Column::words(group, 64.0), Column::words("session", 112.0)];
        for parameter in &found.names {
            let print = Some(symbol_job(ui, &parameter.name, &parameter.unit));
            let head = text::parameter_head(parameter);
            columns.push(Column { print, ..Column::numbers(&head, 88.0) });
        }
        columns.push(Column::numbers("rmse (mN)", 80.0));
        let line = |number: usize| {
            let Some(number) = number.checked_sub(groups.len()) else {
                return groups[number].clone();
            };
            let row = &found.rows[number];
            let name = &self.subjects[row.index].name;
            let mut words = name.clone();
            let mut cells = vec![TableCell::text(&row.group), TableCell::text(&row.short)];
            for (value, decimals) in row.values.iter().zip(&found.decimals) {
                let Some(value) = value else {
                    cells.push(TableCell::default());
                    continue;
                };
                let head = text::parameter_head(&value.parameter);
                words += &format!(
                    "; {head} {}{}",
                    text::cell(&value.parameter),
                    value.deviation_words()
                );
                cells.push(value.cell(*decimals, tokens));
            }
            cells.push(TableCell::text(format!("{:.3}", row.rmse_mn)));
            TableLine { name: words, cells }
        };
        let front = found.rows.iter().position(|row| row.index == 0);
        let front = front.map(|place| place + groups.len());
        let table = ChoiceTable {
            name: "parameters of the sessions shown",
            columns: &columns,
            can_sort: &|_| true,
            sorted: self.parameter_table.sorted,
            count: groups.len() + found.rows.len(),
            at: front,
            line: &line,
            is_chosen: &|number| Some(number) == front,
        };
        let (acts, _) = table.ui(ui, &mut self.parameter_table.scrolled);
        let mut chosen = None;
        for act in acts {
            match act {
                TableAction::Choose(number, _) => {
                    let row = number.checked_sub(groups.len()).map(|number| &found.rows[number]);
                    chosen = row.map(|row| row.index).or(chosen);
                }
                TableAction::Sort(column) => {
                    let sorted = &mut self.parameter_table.sorted;
                    let is_same =
                        sorted.is_some_and(|(by, is_reversed)| by == column && !is_reversed);
                    *sorted = Some((column, is_same));
                }
                TableAction::ChooseAll | TableAction::Open => {}
            }
        }
        chosen
    }
}

/// The name of a group, laid out.
fn name_galley(ui: &Ui, name: String) -> Arc<Galley> {
    let font = TextStyle::Small.resolve(ui.style());
    ui.painter().layout_no_wrap(name, font, tokens_of(ui).text_quiet)
}

/// Draws the names of groups, each beside its lane.
fn lane_names_ui(ui: &Ui, corner: Pos2, width: f32, line: f32, lanes: &[Vec<&Row>]) {
    let mut top = corner.y;
    for rows in lanes {
        let high = lane_height(rows.len(), line);
        let place = Rect::from_min_size(pos2(corner.x, top), vec2(width - 6.0, high));
        let name = name_galley(ui, rows.first().map_or(String::new(), |row| row.group.clone()));
        let at = Align2::LEFT_CENTER.anchor_size(place.left_center(), name.size());
        let painter = ui.painter().with_clip_rect(place.intersect(ui.clip_rect()));
        painter.galley(at.min, name, tokens_of(ui).text_quiet);
        top += high;
    }
}

fn refusals_ui(ui: &mut Ui, subjects: &[ReviewSubject]) {
    for subject in subjects {
        let Some(Err(reason)) = &subject.fit else { continue };
        let words = format!("{}: no fit: {reason}", subject.name);
        // That a rejected session is left out is as it should be.
        if doubt_of(subject).is_some() { quiet_ui(ui, words) } else { alarm_ui(ui, words) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model with fewer parameters leaves the order of a column that is gone.
    #[test]
    fn a_column_that_is_gone_sorts_nothing() {
        let mut found = Parameters { names: Vec::new(), decimals: Vec::new(), rows: Vec::new() };
        for (index, rmse_mn) in [(0, 2.0), (1, 1.0)] {
            let (group, short) = (String::new(), String::new());
            found.rows.push(Row { index, group, short, values: Vec::new(), rmse_mn });
        }
        let order = |found: &Parameters| found.rows.iter().map(|row| row.index).collect::<Vec<_>>();
        found.sort(&[], Some((9, false)));
        assert_eq!(order(&found), [0, 1]);
        found.sort(&[], Some((2, false)));
        assert_eq!(order(&found), [1, 0], "by the residual, the last column");
    }
}
