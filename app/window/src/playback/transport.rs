//! Play, pause, speed and position, as on a recorder.

use crate::widgets::tokens_of;
use eframe::egui::{Button, Context, Key, RichText, Slider, Ui, vec2};
use palpate_figures::uncertain::clock;
use palpate_runner::TimeScale;

/// Speeds to choose from: slow motion for a trigger, a day's rest in minutes, and as fast as it goes.
const SPEEDS: [(&str, TimeScale); 6] = [
    ("0.1x", TimeScale::Factor(0.1)),
    ("1x", TimeScale::Factor(1.0)),
    ("10x", TimeScale::Factor(10.0)),
    ("100x", TimeScale::Factor(100.0)),
    ("1000x", TimeScale::Factor(1000.0)),
    ("max", TimeScale::Max),
];
/// A jump of the arrow keys, in s of session time.
const JUMP_S: f64 = 10.0;

/// Position and speed of the replay.
#[derive(Clone, Debug)]
pub(super) struct Transport {
    end: f64,
    at: f64,
    requested: Option<f64>,
    is_playing: bool,
    scale: TimeScale,
}

impl Transport {
    /// Plays from the beginning of a session of so many seconds.
    pub fn new(end: f64, scale: TimeScale) -> Self {
        Self { end, at: 0.0, requested: None, is_playing: true, scale }
    }

    pub fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// So many seconds of the wall pass while `shown` is on the screen. The session time wanted, where it is a new one.
    pub fn pass(&mut self, seconds: f64, shown: f64) -> Option<f64> {
        if self.is_playing {
            self.at = match self.scale {
                // A machine that falls behind shows everything a little later, and leaves out nothing.
                TimeScale::Factor(factor) if !self.is_behind(shown) => self.at + seconds * factor,
                TimeScale::Factor(_) => self.at,
                TimeScale::Max => self.end,
            };
        }
        self.at = self.at.clamp(0.0, self.end);
        if self.at >= self.end && shown >= self.end {
            self.is_playing = false;
        }
        (self.requested != Some(self.at)).then(|| *self.requested.insert(self.at))
    }

    /// Whether what is shown is more than a second of the wall behind what was requested for.
    fn is_behind(&self, shown: f64) -> bool {
        match self.scale {
            TimeScale::Factor(factor) => {
                self.requested.is_some_and(|requested| requested > shown + factor)
            }
            TimeScale::Max => false,
        }
    }

    /// Plays on, or stays where `shown` is; at the end it begins again.
    fn toggle(&mut self, shown: f64) {
        self.is_playing = !self.is_playing;
        if !self.is_playing {
            self.at = shown;
        } else if self.at >= self.end {
            self.at = 0.0;
        }
    }

    fn jump(&mut self, by: f64, shown: f64) {
        self.at = (shown + by).clamp(0.0, self.end);
    }

    /// Space plays and pauses, arrows jump, Home and End go there; not while text is typed.
    pub fn read_keys(&mut self, ctx: &Context, shown: f64) {
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key| ctx.input(|input| input.key_pressed(key));
        if pressed(Key::Space) && ctx.memory(|memory| memory.focused().is_none()) {
            self.toggle(shown);
        }
        for (key, by) in [
            (Key::ArrowLeft, -JUMP_S),
            (Key::ArrowRight, JUMP_S),
            (Key::Home, -self.end),
            (Key::End, self.end),
        ] {
            if pressed(key) {
                self.jump(by, shown);
            }
        }
    }

    pub fn ui(&mut self, ui: &mut Ui, shown: f64) {
        let tokens = tokens_of(ui);
        ui.horizontal(|ui| {
            let text = if self.is_playing { "Pause" } else { "Play" };
            if ui.add(Button::new(text).min_size(vec2(64.0, 28.0))).on_hover_text("Space").clicked()
            {
                self.toggle(shown);
            }
            for (text, by) in [("Back 10 s", -JUMP_S), ("Forward 10 s", JUMP_S)] {
                if ui.button(text).clicked() {
                    self.jump(by, shown);
                }
            }
            for (text, scale) in SPEEDS {
                ui.selectable_value(&mut self.scale, scale, text);
            }
            let words = format!("{} of {}", clock(shown), clock(self.end));
            ui.label(words);
            if self.is_behind(shown) {
                ui.label(RichText::new("catching up").color(tokens.text_quiet));
            }
        });
        ui.horizontal(|ui| {
            let label = ui.label("session time");
            ui.spacing_mut().slider_width = (ui.available_width() - 90.0).max(100.0);
            let mut at = if self.is_playing { shown } else { self.at };
            // Only shown with one decimal: a slider that rounds would leave the end as soon as it is there.
            let slider = Slider::new(&mut at, 0.0..=self.end)
                .custom_formatter(|at, _| format!("{at:.1}"))
                .suffix(" s");
            if ui.add(slider).labelled_by(label.id).changed() {
                self.at = at;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_plays_at_its_speed_and_stays_at_the_end() {
        let mut transport = Transport::new(100.0, TimeScale::Factor(10.0));
        assert_eq!(transport.pass(0.0, 0.0), Some(0.0));
        assert_eq!(transport.pass(0.5, 0.0), Some(5.0));
        assert_eq!(transport.pass(0.5, 5.0), Some(10.0));
        transport.toggle(10.0);
        assert_eq!(transport.pass(0.5, 10.0), None);
        transport.jump(85.0, 10.0);
        assert_eq!(transport.pass(0.5, 10.0), Some(95.0));
        transport.toggle(95.0);
        assert_eq!(transport.pass(9.0, 95.0), Some(100.0));
        assert!(transport.is_playing());
        assert_eq!(transport.pass(0.1, 100.0), None);
        assert!(!transport.is_playing());
        // From the end it begins again.
        transport.toggle(100.0);
        assert_eq!(transport.pass(0.1, 100.0), Some(1.0));
    }

    #[test]
    fn a_slow_machine_is_waited_for() {
        let mut transport = Transport::new(1e4, TimeScale::Factor(1000.0));
        assert_eq!(transport.pass(1.0, 0.0), Some(1000.0));
        assert_eq!(transport.pass(1.0, 0.0), Some(2000.0));
        // Two seconds behind at this speed: nothing more is requested for.
        assert_eq!(transport.pass(1.0, 10.0), None);
        assert_eq!(transport.pass(1.0, 1500.0), Some(3000.0));
    }
}
