//! Everything that the window can be asked for, for its palette.

use super::activity::run_in_progress;
use super::palette::Action;
use super::run_strip::Wish;
use super::sizes::Edge;
use crate::app::WorkbenchApp;
use crate::command::{Aside, Command, TextSize};
use crate::screens::table::SCREENS;

impl WorkbenchApp {
    /// What can be asked for now, and of the rest why not.
    pub(crate) fn actions(&self) -> Vec<Action> {
        let bench = &self.workbench;
        let run = run_in_progress(&bench.snapshot);
        let no_run = || Err("no run is in progress".to_owned());
        let mut actions = vec![
            Action::new("Stop motion", "F12, Escape", Command::Stop),
            Action::new("Halt: cut the motion without braking", "F11", Command::Halt),
            Action::new("Start the protocol", "F5", Command::Start).if_ok(bench.start_verdict()),
        ];
        for (name, keys, wish) in [
            ("Pause", "F7", Wish::Pause),
            ("Pause at the next checkpoint", "F4", Wish::PauseAfter),
            ("Resume", "F9", Wish::Resume),
            ("Finish early", "F10", Wish::Finish),
            ("Abort the run", "", Wish::Abort),
            ("Answer the prompt: done", "F2", Wish::Confirm),
            ("Answer the prompt: not done", "", Wish::Decline),
            ("Read the last weight again", "", Wish::Redo),
        ] {
            let verdict = run.map_or_else(no_run, |run| wish.operator(run).map(|_| ()));
            actions.push(Action::new(name, keys, Command::Wish(wish)).if_ok(verdict));
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
            None => Err("the link is there".to_owned()),
        };
        actions.extend([
            Action::new("Retract after a stop", "F8", Command::Retract).if_ok(can_retract),
            Action::new("Close the session after a stop", "", Command::CloseSession).if_ok(is_held),
            Action::new("Write a note or a mark", "F3", Command::NoteTyped).if_ok(has_run),
            Action::new("Find home", "", Command::Aside(Aside::home()))
                .if_ok(bench.aside_verdict()),
            Action::new("Connect the rig again", "", Command::Reconnect).if_ok(is_lost),
            Action::new("List the serial ports again", "", Command::ListPorts),
            Action::new("Begin the work of this screen", "F6", Command::Work),
            Action::new("Cancel the work of this screen", "", Command::CancelWork),
        ]);
        actions.extend(self.screens.actions(bench));
        for screen in SCREENS {
            let keys = format!("Ctrl+{}", screen.key.symbol_or_name());
            let name = format!("Screen {}: {}", screen.name, screen.purpose);
            actions.push(Action::new(name, &keys, Command::Show(screen.name)));
        }
        let is_on_tour = match self.tour.is_on() {
            true => Ok(()),
            false => Err("no tour is under way".to_owned()),
        };
        actions.push(Action::new("Light or dark screen", "", Command::SwitchTheme));
        for (name, keys, size) in [
            ("Larger text", "Ctrl++", TextSize::Larger),
            ("Smaller text", "Ctrl+-", TextSize::Smaller),
            ("Text as it is made", "Ctrl+0", TextSize::Usual),
        ] {
            actions.push(Action::new(name, keys, Command::TextSize(size)));
        }
        for edge in Edge::ALL {
            for (word, is_larger) in [("Larger", true), ("Smaller", false)] {
                let name = format!("{word} {}", edge.name());
                actions.push(Action::new(name, "", Command::Resize { edge, is_larger }));
            }
        }
        actions.extend([
            Action::new("Take the tour", "", Command::TourStart),
            Action::new("End the tour", "", Command::TourEnd).if_ok(is_on_tour),
            Action::new("This list", "Ctrl+K, F1", Command::Palette),
        ]);
        actions
    }
}
