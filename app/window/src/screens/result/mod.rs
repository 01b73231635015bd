//! The result screen: whether the run that has ended is good, and what it tells.

mod quality;
mod verdict;

use super::after_stop::ended_ui;
use super::calibration::calibration_session;
use super::exact_fit::exact_ui;
use super::live_panel::{cycles_ui, facts_ui, may_indent};
use super::parameters::parameters_ui;
use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use super::today;
use super::weighing::weighing_ui;
use crate::widgets::{alarm_ui, placeholder_ui, quiet_ui, require, section_ui, sentence_ui};
use crate::workers::fit::Refit;
use crate::workers::queue_desk::QueueWork;
use eframe::egui::{Context, Key, Ui};
use palpate_runner::RunView;
use palpate_sessions::checks::DailyCheck;
use palpate_sessions::specimen_queue::QueueVerdict;
use std::path::Path;
use verdict::RunVerdict;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Result",
    icon: lucide_icons::Icon::ClipboardCheck,
    purpose: "judge the last run and see its parameters",
    key: Some(Key::R),
    open: |_| Box::new(ResultScreen::default()),
};

/// Seconds after which a fit that is under way says so.
const BUSY_SECS: f64 = 1.0;

/// What the operator says of the run. The run itself belongs to the workbench.
#[derive(Default)]
pub struct ResultScreen {
    verdict: RunVerdict,
}

impl ResultScreen {
    /// Accepts the run that has ended and been checked; where specimens wait, the day goes on with the next one.
    fn accept(&mut self, workbench: &mut Workbench) -> Reaction {
        let Some(session) = judgeable(workbench) else {
            return Reaction::Done;
        };
        if workbench.queue.is_busy() {
            return Reaction::Done;
        }
        let work = QueueWork::Judge(session.to_owned(), QueueVerdict::Accept);
        let by = workbench.form.label_text("operator").to_owned();
        workbench.queue.ask(work, &by, self.verdict.reason());
        match workbench.queue.queue().next() {
            Some(_) => Reaction::ShowOther(today::SCREEN.name),
            None => Reaction::Done,
        }
    }
}

impl Screen for ResultScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        if let Some(reason) = &workbench.refusal {
            alarm_ui(ui, reason);
        }
        let Some(run) = workbench.measured_run() else {
            section_ui(ui, "Result");
            placeholder_ui(ui, "no run yet; choose a protocol on the screen Run and start it");
            return;
        };
        let latest = &workbench.latest_run;
        let quality = latest.quality(Some(run));
        if run.outcome.is_none() {
            section_ui(ui, "Result");
            quiet_ui(ui, "the run is in progress; its result comes when it has ended");
            return;
        }
        ended_ui(ui, run, quality, commands);
        if let Some(reason) = latest.failure(Some(run)) {
            alarm_ui(ui, format!("the run could not be checked: {reason}"));
        }
        // A daily check is its own verdict.
        if let Some(check) = latest.daily_check(Some(run)) {
            return daily_check_ui(ui, check);
        }
        if let Some(session) = judgeable(workbench) {
            let may_repeat = workbench.repeat_verdict();
            self.verdict.ui(ui, session, &workbench.queue, &may_repeat, commands);
        }
        if let Some(quality) = quality {
            quality::quality_ui(ui, quality);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, _commands: &mut Commands) {
        match workbench.measured_run().filter(|run| has_weighed(run)) {
            Some(run) => {
                let signal = workbench.snapshot.rig.reading.map(|reading| reading.volts);
                weighing_ui(ui, run, signal, &workbench.bench);
            }
            None => workbench.plots_ui(ui),
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, _commands: &mut Commands) {
        let run = workbench.measured_run();
        if run.is_none_or(may_indent) {
            found_ui(ui, run, workbench.latest_run.refit(run));
        }
        if let Some(run) = run {
            section_ui(ui, "Measured");
            facts_ui(ui, run);
        }
        cycles_ui(ui, workbench.latest_run.plots().cycles());
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::AcceptRun => self.accept(workbench),
            _ => Reaction::NotMine,
        }
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let has_checks = judgeable(workbench).is_some();
        let verdict = require(has_checks, "no run has ended and been checked");
        let accept = PaletteAction::new("Accept the run", "Ctrl+Enter", UiCommand::AcceptRun);
        vec![accept.if_ok(verdict)]
    }
}

/// Session of the run shown, once it is checked and where it needs a verdict: a calibration is kept, and a daily check
/// is its own verdict.
fn judgeable(workbench: &Workbench) -> Option<&Path> {
    let run = workbench.measured_run();
    let (latest, is_calibration) = (&workbench.latest_run, calibration_session(run).is_ok());
    latest.assessed(run).filter(|_| !is_calibration && latest.daily_check(run).is_none())
}

/// Draws what a daily check found.
fn daily_check_ui(ui: &mut Ui, check: &Result<DailyCheck, String>) {
    section_ui(ui, "Daily check");
    match check {
        Err(reason) => alarm_ui(ui, format!("the result was not kept: {reason}")),
        Ok(check) if check.is_passed => quiet_ui(ui, "passed; it holds for today"),
        Ok(_) => alarm_ui(ui, "failed; repair the rig, and check it again"),
    }
    for part in check.iter().flat_map(|check| &check.parts) {
        if part.is_passed { sentence_ui(ui, &part.sentence) } else { alarm_ui(ui, &part.sentence) }
    }
}

/// Whether the run measured a calibration, which has readings in place of a curve.
fn has_weighed(run: &RunView) -> bool {
    !run.planned_weights.is_empty()
}

/// The parameters of the exact fit, or the live ones with the reason.
fn found_ui(ui: &mut Ui, run: Option<&RunView>, refit: Refit<'_>) {
    if let Refit::Done(exact) = refit {
        return exact_ui(ui, &exact.report);
    }
    section_ui(ui, "Live parameters");
    match refit {
        Refit::Refused(reason) => alarm_ui(ui, format!("No exact fit: {reason}")),
        Refit::Busy(seconds) if seconds > BUSY_SECS => {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label(format!("fitting every sample, {seconds:.0} s so far"));
            });
        }
        Refit::Busy(_) | Refit::Done(_) | Refit::NotYet => {}
    }
    parameters_ui(ui, run);
}
