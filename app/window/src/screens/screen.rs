//! The trait of screens, through which the window reaches each of them.

use super::table::screens;
pub use crate::command::{Commands, UiCommand};
pub use crate::shell::palette::PaletteAction;
use crate::shell::panels::{frame, side_ui};
use crate::shell::sizes::PanelEdge;
pub use crate::shell::sizes::Sizes;
use crate::workbench::Occupation;
pub use crate::workbench::Workbench;
use eframe::egui::{CentralPanel, Context, Key, Ui};
use serde_json::Value;
use std::any::Any;
use std::collections::BTreeMap;

/// A screen before it is opened.
#[derive(Clone, Copy)]
pub struct ScreenEntry {
    pub name: &'static str,
    pub icon: lucide_icons::Icon,
    /// Hint on the rail.
    pub purpose: &'static str,
    /// Shows the screen with Ctrl (Command on a Mac); a screen without a key is not on the rail.
    pub key: Option<Key>,
    /// Reads nothing from disk: a thread does that once the screen is shown.
    pub open: fn(&Workbench) -> Box<dyn Screen>,
}

/// Whether a screen has done a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The command belongs to another screen.
    NotMine,
    /// Done, or refused with a reason on the screen.
    Done,
    /// Done, and the screen is to be shown.
    Show,
    /// Done, and the screen of this name is to be shown.
    ShowOther(&'static str),
}

/// The part of the window between the top bar and the event log.
///
/// A screen reaches the rig through [`Workbench`] and never holds a device. Long work is done by a worker, whose answer
/// [`Self::poll`] fetches.
pub trait Screen: Any {
    /// Draws the inputs.
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands);

    /// Draws plots and tables.
    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands);

    /// Draws facts and results.
    fn right_ui(&mut self, _ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {}

    fn has_left(&self) -> bool {
        true
    }

    fn has_right(&self) -> bool {
        true
    }

    /// Whether the left panel scrolls its parts by itself.
    fn has_own_scroll(&self) -> bool {
        false
    }

    /// Draws all panels.
    fn ui(
        &mut self,
        ui: &mut Ui,
        sizes: &mut Sizes,
        workbench: &mut Workbench,
        commands: &mut Commands,
    ) {
        if self.has_left() {
            side_ui(ui, sizes, PanelEdge::Left, !self.has_own_scroll(), |ui| {
                self.left_ui(ui, workbench, commands);
            });
        }
        if self.has_right() {
            side_ui(ui, sizes, PanelEdge::Right, true, |ui| {
                self.right_ui(ui, workbench, commands);
            });
        }
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.middle_ui(ui, workbench, commands));
    }

    /// Fetches the answers of workers; called in every frame for every screen.
    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {}

    /// Called in every frame in which the screen is shown.
    fn shown(&mut self, _ctx: &Context) {}

    /// Does a command, if it is for this screen.
    fn act(
        &mut self,
        _ctx: &Context,
        _command: &UiCommand,
        _workbench: &mut Workbench,
    ) -> Reaction {
        Reaction::NotMine
    }

    /// Begins the work of the screen (F6).
    fn work(&mut self, _ctx: &Context, _workbench: &mut Workbench) {}

    fn cancel(&mut self) {}

    /// Whether its work would disturb a measurement of times.
    fn is_busy(&self) -> bool {
        false
    }

    /// A loop of its own that runs, in words. It is stopped with the rig, and before a run begins.
    fn running(&self) -> Option<&'static str> {
        None
    }

    fn stop(&mut self) {}

    /// Finishes recordings before the window closes.
    fn close(&mut self) {}

    /// Whether a person at the rig may watch live values without using key or pointer.
    fn is_watched(&self) -> bool {
        false
    }

    /// What the next window opens with, such as how its parts are arranged; none where that is as usual.
    fn layout(&self) -> Option<Value> {
        None
    }

    /// Takes what a window before kept.
    fn take_layout(&mut self, _kept: &Value) {}

    /// Its actions for the palette, each possible or with the reason why not.
    fn actions(&self, _workbench: &Workbench) -> Vec<PaletteAction> {
        Vec::new()
    }
}

/// What screens keep from window to window, by their names.
pub type ScreenLayouts = BTreeMap<String, Value>;

/// Every screen, and which is shown.
pub struct Screens {
    pub(crate) all: Vec<(&'static str, Box<dyn Screen>)>,
    shown: usize,
}

impl Screens {
    /// Opens all screens and shows the one of this name, or the run screen.
    #[must_use]
    pub fn open(workbench: &Workbench, name: &str, layouts: &ScreenLayouts) -> Self {
        let all = screens().map(|one| (one.name, (one.open)(workbench)));
        let mut screens = Self { all: all.collect(), shown: 0 };
        for (name, screen) in &mut screens.all {
            if let Some(kept) = layouts.get(*name) {
                screen.take_layout(kept);
            }
        }
        screens.show(super::run::SCREEN.name);
        screens.show(name);
        screens
    }

    /// What the screens keep that are not as usual.
    pub fn layouts(&self) -> ScreenLayouts {
        let all = self.all.iter();
        all.filter_map(|(name, one)| Some(((*name).to_owned(), one.layout()?))).collect()
    }

    /// Shows a screen; an unknown name changes nothing.
    pub fn show(&mut self, name: &str) {
        let found = self.all.iter().position(|(own, _)| *own == name);
        self.shown = found.unwrap_or(self.shown);
    }

    pub fn shown(&self) -> &'static str {
        self.all[self.shown].0
    }

    pub fn shown_mut(&mut self) -> &mut dyn Screen {
        self.all[self.shown].1.as_mut()
    }

    pub fn get<T: Screen>(&self) -> Option<&T> {
        let mut all = self.all.iter();
        all.find_map(|(_, one)| (one.as_ref() as &dyn Any).downcast_ref())
    }

    pub fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        for (_, screen) in &mut self.all {
            screen.poll(ctx, workbench);
        }
        self.shown_mut().shown(ctx);
    }

    /// Passes a command to the screen that it is for.
    pub fn act(&mut self, ctx: &Context, command: &UiCommand, workbench: &mut Workbench) {
        for (index, (_, screen)) in self.all.iter_mut().enumerate() {
            match screen.act(ctx, command, workbench) {
                Reaction::NotMine => {}
                Reaction::Done => return,
                Reaction::Show => {
                    self.shown = index;
                    return;
                }
                Reaction::ShowOther(name) => return self.show(name),
            }
        }
    }

    pub fn stop(&mut self) {
        self.all.iter_mut().for_each(|(_, screen)| screen.stop());
    }

    pub fn close(&mut self) {
        self.all.iter_mut().for_each(|(_, screen)| screen.close());
    }

    pub fn occupation(&self) -> Occupation {
        let running = |(name, one): &(&'static str, Box<dyn Screen>)| Some((*name, one.running()?));
        Occupation {
            is_busy: self.all.iter().any(|(_, one)| one.is_busy()),
            running: self.all.iter().filter_map(running).collect(),
        }
    }

    pub fn actions(&self, workbench: &Workbench) -> Vec<PaletteAction> {
        let each = self.all.iter().map(|(_, one)| one.actions(workbench));
        each.flatten().collect()
    }
}
