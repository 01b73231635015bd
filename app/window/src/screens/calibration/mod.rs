//! The calibrations of the library, the quality of the chosen one, and a new one from the last run.

mod plots;

use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::widgets::{
    NamedControl, alarm_ui, answer_ui, fact_ui, form_label, placeholder_ui, quiet_ui,
    reason_button, require, section_ui, sentence_ui, small_alarm_ui,
};
use crate::workers::BackgroundTask;
use eframe::egui::{Button, Context, Key, TextEdit, Ui, vec2};
use palpate_analysis::calibrations::{
    CalibrationOverview, CalibrationView, read, store_calibration,
};
use palpate_analysis::daily::is_daily_check_run;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_runner::RunView;
use std::path::{Path, PathBuf};

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Calibration",
    icon: lucide_icons::Icon::Scale,
    purpose: "load-cell calibrations in the library, which convert volts to newtons",
    key: Some(Key::Num2),
    open: |workbench| Box::new(CalibrationScreen::new(workbench)),
};

pub struct CalibrationScreen {
    library: Result<PathBuf, String>,
    /// The one with which the rig was opened and the one that comes with it, and the rig's name.
    own: (Vec<Calibration>, String),
    shelved: BackgroundTask<CalibrationOverview>,
    chosen: usize,
    name: String,
    /// What became of the last save is to be scrolled into sight: the list above it has grown meanwhile.
    is_news: bool,
}

/// The session of a run that measured a calibration, or why there is none to save.
pub fn calibration_session(run: Option<&RunView>) -> Result<&Path, String> {
    let has_weighed = |run: &&RunView| {
        !is_daily_check_run(run) && run.phases.iter().any(|(_, phase)| *phase == Phase::Weigh)
    };
    let Some(run) = run.filter(has_weighed) else {
        return Err("the last run measured no calibration; measure a calibration first".into());
    };
    match &run.outcome {
        None => Err("the run is still in progress".into()),
        Some(outcome) if outcome.ending != EndingKind::Finish => Err(
            "the last run ended before its calibration was complete; measure the calibration again"
                .into(),
        ),
        Some(_) => Ok(&run.folder),
    }
}

impl CalibrationScreen {
    fn new(workbench: &Workbench) -> Self {
        let rig = &workbench.snapshot.rig.description.name;
        let opened_with = std::iter::once(&workbench.bench.calibration);
        let own = opened_with.chain(&workbench.built_in).cloned().collect();
        Self {
            library: workbench.library.clone(),
            name: format!("cell of {rig}"),
            own: (own, rig.clone()),
            shelved: BackgroundTask::default(),
            chosen: 0,
            is_news: false,
        }
    }

    /// Stores what a run measured and reads the library again.
    fn keep(&mut self, run: Option<&RunView>, ctx: &Context) {
        let (Ok(folder), name) = (calibration_session(run), self.name.trim().to_owned()) else {
            return;
        };
        if name.is_empty() {
            return;
        }
        let (library, own, folder) = (self.library.clone(), self.own.clone(), folder.to_owned());
        self.shelved.start("calibrations", ctx, move |_| {
            let library = library?;
            let id = store_calibration(&library, &folder, &name);
            Ok(read(&library, own, Some(id)))
        });
    }

    fn shown_one(&self) -> Option<&CalibrationView> {
        self.shelved.answer()?.as_ref().ok()?.calibrations.get(self.chosen)
    }

    /// The chosen calibration, or why it cannot be used now.
    fn usable(&self, workbench: &Workbench) -> Result<&CalibrationView, String> {
        let one = self.shown_one().ok_or("the library is not read yet")?;
        workbench.free_verdict()?;
        require(one.calibration != workbench.bench.calibration, "it is in use")?;
        one.details.as_ref().map(|_| one).map_err(Clone::clone)
    }
}

