//! The first-run tour: a strip of a few sentences, each about a part of the screen, that covers no control.

use crate::command::{Commands, UiCommand};
use crate::screens::{calibration, library, review, rig, run};
use crate::widgets::tokens_of;
use eframe::egui::{Frame, Label, Margin, RichText, Stroke, Ui};

/// The number of the stop; none when the tour is closed.
#[derive(Debug, Default)]
pub struct Tour(Option<usize>);

/// Screens with their texts.
const STOPS: [(&str, &str); 7] = [
    (
        run::SCREEN.name,
        "This is the built-in simulated rig: nothing here can be damaged. Press Start F5 and watch the probe find the tissue, press into it and hold. F12 or Escape stops the motion from any screen.",
    ),
    (
        run::SCREEN.name,
        "The left panel has the protocol and its values; Expected course draws it before anything moves. While Start is disabled, the reason is shown below the button.",
    ),
    (
        rig::SCREEN.name,
        "Readings of the rig in large letters, and manual moves. Start palpate with 'palpate window --rig FILE.toml' to open a rig that is connected to this computer.",
    ),
    (
        calibration::SCREEN.name,
        "Volts to newtons. Measure... asks for one weight after another, shows when the signal is steady, and can read a weight again.",
    ),
    (
        library::SCREEN.name,
        "Search all sessions by words, names and values. Enter opens the chosen sessions in Review.",
    ),
    (
        review::SCREEN.name,
        "One session in detail, or several side by side: cursors, phases, fits, other calibrations, a report.",
    ),
    (
        run::SCREEN.name,
        "Ctrl+K lists all commands by name, with their keys. Press Start F5 when you are ready.",
    ),
];

impl Tour {
    pub fn start(&mut self) {
        self.0 = Some(0);
    }

    pub fn end(&mut self) {
        self.0 = None;
    }

    pub fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Goes to the next stop, or ends; returns the screen to show.
    pub fn go_on(&mut self) -> Option<&'static str> {
        let next = self.0? + 1;
        self.0 = (next < STOPS.len()).then_some(next);
        self.0.map(|at| STOPS[at].0)
    }

    pub fn ui(&self, ui: &mut Ui, commands: &mut Commands) {
        let Some((at, (_, words))) = self.0.and_then(|at| Some((at, STOPS.get(at)?))) else {
            return;
        };
        let tokens = tokens_of(ui);
        Frame::new()
            .fill(tokens.canvas)
            .stroke(Stroke::new(2.0, tokens.focus))
            .inner_margin(Margin::symmetric(10, 6))
            .show(ui, |ui| {
                ui.horizontal(|ui| {
                    let place = format!("Tour {} of {}", at + 1, STOPS.len());
                    ui.label(RichText::new(place).strong());
                    let name = if at + 1 == STOPS.len() { "Done with the tour" } else { "Next" };
                    if ui.button(name).clicked() {
                        commands.push(UiCommand::TourNext);
                    }
                    if at + 1 < STOPS.len() && ui.button("End the tour").clicked() {
                        commands.push(UiCommand::TourEnd);
                    }
                    ui.add(Label::new(*words).wrap());
                });
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_visits_every_stop_and_ends() {
        let mut tour = Tour::default();
        assert_eq!((tour.go_on(), tour.is_on()), (None, false));
        tour.start();
        let mut visited = 1;
        while tour.go_on().is_some() {
            visited += 1;
        }
        assert_eq!((visited, tour.is_on()), (STOPS.len(), false));
    }
}
