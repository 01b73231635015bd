//! The run screen: rig and protocol on the left, what is expected or measured in the middle, what is known on the right.

use super::after_stop::after_stop_ui;
use super::approach::Approach;
use super::form::CheckedPlan;
use super::live_panel::findings_ui;
use super::protocol_panel::{ProtocolFacts, protocol_ui, start_ui};
use super::rig_panel::rig_ui;
use super::run_panes::{Chooser, RunPane, expected_ui, first_view, is_offered, views_ui};
use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use super::weighing::weighing_ui;
use super::{result, today};
use crate::plots::course::CourseLimits;
use crate::widgets::require;
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{CentralPanel, Context, Frame, Key, Margin, Panel, ScrollArea, Ui};
use palpate_analysis::daily::{DAILY_CHECK, needs_daily_check};
use palpate_protocols::file::BUILT_IN;
use palpate_runner::{RunRequest, wall_now};
use palpate_sessions::recover::recover_library;
use std::path::Path;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Run",
    icon: lucide_icons::Icon::Play,
    purpose: "run a protocol and watch it",
    key: Some(Key::Num3),
    open: |_| Box::new(RunScreen::new()),
};

/// The screen's state. What runs belongs to the runner.
pub struct RunScreen {
    chooser: Chooser,
    middle: RunPane,
    approach: Approach,
    /// Sessions recovered after a crash, a line each.
    recovery: BackgroundTask<Vec<String>>,
    is_recovery_begun: bool,
    /// Where sessions go if no folder is chosen, or why nowhere.
    library: Result<String, String>,
}

impl RunScreen {
    fn new() -> Self {
        Self {
            chooser: Chooser::default(),
            middle: RunPane::default(),
            approach: Approach::default(),
            recovery: BackgroundTask::default(),
            is_recovery_begun: false,
            library: palpate_sessions::library_folder()
                .map(|path| path.display().to_string())
                .map_err(|err| err.to_string()),
        }
    }

    /// Takes a built-in protocol into the form, unless a run is in progress.
    fn take_protocol(&mut self, name: &str, workbench: &mut Workbench) {
        if !workbench.is_busy() {
            workbench.form.choose_built_in(name);
            self.middle = RunPane::Course;
        }
    }

    fn begin(
        &mut self,
        request: Option<RunRequest>,
        form_start: Option<[String; 2]>,
        workbench: &mut Workbench,
    ) {
        if let Some(request) = request {
            self.middle = first_view(&request.plan);
            workbench.set_next_run(request, form_start);
        }
    }

    /// Takes protocol and labels of a specimen in the queue into the form, and shows them.
    fn take_specimen(&mut self, number: u32, ctx: &Context, workbench: &mut Workbench) -> Reaction {
        let found = workbench.free_verdict().and_then(|()| workbench.queue.waiting(number));
        let item = match found {
            Ok(item) => item,
            Err(reason) => {
                workbench.queue.refusal = Some(reason);
                return Reaction::Done;
            }
        };
        workbench.queue.refusal = None;
        workbench.form.take_labels(&item.wanted, workbench.queue.queue().is_blinded);
        let protocol = &item.wanted.protocol;
        // Values that were typed for it stay: the queue says that it takes the protocol as it is on Run.
        if workbench.form.source_name() == *protocol && workbench.form.protocol.is_ok() {
            self.middle = RunPane::Course;
            return Reaction::Show;
        }
        match BUILT_IN.iter().find(|(name, _)| name == protocol) {
            Some((name, _)) => self.take_protocol(name, workbench),
            None => self.read(Some(Path::new(protocol)), ctx, workbench),
        }
        Reaction::Show
    }

    fn read(&mut self, path: Option<&Path>, ctx: &Context, workbench: &mut Workbench) {
        let library = workbench.library.as_deref().ok();
        let begun = match path {
            Some(path) => self.chooser.read(path, library, ctx),
            None => self.chooser.read_typed(library, ctx),
        };
        if let Err(err) = begun {
            workbench.refusal = Some(format!("the protocol cannot be read: {err}"));
        }
    }

    fn facts(&self) -> ProtocolFacts<'_> {
        let recovered = match self.recovery.answer() {
            None => &[],
            Some(Ok(lines)) => lines.as_slice(),
            Some(Err(reason)) => std::slice::from_ref(reason),
        };
        ProtocolFacts { library: &self.library, recovered }
    }
}

/// Refuses a start, on the page on which the run that has no verdict yet can be judged.
fn refuse(workbench: &mut Workbench, reason: String) -> Reaction {
    if workbench.queue.queue().open_run().is_none() {
        workbench.refusal = Some(reason);
        return Reaction::Show;
    }
    if workbench.is_open_run_shown() {
        workbench.refusal = Some(reason);
        return Reaction::ShowOther(result::SCREEN.name);
    }
    workbench.queue.refusal = Some(reason);
    Reaction::ShowOther(today::SCREEN.name)
}

