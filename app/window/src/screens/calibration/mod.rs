//! The calibrations of the library: which there are, what the chosen one is worth, which is in use; and a new one
//! from the last run.

mod plots;

use super::screen::{Screen, ScreenEntry, ScreenReply};
use crate::command::{CommandQueue, UserCommand};
use crate::shell::palette::PaletteAction;
use crate::theme::Tokens;
use crate::widgets::fact_row::{fact_ui, section_ui};
use crate::widgets::places::NamedControl;
use crate::widgets::quantity_input::form_label;
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::alarm_ui;
use crate::workbench::Workbench;
use crate::workers::Job;
use eframe::egui::{Button, Context, Key, Label, RichText, TextEdit, Ui, vec2};
use palpate_analysis::calibrations::{Shelved, Shown, keep, read};
use palpate_analysis::report::calibration::Entry;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_runner::RunView;
use std::path::{Path, PathBuf};

/// The screen's line in the table.
pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Calibration",
    purpose: "volts to newtons: which calibrations there are",
    key: Key::Num2,
    open: |workbench| Box::new(CalibrationScreen::new(workbench)),
};

/// The screen's state.
pub struct CalibrationScreen {
    library: Result<PathBuf, String>,
    /// The rig's own, which needs no library, and the rig's name.
    own: (Calibration, String),
    job: Job<Result<Shelved, String>>,
    shelved: Option<Result<Shelved, String>>,
    chosen: usize,
    name: String,
}

/// Whether a run measured a calibration, or why not.
pub fn can_keep(run: Option<&RunView>) -> Result<&Path, String> {
    let has_weighed = |run: &&RunView| run.phases.iter().any(|(_, phase)| *phase == Phase::Weigh);
    let Some(run) = run.filter(has_weighed) else {
        return Err("the last run weighed nothing; measure first".into());
    };
    match &run.outcome {
        None => Err("the run goes on".into()),
        Some(outcome) if outcome.ending != EndingKind::Finish => {
            Err("the last run did not finish; a calibration must be complete".into())
        }
        Some(_) => Ok(&run.folder),
    }
}

impl CalibrationScreen {
    fn new(workbench: &Workbench) -> Self {
        let rig = &workbench.snapshot.rig.description.name;
        Self {
            library: workbench.library.clone(),
            name: format!("cell of {rig}"),
            own: (workbench.bench.calibration.clone(), rig.clone()),
            job: Job::default(),
            shelved: None,
            chosen: 0,
        }
    }

    /// Stores what a run measured and reads the library again.
    fn keep(&mut self, run: Option<&RunView>, ctx: &Context) {
        let (Ok(folder), name) = (can_keep(run), self.name.trim().to_owned()) else {
            return;
        };
        if name.is_empty() || self.job.is_busy() {
            return;
        }
        let (library, own, ctx) = (self.library.clone(), self.own.clone(), ctx.clone());
        let folder = folder.to_owned();
        let work = move || {
            let library = library?;
            let id = keep(&library, &folder, &name);
            Ok(read(&library, own, Some(id)))
        };
        self.begin(work, ctx);
    }

    fn begin(
        &mut self,
        work: impl FnOnce() -> Result<Shelved, String> + Send + 'static,
        ctx: Context,
    ) {
        let done = move || ctx.request_repaint();
        if let Err(err) = self.job.start("calibrations", work, done) {
            self.shelved = Some(Err(format!("the library cannot be read: {err}")));
        }
    }

    fn shown_one(&self) -> Option<&Shown> {
        self.shelved.as_ref()?.as_ref().ok()?.shown.get(self.chosen)
    }

    /// The chosen calibration, if it may be used now, or why not.
    fn usable(&self, workbench: &Workbench) -> Result<&Calibration, String> {
        let one = self.shown_one().ok_or("the library is not read yet")?;
        if workbench.is_busy() {
            return Err("a run is in progress".into());
        }
        if one.calibration == workbench.bench.calibration {
            return Err("it is in use".into());
        }
        if let Err(reason) = &one.told {
            return Err(reason.clone());
        }
        Ok(&one.calibration)
    }
}

