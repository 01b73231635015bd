//! The start page: where a person begins who has no session yet. Nothing on it moves a rig.

use super::library;
use super::screen::{
    Commands, PaletteAction, Reaction, Screen, ScreenEntry, Sizes, UiCommand, Workbench,
};
use crate::shell::panels::frame;
use crate::widgets::{
    NamedControl, alarm_ui, placeholder_ui, progress_ui, quiet_ui, require, section_ui,
    sentence_ui, steady, tokens_of,
};
use crate::workers::{BackgroundTask, Job, PathPurpose};
use eframe::egui::text::LayoutJob;
use eframe::egui::{
    Align, Button, CentralPanel, Context, FontSelection, RichText, Role, ScrollArea, Style, Ui,
    WidgetInfo, vec2,
};
use palpate_analysis::demonstration_library::{has_no_session, record_demonstration};
use palpate_analysis::progress::Progress;
use palpate_analysis::window_requests::WorkbenchRequest;
use palpate_drivers::rig_search::{FoundPort, FoundRigFile, FoundRigs, find_rigs};
use palpate_runner::demonstration::DEMONSTRATION_RUNS;
use palpate_runner::driver_clock;
use std::path::{Path, PathBuf};

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Start page",
    icon: lucide_icons::Icon::House,
    purpose: "simulated rig, search for a rig, recorded sessions",
    key: None,
    open: |workbench| Box::new(StartPage::new(workbench.library.clone())),
};

/// Folder of the library in which rig files are found.
const RIGS_FOLDER: &str = "rigs";
/// Width of the column in points.
const WIDTH: f32 = 680.0;
const CHOICE_HEIGHT: f32 = 74.0;

const FILL: &str = "Fill the library with twelve simulated sessions";
const _: () = assert!(DEMONSTRATION_RUNS.len() == 12, "the button says twelve");

const SIMULATED: (&str, &str) = (
    "Simulated rig",
    "Axis, load cell and tissue are simulated: try everything, nothing can be damaged.",
);
const FIND: (&str, &str) = (
    "Find my rig",
    "Reads rig files and asks every serial port which device is there. An Arduino restarts.",
);
const OPEN: (&str, &str) =
    ("Open a session", "Choose the folder of a recorded session. The review screen shows it.");

pub struct StartPage {
    library: Result<PathBuf, String>,
    search: BackgroundTask<FoundRigs>,
    connection: Job<Result<WorkbenchRequest, String>>,
    /// The rig that is being opened, in words.
    connecting: String,
    /// Why the last rig was not connected.
    refusal: Option<String>,
    fill: BackgroundTask<()>,
    /// Whether the library has no session, as far as is known.
    is_empty: Option<bool>,
    emptiness: Job<bool>,
    /// It was shown in the last frame.
    was_shown: bool,
    is_back: bool,
}

