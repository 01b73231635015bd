//! The rig's own screen: what it reports, large, and moving it by hand.

use super::rig_panel::rig_ui;
use super::screen::{Screen, ScreenEntry};
use crate::command::{CommandQueue, ManualMove, UserCommand};
use crate::theme::{Tokens, reading_style};
use crate::widgets::quantity_input::{QuantityField, quantity_ui};
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::alarm_ui;
use crate::workbench::Workbench;
use eframe::egui::{Button, Grid, Key, Label, RichText, ScrollArea, Ui, vec2};
use palpate_model::rig::Limits;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::units::{MmPerS, Newtons, Seconds};
use palpate_runner::RigView;

/// The screen's line in the table.
pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Rig",
    purpose: "what the rig reports, and moving it by hand",
    key: Key::Num1,
    open: |_| Box::new(RigScreen::default()),
};

/// Distances that stand ready, in mm; towards the tissue is positive.
const READY: [f64; 8] = [-10.0, -5.0, -1.0, -0.1, 0.1, 1.0, 5.0, 10.0];

/// What is typed on the screen.
#[derive(Debug)]
pub struct RigScreen {
    distance: QuantityField,
    speed: QuantityField,
}

impl Default for RigScreen {
    fn default() -> Self {
        Self { distance: QuantityField::new(1.0), speed: QuantityField::new(3.0) }
    }
}

/// What the screen must know of the rest.
struct Facts<'a> {
    /// The interlocks.
    limits: &'a Limits,
    /// Force of the newest sample by the calibration in use, without tare.
    force: Option<Newtons>,
    /// Whether the axis may be moved now, or why not.
    verdict: &'a Result<(), String>,
    /// Why the last move was refused.
    refusal: Option<&'a str>,
}

impl Screen for RigScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue) {
        rig_ui(ui, &workbench.snapshot, &workbench.ports, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut CommandQueue) {
        let curve = &workbench.bench.curve;
        let rig = &workbench.snapshot.rig;
        let facts = Facts {
            limits: &workbench.bench.limits,
            force: rig.reading.map(|reading| curve.newtons_from_volts(reading.volts)),
            verdict: &workbench.move_verdict(),
            refusal: workbench.refusal.as_deref(),
        };
        ScrollArea::vertical().id_salt("rig").auto_shrink(false).show(ui, |ui| {
            heading(ui, "Now");
            values_ui(ui, rig, &facts);
            heading(ui, "Move by hand");
            self.move_ui(ui, rig, &facts, commands);
            heading(ui, "Limits that no protocol can loosen");
            limits_ui(ui, rig, facts.limits);
        });
    }

    fn has_right(&self) -> bool {
        false
    }

    fn is_watched(&self) -> bool {
        // Somebody may press the cell by hand.
        true
    }
}

impl RigScreen {
    fn move_ui(
        &mut self,
        ui: &mut Ui,
        rig: &RigView,
        facts: &Facts<'_>,
        commands: &mut CommandQueue,
    ) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let fastest = rig.description.speed_max.0;
        let furthest = rig.description.travel.0;
        ui.horizontal(|ui| {
            quantity_ui(ui, "distance", "mm", &mut self.distance);
            quantity_ui(ui, "jog speed", "mm/s", &mut self.speed);
        });
        self.distance.check(|mm| match mm != 0.0 && mm.abs() <= furthest {
            true => Ok(()),
            false => Err(format!("a distance of at most {furthest:.0} mm, and not 0")),
        });
        self.speed.check(|speed| match speed > 0.0 && speed <= fastest {
            true => Ok(()),
            false => Err(format!("a speed above 0 and at most {fastest} mm/s")),
        });
        let typed = self.distance.value.clone().and_then(|distance| {
            let speed = self.speed.value.clone()?;
            facts.verdict.clone()?;
            Ok((distance, speed))
        });
        ui.horizontal_wrapped(|ui| {
            let verdict = typed.clone().map(|_| ());
            if reason_button(ui, "Jog", vec2(80.0, 34.0), &verdict)
                && let Ok((distance, speed)) = typed
            {
                commands.push(UserCommand::ManualMove(ManualMove::jog(distance, speed)));
            }
        });
        ui.horizontal_wrapped(|ui| {
            let speed = self.speed.value.clone();
            for distance in READY {
                let button = Button::new(format!("{distance:+} mm")).min_size(vec2(66.0, 30.0));
                let is_possible = facts.verdict.is_ok() && speed.is_ok();
                if ui.add_enabled(is_possible, button).clicked()
                    && let Ok(speed) = speed
                {
                    commands.push(UserCommand::ManualMove(ManualMove::jog(distance, speed)));
                }
            }
        });
        let words = "Plus goes towards the tissue. Every move is a run of its own: recorded, with all interlocks, and Stop motion stops it.";
        ui.add(Label::new(RichText::new(words).color(tokens.text_quiet)).wrap());
        ui.add_space(6.0);
        ui.horizontal_wrapped(|ui| {
            if reason_button(ui, "Find home", vec2(110.0, 34.0), facts.verdict) {
                commands.push(UserCommand::ManualMove(ManualMove::home()));
            }
            let words = if rig.is_homed {
                "Position zero is known. Home is touched once more and compared."
            } else {
                "Position zero is not known; the probe goes away from the tissue until the home switch closes."
            };
            ui.add(Label::new(RichText::new(words).color(tokens.text_quiet)).wrap());
        });
        if let Some(reason) = facts.refusal {
            alarm_ui(ui, reason);
        }
    }
}

