//! What is right and what is refused at the ends of every range.

use crate::command::{Command, Commands};
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::places::Place;
use crate::widgets::quantity_input::form_label;
use crate::widgets::table::{Column, Row as TableRow, RowLook, table_ui};
use crate::widgets::task_bar::{Pressed, task_ui};
use crate::workers::task::Task;
use eframe::egui::{ComboBox, Context, Label, RichText, Ui};
use palpate_analysis::extremes::survey;
use palpate_analysis::report::extremes::{GroupSummary, VERDICTS, summary};
use palpate_rheology::extremes::{Extent, Row, Verdict};

/// How much is run, in words.
const EXTENTS: [(Extent, &str); 2] = [
    (Extent::Quick, "corners: seconds"),
    (Extent::Whole, "everything: minutes"),
];

/// What was found.
pub struct Found {
    rows: Vec<Row>,
    groups: Vec<GroupSummary>,
}

/// The screen's state.
pub struct ExtremesScreen {
    extent: Extent,
    /// Shown alone; all groups if none.
    group: Option<&'static str>,
    /// Shown alone; all verdicts if none.
    verdict: Option<Verdict>,
    task: Task<Found>,
}

impl Default for ExtremesScreen {
    fn default() -> Self {
        Self {
            extent: Extent::Quick,
            group: None,
            verdict: None,
            task: Task::default(),
        }
    }
}

impl ExtremesScreen {
    /// Whether work is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.task.standing().is_some()
    }

    /// Fetches an answer that has come.
    pub fn poll(&mut self) {
        self.task.poll();
    }

    /// Rows found by the last test.
    #[must_use]
    pub fn rows(&self) -> Option<&[Row]> {
        let found = self.task.answer()?.as_ref().ok()?;
        Some(&found.rows)
    }

    /// Starts the test.
    pub fn start(&mut self, ctx: &Context) {
        let extent = self.extent;
        self.task.start("extremes", ctx, move |progress| {
            let rows = survey(extent, None, progress).map_err(|err| err.to_string())?;
            let rows = rows.ok_or("ended before it was done")?;
            Ok(Found {
                groups: summary(&rows),
                rows,
            })
        });
    }

    /// Ends a test under way.
    pub fn cancel(&self) {
        self.task.cancel();
    }

    /// What is run and what is shown.
    pub fn left_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        section_ui(ui, "Test");
        ui.add(
            Label::new(
                "Every family, integrator and fit at the ends of every range: each case must give the right number or a refusal that names the reason.",
            )
            .wrap(),
        );
        ui.horizontal(|ui| {
            let label = form_label(ui, "extent");
            let words = EXTENTS
                .iter()
                .find(|(extent, _)| *extent == self.extent)
                .map_or("", |(_, words)| words);
            ComboBox::from_id_salt("extent")
                .selected_text(words)
                .show_ui(ui, |ui| {
                    for (extent, words) in EXTENTS {
                        ui.selectable_value(&mut self.extent, extent, words);
                    }
                })
                .response
                .labelled_by(label.id)
                .place("extent");
        });
        ui.add_space(8.0);
        match task_ui(ui, "Test the extremes  F6", &self.task, &Ok(())) {
            Some(Pressed::Start) => commands.push(Command::Work),
            Some(Pressed::Cancel) => commands.push(Command::CancelWork),
            None => {}
        }
        if let Some(Ok(found)) = self.task.answer() {
            section_ui(ui, "Shown");
            let groups = found.groups.iter().map(|one| (Some(one.group), one.group));
            let groups: Vec<_> = std::iter::once((None, "all groups"))
                .chain(groups)
                .collect();
            choice_ui(ui, "group", &mut self.group, &groups);
            let verdicts = VERDICTS.iter().map(|one| (Some(*one), one.word()));
            let verdicts: Vec<_> = std::iter::once((None, "all verdicts"))
                .chain(verdicts)
                .collect();
            choice_ui(ui, "verdict", &mut self.verdict, &verdicts);
        }
    }

    /// The table.
    pub fn middle_ui(&self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let found = match self.task.answer() {
            Some(Ok(found)) => found,
            Some(Err(reason)) => {
                ui.add(Label::new(RichText::new(reason).color(tokens.alarm_text)).wrap());
                return;
            }
            None => {
                ui.label(RichText::new("nothing tested yet").color(tokens.text_quiet));
                return;
            }
        };
        let rows: Vec<TableRow> = found
            .rows
            .iter()
            .filter(|row| self.group.is_none_or(|group| group == row.group))
            .filter(|row| self.verdict.is_none_or(|verdict| verdict == row.verdict))
            .map(table_row)
            .collect();
        let title = format!("Cases, {} of {}", rows.len(), found.rows.len());
        ui.label(RichText::new(title).heading().strong());
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

    /// Each group in numbers.
    pub fn right_ui(&self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "Result");
        let Some(Ok(found)) = self.task.answer() else {
            ui.label(RichText::new("nothing tested yet").color(tokens.text_quiet));
            return;
        };
        let wrong: usize = found.groups.iter().map(|one| one.counts[3]).sum();
        let (text, ink) = match wrong {
            0 => (
                "every case is right or refused with its reason".to_owned(),
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
                .zip(VERDICTS)
                .filter(|(count, _)| **count > 0)
                .map(|(count, verdict)| format!("{count} {}", verdict.word()))
                .collect();
            ui.label(counts.join(", "));
            if let Some(tightest) = &facts.tightest {
                let text = format!("closest to its tolerance: {tightest}");
                ui.add(Label::new(RichText::new(text).color(tokens.text_quiet).small()).wrap());
            }
        }
    }
}

fn choice_ui<T: Copy + PartialEq>(ui: &mut Ui, name: &str, value: &mut T, choices: &[(T, &str)]) {
    ui.horizontal(|ui| {
        let label = form_label(ui, name);
        let words = choices
            .iter()
            .find(|(choice, _)| choice == value)
            .map_or("", |(_, words)| words);
        ComboBox::from_id_salt(name)
            .selected_text(words)
            .show_ui(ui, |ui| {
                for (choice, words) in choices {
                    ui.selectable_value(value, *choice, *words);
                }
            })
            .response
            .labelled_by(label.id)
            .place(name);
    });
}

fn table_row(row: &Row) -> TableRow {
    TableRow {
        cells: vec![
            row.subject.clone(),
            row.case.clone(),
            row.verdict.word().to_owned(),
            row.relative_error
                .map_or_else(|| "-".to_owned(), |error| format!("{error:.1e}")),
            format!("{:.0e}", row.tolerance),
            row.group.to_owned(),
        ],
        look: match row.verdict {
            Verdict::Wrong => RowLook::Alarm,
            Verdict::Right => RowLook::Plain,
            Verdict::Refused | Verdict::Flagged => RowLook::Quiet,
        },
        hint: (!row.sentence.is_empty()).then(|| row.sentence.clone()),
    }
}