impl StartPage {
    fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            search: BackgroundTask::default(),
            connection: Job::default(),
            connecting: String::new(),
            refusal: None,
            fill: BackgroundTask::default(),
            is_empty: None,
            emptiness: Job::default(),
            was_shown: false,
            is_back: true,
        }
    }

    /// The rigs that the last search found.
    pub fn found(&self) -> Option<&FoundRigs> {
        self.search.answer()?.as_ref().ok()
    }

    fn search_verdict(&self, workbench: &Workbench) -> Result<(), String> {
        workbench.free_verdict()?;
        let rig = &workbench.snapshot.rig.description.name;
        // A port in use must not be opened a second time: some devices restart then.
        let words = format!("the rig {rig} is connected; take the simulated rig first");
        require(workbench.is_simulated, words)?;
        require(!self.search.is_busy(), "the search is in progress")
    }

    fn connect_verdict(&self, workbench: &Workbench) -> Result<(), String> {
        workbench.free_verdict()?;
        require(workbench.open_rig.is_some(), "this window cannot open another rig")?;
        require(!self.connection.is_busy(), format!("connecting {}", self.connecting))
    }

    fn fill_verdict(&self) -> Result<(), String> {
        self.library.as_ref().map_err(Clone::clone)?;
        require(!self.fill.is_busy(), "the sessions are being recorded")?;
        match self.is_empty {
            Some(true) => Ok(()),
            Some(false) => Err("the library has sessions already".into()),
            None => Err("reading the library".into()),
        }
    }

    fn find(&mut self, ctx: &Context, workbench: &Workbench) {
        if self.search_verdict(workbench).is_err() {
            return;
        }
        let list_ports = workbench.list_ports;
        let own = self.library.iter().map(|library| library.join(RIGS_FOLDER));
        let folders: Vec<PathBuf> = own.chain(std::env::current_dir()).collect();
        self.search.start("rig-search", ctx, move |progress| {
            let ports = list_ports().map_err(|err| err.to_string())?;
            let report = |done: usize, of: usize, what: &str| progress.report(done, of, what);
            Ok(find_rigs(&folders, ports, &driver_clock(), &report))
        });
    }

    /// Opens a rig on a thread of its own; its window takes it when it is open.
    fn connect(&mut self, name: &str, ctx: &Context, workbench: &Workbench) {
        let (Some(open), Ok(())) = (workbench.open_rig.clone(), self.connect_verdict(workbench))
        else {
            return;
        };
        self.refusal = None;
        self.connecting = name.to_owned();
        let name = name.to_owned();
        if let Err(err) = self.connection.start("rig-opening", ctx, move || open(&name)) {
            self.refusal = Some(format!("the rig cannot be opened: {err}"));
        }
    }

    fn fill(&mut self, ctx: &Context) {
        let (Ok(library), Ok(())) = (self.library.clone(), self.fill_verdict()) else { return };
        self.fill.start("demonstration", ctx, move |progress| {
            let recorded = record_demonstration(&library, progress);
            recorded.map(|_| ()).map_err(|err| err.to_string())
        });
    }

    fn choices_ui(&self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        let simulated = match workbench.is_simulated {
            true => Ok(()),
            false => self.connect_verdict(workbench),
        };
        for (choice, command, verdict) in [
            (SIMULATED, UiCommand::TakeSimulatedRig, simulated),
            (FIND, UiCommand::FindRig, self.search_verdict(workbench)),
            (OPEN, UiCommand::Choose(PathPurpose::Opened), Ok(())),
        ] {
            if choice_ui(ui, choice, &verdict) {
                commands.push(command);
            }
            ui.add_space(8.0);
        }
        let verdict = self.fill_verdict();
        ui.horizontal_wrapped(|ui| {
            if ui.add_enabled(verdict.is_ok(), Button::new(FILL)).named(FILL).clicked() {
                commands.push(UiCommand::FillLibrary);
            }
            match &verdict {
                Ok(()) => quiet_ui(
                    ui,
                    "gives the screens Library, Review, Models and Trade something to show",
                ),
                Err(reason) => quiet_ui(ui, reason),
            }
        });
    }

    fn work_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        if let Some(state) = self.fill.state() {
            section_ui(ui, "Simulated sessions");
            if progress_ui(ui, &state, "Cancel the recording") {
                self.fill.cancel();
            }
        } else if let Some(answer) = self.fill.answer() {
            section_ui(ui, "Simulated sessions");
            match answer {
                Ok(()) => {
                    sentence_ui(ui, "Twelve sessions were recorded; the library has them.");
                    if ui.button("Show the library").named("Show the library").clicked() {
                        commands.push(UiCommand::Show(library::SCREEN.name));
                    }
                }
                Err(reason) => alarm_ui(ui, reason),
            }
        }
        if self.connection.is_busy() {
            section_ui(ui, "Connection");
            placeholder_ui(ui, format!("connecting {}; nothing moves", self.connecting));
        } else if let Some(reason) = &self.refusal {
            section_ui(ui, "Connection");
            alarm_ui(ui, reason);
        }
    }

    fn found_ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        if let Some(state) = self.search.state() {
            section_ui(ui, "Rigs");
            if progress_ui(ui, &state, "Cancel the search") {
                self.search.cancel();
            }
            return;
        }
        let found = match self.search.answer() {
            None => return,
            Some(Err(reason)) => {
                section_ui(ui, "Rigs");
                return alarm_ui(ui, reason);
            }
            Some(Ok(found)) => found,
        };
        section_ui(ui, "Rigs");
        let verdict = self.connect_verdict(workbench);
        for file in &found.files {
            file_ui(ui, file, &verdict, commands);
        }
        for one in &found.ports {
            port_ui(ui, one, &found.files);
        }
        if found.files.is_empty() {
            sentence_ui(ui, nothing_words(found, self.library.as_deref().ok()));
        }
        ui.horizontal_wrapped(|ui| {
            let button = Button::new("Choose a rig file...");
            if ui.add_enabled(verdict.is_ok(), button).named("Choose a rig file").clicked() {
                commands.push(UiCommand::Choose(PathPurpose::Rig));
            }
            if let Err(reason) = &verdict {
                quiet_ui(ui, reason);
            }
        });
    }
}

