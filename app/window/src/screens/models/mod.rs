//! Which model recordings need: what is compared on the left, the families in the middle, the choice on
//! the right.

mod answer;
mod form;

pub use form::ModelsForm;

use crate::command::{Command, Commands};
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::task_bar::{Pressed, task_ui};
use crate::workers::task::Task;
use eframe::egui::{Context, Label, RichText, Ui};
use palpate_analysis::select::{Selected, select_sources};

/// The screen's state.
#[derive(Default)]
pub struct ModelsScreen {
    form: ModelsForm,
    task: Task<Selected>,
}

impl ModelsScreen {
    /// Whether work is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.task.standing().is_some()
    }

    /// Fetches an answer that has come.
    pub fn poll(&mut self) {
        self.task.poll();
    }

    /// Adds a recording to those compared.
    pub fn add(&mut self, path: &std::path::Path) {
        self.form.add(path);
    }

    /// The last comparison.
    #[must_use]
    pub fn answer(&self) -> Option<&Result<Selected, String>> {
        self.task.answer()
    }

    /// Starts the comparison that stands in the form.
    pub fn start(&mut self, ctx: &Context) {
        let Ok(request) = self.form.request() else {
            return;
        };
        self.task.start("select", ctx, move |progress| {
            select_sources(request, progress).map_err(|err| err.to_string())
        });
    }

    /// Ends a comparison under way.
    pub fn cancel(&self) {
        self.task.cancel();
    }

    /// What is compared. `last_run` is the session on the run screen, once it has ended.
    pub fn left_ui(
        &mut self,
        ui: &mut Ui,
        last_run: Option<&std::path::Path>,
        commands: &mut Commands,
    ) {
        section_ui(ui, "Recordings compared");
        self.form.sources_ui(ui, last_run, commands);
        section_ui(ui, "How");
        self.form.choices_ui(ui);
        ui.add_space(8.0);
        let verdict = self.form.request().map(|_| ());
        match task_ui(ui, "Compare models  F6", &self.task, &verdict) {
            Some(Pressed::Start) => commands.push(Command::Work),
            Some(Pressed::Cancel) => commands.push(Command::CancelWork),
            None => {}
        }
    }

    /// The families as points and as a table.
    pub fn middle_ui(&self, ui: &mut Ui) {
        match self.task.answer() {
            Some(Ok(selected)) => answer::families_ui(ui, &selected.selection),
            Some(Err(reason)) => sentence_ui(ui, reason, true),
            None => sentence_ui(
                ui,
                "Add recordings on the left and compare. Two speeds or depths of one specimen tell more than one: what is held out of each fit is then predicted.",
                false,
            ),
        }
    }

    /// The choice, what each term buys, and what is known of the recordings.
    pub fn right_ui(&self, ui: &mut Ui) {
        match self.task.answer() {
            Some(Ok(selected)) => answer::choice_ui(ui, selected),
            _ => {
                section_ui(ui, "Choice");
                sentence_ui(ui, "nothing compared yet", false);
            }
        }
    }
}

fn sentence_ui(ui: &mut Ui, text: &str, is_wrong: bool) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let ink = if is_wrong {
        tokens.alarm_text
    } else {
        tokens.text_quiet
    };
    ui.add(Label::new(RichText::new(text).color(ink)).wrap());
}
