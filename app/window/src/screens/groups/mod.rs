//! From the sessions of a study to the population of its animals: sessions and effects on the left, one figure in the middle, the
//! numbers and all that is to be said of them at the right.

mod form;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::plots::figure::{PlacedPlot, PlotLook, legend_ui};
use crate::widgets::{
    alarm_ui, answer_ui, choice_ui, fact_ui, heading_ui, placeholder_ui, quiet_ui, require,
    section_ui, sentence_ui, task_ui, text_row, work_ui,
};
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Ui, vec2};
use form::{GroupsForm, GroupsRequest};
use palpate_analysis::population::{
    Population, PopulationReport, PopulationRequest, population, write_results,
};
use palpate_analysis::progress::Progress;
use serde_json::Value;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Groups",
    icon: lucide_icons::Icon::Users,
    purpose: "the population that the specimens of a study come from",
    key: Some(Key::G),
    open: |workbench| Box::new(GroupsScreen::new(workbench.library.clone().ok())),
};

const BEFORE: &str = "Choose a folder of sessions that say which animal and specimen they are of, and find their population. Presses on one animal are alike: twelve presses on four animals are not twelve specimens.";
/// Height in points of the words above and below a plot.
const WORDS: f32 = 56.0;

/// A population with its figures, whose points are placed once.
pub struct FoundPopulation {
    pub population: Arc<Population>,
    figures: Vec<PlacedFigure>,
}

struct PlacedFigure {
    name: String,
    caption: String,
    columns: usize,
    plots: Vec<PlacedPlot>,
}

impl FoundPopulation {
    fn of(population: Population) -> Self {
        let figures = population.figures().into_iter().map(|one| PlacedFigure {
            name: one.panels.title,
            caption: one.caption,
            columns: one.panels.columns.max(1),
            plots: one.panels.plots.into_iter().map(PlacedPlot::from).collect(),
        });
        Self { figures: figures.collect(), population: Arc::new(population) }
    }
}

pub struct GroupsScreen {
    library: Option<PathBuf>,
    form: GroupsForm,
    task: BackgroundTask<FoundPopulation>,
    /// Place of the figure that is shown.
    figure: usize,
    /// The new folder for the results, and what became of the last one.
    folder: String,
    writing: BackgroundTask<String>,
}

impl GroupsScreen {
    fn new(library: Option<PathBuf>) -> Self {
        Self {
            library,
            form: GroupsForm::default(),
            task: BackgroundTask::default(),
            figure: 0,
            folder: String::new(),
            writing: BackgroundTask::default(),
        }
    }

    /// The last population.
    pub fn found(&self) -> Option<&FoundPopulation> {
        self.task.answer()?.as_ref().ok()
    }

    /// Draws what writes tables, figures and words into a folder.
    fn write_ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "For a paper");
        text_row(ui, "folder", "new, for tables, figures and a paragraph", &mut self.folder);
        let verdict = require(!self.folder.trim().is_empty(), "type a new folder");
        if task_ui(ui, "Write results", &self.writing, &verdict)
            && let Some(found) = self.task.answer().and_then(|answer| answer.as_ref().ok())
        {
            let (population, folder) = (Arc::clone(&found.population), self.folder.clone());
            self.writing.start("population-results", ui.ctx(), move |_| {
                let folder = Path::new(folder.trim());
                let written = write_results(&population, folder);
                written.map(|()| format!("wrote {}", folder.display())).map_err(|err| {
                    format!(
                        "{} was not written ({err}); type a folder that does not exist yet",
                        folder.display()
                    )
                })
            });
        }
        match self.writing.answer() {
            Some(Ok(sentence)) => quiet_ui(ui, sentence),
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
    }
}

/// Draws the plots of a figure in its columns, its caption beneath.
fn figure_ui(ui: &mut Ui, figure: &PlacedFigure) {
    legend_ui(ui, &figure.plots.iter().map(|one| &one.plot).take(1).collect::<Vec<_>>());
    let rows = figure.plots.len().div_ceil(figure.columns).max(1);
    let height = (ui.available_height() - WORDS) / rows as f32 - WORDS;
    for row in figure.plots.chunks(figure.columns) {
        ui.columns(figure.columns, |columns| {
            for (ui, one) in columns.iter_mut().zip(row) {
                quiet_ui(ui, &one.plot.title);
                ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
                    let id = format!("{} {}", figure.name, one.plot.title);
                    one.ui(ui, &id, PlotLook::default());
                });
            }
        });
    }
    quiet_ui(ui, &figure.caption);
}

fn numbers_ui(ui: &mut Ui, report: &PopulationReport) {
    for line in report.parameter_lines() {
        section_ui(ui, &line.parameter);
        for (name, words) in line.facts {
            fact_ui(ui, &name, words);
        }
    }
    let remarks = report.remarks();
    if !remarks.is_empty() {
        section_ui(ui, "To know");
        remarks.iter().for_each(|remark| sentence_ui(ui, remark));
    }
    let influence = report.influence_rows();
    if !influence.is_empty() {
        section_ui(ui, "Most influential");
        quiet_ui(ui, "left out: what changes most, in standard errors");
        for [group, number, _, without, change] in influence {
            fact_ui(ui, &group, format!("{number}: {without} ({change})"));
        }
    }
}

impl Screen for GroupsScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        let sessions = workbench.library.as_deref().ok();
        if self.form.ui(ui, sessions) {
            commands.push(UiCommand::Choose(PathPurpose::Study));
        }
        ui.add_space(6.0);
        work_ui(ui, "Find population  F6", &self.task, &self.form.verdict(), commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let Some(found) = answer_ui(ui, &self.task, BEFORE) else { return };
        let names = found.figures.iter().enumerate().map(|(k, one)| (k, one.name.as_str()));
        self.figure = self.figure.min(found.figures.len().saturating_sub(1));
        choice_ui(ui, "figure", &mut self.figure, &names.collect::<Vec<_>>());
        if let Some(figure) = found.figures.get(self.figure) {
            heading_ui(ui, &figure.name);
            figure_ui(ui, figure);
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        match self.found() {
            Some(found) => {
                numbers_ui(ui, &found.population.report);
                self.write_ui(ui);
            }
            None => {
                section_ui(ui, "Population");
                placeholder_ui(ui, "no population yet");
            }
        }
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        self.task.poll();
        self.writing.poll();
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Chosen(PathPurpose::Study, path) => self.form.take(path),
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        // What was written of the population before says nothing of this one.
        self.writing = BackgroundTask::default();
        let (form, library) = (self.form.clone(), self.library.clone());
        self.task.start("population", ctx, move |progress| {
            let request = form.request(library.as_deref())?;
            found(&request, progress).map(FoundPopulation::of)
        });
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy() || self.writing.is_busy()
    }

    fn layout(&self) -> Option<Value> {
        (self.form != GroupsForm::default()).then(|| serde_json::to_value(&self.form).ok())?
    }

    fn take_layout(&mut self, kept: &Value) {
        self.form = serde_json::from_value(kept.clone()).unwrap_or_default();
    }
}

fn found(request: &GroupsRequest, progress: &dyn Progress) -> Result<Population, String> {
    let request = PopulationRequest {
        paths: &request.paths,
        recipe: &request.recipe,
        parameters: &request.parameters,
        levels: &request.levels,
        effects: &request.effects,
        method: request.method,
        is_drawn: true,
        is_influence_wanted: request.is_influence_wanted,
        wanted_percent: None,
        jobs: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
    };
    population(&request, progress).map_err(|err| err.to_string())
}
