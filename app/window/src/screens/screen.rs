//! What a screen is: the one way in which the window reaches each of them.

use super::table::SCREENS;
use crate::command::{CommandQueue, UserCommand};
use crate::shell::palette::PaletteAction;
use crate::shell::panels::{frame, side_ui};
use crate::shell::sizes::{PanelEdge, Sizes};
use crate::workbench::{Occupation, Workbench};
use eframe::egui::{CentralPanel, Context, Key, Ui};
use std::any::Any;

/// What the window knows of a screen before it is opened.
#[derive(Clone, Copy)]
pub struct ScreenEntry {
    /// Name on the rail.
    pub name: &'static str,
    /// What it is for, for the rail's hint.
    pub purpose: &'static str,
    /// The key that shows it, with Ctrl (Command on a Mac).
    pub key: Key,
    /// Makes it. What it reads from disk is read on a thread, once it is shown.
    pub open: fn(&Workbench) -> Box<dyn Screen>,
}

/// What a screen makes of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScreenReply {
    /// It is none of its own.
    NotMine,
    /// Done, or refused with its reason on the screen.
    Done,
    /// The same, and the screen is to be shown.
    Show,
}

/// What stands between the top bar and the event log.
///
/// A screen reaches the rig through [`Workbench`] and never holds a device; what takes its time is done by a worker,
/// whose answer [`Self::poll`] fetches.
pub trait Screen: Any {
    /// Draws what is asked for.
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue);

    /// Draws what it is about.
    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue);

    /// Draws what is known.
    fn right_ui(&mut self, _ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
    }

    /// Whether there is a panel on the right.
    fn has_right(&self) -> bool {
        true
    }

    /// Draws all of it.
    fn ui(
        &mut self,
        ui: &mut Ui,
        sizes: &mut Sizes,
        workbench: &mut Workbench,
        commands: &mut CommandQueue,
    ) {
        side_ui(ui, sizes, PanelEdge::Left, |ui| {
            self.left_ui(ui, workbench, commands);
        });
        if self.has_right() {
            side_ui(ui, sizes, PanelEdge::Right, |ui| {
                self.right_ui(ui, workbench, commands);
            });
        }
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.middle_ui(ui, workbench, commands));
    }

    /// Fetches what workers have answered, in every frame whatever is shown.
    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {}

    /// Called in every frame in which it is shown.
    fn shown(&mut self, _ctx: &Context) {}

    /// Does what was asked for, if it is for this screen.
    fn act(
        &mut self,
        _ctx: &Context,
        _command: &UserCommand,
        _workbench: &mut Workbench,
    ) -> ScreenReply {
        ScreenReply::NotMine
    }

    /// Begins the work of the screen (F6).
    fn work(&mut self, _ctx: &Context, _workbench: &mut Workbench) {}

    /// Ends it.
    fn cancel(&mut self) {}

    /// Whether times measured now would be disturbed.
    fn is_busy(&self) -> bool {
        false
    }

    /// A loop of its own that runs, in words. It is stopped with the rig, and before a run begins.
    fn running(&self) -> Option<&'static str> {
        None
    }

    /// Stops that loop.
    fn stop(&mut self) {}

    /// The window closes: what is recorded reaches the disk.
    fn close(&mut self) {}

    /// Whether somebody at the rig may look at live values without touching key or pointer.
    fn is_watched(&self) -> bool {
        false
    }

    /// What can be asked of it by name, and of the rest why not.
    fn actions(&self, _workbench: &Workbench) -> Vec<PaletteAction> {
        Vec::new()
    }
}

/// Every screen, and which is shown.
pub struct Screens {
    pub(crate) all: Vec<(&'static str, Box<dyn Screen>)>,
    shown: usize,
}

impl Screens {
    /// Opens all of them; the one of this name is shown, or that for runs.
    #[must_use]
    pub fn open(workbench: &Workbench, name: &str) -> Self {
        let all = SCREENS.iter().map(|one| (one.name, (one.open)(workbench)));
        let mut screens = Self { all: all.collect(), shown: 0 };
        screens.show(super::run::SCREEN.name);
        screens.show(name);
        screens
    }

    /// Shows a screen. What goes on goes on; a name that is none changes nothing.
    pub fn show(&mut self, name: &str) {
        let found = self.all.iter().position(|(own, _)| *own == name);
        self.shown = found.unwrap_or(self.shown);
    }

    /// Name of the one shown.
    pub fn shown(&self) -> &'static str {
        self.all[self.shown].0
    }

    /// The one shown.
    pub fn shown_mut(&mut self) -> &mut dyn Screen {
        self.all[self.shown].1.as_mut()
    }

    /// A screen by its type.
    pub fn get<T: Screen>(&self) -> Option<&T> {
        let mut all = self.all.iter();
        all.find_map(|(_, one)| (one.as_ref() as &dyn Any).downcast_ref())
    }

    /// Fetches what workers have answered.
    pub fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        for (_, screen) in &mut self.all {
            screen.poll(ctx, workbench);
        }
        self.shown_mut().shown(ctx);
    }

    /// Has the screen do a command whose own it is.
    pub fn act(&mut self, ctx: &Context, command: &UserCommand, workbench: &mut Workbench) {
        for (index, (_, screen)) in self.all.iter_mut().enumerate() {
            match screen.act(ctx, command, workbench) {
                ScreenReply::NotMine => {}
                ScreenReply::Done => return,
                ScreenReply::Show => {
                    self.shown = index;
                    return;
                }
            }
        }
    }

    /// Stops every loop.
    pub fn stop(&mut self) {
        self.all.iter_mut().for_each(|(_, screen)| screen.stop());
    }

    /// The window closes.
    pub fn close(&mut self) {
        self.all.iter_mut().for_each(|(_, screen)| screen.close());
    }

    /// What they are at.
    pub fn occupation(&self) -> Occupation {
        let running = |(name, one): &(&'static str, Box<dyn Screen>)| Some((*name, one.running()?));
        Occupation {
            is_busy: self.all.iter().any(|(_, one)| one.is_busy()),
            running: self.all.iter().filter_map(running).collect(),
        }
    }

    /// What can be asked of them by name.
    pub fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let each = self.all.iter().map(|(_, one)| one.actions(workbench));
        each.flatten().collect()
    }
}
