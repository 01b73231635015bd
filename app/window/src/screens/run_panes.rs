//! The middle of the run screen: which protocol, what it is expected to do, or what was measured.

use super::form::{CheckedPlan, ProtocolForm};
use crate::command::{Commands, UiCommand};
use crate::plots::course::{CourseLimits, course_ui};
use crate::widgets::{NamedControl, heading_ui, placeholder_ui, tokens_of};
use crate::workbench::Workbench;
use crate::workers::{BackgroundTask, Job, PathPurpose};
use eframe::egui::{Button, Context, Label, RichText, ScrollArea, TextEdit, Ui, vec2};
use palpate_analysis::protocol_sources::{ProtocolSource, find_protocol, locked_protocols};
use palpate_model::rig::Phase;
use palpate_protocols::file::{BUILT_IN, Protocol};
use palpate_protocols::plans::{Plan, Step};
use palpate_runner::RunView;
use palpate_sessions::locked_protocols::StoredLockedProtocol;
use std::path::{Path, PathBuf};

/// A view in the middle of the run screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RunPane {
    Choose,
    #[default]
    Course,
    Measured,
    Weighing,
    Approach,
}

/// Views and their names.
const VIEWS: [(RunPane, &str); 5] = [
    (RunPane::Choose, "Protocols"),
    (RunPane::Course, "Expected course"),
    (RunPane::Measured, "Measured"),
    (RunPane::Weighing, "Weights"),
    (RunPane::Approach, "Surface"),
];

/// Draws the switch between the views.
pub fn views_ui(ui: &mut Ui, shown: RunPane, run: Option<&RunView>, commands: &mut Commands) {
    ui.horizontal_wrapped(|ui| {
        for (view, name) in VIEWS {
            if !is_offered(view, run) {
                continue;
            }
            if ui.selectable_label(shown == view, name).named(name).clicked() {
                commands.push(UiCommand::View(view));
            }
        }
    });
    ui.separator();
}

/// Whether a view has anything to show.
#[must_use]
pub fn is_offered(view: RunPane, run: Option<&RunView>) -> bool {
    match view {
        RunPane::Choose | RunPane::Course | RunPane::Measured => true,
        RunPane::Weighing => run.is_some_and(|run| !run.planned_weights.is_empty()),
        RunPane::Approach => {
            run.is_some_and(|run| run.phase == Phase::Contact || !run.contact_triggers.is_empty())
        }
    }
}

/// The view that shows most of a run that begins.
#[must_use]
pub fn first_view(plan: &Plan) -> RunPane {
    let has = |is: fn(&Step) -> bool| plan.steps.iter().any(|planned| is(&planned.step));
    if has(|step| matches!(step, Step::Weigh(_))) {
        RunPane::Weighing
    } else if has(|step| matches!(step, Step::FindContact(_) | Step::FindBase(_)))
        && !has(|step| matches!(step, Step::Ramp(_) | Step::LoadTo(_) | Step::Sine(_)))
    {
        // It looks for the surface and no more.
        RunPane::Approach
    } else {
        RunPane::Measured
    }
}

/// A file read, or why not.
type Text = (PathBuf, Result<ProtocolSource, String>);

/// The list of protocols and the file being read.
pub struct Chooser {
    built_in: Vec<Protocol>,
    /// Name and author of each locked protocol of the library, once they are read.
    locked: BackgroundTask<Vec<(String, String)>>,
    typed: String,
    reading: Job<Text>,
}

impl Default for Chooser {
    fn default() -> Self {
        let texts = BUILT_IN.iter().map(|(_, text)| Protocol::read(text));
        Self {
            built_in: texts.filter_map(Result::ok).collect(),
            locked: BackgroundTask::default(),
            typed: String::new(),
            reading: Job::default(),
        }
    }
}

impl Chooser {
    /// Reads the file whose path is typed; the answer is polled.
    pub fn read_typed(&mut self, library: Option<&Path>, ctx: &Context) -> std::io::Result<()> {
        let path = PathBuf::from(self.typed.trim());
        self.read(&path, library, ctx)
    }

    /// Reads a file, or a locked protocol of the library by its name, on a thread of its own.
    pub fn read(
        &mut self,
        path: &Path,
        library: Option<&Path>,
        ctx: &Context,
    ) -> std::io::Result<()> {
        let library = library.map(Path::to_owned);
        self.typed = path.display().to_string();
        let path = path.to_owned();
        let work = move || {
            let name = path.display();
            let found = find_protocol(&path.to_string_lossy(), library.as_deref());
            let none = || format!("the file {name} does not exist; choose another");
            let source = found.and_then(|found| found.ok_or_else(none));
            (path, source)
        };
        self.reading.start("protocol-file", ctx, work)
    }

    /// A file that was read, once.
    pub fn poll(&mut self) -> Option<Text> {
        self.locked.poll();
        self.reading.poll()
    }

