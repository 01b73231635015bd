//! A piece of tissue in three dimensions that is pressed with the pointer, the keys or along a path, and the force on the
//! hand.

mod form;
mod middle;
mod plan;
mod right;

use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use super::tape::{TapePanel, loop_button_ui};
use crate::scene::hand::ToolTarget;
use crate::scene::look::SceneLook;
use crate::scene::view::SceneView;
use crate::widgets::{alarm_ui, quiet_ui, require, section_ui, small_ui, work_ui};
use crate::workers::live_scene::{
    ComputedPath, LiveScene, SceneLead, compute_path, simulated_loop,
};
use crate::workers::scene_tissue::{MeshTissue, SceneInstant, TissueScene};
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Ui};
use form::{HandChoice, SceneForm};
use middle::PictureSource;
use palpate_analysis::progress::Progress;
use palpate_analysis::report::scene::device_lines;
use palpate_analysis::scene::{check_scene, read_scene, replay};
use palpate_analysis::scene_device::{DeviceReport, OpenDevice, open_device};
use palpate_analysis::tick_replay::ReplayResult;
use palpate_haptics::margin::LoopDevice;
use palpate_haptics::scene::{HandPose, SceneSettings};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::scene::{COLUMNS, SENSED_COLUMNS, SceneRecorder};
use palpate_runner::haptics::scene_file::SceneFile;
use plan::PlannedScene;
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// Why nothing else is started meanwhile.
const OPENING: &str = "the device of the scene is being opened";

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Scene",
    icon: lucide_icons::Icon::Box,
    purpose: "press into a piece of tissue and see it deform",
    // Every number is taken: Ctrl+0 is the usual size of text.
    key: Some(Key::E),
    open: |_| Box::new(SceneScreen::default()),
};

pub struct SceneScreen {
    form: SceneForm,
    reading: BackgroundTask<ReadScene>,
    /// The mesh of the form's scene; `None` where its tissue is a square.
    mesh: Option<Arc<MeshTissue>>,
    computed: BackgroundTask<ComputedPath>,
    /// A device that is being opened for the scene of the form.
    opening: BackgroundTask<(OpenDevice, DeviceReport)>,
    /// A device without a button that is open, without force, until a person has read the report and starts the scene.
    opened: Option<(OpenDevice, DeviceReport)>,
    is_shown: bool,
    live: Option<LiveScene>,
    /// What it is made of.
    live_file: SceneFile,
    refusal: Option<String>,
    tape: TapePanel,
    planned: Option<PlannedScene>,
    side: PictureSource,
    view: SceneView,
    /// What the view was made for.
    viewed: ViewedTissue,
}

/// A scene file that was read, with its mesh.
struct ReadScene {
    file: SceneFile,
    notes: Vec<String>,
    mesh: Option<MeshTissue>,
}

/// The tissue in the picture.
#[derive(Clone, Debug)]
enum ViewedTissue {
    /// Of this side in mm.
    Square(f64),
    Mesh(Arc<MeshTissue>),
}

impl ViewedTissue {
    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Square(one), Self::Square(other)) => one.to_bits() == other.to_bits(),
            (Self::Mesh(one), Self::Mesh(other)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }
}

/// What the numbers on the right are of.
struct SeenScene<'a> {
    settings: &'a SceneSettings,
    instant: &'a SceneInstant,
    /// Of each material.
    bodies: Vec<ModifiedKelvin>,
    device: LoopDevice,
}

impl Default for SceneScreen {
    fn default() -> Self {
        let form = SceneForm::default();
        let side = SceneFile::default().side_mm;
        Self {
            form,
            reading: BackgroundTask::default(),
            mesh: None,
            computed: BackgroundTask::default(),
            opening: BackgroundTask::default(),
            opened: None,
            is_shown: false,
            live: None,
            live_file: SceneFile::default(),
            refusal: None,
            tape: TapePanel::default(),
            planned: None,
            side: PictureSource::Computed,
            view: SceneView::of(ToolTarget::above([side; 2])),
            viewed: ViewedTissue::Square(side),
        }
    }
}