/// What to do where the search found no rig file.
fn nothing_words(found: &FoundRigs, library: Option<&Path>) -> String {
    let folder = library.map_or_else(
        || "the folder in which palpate was started".to_owned(),
        |library| library.join(RIGS_FOLDER).display().to_string(),
    );
    let first = match found.ports.is_empty() {
        true => {
            "No rig file and no serial port was found. Check the cable and the rig's power, then search again."
        }
        false => {
            "No rig file was found. It tells palpate what no device can report, such as travel and speed."
        }
    };
    format!(
        "{first} Write a rig file as in the guide, 'A rig on wires', and put it into {folder}. A controller on a network needs one too."
    )
}

/// A large button of two lines; true when it is pressed.
fn choice_ui(ui: &mut Ui, (name, words): (&str, &str), verdict: &Result<(), String>) -> bool {
    let tokens = tokens_of(ui);
    let is_possible = verdict.is_ok();
    let ink = if is_possible { tokens.text } else { tokens.text_quiet };
    let second = verdict.as_ref().err().map_or(words, String::as_str);
    let mut text = LayoutJob::default();
    let style: &Style = ui.style();
    for line in [
        RichText::new(format!("{name}\n")).size(18.0).strong().color(ink),
        RichText::new(second).color(tokens.text_quiet),
    ] {
        line.append_to(&mut text, style, FontSelection::Default, Align::LEFT);
    }
    let size = vec2(ui.available_width(), CHOICE_HEIGHT);
    let button = Button::new(text).min_size(size).wrap();
    steady(ui, name, |ui| {
        ui.spacing_mut().button_padding.x = 18.0;
        let response = ui.add_enabled(is_possible, button);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, is_possible, name));
        response.named(name).clicked()
    })
}

fn file_ui(
    ui: &mut Ui,
    file: &FoundRigFile,
    verdict: &Result<(), String>,
    commands: &mut Commands,
) {
    let name = file.path.file_name().unwrap_or_default().to_string_lossy();
    match &file.places {
        Ok(places) => {
            ui.horizontal_wrapped(|ui| {
                let words = format!("Connect {name}");
                let button = Button::new(&words).min_size(vec2(170.0, 34.0));
                if ui.add_enabled(verdict.is_ok(), button).named(&words).clicked() {
                    commands.push(UiCommand::ConnectRig(file.path.clone()));
                }
                let places: Vec<String> = places.iter().map(ToString::to_string).collect();
                ui.label(places.join(", "));
                quiet_ui(ui, file.path.display().to_string());
            });
        }
        Err(mistakes) => alarm_ui(ui, mistakes),
    }
    ui.add_space(4.0);
}