    /// Lists the locked protocols of the library again.
    pub fn list_locked(&mut self, library: Option<PathBuf>, ctx: &Context) {
        self.locked.start("locked-protocols", ctx, move |_| {
            let (found, _) = library.map(|library| locked_protocols(&library)).unwrap_or_default();
            let pair = |one: StoredLockedProtocol| (one.document.name, one.document.by);
            Ok(found.into_iter().map(pair).collect())
        });
    }

    fn locked_ui(&self, ui: &mut Ui, form: &ProtocolForm, commands: &mut Commands) {
        let Some(Ok(locked)) = self.locked.answer() else { return };
        if locked.is_empty() {
            return;
        }
        heading_ui(ui, "Locked protocols");
        for (name, by) in locked {
            let is_chosen = form.is_locked && form.file.as_deref() == Some(Path::new(name));
            let button = Button::selectable(is_chosen, RichText::new(name).strong());
            if ui.add(button.min_size(vec2(280.0, 32.0))).named(name).clicked() {
                commands.push(UiCommand::Chosen(PathPurpose::Protocol, name.into()));
            }
            placeholder_ui(ui, format!("locked by {by}: its values cannot be changed"));
        }
        ui.add_space(8.0);
    }

    /// Draws the list, the field for a file and what is wrong with the file chosen.
    pub fn ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        let (form, is_busy) = (&workbench.form, workbench.is_busy());
        if is_busy {
            ui.label("A run is in progress. Choose another protocol when it has ended.");
        }
        ScrollArea::vertical().id_salt("protocols").auto_shrink(false).show(ui, |ui| {
            if is_busy {
                ui.disable();
            }
            self.file_ui(ui, workbench.dialog.is_open(), commands);
            if let (Some(file), false) = (&form.file, form.problems().is_empty()) {
                mistakes_ui(ui, file, form);
            }
            ui.add_space(8.0);
            self.locked_ui(ui, form, commands);
            ui.label(RichText::new("Built-in protocols").heading().strong());
            for protocol in &self.built_in {
                let chosen = form.protocol.as_ref().ok();
                let is_chosen = form.file.is_none()
                    && chosen.is_some_and(|chosen| chosen.name == protocol.name);
                protocol_ui(ui, protocol, is_chosen, commands);
            }
        });
    }

    fn file_ui(&mut self, ui: &mut Ui, is_dialog_open: bool, commands: &mut Commands) {
        heading_ui(ui, "Your own protocol");
        ui.horizontal(|ui| {
            let label = ui.label("protocol file");
            let width = (ui.available_width() - 250.0).max(120.0);
            let input = TextEdit::singleline(&mut self.typed)
                .desired_width(width)
                .char_limit(4096)
                .hint_text("a TOML file");
            ui.add(input).labelled_by(label.id).named("protocol file");
            let can_open = !self.typed.trim().is_empty() && !self.reading.is_busy();
            if ui.add_enabled(can_open, Button::new("Open")).clicked() {
                commands.push(UiCommand::OpenProtocol);
            }
            let button = Button::new("Open a protocol file...");
            if ui.add_enabled(!is_dialog_open, button).clicked() {
                commands.push(UiCommand::Choose(PathPurpose::Protocol));
            }
        });
    }
}

fn mistakes_ui(ui: &mut Ui, file: &Path, form: &ProtocolForm) {
    let tokens = tokens_of(ui);
    let head = format!("{} cannot run:", file.display());
    ui.label(RichText::new(head).strong());
    for problem in form.problems() {
        let text = RichText::new(problem.to_string()).color(tokens.alarm_text);
        ui.add(Label::new(text).wrap());
    }
    let words = "Correct the file and press Open again.";
    placeholder_ui(ui, words);
}

fn protocol_ui(ui: &mut Ui, protocol: &Protocol, is_chosen: bool, commands: &mut Commands) {
    let tokens = tokens_of(ui);
    let name = BUILT_IN.iter().find(|(name, _)| *name == protocol.name);
    ui.add_space(4.0);
    let button = Button::selectable(is_chosen, RichText::new(&protocol.title).strong())
        .min_size(vec2(280.0, 24.0));
    if let (true, Some((name, _))) = (ui.add(button).clicked(), name) {
        commands.push(UiCommand::TakeProtocol(name));
    }
    let about = RichText::new(&protocol.about).color(tokens.text_quiet);
    ui.add(Label::new(about).wrap()).on_hover_text(&protocol.source);
}

/// Draws the expected course of the plan.
pub fn expected_ui(ui: &mut Ui, checked: Option<&CheckedPlan>, limits: CourseLimits) {
    match checked {
        // A search for the surface retracts from it, to a depth below zero.
        Some(checked) if checked.outline.iter().all(|point| point.depth.0 <= 0.0) => {
            placeholder_ui(
                ui,
                "this protocol does not indent the specimen, so no depth or force can be drawn",
            );
        }
        Some(checked) => course_ui(ui, &checked.outline, limits),
        None => {
            placeholder_ui(ui, "correct the protocol and its values to see the expected course")
        }
    }
}