impl SceneScreen {
    pub fn is_running(&self) -> bool {
        self.live.as_ref().is_some_and(LiveScene::is_running)
    }

    /// Whether the settings of the scene must stay: it runs, or a device is open for it.
    fn is_settled(&self) -> bool {
        self.is_running() || self.opening.is_busy() || self.opened.is_some()
    }

    /// The scene that runs or ran last.
    pub fn live_scene(&self) -> Option<&LiveScene> {
        self.live.as_ref()
    }

    /// The path that was computed last.
    pub fn computed_path(&self) -> Option<&Result<ComputedPath, String>> {
        self.computed.answer()
    }

    /// Whether the scene of the form can start, or why not.
    fn verdict(&self, workbench: &Workbench) -> Result<(), String> {
        workbench.loop_verdict(SCREEN.name)?;
        self.compute_verdict()?;
        match self.form.hand {
            HandChoice::Device => self.form.device().map(|_| ()),
            HandChoice::Path(_) | HandChoice::Pointer => Ok(()),
        }
    }

    fn compute_verdict(&self) -> Result<(), String> {
        require(!self.is_running(), "the scene runs")?;
        require(!self.opening.is_busy(), OPENING)?;
        require(!self.reading.is_busy(), "the scene file is being read")?;
        self.form.settings().map(|_| ())
    }

    pub fn replayed(&self) -> Option<&Result<ReplayResult, String>> {
        self.tape.replayed()
    }

    /// Reads the file that is named, on a thread: a body may have to be fitted.
    fn read(&mut self, ctx: &Context) {
        if self.is_settled() {
            return;
        }
        let named = self.form.file.trim().to_owned();
        self.reading.start("scene-read", ctx, move |_| {
            let (file, notes) = read_scene((!named.is_empty()).then_some(Path::new(&named)))?;
            let mesh = MeshTissue::of(&file)?;
            Ok(ReadScene { file, notes, mesh })
        });
    }

    /// Computes the scene of the form along its path.
    fn compute(&mut self, ctx: &Context) {
        let Ok(file) = self.form.scene_file() else { return };
        let scene = match TissueScene::of(&file, self.mesh.as_deref()) {
            Ok(scene) => scene,
            Err(reason) => {
                self.refusal = Some(reason);
                return;
            }
        };
        self.look_at(&scene);
        self.side = PictureSource::Computed;
        let path = self.form.path();
        self.computed.start("scene-path", ctx, move |progress| {
            compute_path(scene, path, &mut |share| progress.share(share, "the path"))
        });
    }

    /// Starts the scene, unless it runs, and records it if a folder is named. A device is opened first.
    fn start(&mut self, ctx: &Context) {
        if self.is_running() {
            return;
        }
        if let Some((device, report)) = self.opened.take() {
            self.begin(ctx, SceneLead::Device(device, Box::new(report)));
            return;
        }
        match self.form.hand {
            HandChoice::Path(path) => self.begin(ctx, SceneLead::Path(path)),
            HandChoice::Pointer => self.begin(ctx, SceneLead::Pointer),
            HandChoice::Device => {
                let wanted = (self.form.device(), self.form.scene_file());
                let (Ok(choice), Ok(file)) = wanted else { return };
                self.refusal = None;
                self.opening.start("scene-device", ctx, move |_| {
                    open_device(&choice, &check_scene(&file)?)
                });
            }
        }
    }

    /// Starts the scene with what leads it.
    fn begin(&mut self, ctx: &Context, lead: SceneLead) {
        let started = self.form.scene_file().and_then(|mut file| {
            let columns = match &lead {
                SceneLead::Path(_) | SceneLead::Pointer => COLUMNS,
                SceneLead::Device(open, _) => {
                    file.device = *open.device.settings();
                    SENSED_COLUMNS
                }
            };
            let scene = TissueScene::of(&file, self.mesh.as_deref())?;
            self.look_at(&scene);
            let text = file.text();
            let begin = |folder: &Path| SceneRecorder::start(folder, &text, columns);
            let recorder = self.tape.begin(ctx, begin)?;
            let live = LiveScene::start(scene, lead, recorder)?;
            Ok((live, file))
        });
        match started {
            Ok((live, file)) => {
                self.live = Some(live);
                self.live_file = file;
                self.side = PictureSource::Live;
                self.refusal = None;
            }
            Err(reason) => {
                self.refusal = Some(reason);
                self.tape.cut_off();
            }
        }
    }

