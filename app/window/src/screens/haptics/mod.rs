//! From model to touch: the damping that a material needs of a device, and the haptic loop with a hand that is led from
//! here.

mod form;
mod middle;
mod right;

use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use super::tape::{TapePanel, loop_button_ui};
use crate::widgets::{
    NamedControl, alarm_ui, form_label, quiet_ui, require, section_ui, tick_box, work_ui,
};
use crate::workers::haptic_loop::HapticLoop;
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Slider, Ui};
use form::HapticsForm;
use middle::View;
use palpate_analysis::haptics::{HapticCheck, HapticSettings, check, fit_haptic_body};
use palpate_analysis::haptics_tape::{finish_recording, hand_led_recorder, replay};
use palpate_analysis::progress::Progress;
use palpate_analysis::tick_replay::ReplayResult;
use std::path::{Path, PathBuf};

/// How far above the surface a hand can be led, in mm.
const ABOVE: f64 = 2.0;

/// A material on a device, checked.
pub struct HapticsCheck {
    source: PathBuf,
    setting: HapticSettings,
    notes: Vec<String>,
    pub checked: HapticCheck,
}

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Haptics",
    icon: lucide_icons::Icon::Hand,
    purpose: "feel a material through a haptic device: stability margin, limit cycle and force loop",
    key: Some(Key::Num9),
    open: |_| Box::new(HapticsScreen::default()),
};

#[derive(Default)]
pub struct HapticsScreen {
    form: HapticsForm,
    is_open: bool,
    task: BackgroundTask<HapticsCheck>,
    live_loop: Option<HapticLoop>,
    refusal: Option<String>,
    tape: TapePanel,
    view: View,
}

impl HapticsScreen {
    pub fn is_running(&self) -> bool {
        self.live_loop.as_ref().is_some_and(HapticLoop::is_running)
    }

    /// The last check.
    pub fn check_result(&self) -> Option<&Result<HapticsCheck, String>> {
        self.task.answer()
    }

    /// The loop that runs or ran last.
    pub fn live_loop(&self) -> Option<&HapticLoop> {
        self.live_loop.as_ref()
    }

    pub fn replayed(&self) -> Option<&Result<ReplayResult, String>> {
        self.tape.replayed()
    }

    /// The check of the setting in the form, or why the loop may not start.
    fn checked(&self) -> Result<&HapticsCheck, String> {
        let request = self.form.request()?;
        match self.task.answer() {
            Some(Ok(check)) if (&check.source, &check.setting) == (&request.0, &request.1) => {
                Ok(check)
            }
            _ => Err("check this setting first".into()),
        }
    }

    /// Starts the loop, unless it runs, and records it if a folder is named.
    fn start_loop(&mut self, ctx: &Context) {
        if self.is_running() {
            return;
        }
        let checked = self.checked();
        let checked = checked.map(|check| (check.setting, check.checked.body));
        let started = checked.and_then(|(setting, body)| {
            let is_guarded = !self.is_open;
            let begin = |folder: &Path| hand_led_recorder(folder, body, &setting, is_guarded);
            let recorder = self.tape.begin(ctx, begin)?;
            let settings = setting.simulation(body, is_guarded);
            HapticLoop::start(&settings, setting.speed, recorder)
        });
        match started {
            Ok(live_loop) => {
                self.live_loop = Some(live_loop);
                self.view = View::Live;
                self.refusal = None;
            }
            Err(reason) => {
                self.refusal = Some(reason);
                self.tape.cut_off();
            }
        }
    }

