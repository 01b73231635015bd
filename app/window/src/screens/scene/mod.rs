//! A piece of tissue that is pressed with the pointer, the keys or along a path, seen in three dimensions, with the force
//! that a hand would feel.

mod form;
mod middle;
mod plan;
mod right;

use super::screen::{Screen, ScreenEntry, ScreenReply};
use super::tape::TapePanel;
use crate::command::{CommandQueue, UserCommand};
use crate::scene::view::SceneView;
use crate::shell::palette::PaletteAction;
use crate::widgets::fact_row::section_ui;
use crate::widgets::places::NamedControl;
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::{alarm_ui, quiet_ui};
use crate::widgets::task_bar::work_ui;
use crate::workbench::Workbench;
use crate::workers::live_scene::{ComputedPath, LiveScene, SceneInstant, ahead};
use crate::workers::path_dialog::PathPurpose;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Button, Context, Key, Ui, vec2};
use form::SceneForm;
use middle::PictureSource;
use palpate_analysis::progress::Progress;
use palpate_analysis::recorded::Replayed;
use palpate_analysis::scene::{recorded, replay, scene_of};
use palpate_haptics::scene::{Hand6, SceneSettings};
use palpate_runner::haptics::scene::{COLUMNS, SceneRecorder};
use palpate_runner::haptics::scene_file::SceneFile;
use plan::PlannedScene;
use std::path::Path;

/// How the stylus is held with the pointer and the keys: yaw, pitch and roll in rad, as the paths have it at rest.
const TURN: [f64; 3] = [0.0, -0.5, 0.0];

/// The screen's line in the table.
pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Scene",
    purpose: "press into a piece of tissue and see it give way",
    // Every number is taken: Ctrl+0 is the usual size of text.
    key: Key::E,
    open: |_| Box::new(SceneScreen::default()),
};

/// The screen's state.
pub struct SceneScreen {
    form: SceneForm,
    reading: BackgroundTask<(SceneFile, Vec<String>)>,
    /// Whether the file asked for has not come yet.
    is_reading: bool,
    ahead: BackgroundTask<ComputedPath>,
    is_shown: bool,
    touch: Option<LiveScene>,
    /// What it is made of.
    touched: SceneFile,
    refusal: Option<String>,
    tape: TapePanel,
    planned: Option<PlannedScene>,
    side: PictureSource,
    view: SceneView,
    /// The length of the side that the view was made for, in mm.
    viewed_mm: f64,
}

impl Default for SceneScreen {
    fn default() -> Self {
        let form = SceneForm::default();
        let side = SceneFile::default().side_mm;
        Self {
            form,
            reading: BackgroundTask::default(),
            is_reading: false,
            ahead: BackgroundTask::default(),
            is_shown: false,
            touch: None,
            touched: SceneFile::default(),
            refusal: None,
            tape: TapePanel::default(),
            planned: None,
            side: PictureSource::Computed,
            view: SceneView::of([side; 2]),
            viewed_mm: side,
        }
    }
}

impl SceneScreen {
    /// Whether the scene runs.
    pub fn is_running(&self) -> bool {
        self.touch.as_ref().is_some_and(LiveScene::is_running)
    }

    /// The scene that runs or ran last.
    pub fn touch(&self) -> Option<&LiveScene> {
        self.touch.as_ref()
    }

    /// The path that was computed last.
    pub fn ahead(&self) -> Option<&Result<ComputedPath, String>> {
        self.ahead.answer()
    }

    /// Whether what stands in the form can be started.
    fn verdict(&self, workbench: &Workbench) -> Result<(), String> {
        workbench.loop_verdict(SCREEN.name)?;
        if self.is_running() {
            return Err("the scene runs".into());
        }
        self.form.settings().map(|_| ())
    }

    /// A recording that was computed again last.
    pub fn replayed(&self) -> Option<&Result<Replayed, String>> {
        self.tape.replayed()
    }

    /// Reads the file that is named, on a thread: a body may have to be fitted.
    fn read(&mut self, ctx: &Context) {
        if self.is_running() {
            return;
        }
        let named = self.form.file.trim().to_owned();
        self.is_reading = true;
        self.reading.start("scene-read", ctx, move |_| {
            scene_of((!named.is_empty()).then_some(Path::new(&named)))
        });
    }

    /// Computes what stands in the form along its path.
    fn compute(&mut self, ctx: &Context) {
        let Ok(settings) = self.form.settings() else {
            return;
        };
        let path = self.form.path.unwrap_or(form::FIRST_PATH);
        self.side = PictureSource::Computed;
        self.look_at(&settings);
        self.ahead.start("scene-ahead", ctx, move |progress| {
            ahead(settings, path, &mut |share| progress.share(share, "the path"))
        });
    }

    /// Starts the scene, unless it runs, and records it if a folder is named.
    fn start(&mut self, ctx: &Context) {
        if self.is_running() {
            return;
        }
        let started = self.form.scene_file().and_then(|file| {
            let settings = self.form.settings()?;
            self.look_at(&settings);
            let text = file.text();
            let begin = |folder: &Path| SceneRecorder::start(folder, &text, COLUMNS);
            let recorder = self.tape.begin(ctx, begin)?;
            let touch = LiveScene::start(settings, self.form.path, recorder)?;
            Ok((touch, file))
        });
        match started {
            Ok((touch, file)) => {
                self.touch = Some(touch);
                self.touched = file;
                self.side = PictureSource::Live;
                self.refusal = None;
            }
            Err(reason) => {
                self.refusal = Some(reason);
                self.tape.cut_off();
            }
        }
    }