    /// Looks at the tissue of a scene from the start, where it is not the one in the picture.
    fn look_at(&mut self, scene: &TissueScene) {
        let side_mm = scene.settings().side_mm;
        let tissue = self
            .mesh
            .as_ref()
            .map_or(ViewedTissue::Square(side_mm), |mesh| ViewedTissue::Mesh(Arc::clone(mesh)));
        if tissue.is(&self.viewed) {
            return;
        }
        self.view.take_tissue(match &tissue {
            ViewedTissue::Square(side_mm) => ToolTarget::above([*side_mm; 2]),
            ViewedTissue::Mesh(mesh) => {
                ToolTarget::over(Arc::clone(&mesh.read.mesh), scene.start())
            }
        });
        self.viewed = tissue;
    }

    fn bodies(&self, settings: &SceneSettings) -> Vec<ModifiedKelvin> {
        self.mesh.as_ref().map_or_else(|| vec![settings.body], |mesh| mesh.read.bodies.clone())
    }

    /// What is on the screen: the scene that runs or ran, or the computed path.
    fn seen(&self) -> Option<SeenScene<'_>> {
        match (self.side, &self.live, self.computed.answer()) {
            (PictureSource::Live, Some(live), _) => Some(SeenScene {
                settings: live.settings(),
                instant: live.moment(),
                bodies: self.bodies(live.settings()),
                device: live.loop_device(),
            }),
            (PictureSource::Computed, _, Some(Ok(computed))) => Some(SeenScene {
                settings: &computed.settings,
                instant: &computed.deepest,
                bodies: self.bodies(&computed.settings),
                device: simulated_loop(&computed.settings),
            }),
            _ => None,
        }
    }
}