    fn feel_ui(&mut self, ui: &mut Ui, verdict: &Result<(), String>, commands: &mut Commands) {
        section_ui(ui, "Feel");
        let is_running = self.is_running();
        ui.add_enabled_ui(!is_running, |ui| {
            tick_box(ui, &mut self.is_open, "without guards and controller");
        });
        if let Some(reason) = &self.refusal {
            alarm_ui(ui, reason);
        }
        let verdict = verdict.clone().and_then(|()| self.checked().map(|_| ()));
        let both = [UiCommand::LoopStart, UiCommand::LoopStop];
        loop_button_ui(ui, "loop", is_running, &verdict, both, commands);
        let answer = self.task.answer().filter(|_| is_running);
        let (Some(live_loop), Some(Ok(check))) = (&self.live_loop, answer) else { return };
        let deepest = check.setting.deepest.0;
        let mut place = live_loop.place();
        ui.horizontal(|ui| {
            let label = form_label(ui, "hand");
            let slider = Slider::new(&mut place, -ABOVE..=deepest).step_by(0.1).suffix(" mm");
            let slider = ui.add(slider).labelled_by(label.id).named("hand");
            if slider.changed() {
                live_loop.lead(place);
            }
        });
        ui.horizontal(|ui| {
            for (name, place) in [("Ramp and hold", deepest), ("Lift off", -ABOVE)] {
                if ui.button(name).named(name).clicked() {
                    live_loop.lead(place);
                }
            }
        });
        let words = "The simulated hand moves to this depth at its own speed; arrow keys move the slider while the slider has the focus.";
        quiet_ui(ui, words);
    }
}

impl Screen for HapticsScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        // A running loop keeps the setting that was checked.
        let is_running = self.is_running();
        ui.add_enabled_ui(!is_running, |ui| {
            if self.form.ui(ui, &workbench.front) {
                commands.push(UiCommand::Choose(PathPurpose::Body));
            }
        });
        ui.add_space(6.0);
        let verdict = require(!is_running, "the loop runs").and(self.form.request().map(|_| ()));
        work_ui(ui, "Check  F6", &self.task, &verdict, commands);
        self.feel_ui(ui, &workbench.loop_verdict(SCREEN.name), commands);
        self.tape.ui(ui, is_running, replay);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        self.draw_middle(ui);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        self.draw_right(ui);
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        self.task.poll();
        self.form.check();
        self.tape.poll();
        if let Some(Err(reason)) = self.live_loop.as_mut().map(HapticLoop::poll) {
            self.refusal = Some(reason);
            self.tape.cut_off();
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::LoopStart if workbench.loop_verdict(SCREEN.name).is_ok() => {
                self.start_loop(ctx);
                return Reaction::Show;
            }
            UiCommand::LoopStart => {}
            UiCommand::LoopStop => self.stop(),
            UiCommand::Chosen(PathPurpose::Body, path) => self.form.take(path),
            UiCommand::ReplayLoop(folder) => {
                self.tape.take(folder);
                return Reaction::Show;
            }
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        let Ok((source, setting)) = self.form.request() else { return };
        self.view = View::Margin;
        self.task.start("haptics-check", ctx, move |progress| {
            progress.share(0.0, "the fit");
            let body = fit_haptic_body(&source)?;
            let checked = check(body.body, &setting, &mut |share| {
                progress.share(share, "the simulated device")
            })?;
            let mut notes = body.notes.clone();
            notes.extend(body.extrapolation_warning(setting.deepest));
            Ok(HapticsCheck { source, setting, notes, checked })
        });
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy() || self.tape.is_busy() || self.is_running()
    }

    fn running(&self) -> Option<&'static str> {
        self.is_running().then_some("the haptic loop runs")
    }

    fn stop(&mut self) {
        if let Some(beat) = self.live_loop.as_mut().and_then(HapticLoop::stop) {
            self.tape.end(move || beat.end().and_then(finish_recording));
        }
    }

    fn close(&mut self) {
        self.stop();
        self.tape.settle();
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let can_stop = require(self.is_running(), "the loop is not running");
        let can_start = workbench.loop_verdict(SCREEN.name);
        vec![
            PaletteAction::new("Start the haptic loop", "", UiCommand::LoopStart).if_ok(can_start),
            PaletteAction::new("Stop the haptic loop", "", UiCommand::LoopStop).if_ok(can_stop),
        ]
    }
}
