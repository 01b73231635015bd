//! The screen of the rig: its readings in large letters, and manual moves.

mod station;

use super::rig_panel::rig_ui;
use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::command::ManualMove;
use crate::theme::reading_style;
use crate::widgets::{
    QuantityField, alarm_ui, fact_ui, placeholder_ui, quantity_ui, reason_button, require,
    section_ui, tokens_of,
};
use crate::workers::PathPurpose;
use eframe::egui::{
    Align, Button, Context, Key, Label, Layout, RichText, ScrollArea, Ui, Vec2, vec2,
};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::Limits;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::units::{MmPerS, Seconds};
use palpate_runner::RigView;
use station::StationForm;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Rig",
    icon: lucide_icons::Icon::Plug,
    purpose: "readings of the rig, and manual moves",
    key: Some(Key::Num1),
    open: |_| Box::new(RigScreen::default()),
};

/// Distances of the buttons, in mm; positive towards the tissue.
const READY: [f64; 8] = [-10.0, -5.0, -1.0, -0.1, 0.1, 1.0, 5.0, 10.0];

/// Room of one large reading, in points.
const READING: Vec2 = vec2(180.0, 52.0);

#[derive(Debug)]
pub struct RigScreen {
    distance: QuantityField,
    speed: QuantityField,
    station: StationForm,
}

impl Default for RigScreen {
    fn default() -> Self {
        Self {
            distance: QuantityField::new(1.0),
            speed: QuantityField::new(3.0),
            station: StationForm::default(),
        }
    }
}

impl Screen for RigScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        rig_ui(ui, &workbench.snapshot, &workbench.ports, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        let rig = &workbench.snapshot.rig;
        ScrollArea::vertical().id_salt("rig").auto_shrink(false).show(ui, |ui| {
            section_ui(ui, "Readings");
            values_ui(ui, rig, &workbench.bench.curve);
            section_ui(ui, "Manual move");
            self.move_ui(ui, workbench, commands);
            section_ui(ui, "Limits that no protocol can loosen");
            limits_ui(ui, rig, &workbench.bench.limits);
            section_ui(ui, "Station");
            self.station.ui(ui, workbench, commands);
        });
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Chosen(PathPurpose::RemoteQueue, path) => {
                self.station.file = path.display().to_string();
                Reaction::Show
            }
            _ => Reaction::NotMine,
        }
    }

    fn has_right(&self) -> bool {
        false
    }

    fn is_watched(&self) -> bool {
        // A person may press the load cell by hand.
        true
    }
}

impl RigScreen {
    fn move_ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        let (rig, verdict) = (&workbench.snapshot.rig, workbench.move_verdict());
        let fastest = rig.description.speed_max.0;
        let furthest = rig.description.travel.0;
        ui.horizontal(|ui| quantity_ui(ui, "distance", "mm", &mut self.distance));
        ui.horizontal(|ui| quantity_ui(ui, "jog speed", "mm/s", &mut self.speed));
        self.distance.check(|mm| {
            let words = format!(
                "type a distance other than 0, at most {furthest:.0} mm in either direction"
            );
            require(mm != 0.0 && mm.abs() <= furthest, words)
        });
        self.speed.check(|speed| {
            let words = format!("type a speed above 0 and at most {fastest} mm/s");
            require(speed > 0.0 && speed <= fastest, words)
        });
        let typed = self.distance.value.clone().and_then(|distance| {
            let speed = self.speed.value.clone()?;
            verdict.clone()?;
            Ok((distance, speed))
        });
        ui.horizontal_wrapped(|ui| {
            let is_possible = typed.clone().map(|_| ());
            if reason_button(ui, "Jog", vec2(80.0, 48.0), &is_possible)
                && let Ok((distance, speed)) = typed
            {
                commands.push(UiCommand::ManualMove(ManualMove::jog(distance, speed)));
            }
        });
        ui.horizontal_wrapped(|ui| {
            let speed = self.speed.value.clone();
            for distance in READY {
                let button = Button::new(format!("{distance:+} mm")).min_size(vec2(72.0, 48.0));
                let is_possible = verdict.is_ok() && speed.is_ok();
                if ui.add_enabled(is_possible, button).clicked()
                    && let Ok(speed) = speed
                {
                    commands.push(UiCommand::ManualMove(ManualMove::jog(distance, speed)));
                }
            }
        });
        let words = "Plus moves towards the tissue. Every move is a run of its own: it is recorded, all interlocks apply, and Stop motion stops it.";
        placeholder_ui(ui, words);
        ui.add_space(6.0);
        if reason_button(ui, "Find home", vec2(110.0, 48.0), &verdict) {
            commands.push(UiCommand::ManualMove(ManualMove::home()));
        }
        let words = if rig.is_homed {
            "Position zero is known. The axis touches the home switch again to verify it."
        } else {
            "Position zero is not known. The probe moves away from the tissue until the home switch closes."
        };
        placeholder_ui(ui, words);
        if let Some(reason) = &workbench.refusal {
            alarm_ui(ui, reason);
        }
    }
}

fn values_ui(ui: &mut Ui, rig: &RigView, curve: &CalibrationCurve) {
    let tokens = tokens_of(ui);
    let none = || "--".to_owned();
    let position = rig.reading.map(|reading| {
        let place = position_from_pulses(reading.pulses, rig.description.mm_per_pulse);
        format!("{:.3} mm", place.0)
    });
    let place = if rig.is_homed { "position from home" } else { "counter, home not known" };
    let signal = rig.reading.map(|reading| format!("{:.4}", reading.volts));
    let force = rig.reading.map(|reading| curve.newtons_from_volts(reading.volts));
    let force = force.map(|force| format!("{force:.3}"));
    ui.horizontal_wrapped(|ui| {
        for (name, value) in [("signal", signal), ("force, not tared", force), (place, position)] {
            ui.allocate_ui_with_layout(READING, Layout::top_down(Align::Min), |ui| {
                ui.set_width(READING.x);
                placeholder_ui(ui, name);
                ui.label(RichText::new(value.unwrap_or_else(none)).text_style(reading_style()));
            });
        }
    });
    let health = match (&rig.link_error, &rig.link) {
        (Some(reason), _) => RichText::new(format!("Link lost: {reason}")).color(tokens.alarm_text),
        (None, Some(words)) => RichText::new(format!("link: {words}")),
        (None, None) => RichText::new("link: connected"),
    };
    ui.add(Label::new(health).wrap());
    let age = rig.reading.and_then(|reading| reading.age);
    if let Some(age) = age {
        ui.label(format!(
            "newest sample: {:.1} ± {:.1} ms old on arrival",
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
    for (name, value) in [
        ("furthest position", format!("{:.1} mm from home", limits.travel_max.0)),
        ("force above tare", format!("{:.1} to {:.1}", limits.force_min, limits.force_max)),
        ("change of force", format!("{:.0} N/s", limits.force_rate_max)),
        ("signal", format!("{:.2}, independent of the calibration", limits.volts_max)),
        (
            "time without a sample",
            format!("{:.0} ms at rest, {:.0} ms at {fastest} mm/s", silence(0.0), silence(fastest)),
        ),
    ] {
        fact_ui(ui, name, value);
    }
}