    /// Another piece of tissue is looked at anew.
    fn look_at(&mut self, settings: &SceneSettings) {
        if settings.side_mm.to_bits() != self.viewed_mm.to_bits() {
            self.viewed_mm = settings.side_mm;
            let has_lines = self.view.has_lines;
            self.view = SceneView::of([settings.side_mm; 2]);
            self.view.has_lines = has_lines;
        }
    }

    /// What is on the screen: the scene that runs or ran, or the path computed ahead.
    fn seen(&self) -> Option<(&SceneSettings, &SceneInstant)> {
        match (self.side, &self.touch, self.ahead.answer()) {
            (PictureSource::Live, Some(touch), _) => Some((touch.settings(), touch.moment())),
            (PictureSource::Computed, _, Some(Ok(ahead))) => {
                Some((&ahead.settings, &ahead.deepest))
            }
            _ => None,
        }
    }
}

impl Screen for SceneScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue) {
        // What runs is not to be changed under a hand.
        let is_running = self.is_running();
        ui.add_enabled_ui(!is_running, |ui| match self.form.ui(ui) {
            Some(form::FileAction::Dialog) => {
                commands.push(UserCommand::Choose(PathPurpose::Scene))
            }
            Some(form::FileAction::Read) => commands.push(UserCommand::OpenScene),
            None => {}
        });
        if let Some(reason) = &self.refusal {
            alarm_ui(ui, reason);
        }
        ui.add_space(6.0);
        let may = match is_running {
            true => Err("the scene runs".into()),
            false => self.form.settings().map(|_| ()),
        };
        work_ui(ui, "Compute the path  F6", &self.ahead, &may, commands);
        section_ui(ui, "Touch");
        let size = vec2(170.0, 34.0);
        if is_running {
            let stop = Button::new("Stop the scene").min_size(size);
            if ui.add(stop).named("Stop the scene").clicked() {
                commands.push(UserCommand::SceneStop);
            }
        } else if reason_button(ui, "Start the scene", size, &self.verdict(workbench)) {
            commands.push(UserCommand::SceneStart);
        }
        let words = match self.touch.as_ref().is_some_and(LiveScene::is_led) {
            true => "the path leads the hand; after it the pointer and the keys do",
            false => {
                "in the picture: hold the left button to press, with the wheel deeper; drag with the right button to \
                 turn, wheel to zoom. Keys: arrows move, Page Down presses, Page Up lifts, Shift with arrows turns, \
                 + and - zoom, Home looks as at first"
            }
        };
        quiet_ui(ui, words);
        ui.add_enabled_ui(!is_running, |ui| self.form.parts_ui(ui));
        self.plan_ui(ui, is_running, commands);
        self.tape.ui(ui, is_running, replay);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
        self.draw_middle(ui);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
        self.draw_right(ui);
    }

    fn poll(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        self.form.check();
        self.tape.poll();
        self.ahead.poll();
        self.reading.poll();
        if self.is_reading && self.reading.state().is_none() {
            self.is_reading = false;
            match self.reading.answer() {
                Some(Ok((file, notes))) => {
                    self.refusal = None;
                    self.form.fill(file.clone(), notes.clone());
                }
                Some(Err(reason)) => self.refusal = Some(reason.clone()),
                None => {}
            }
        }
        let hand = Hand6 { at: self.view.hand().at(), turn: TURN };
        if let Some(Err(reason)) = self.touch.as_mut().map(|touch| touch.poll(hand)) {
            self.refusal = Some(reason);
            self.tape.cut_off();
        }
        self.plan(workbench.front.scene_curves.as_deref());
    }

    fn shown(&mut self, ctx: &Context) {
        // So that there is something to see.
        if !std::mem::replace(&mut self.is_shown, true) {
            self.compute(ctx);
        }
    }

    fn act(
        &mut self,
        ctx: &Context,
        command: &UserCommand,
        workbench: &mut Workbench,
    ) -> ScreenReply {
        match command {
            UserCommand::SceneStart if self.verdict(workbench).is_ok() => {
                self.start(ctx);
                return ScreenReply::Show;
            }
            UserCommand::SceneStart => {}
            UserCommand::SceneStop => self.stop(),
            UserCommand::OpenScene => self.read(ctx),
            UserCommand::Chosen(PathPurpose::Scene, path) => {
                self.form.file = path.display().to_string();
                self.read(ctx);
            }
            UserCommand::ReplayScene(folder) => {
                self.tape.take(folder);
                return ScreenReply::Show;
            }
            _ => return ScreenReply::NotMine,
        }
        ScreenReply::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        self.compute(ctx);
    }

    fn cancel(&mut self) {
        self.ahead.cancel();
    }

    fn is_busy(&self) -> bool {
        self.ahead.state().is_some() || self.tape.is_busy() || self.is_running()
    }

    fn running(&self) -> Option<&'static str> {
        self.is_running().then_some("the scene runs")
    }

    fn stop(&mut self) {
        if let Some(live) = self.touch.as_mut().and_then(LiveScene::stop) {
            self.tape.end(move || live.stop().and_then(recorded));
        }
    }

    fn close(&mut self) {
        self.stop();
        self.tape.settle();
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let can_stop = match self.is_running() {
            true => Ok(()),
            false => Err("the scene does not run".to_owned()),
        };
        let can_start = self.verdict(workbench);
        vec![
            PaletteAction::new("Start the scene", "", UserCommand::SceneStart).if_ok(can_start),
            PaletteAction::new("Stop the scene", "", UserCommand::SceneStop).if_ok(can_stop),
        ]
    }
}