impl Screen for CalibrationScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        section_ui(ui, "Calibrations");
        if let Some(shelved) = answer_ui(ui, &self.shelved, "reading the library") {
            for (index, one) in shelved.calibrations.iter().enumerate() {
                let button = Button::selectable(index == self.chosen, &one.entry.id)
                    .min_size(vec2(ui.available_width(), 24.0));
                if ui.add(button).clicked() {
                    self.chosen = index;
                }
                let is_used = one.calibration == workbench.bench.calibration;
                quiet_ui(ui, state_words(one, is_used));
            }
            shelved.unreadable.iter().for_each(|reason| small_alarm_ui(ui, reason));
        }
        ui.add_space(8.0);
        let verdict = self.usable(workbench).map(|_| ());
        if reason_button(ui, "Use calibration  F6", vec2(150.0, 30.0), &verdict) {
            commands.push(UiCommand::Work);
        }
        section_ui(ui, "New calibration");
        let button = Button::new("Measure...").min_size(vec2(150.0, 28.0));
        if ui.add_enabled(!workbench.is_busy(), button).clicked() {
            commands.push(UiCommand::MeasureCalibration);
        }
        ui.horizontal(|ui| {
            let label = form_label(ui, "name");
            let input = TextEdit::singleline(&mut self.name)
                .desired_width(ui.available_width() - 10.0)
                .char_limit(80);
            ui.add(input).labelled_by(label.id).named("name");
        });
        let has_name = require(!self.name.trim().is_empty(), "type a name first");
        let verdict = calibration_session(workbench.measured_run()).and(has_name);
        if reason_button(ui, "Save calibration of last run", vec2(150.0, 28.0), &verdict) {
            commands.push(UiCommand::KeepCalibration);
        }
        let said = ui.scope(|ui| {
            match self.shelved.answer().and_then(|answer| answer.as_ref().ok()?.stored.as_ref()) {
                Some(Ok(id)) => sentence_ui(ui, format!("saved as {id}")),
                Some(Err(reason)) => alarm_ui(ui, format!("Not saved: {reason}")),
                None => {}
            }
        });
        if std::mem::take(&mut self.is_news) {
            said.response.scroll_to_me(None);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        if let Some(CalibrationView { details: Ok((_, curves)), .. }) = self.shown_one() {
            plots::curves_ui(ui, curves);
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        section_ui(ui, "Chosen calibration");
        let Some(one) = self.shown_one() else { return placeholder_ui(ui, "none yet") };
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
        let findings = match &one.details {
            Ok((report, _)) => &report.quality.findings,
            Err(reason) => return alarm_ui(ui, reason),
        };
        section_ui(ui, "Findings");
        if findings.is_empty() {
            placeholder_ui(ui, "none");
        }
        findings.iter().for_each(|finding| sentence_ui(ui, finding));
        if !one.doubts.is_empty() {
            section_ui(ui, "Warnings");
        }
        one.doubts.iter().for_each(|doubt| alarm_ui(ui, doubt));
    }

    fn poll(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        if !self.shelved.poll() {
            return;
        }
        // The one just stored, or the one in use.
        let Some(Ok(CalibrationOverview { stored, calibrations, .. })) = self.shelved.answer()
        else {
            return;
        };
        self.is_news = stored.is_some();
        let is_it = |one: &CalibrationView| match stored {
            Some(Ok(id)) => one.entry.id == *id,
            _ => one.calibration == workbench.bench.calibration,
        };
        self.chosen = calibrations.iter().position(is_it).unwrap_or(0);
    }

    fn shown(&mut self, ctx: &Context) {
        if self.shelved.answer().is_none() {
            let (library, own) = (self.library.clone(), self.own.clone());
            let work = move |_: &_| library.map(|library| read(&library, own, None));
            self.shelved.start("calibrations", ctx, work);
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::KeepCalibration => self.keep(workbench.measured_run(), ctx),
            _ => return Reaction::NotMine,
        }
        Reaction::Show
    }

    /// New sessions are read with the calibration that is chosen.
    fn work(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        let Ok(one) = self.usable(workbench) else { return };
        let (calibration, doubts) = (one.calibration.clone(), one.doubts.clone());
        if workbench.bench.take_calibration(calibration, doubts).is_ok() {
            workbench.form.forget();
            workbench.station.disarm("another calibration was chosen at the rig");
        }
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let is_measured = calibration_session(workbench.measured_run()).map(|_| ());
        let keep = "Save the calibration of the last run";
        vec![
            PaletteAction::new("Measure a calibration", "", UiCommand::MeasureCalibration)
                .if_ok(workbench.free_verdict()),
            PaletteAction::new(keep, "", UiCommand::KeepCalibration).if_ok(is_measured),
        ]
    }
}

/// Age and state, and whether it is in use.
fn state_words(one: &CalibrationView, is_used: bool) -> String {
    let entry = &one.entry;
    let mut words = Vec::new();
    if is_used {
        words.push("IN USE".to_owned());
    }
    if !entry.rig.is_empty() {
        words.push(format!("rig {}", entry.rig));
    }
    words.extend(entry.age_days.map(|age| format!("{age} d old")));
    words.push(if one.comes_with_rig { "comes with the rig".into() } else { entry.state() });
    words.join(", ")
}