fn port_ui(ui: &mut Ui, found: &FoundPort, files: &[FoundRigFile]) {
    let FoundPort { port, device } = found;
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(&port.name).strong());
        ui.label(&port.description);
    });
    match device {
        Ok(device) => sentence_ui(ui, device.to_string()),
        Err(reason) => alarm_ui(ui, reason),
    }
    let places = files.iter().filter_map(|file| file.places.as_ref().ok()).flatten();
    let is_named = places.into_iter().any(|place| place.to_string().starts_with(&port.name));
    if let (Ok(Some(word)), false) = (device.as_ref().map(|device| device.device()), is_named) {
        quiet_ui(ui, format!("no rig file names this port; one begins with device = \"{word}\""));
    }
    ui.add_space(4.0);
}

impl Screen for StartPage {
    fn left_ui(&mut self, _: &mut Ui, _: &mut Workbench, _: &mut Commands) {}

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        ScrollArea::vertical().id_salt("start page").auto_shrink(false).show(ui, |ui| {
            let width = WIDTH.min(ui.available_width());
            let margin = (ui.available_width() - width) / 2.0;
            ui.horizontal_top(|ui| {
                ui.add_space(margin);
                ui.vertical(|ui| {
                    ui.set_width(width);
                    ui.add_space(24.0);
                    ui.label(RichText::new("Three ways to begin").size(22.0).strong());
                    placeholder_ui(
                        ui,
                        "Nothing moves before you start a run. Ctrl+K and 'start page' leads back here.",
                    );
                    ui.add_space(12.0);
                    self.choices_ui(ui, workbench, commands);
                    self.work_ui(ui, commands);
                    self.found_ui(ui, workbench, commands);
                });
            });
        });
    }

    fn ui(
        &mut self,
        ui: &mut Ui,
        _sizes: &mut Sizes,
        workbench: &mut Workbench,
        commands: &mut Commands,
    ) {
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.middle_ui(ui, workbench, commands));
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.is_back |= !std::mem::take(&mut self.was_shown);
        self.search.poll();
        if self.fill.poll() {
            self.is_back = true;
        }
        match self.connection.poll() {
            Some(Ok(request)) => workbench.next_rig = Some(request),
            Some(Err(reason)) => self.refusal = Some(reason),
            None => {}
        }
        if let Some(is_empty) = self.emptiness.poll() {
            self.is_empty = Some(is_empty);
            ctx.request_repaint();
        }
    }

    fn shown(&mut self, ctx: &Context) {
        self.was_shown = true;
        if let (true, Ok(library)) = (std::mem::take(&mut self.is_back), self.library.clone()) {
            // Without a thread the button stays off.
            let _ = self.emptiness.start("library", ctx, move || has_no_session(&library));
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::TakeSimulatedRig => self.connect("sim", ctx, workbench),
            UiCommand::FindRig => self.find(ctx, workbench),
            UiCommand::ConnectRig(file) | UiCommand::Chosen(PathPurpose::Rig, file) => {
                self.connect(&file.to_string_lossy(), ctx, workbench);
            }
            UiCommand::FillLibrary => self.fill(ctx),
            _ => return Reaction::NotMine,
        }
        Reaction::Show
    }

    fn work(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.find(ctx, workbench);
    }

    fn cancel(&mut self) {
        self.search.cancel();
        self.fill.cancel();
    }

    fn is_busy(&self) -> bool {
        self.fill.is_busy()
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        vec![
            PaletteAction::new("Take the simulated rig", "", UiCommand::TakeSimulatedRig),
            PaletteAction::new("Find my rig", "", UiCommand::FindRig)
                .if_ok(self.search_verdict(workbench)),
            PaletteAction::new("Connect a rig file", "", UiCommand::Choose(PathPurpose::Rig))
                .if_ok(self.connect_verdict(workbench)),
            PaletteAction::new("Open a session", "", UiCommand::Choose(PathPurpose::Opened)),
            PaletteAction::new(FILL, "", UiCommand::FillLibrary).if_ok(self.fill_verdict()),
        ]
    }
}
