//! Which cases at the ends of every range are right and which are refused.

use super::screen::{Commands, Screen, ScreenEntry, Workbench};
use crate::widgets::{
    Column, Emphasis, TableRow, answer_ui, choice_ui, heading_ui, placeholder_ui, quiet_ui,
    section_ui, table_ui, tokens_of, work_ui,
};
use crate::workers::BackgroundTask;
use eframe::egui::{Context, Key, Label, RichText, Ui};
use palpate_analysis::extremes::survey;
use palpate_analysis::report::extremes::{GroupSummary, summary};
use palpate_rheology::extremes::{ExtremesExtent, ExtremesRow, ExtremesVerdict};

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Extremes",
    icon: lucide_icons::Icon::MoveHorizontal,
    purpose: "numerical stability of every family, integrator and fit at extreme inputs",
    key: Some(Key::Num8),
    open: |_| Box::new(ExtremesScreen::default()),
};

const EXTENTS: [(ExtremesExtent, &str); 2] =
    [(ExtremesExtent::Quick, "corners: seconds"), (ExtremesExtent::Whole, "everything: minutes")];

struct ExtremesResult {
    rows: Vec<ExtremesRow>,
    groups: Vec<GroupSummary>,
}

pub struct ExtremesScreen {
    extent: ExtremesExtent,
    /// All groups if none.
    group: Option<&'static str>,
    /// All verdicts if none.
    verdict: Option<ExtremesVerdict>,
    task: BackgroundTask<ExtremesResult>,
}

impl Default for ExtremesScreen {
    fn default() -> Self {
        Self {
            extent: ExtremesExtent::Quick,
            group: None,
            verdict: None,
            task: BackgroundTask::default(),
        }
    }
}

impl ExtremesScreen {
    /// Rows found by the last test.
    pub fn rows(&self) -> Option<&[ExtremesRow]> {
        let found = self.task.answer()?.as_ref().ok()?;
        Some(&found.rows)
    }
}

impl Screen for ExtremesScreen {
    fn left_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut Commands) {
        section_ui(ui, "Test");
        ui.add(
            Label::new(
                "The test runs every model family, integrator and fit with the smallest and largest values of every input. A case passes if its result is correct, or if an error message states why there is no result.",
            )
            .wrap(),
        );
        choice_ui(ui, "extent", &mut self.extent, &EXTENTS);
        ui.add_space(8.0);
        work_ui(ui, "Test the extremes  F6", &self.task, &Ok(()), commands);
        if let Some(Ok(found)) = self.task.answer() {
            section_ui(ui, "Shown");
            let groups = found.groups.iter().map(|one| (Some(one.group), one.group));
            let groups: Vec<_> = std::iter::once((None, "all groups")).chain(groups).collect();
            choice_ui(ui, "group", &mut self.group, &groups);
            let verdicts = ExtremesVerdict::ALL.iter().map(|one| (Some(*one), one.name()));
            let verdicts: Vec<_> =
                std::iter::once((None, "all verdicts")).chain(verdicts).collect();
            choice_ui(ui, "verdict", &mut self.verdict, &verdicts);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let before = "nothing tested yet";
        let Some(found) = answer_ui(ui, &self.task, before) else { return };
        let rows: Vec<TableRow> = found
            .rows
            .iter()
            .filter(|row| self.group.is_none_or(|group| group == row.group))
            .filter(|row| self.verdict.is_none_or(|verdict| verdict == row.verdict))
            .map(table_row)
            .collect();
        let title = format!("Cases, {} of {}", rows.len(), found.rows.len());
        heading_ui(ui, title);
        let columns = [
            Column::words("subject", 130.0),
            Column::words("case", 240.0),
            Column::words("verdict", 52.0),
            Column::numbers("error", 56.0),
            Column::numbers("tolerance", 60.0),
            Column::words("group", 220.0),
        ];
        table_ui(ui, "extremes_table", &columns, &rows);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let tokens = tokens_of(ui);
        section_ui(ui, "Result");
        let Some(Ok(found)) = self.task.answer() else {
            placeholder_ui(ui, "nothing tested yet");
            return;
        };
        let wrong: usize = found.groups.iter().map(|one| one.counts[3]).sum();
        let (text, ink) = match wrong {
            0 => (
                "every case gives a correct result or an error message with the reason".to_owned(),
                tokens.text,
            ),
            1 => ("1 case is wrong".to_owned(), tokens.alarm_text),
            many => (format!("{many} cases are wrong"), tokens.alarm_text),
        };
        ui.add(Label::new(RichText::new(text).strong().color(ink)).wrap());
        for facts in &found.groups {
            section_ui(ui, facts.group);
            let counts: Vec<String> = facts
                .counts
                .iter()
                .zip(ExtremesVerdict::ALL)
                .filter(|(count, _)| **count > 0)
                .map(|(count, verdict)| format!("{count} {}", verdict.name()))
                .collect();
            ui.label(counts.join(", "));
            if let Some(tightest) = &facts.tightest {
                quiet_ui(ui, format!("largest error relative to its tolerance: {tightest}"));
            }
        }
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        self.task.poll();
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        let extent = self.extent;
        self.task.start("extremes", ctx, move |progress| {
            let rows = survey(extent, None, progress).map_err(|err| err.to_string())?;
            let rows = rows.ok_or("the test was cancelled")?;
            Ok(ExtremesResult { groups: summary(&rows), rows })
        });
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy()
    }
}

fn table_row(row: &ExtremesRow) -> TableRow {
    TableRow {
        cells: vec![
            row.subject.clone(),
            row.case.clone(),
            row.verdict.name().to_owned(),
            row.relative_error.map_or_else(|| "-".to_owned(), |error| format!("{error:.1e}")),
            format!("{:.0e}", row.tolerance),
            row.group.to_owned(),
        ],
        emphasis: match row.verdict {
            ExtremesVerdict::Wrong => Emphasis::Alarm,
            ExtremesVerdict::Right => Emphasis::Plain,
            ExtremesVerdict::Refused | ExtremesVerdict::Flagged => Emphasis::Quiet,
        },
        hint: (!row.sentence.is_empty()).then(|| row.sentence.clone()),
    }
}