impl Screen for RunScreen {
    fn has_own_scroll(&self) -> bool {
        // The start strip on the left never scrolls away.
        true
    }

    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        Panel::bottom("start")
            .resizable(false)
            .frame(Frame::new().inner_margin(Margin::symmetric(0, 6)))
            .show(ui, |ui| start_ui(ui, workbench, commands));
        CentralPanel::no_frame().show(ui, |ui| {
            ScrollArea::vertical().id_salt("rig_and_protocol").auto_shrink(false).show(ui, |ui| {
                protocol_ui(ui, workbench, &self.facts(), commands);
                rig_ui(ui, &workbench.snapshot, &workbench.ports, commands);
            });
        });
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        let run = workbench.measured_run();
        views_ui(ui, self.middle, run, commands);
        let limits = &workbench.bench.limits;
        match (self.middle, run) {
            (RunPane::Weighing, Some(run)) => {
                let signal = workbench.snapshot.rig.reading.map(|reading| reading.volts);
                weighing_ui(ui, run, signal, &workbench.bench);
            }
            (RunPane::Approach, Some(run)) => self.approach.ui(ui, run),
            (RunPane::Weighing | RunPane::Approach, None) => {}
            (RunPane::Choose, _) => self.chooser.ui(ui, workbench, commands),
            (RunPane::Course, _) => {
                let checked = workbench.form.checked();
                let tight = |checked: &CheckedPlan| checked.plan.limits.tighten(*limits);
                let limits = CourseLimits {
                    force: checked.map_or(*limits, tight).force_max,
                    speed: workbench.snapshot.rig.description.speed_max,
                };
                expected_ui(ui, checked, limits);
            }
            (RunPane::Measured, _) => workbench.plots_ui(ui),
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        if let Some(run) = workbench.run() {
            after_stop_ui(ui, run, commands);
        }
        // Of the run whose curves are drawn: a move by hand leaves both as they are.
        let (run, latest) = (workbench.measured_run(), &workbench.latest_run);
        findings_ui(ui, &workbench.snapshot.rig, run, latest.plots().cycles());
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        if !std::mem::replace(&mut self.is_recovery_begun, true)
            && let Ok(library) = workbench.library.clone()
        {
            self.recovery.start("recovery", ctx, move |_| {
                Ok(recover_library(&library, env!("CARGO_PKG_VERSION"), wall_now().into()))
            });
        }
        self.recovery.poll();
        // The form keeps the protocol of a run in progress.
        if let Some((path, text)) = self.chooser.poll()
            && !workbench.is_busy()
        {
            workbench.form.choose_file(&path, text);
            self.middle = match workbench.form.protocol {
                Ok(_) => RunPane::Course,
                Err(_) => RunPane::Choose,
            };
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Start => {
                let specimen = workbench.form.specimen().to_owned();
                let protocol = workbench.form.source_name();
                let request = workbench.ready_run();
                let form_start = Some(workbench.form.next_start());
                let queue = &mut workbench.queue;
                // The queue has no say in what touches no specimen.
                let mut may_start = |request: RunRequest| match needs_daily_check(&request.plan) {
                    true => queue.start(&specimen, &protocol).map(|()| request),
                    false => {
                        queue.cancel_start();
                        Ok(request)
                    }
                };
                match request.map(&mut may_start) {
                    Some(Err(reason)) => return refuse(workbench, reason),
                    request => self.begin(request.and_then(Result::ok), form_start, workbench),
                }
                // What moves is to be seen.
                return Reaction::Show;
            }
            UiCommand::ManualMove(manual) => {
                workbench.queue.cancel_start();
                let request = workbench.manual_run(manual);
                self.begin(request, None, workbench);
            }
            UiCommand::View(view) => {
                if *view == RunPane::Choose {
                    self.chooser.list_locked(workbench.library.clone().ok(), ctx);
                }
                self.middle = *view;
                return Reaction::Show;
            }
            UiCommand::TakeProtocol(name) => {
                self.take_protocol(name, workbench);
                return Reaction::Show;
            }
            UiCommand::TakeSpecimen(number) => {
                return self.take_specimen(*number, ctx, workbench);
            }
            UiCommand::MeasureCalibration => {
                self.take_protocol("load-cell-calibration", workbench);
                workbench.form.set_label("specimen", "");
                return Reaction::Show;
            }
            UiCommand::CheckRig => {
                self.take_protocol(DAILY_CHECK, workbench);
                workbench.form.set_label("specimen", "");
                return Reaction::Show;
            }
            UiCommand::OpenProtocol => self.read(None, ctx, workbench),
            UiCommand::Chosen(PathPurpose::Protocol, path) => self.read(Some(path), ctx, workbench),
            UiCommand::Chosen(PathPurpose::NewSessions, folder) => {
                workbench.form.folder = folder.display().to_string();
            }
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let views = [
            (RunPane::Choose, "View: protocols"),
            (RunPane::Course, "View: expected course"),
            (RunPane::Measured, "View: measured"),
            (RunPane::Weighing, "View: weights"),
            (RunPane::Approach, "View: surface search"),
        ];
        let mut actions: Vec<PaletteAction> = views
            .into_iter()
            .map(|(view, name)| {
                let is_offered = is_offered(view, workbench.measured_run());
                let verdict = require(is_offered, "the run does not have this view");
                PaletteAction::new(name, "", UiCommand::View(view)).if_ok(verdict)
            })
            .collect();
        let is_free = workbench.free_verdict();
        actions.extend(BUILT_IN.iter().map(|(name, _)| {
            let words = format!("Protocol {name}");
            PaletteAction::new(words, "", UiCommand::TakeProtocol(name)).if_ok(is_free.clone())
        }));
        let check = PaletteAction::new("Run the daily check", "", UiCommand::CheckRig);
        actions.push(check.if_ok(is_free));
        actions.push(PaletteAction::new(
            "Open a protocol file",
            "",
            UiCommand::Choose(PathPurpose::Protocol),
        ));
        actions
    }
}
