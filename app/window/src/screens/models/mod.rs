//! Model selection: recordings on the left, families in the middle, the choice on the right.

mod answer;
mod form;

pub use form::ModelsForm;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::widgets::{answer_ui, placeholder_ui, section_ui, work_ui};
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Ui};
use palpate_analysis::select::{SelectionReport, select_sources};

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Models",
    icon: lucide_icons::Icon::Sigma,
    purpose: "which model family a recording needs",
    key: Some(Key::Num6),
    open: |_| Box::new(ModelsScreen::default()),
};

#[derive(Default)]
pub struct ModelsScreen {
    form: ModelsForm,
    task: BackgroundTask<SelectionReport>,
}

impl ModelsScreen {
    /// The last comparison.
    pub fn answer(&self) -> Option<&Result<SelectionReport, String>> {
        self.task.answer()
    }
}

impl Screen for ModelsScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        let run = workbench.measured_run().filter(|run| run.outcome.is_some());
        let last_run = run.map(|run| run.folder.as_path());
        section_ui(ui, "Recordings compared");
        self.form.sources_ui(ui, last_run, commands);
        section_ui(ui, "How");
        self.form.choices_ui(ui);
        ui.add_space(8.0);
        let verdict = self.form.request().map(|_| ());
        work_ui(ui, "Compare models  F6", &self.task, &verdict, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let before = "Add recordings on the left and compare them. Recordings at two speeds or depths of one specimen are best, because each fit is then tested on recordings that it was not fitted to.";
        if let Some(selected) = answer_ui(ui, &self.task, before) {
            answer::families_ui(ui, &selected.selection);
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        match self.task.answer() {
            Some(Ok(selected)) => answer::choice_ui(ui, selected),
            _ => {
                section_ui(ui, "Choice");
                placeholder_ui(ui, "nothing compared yet");
            }
        }
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        self.task.poll();
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Chosen(PathPurpose::Session | PathPurpose::Table, path) => {
                self.form.add(path)
            }
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        let Ok(request) = self.form.request() else { return };
        self.task.start("select", ctx, move |progress| {
            select_sources(request, progress).map_err(|err| err.to_string())
        });
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy()
    }
}