impl Screen for SceneScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        // A running scene keeps its settings, and one whose device is being opened.
        let is_running = self.is_running() || self.opening.is_busy();
        let is_settled = self.is_settled();
        ui.add_enabled_ui(!is_settled, |ui| match self.form.ui(ui) {
            Some(form::FileAction::Dialog) => commands.push(UiCommand::Choose(PathPurpose::Scene)),
            Some(form::FileAction::Read) => commands.push(UiCommand::OpenScene),
            None => {}
        });
        if let Some(reason) = &self.refusal {
            alarm_ui(ui, reason);
        }
        ui.add_space(6.0);
        let verdict = self.compute_verdict();
        work_ui(ui, "Compute path  F6", &self.computed, &verdict, commands);
        section_ui(ui, "Touch");
        let both = [UiCommand::SceneStart, UiCommand::SceneStop];
        loop_button_ui(ui, "scene", is_running, &self.verdict(workbench), both, commands);
        let live = self.live.as_ref().filter(|live| live.is_running());
        let words = match (live.map(LiveScene::is_led), live.and_then(LiveScene::device)) {
            _ if self.opening.is_busy() => {
                "The device is being opened; its delay is measured with zero force."
            }
            _ if self.opened.is_some() => {
                "The device is open and gives no force. It has no button: read what follows, then start the scene. Esc closes the device."
            }
            (_, Some(_)) => {
                "The device moves the stylus. One with a grip gives a force while its button is pressed, one without from the start. F12 ends the scene."
            }
            (Some(true), None) => {
                "The path moves the hand; at its end the pointer and the keys take over."
            }
            (Some(false) | None, None) => {
                "In the picture: hold the left button to press, and turn the wheel to press deeper; drag with the right \
                 button to rotate, turn the wheel to zoom. Keys: arrows move, Page Down presses, Page Up lifts, Shift \
                 with arrows rotates, + and - zoom, Home resets the camera."
            }
        };
        quiet_ui(ui, words);
        if let Some((_, report)) = &self.opened {
            for line in device_lines(report) {
                small_ui(ui, line);
            }
        }
        section_ui(ui, "Picture");
        let side_mm = self.view.side_mm();
        self.view.look.ui(ui, side_mm);
        ui.add_enabled_ui(!is_settled, |ui| self.form.parts_ui(ui));
        self.plan_ui(ui, is_settled, commands);
        self.tape.ui(ui, is_running, replay);
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, _commands: &mut Commands) {
        self.draw_middle(ui, &mut workbench.graphics);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        self.draw_right(ui);
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.form.check();
        self.tape.poll();
        self.computed.poll();
        if self.reading.poll() {
            match self.reading.take_answer() {
                Some(Ok(ReadScene { file, notes, mesh })) => {
                    self.refusal = None;
                    self.computed = BackgroundTask::default();
                    // What ran on a mesh cannot be drawn on another.
                    if self.mesh.is_some() || mesh.is_some() {
                        self.live = None;
                    }
                    self.mesh = mesh.map(Arc::new);
                    self.form.fill(file, notes);
                    self.compute(ctx);
                }
                Some(Err(reason)) => self.refusal = Some(reason),
                None => {}
            }
        }
        if self.opening.poll() {
            match self.opening.take_answer() {
                Some(Ok((device, report))) if report.has_button => {
                    self.begin(ctx, SceneLead::Device(device, Box::new(report)));
                }
                Some(Ok(opened)) => self.opened = Some(opened),
                Some(Err(reason)) => self.refusal = Some(reason),
                None => {}
            }
        }
        let hand = HandPose { at: self.view.hand().at(), turn: self.view.hand().turn() };
        if let Some(Err(reason)) = self.live.as_mut().map(|live| live.poll(hand)) {
            self.refusal = Some(reason);
            self.tape.cut_off();
        }
        self.plan(workbench.front.scene_curves.as_deref());
    }

    fn shown(&mut self, ctx: &Context) {
        // An example is on the screen from the start.
        if !std::mem::replace(&mut self.is_shown, true) {
            self.compute(ctx);
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::SceneStart if self.verdict(workbench).is_ok() => {
                self.start(ctx);
                return Reaction::Show;
            }
            UiCommand::SceneStart => {}
            UiCommand::SceneStop => self.stop(),
            UiCommand::OpenScene => self.read(ctx),
            UiCommand::Chosen(PathPurpose::Scene, path) => {
                self.form.file = path.display().to_string();
                self.read(ctx);
            }
            UiCommand::ReplayScene(folder) => {
                self.tape.take(folder);
                return Reaction::Show;
            }
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        self.compute(ctx);
    }

    fn cancel(&mut self) {
        self.computed.cancel();
    }

    fn is_busy(&self) -> bool {
        self.computed.is_busy() || self.tape.is_busy() || self.is_settled()
    }

    fn running(&self) -> Option<&'static str> {
        match (self.opening.is_busy(), &self.opened) {
            (true, _) => Some(OPENING),
            (false, Some(_)) => Some("a device is open for the scene"),
            (false, None) => self.is_running().then_some("the scene runs"),
        }
    }

    fn stop(&mut self) {
        // A device that is still being opened is closed as soon as it is open.
        self.opening = BackgroundTask::default();
        self.opened = None;
        if let Some(live) = self.live.as_mut().and_then(LiveScene::stop) {
            self.tape.end(move || live.finish());
        }
    }

    fn close(&mut self) {
        self.stop();
        self.tape.settle();
    }

    fn layout(&self) -> Option<Value> {
        self.view.look.kept()
    }

    fn take_layout(&mut self, kept: &Value) {
        self.view.look = SceneLook::from_kept(kept);
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let can_stop = require(self.is_settled(), "the scene is not running");
        let can_start = self.verdict(workbench);
        vec![
            PaletteAction::new("Start the scene", "", UiCommand::SceneStart).if_ok(can_start),
            PaletteAction::new("Stop the scene", "", UiCommand::SceneStop).if_ok(can_stop),
        ]
    }
}
