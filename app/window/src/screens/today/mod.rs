//! The page a day begins on: the next specimen and the queue behind it, the rig's state, and what was measured today.

mod facts;
mod queue;

use super::screen::{Commands, PaletteAction, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::widgets::require;
use crate::workers::queue_desk::QueueWork;
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Ui};
use palpate_analysis::today::{TodayFacts, read_today};
use palpate_runner::wall_now;
use queue::QueueForm;
use std::path::PathBuf;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Today",
    icon: lucide_icons::Icon::Sun,
    purpose: "the next specimen, the queue, and the state of the rig",
    key: Some(Key::T),
    open: |workbench| Box::new(TodayScreen::new(workbench)),
};

pub struct TodayScreen {
    library: Result<PathBuf, String>,
    rig: String,
    facts: BackgroundTask<TodayFacts>,
    form: QueueForm,
    /// It was shown in the last frame.
    was_shown: bool,
    /// The facts are to be read again.
    is_stale: bool,
    /// The queue is to be read again: the command line may have changed it.
    is_queue_stale: bool,
}

impl TodayScreen {
    fn new(workbench: &Workbench) -> Self {
        Self {
            library: workbench.library.clone(),
            rig: workbench.snapshot.rig.description.name.clone(),
            facts: BackgroundTask::default(),
            form: QueueForm::default(),
            was_shown: false,
            is_stale: true,
            // Once at the beginning, so that the screen of the run knows it too.
            is_queue_stale: true,
        }
    }

    fn read(&mut self, ctx: &Context) {
        let (library, rig) = (self.library.clone(), self.rig.clone());
        self.facts.start("today", ctx, move |progress| {
            read_today(&library?, &rig, wall_now().into(), progress)
        });
    }

    /// Whether the next specimen can be taken now, or why not.
    fn next_verdict(workbench: &Workbench) -> Result<u32, String> {
        workbench.free_verdict()?;
        let queue = workbench.queue.queue();
        if let Some(open) = queue.open_run() {
            return Err(format!("the run of {} has no verdict yet", open.wanted.specimen));
        }
        queue.next().map(|next| next.number).ok_or_else(|| "no specimen waits".into())
    }
}

impl Screen for TodayScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        self.form.ui(ui, workbench, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        let verdict = Self::next_verdict(workbench);
        self.form.queue_ui(ui, workbench, &verdict, commands);
    }

    fn right_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        facts::facts_ui(ui, workbench, &self.facts, commands);
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.is_stale |= !std::mem::take(&mut self.was_shown);
        self.facts.poll();
        self.form.poll(workbench);
        if std::mem::take(&mut self.is_queue_stale) && self.library.is_ok() {
            workbench.queue.ask(QueueWork::Read, "", "");
            ctx.request_repaint();
        }
    }

    fn shown(&mut self, ctx: &Context) {
        self.was_shown = true;
        if std::mem::take(&mut self.is_stale) {
            self.read(ctx);
            self.is_queue_stale = true;
            self.form.has_come();
        }
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Chosen(PathPurpose::Specimens, path) => {
                let protocol = workbench.form.specimen_protocol();
                let by = workbench.form.label_text("operator").to_owned();
                workbench.queue.ask(QueueWork::AddTable(path.clone(), protocol), &by, "");
                Reaction::Show
            }
            _ => Reaction::NotMine,
        }
    }

    fn work(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.read(ctx);
        workbench.queue.ask(QueueWork::Read, "", "");
    }

    fn cancel(&mut self) {
        self.facts.cancel();
    }

    fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let verdict = Self::next_verdict(workbench);
        let number = verdict.clone().unwrap_or_default();
        let is_free = require(!workbench.queue.is_busy(), "the queue is being written");
        vec![
            PaletteAction::new("Measure the next specimen", "", UiCommand::TakeSpecimen(number))
                .if_ok(verdict.map(|_| ())),
            PaletteAction::new(
                "Add a table of specimens",
                "",
                UiCommand::Choose(PathPurpose::Specimens),
            )
            .if_ok(is_free),
        ]
    }
}