fn heading(ui: &mut Ui, words: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(words).heading().strong());
    ui.separator();
}

fn values_ui(ui: &mut Ui, rig: &RigView, facts: &Facts<'_>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let none = || "--".to_owned();
    let position = rig.reading.map(|reading| {
        let place = position_from_pulses(reading.pulses, rig.description.mm_per_pulse);
        format!("{:.3} mm", place.0)
    });
    let place = match rig.is_homed {
        true => "position from home",
        false => "counter, home not known",
    };
    Grid::new("values").num_columns(3).spacing(vec2(40.0, 6.0)).show(ui, |ui| {
        for name in ["signal", "force, not tared", place] {
            ui.label(RichText::new(name).color(tokens.text_quiet));
        }
        ui.end_row();
        let signal = rig.reading.map(|reading| format!("{:.4}", reading.volts));
        let force = facts.force.map(|force| format!("{force:.3}"));
        for value in [signal, force, position] {
            ui.label(RichText::new(value.unwrap_or_else(none)).text_style(reading_style()));
        }
        ui.end_row();
    });
    let health = match (&rig.link_error, &rig.link) {
        (Some(reason), _) => RichText::new(format!("Link lost: {reason}")).color(tokens.alarm_text),
        (None, Some(words)) => RichText::new(format!("link: {words}")),
        (None, None) => RichText::new("link: the rig is part of this program"),
    };
    ui.add(Label::new(health).wrap());
    let age = rig.reading.and_then(|reading| reading.age);
    if let Some(age) = age {
        ui.label(format!(
            "newest sample: taken {:.1} ms before it came, within {:.1} ms",
            age.by.seconds().0 * 1e3,
            age.within.seconds().0 * 1e3
        ));
    }
}

fn limits_ui(ui: &mut Ui, rig: &RigView, limits: &Limits) {
    let about = &rig.description;
    let apart = Seconds((about.ticks_per_sample - 1.0) * about.tick().0);
    let silence =
        |speed: f64| Limits::sample_age_max(MmPerS(speed), about.unseen_max, apart).0 * 1e3;
    let fastest = about.speed_max.0;
    Grid::new("limits").num_columns(2).spacing(vec2(24.0, 4.0)).show(ui, |ui| {
        for (name, value) in [
            ("furthest position", format!("{:.1} mm from home", limits.travel_max.0)),
            ("force above tare", format!("{:.1} to {:.1}", limits.force_min, limits.force_max)),
            ("change of force", format!("{:.0} N/s", limits.force_rate_max)),
            ("signal", format!("{:.2} whatever the calibration says", limits.volts_max)),
            (
                "silence",
                format!(
                    "{:.0} ms at rest, {:.0} ms at {fastest} mm/s",
                    silence(0.0),
                    silence(fastest)
                ),
            ),
        ] {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
