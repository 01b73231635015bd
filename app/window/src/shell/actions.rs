//! Everything that the window can be asked for, for its palette.

use super::activity::run_in_progress;
use super::palette::PaletteAction;
use super::run_strip::RunControl;
use super::sizes::PanelEdge;
use crate::app::WorkbenchApp;
use crate::command::{ManualMove, TextSize, UiCommand};
use crate::screens::table::screens;
use crate::widgets::require;

impl WorkbenchApp {
    /// What can be asked for now, and of the rest why not.
    pub(crate) fn actions(&self) -> Vec<PaletteAction> {
        let bench = &self.workbench;
        let run = run_in_progress(&bench.snapshot);
        let no_run = || Err("no run is in progress".to_owned());
        let mut actions = vec![
            PaletteAction::new("Stop motion", "F12, Escape", UiCommand::Stop),
            PaletteAction::new("Halt: stop without braking", "F11", UiCommand::Halt),
            PaletteAction::new("Start the protocol", "F5", UiCommand::Start)
                .if_ok(bench.start_verdict()),
        ];
        for (name, keys, control) in [
            ("Pause", "F7", RunControl::Pause),
            ("Pause at the next checkpoint", "F4", RunControl::PauseAfter),
            ("Resume", "F9", RunControl::Resume),
            ("Finish early", "F10", RunControl::Finish),
            ("Abort the run", "", RunControl::Abort),
            ("Answer the prompt: done", "F2", RunControl::Confirm),
            ("Answer the prompt: not done", "", RunControl::Decline),
            ("Read the last weight again", "", RunControl::Redo),
        ] {
            let verdict = run.map_or_else(no_run, |run| control.operator(run).map(|_| ()));
            actions.push(
                PaletteAction::new(name, keys, UiCommand::RunControl(control)).if_ok(verdict),
            );
        }
        let has_run = run.map_or_else(no_run, |_| Ok(()));
        let can_retract = run.map_or_else(no_run, |run| run.can_retract.clone());
        let is_held = match run.map(|run| run.holding.is_some()) {
            Some(true) => Ok(()),
            Some(false) => Err("the run has not stopped".to_owned()),
            None => no_run(),
        };
        let is_lost = match bench.snapshot.rig.link_error {
            Some(_) => Ok(()),
            None => Err("the rig is connected; there is nothing to reconnect".to_owned()),
        };
        actions.extend([
            PaletteAction::new("Retract after a stop", "F8", UiCommand::Retract).if_ok(can_retract),
            PaletteAction::new("Close the session after a stop", "", UiCommand::CloseSession)
                .if_ok(is_held),
            PaletteAction::new("Write a note or a mark", "F3", UiCommand::NoteTyped).if_ok(has_run),
            PaletteAction::new("Find home", "", UiCommand::ManualMove(ManualMove::home()))
                .if_ok(bench.move_verdict()),
            PaletteAction::new("Connect the rig again", "", UiCommand::Reconnect).if_ok(is_lost),
            PaletteAction::new("List the serial ports again", "", UiCommand::ListPorts),
            PaletteAction::new("Start this screen's task", "F6", UiCommand::Work),
            PaletteAction::new("Cancel this screen's task", "", UiCommand::CancelWork),
        ]);
        actions.extend(self.screens.actions(bench));
        for screen in screens() {
            let keys =
                screen.key.map_or_else(String::new, |key| format!("Ctrl+{}", key.symbol_or_name()));
            let name = format!("Screen {}: {}", screen.name, screen.purpose);
            actions.push(PaletteAction::new(name, &keys, UiCommand::Show(screen.name)));
        }
        let is_on_tour = require(self.tour.is_on(), "the tour is not open");
        actions.push(PaletteAction::new(
            "Switch between light and dark theme",
            "",
            UiCommand::SwitchTheme,
        ));
        for (name, keys, size) in [
            ("Larger text", "Ctrl++", TextSize::Larger),
            ("Smaller text", "Ctrl+-", TextSize::Smaller),
            ("Usual text size", "Ctrl+0", TextSize::Usual),
        ] {
            actions.push(PaletteAction::new(name, keys, UiCommand::TextSize(size)));
        }
        for edge in PanelEdge::ALL {
            for (word, is_larger) in [("Larger", true), ("Smaller", false)] {
                let name = format!("{word} {}", edge.name());
                actions.push(PaletteAction::new(name, "", UiCommand::Resize { edge, is_larger }));
            }
        }
        actions.extend([
            PaletteAction::new("Take the tour", "", UiCommand::TourStart),
            PaletteAction::new("End the tour", "", UiCommand::TourEnd).if_ok(is_on_tour),
            PaletteAction::new("This list", "Ctrl+K, F1", UiCommand::Palette),
        ]);
        actions
    }
}