impl Screen for CalibrationScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "Calibrations");
        let quiet = |text: String| RichText::new(text).color(tokens.text_quiet).small();
        let alarm = |text: &str| RichText::new(text).color(tokens.alarm_text);
        match &self.shelved {
            None => {
                ui.label(quiet("reading the library".into()));
            }
            Some(Err(reason)) => {
                ui.add(Label::new(alarm(reason)).wrap());
            }
            Some(Ok(shelved)) => {
                for (index, one) in shelved.shown.iter().enumerate() {
                    let is_chosen = index == self.chosen;
                    let button = Button::selectable(is_chosen, &one.entry.id)
                        .min_size(vec2(ui.available_width(), 24.0));
                    if ui.add(button).clicked() {
                        self.chosen = index;
                    }
                    // The rig's own stands first.
                    let is_own = index == 0;
                    let is_used = one.calibration == workbench.bench.calibration;
                    ui.add(Label::new(quiet(state_words(&one.entry, is_own, is_used))).wrap());
                }
                for reason in &shelved.unreadable {
                    ui.add(Label::new(alarm(reason).small()).wrap());
                }
            }
        }
        ui.add_space(8.0);
        let verdict = self.usable(workbench).map(|_| ());
        if reason_button(ui, "Use this one  F6", vec2(150.0, 30.0), &verdict) {
            commands.push(UserCommand::Work);
        }
        section_ui(ui, "A new one");
        let button = Button::new("Measure...").min_size(vec2(150.0, 28.0));
        if ui.add_enabled(!workbench.is_busy(), button).clicked() {
            commands.push(UserCommand::MeasureCalibration);
        }
        ui.horizontal(|ui| {
            let label = form_label(ui, "name");
            let input = TextEdit::singleline(&mut self.name)
                .desired_width(ui.available_width() - 10.0)
                .char_limit(80);
            ui.add(input).labelled_by(label.id).named("name");
        });
        let verdict = match (can_keep(workbench.run()), self.name.trim().is_empty()) {
            (Err(reason), _) => Err(reason),
            (Ok(_), true) => Err("give it a name first".into()),
            (Ok(_), false) => Ok(()),
        };
        if reason_button(ui, "Keep the last run's", vec2(150.0, 28.0), &verdict) {
            commands.push(UserCommand::KeepCalibration);
        }
        if let Some(Ok(shelved)) = &self.shelved {
            match &shelved.kept {
                Some(Ok(id)) => {
                    ui.add(Label::new(quiet(format!("kept as {id}"))).wrap());
                }
                Some(Err(reason)) => {
                    ui.add(Label::new(alarm(&format!("Not kept: {reason}"))).wrap());
                }
                None => {}
            }
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
        if let Some(Shown { told: Ok((_, curves)), .. }) = self.shown_one() {
            plots::curves_ui(ui, curves);
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "Chosen calibration");
        let Some(one) = self.shown_one() else {
            ui.label(RichText::new("none yet").color(tokens.text_quiet));
            return;
        };
        let document = &one.calibration;
        let taken = document.taken_at.clone();
        for (name, value) in [
            ("name", document.name.clone()),
            ("source", document.source.clone()),
            ("taken", taken.unwrap_or_else(|| "not stated".into())),
            ("rig", document.rig.clone()),
            ("operator", document.operator.clone()),
            ("curve", document.curve.to_string()),
        ] {
            if !value.is_empty() {
                fact_ui(ui, name, value);
            }
        }
        let findings = match &one.told {
            Ok((told, _)) => &told.quality.findings,
            Err(reason) => {
                alarm_ui(ui, reason);
                return;
            }
        };
        section_ui(ui, "Findings");
        if findings.is_empty() {
            ui.label(RichText::new("none").color(tokens.text_quiet));
        }
        for finding in findings {
            ui.add(Label::new(finding).wrap());
        }
        if !one.doubts.is_empty() {
            section_ui(ui, "Doubts");
        }
        for doubt in &one.doubts {
            alarm_ui(ui, doubt);
        }
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        if let Some(answer) = self.job.poll() {
            if let Ok(Shelved { kept: Some(Ok(id)), shown, .. }) = &answer {
                let place = shown.iter().position(|one| one.entry.id == *id);
                self.chosen = place.unwrap_or(0);
            }
            self.shelved = Some(answer);
        }
    }

    fn shown(&mut self, ctx: &Context) {
        if self.shelved.is_none() && !self.job.is_busy() {
            let (library, own, ctx) = (self.library.clone(), self.own.clone(), ctx.clone());
            let work = move || library.map(|library| read(&library, own, None));
            self.begin(work, ctx);
        }
    }

    fn act(
        &mut self,
        ctx: &Context,
        command: &UserCommand,
        workbench: &mut Workbench,
    ) -> ScreenReply {
        match command {
            UserCommand::KeepCalibration => self.keep(workbench.run(), ctx),
            _ => return ScreenReply::NotMine,
        }
        ScreenReply::Show
    }

    /// New sessions are read with the calibration that is chosen.
    fn work(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        let Ok(calibration) = self.usable(workbench).cloned() else {
            return;
        };
        // What makes no curve is not usable.
        if let Ok(curve) = calibration.curve() {
            workbench.bench.calibration = calibration;
            workbench.bench.curve = curve;
            workbench.form.forget();
        }
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let can_keep = can_keep(workbench.run()).map(|_| ());
        let keep = "Keep the calibration that was measured";
        vec![
            PaletteAction::new("Measure a calibration", "", UserCommand::MeasureCalibration)
                .if_ok(workbench.free_verdict()),
            PaletteAction::new(keep, "", UserCommand::KeepCalibration).if_ok(can_keep),
        ]
    }
}

/// Age and state, and whether new sessions are read with it.
fn state_words(entry: &Entry, is_own: bool, is_used: bool) -> String {
    let mut words = Vec::new();
    if is_used {
        words.push("IN USE".to_owned());
    }
    if !entry.rig.is_empty() {
        words.push(format!("rig {}", entry.rig));
    }
    words.extend(entry.age_days.map(|age| format!("{age} d old")));
    words.push(if is_own { "comes with the rig".into() } else { entry.state() });
    words.join(", ")
}
