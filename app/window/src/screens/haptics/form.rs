//! The body, the device, the loop and the hand as typed.

use crate::screens::haptics::OfferedSessions;
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::places::NamedControl;
use crate::widgets::quantity_input::{QuantityField, form_label, quantity_ui};
use crate::widgets::text_row::text_row;
use eframe::egui::{Button, RichText, Ui};
use palpate_analysis::haptics::{Setting, THESIS};
use palpate_haptics::{DriveKind, Period, TorqueSettings};
use palpate_model::units::{Depth, MmPerS, Newtons};
use std::path::{Path, PathBuf};

/// What is asked for.
pub(super) struct HapticsForm {
    body: String,
    is_current: bool,
    damping: QuantityField,
    friction: QuantityField,
    rate: QuantityField,
    delay: QuantityField,
    depth: QuantityField,
    speed: QuantityField,
}

/// Friction of the source's motor at the rack in N, as it stands in the form until another is typed.
fn usual_friction() -> String {
    format!("{:.3}", TorqueSettings::default().friction().0)
}

impl Default for HapticsForm {
    fn default() -> Self {
        let usual = Setting::source(Period::MILLISECOND);
        Self {
            body: THESIS.into(),
            is_current: false,
            damping: QuantityField::new(0.0),
            friction: QuantityField { text: usual_friction(), value: Err("not read yet".into()) },
            rate: QuantityField::new(usual.period.hz()),
            delay: QuantityField::new(0.0),
            depth: QuantityField::new(usual.deepest.0),
            speed: QuantityField::new(usual.speed.0),
        }
    }
}

impl HapticsForm {
    /// Takes a session or a table as the body's.
    pub fn take(&mut self, path: &Path) {
        self.body = path.display().to_string();
    }

    /// Checks every field.
    pub fn check(&mut self) {
        let not_negative = |value: f64| match value >= 0.0 {
            true => Ok(()),
            false => Err("must be 0 or more".to_owned()),
        };
        let up_to = |value: f64, most: f64| match value > 0.0 && value <= most {
            true => Ok(()),
            false => Err(format!("must be above 0 and at most {most}")),
        };
        self.damping.check(not_negative);
        self.friction.check(not_negative);
        self.rate.check(|rate| {
            let period = Period::of_rate(rate);
            period.map(|_| ()).map_err(|err| err.to_string())
        });
        let most = f64::from(Setting::DELAY_MAX);
        self.delay.check(|delay| match (0.0..=most).contains(&delay) && delay.fract() == 0.0 {
            true => Ok(()),
            false => Err(format!("must be a whole number from 0 to {most}")),
        });
        self.depth.check(|depth| up_to(depth, Setting::DEPTH_MAX));
        self.speed.check(|speed| up_to(speed, Setting::SPEED_MAX));
    }

    /// What is asked for, or the first thing that is wrong.
    pub fn wanted(&self) -> Result<(PathBuf, Setting), String> {
        let body = self.body.trim();
        if body.is_empty() {
            return Err(format!("name a body: the folder of a session, a table, or '{THESIS}'"));
        }
        let value = |name: &str, field: &QuantityField| {
            let value = field.value.clone();
            value.map_err(|reason| format!("{name}: {reason}"))
        };
        let period = Period::of_rate(value("rate", &self.rate)?).map_err(|err| err.to_string())?;
        let usual = Setting::source(period);
        let friction = value("friction", &self.friction)?;
        let setting = Setting {
            period,
            drive: match self.is_current {
                false => usual.drive,
                true => DriveKind::Current { amps_per_volt: 1.0 },
            },
            // N s/m as catalogues have it, N s/mm inside.
            damping: 1e-3 * value("damping", &self.damping)?,
            // Untouched it is the motor's own, to the last digit.
            friction: (self.friction.text != usual_friction()).then_some(Newtons(friction)),
            delay: value("delay", &self.delay)? as usize,
            deepest: Depth(value("depth", &self.depth)?),
            speed: MmPerS(value("speed", &self.speed)?),
        };
        Ok((PathBuf::from(body), setting))
    }

    /// Draws the fields; true when a dialog for a session is wanted.
    pub fn ui(&mut self, ui: &mut Ui, offered: &OfferedSessions<'_>) -> bool {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "Body");
        text_row(ui, "body", "a session's folder, a table, or thesis", &mut self.body);
        let mut is_dialog_wanted = false;
        ui.horizontal_wrapped(|ui| {
            if ui.button("Source thesis").clicked() {
                self.body = THESIS.into();
            }
            for (name, session) in [("In review", offered.review), ("In library", offered.library)]
            {
                let button = ui.add_enabled(session.is_some(), Button::new(name));
                if let (true, Some(session)) = (button.clicked(), session) {
                    self.take(session);
                }
            }
            is_dialog_wanted = ui.button("Choose a session...").clicked();
        });
        section_ui(ui, "Device");
        ui.horizontal(|ui| {
            form_label(ui, "drive");
            ui.radio_value(&mut self.is_current, false, "voltage").named("voltage");
            ui.radio_value(&mut self.is_current, true, "current").named("current");
        });
        let damps = match self.is_current {
            false => "the motor's back-EMF damps",
            true => "the motor damps nothing",
        };
        ui.label(RichText::new(damps).color(tokens.text_quiet).small());
        quantity_ui(ui, "damping", "N s/m, own", &mut self.damping);
        quantity_ui(ui, "friction", "N", &mut self.friction);
        section_ui(ui, "Loop");
        quantity_ui(ui, "rate", "ticks a second", &mut self.rate);
        quantity_ui(ui, "delay", "ticks", &mut self.delay);
        section_ui(ui, "Hand");
        quantity_ui(ui, "depth", "mm, stroke", &mut self.depth);
        quantity_ui(ui, "speed", "mm/s", &mut self.speed);
        is_dialog_wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn untouched_the_form_asks_for_the_source_device_itself() {
        let mut form = HapticsForm::default();
        form.check();
        let (body, setting) = form.wanted().unwrap();
        assert_eq!(body, Path::new(THESIS));
        assert_eq!(setting, Setting::source(Period::MILLISECOND));
    }

    #[test]
    fn every_field_reaches_the_setting_in_the_units_of_the_model() {
        let mut form = HapticsForm { is_current: true, ..HapticsForm::default() };
        for (field, text) in [
            (&mut form.damping, "0.5"),
            (&mut form.friction, "0"),
            (&mut form.rate, "2000"),
            (&mut form.delay, "2"),
            (&mut form.depth, "25"),
            (&mut form.speed, "80"),
        ] {
            field.text = text.into();
        }
        form.check();
        let (_, setting) = form.wanted().unwrap();
        let wanted = Setting {
            period: Period::of_rate(2000.0).unwrap(),
            drive: DriveKind::Current { amps_per_volt: 1.0 },
            damping: 0.5e-3,
            friction: Some(Newtons(0.0)),
            delay: 2,
            deepest: Depth(25.0),
            speed: MmPerS(80.0),
        };
        assert_eq!(setting, wanted);
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_name() {
        let refusal = |change: fn(&mut HapticsForm) -> &mut QuantityField, text: &str| {
            let mut form = HapticsForm::default();
            change(&mut form).text = text.into();
            form.check();
            form.wanted().unwrap_err()
        };
        assert!(refusal(|form| &mut form.rate, "100").contains("250 Hz"));
        assert!(refusal(|form| &mut form.delay, "1.5").contains("delay: must be a whole"));
        assert!(refusal(|form| &mut form.delay, "17").contains("0 to 16"));
        assert!(refusal(|form| &mut form.damping, "-1").contains("damping: must be 0"));
        assert!(refusal(|form| &mut form.depth, "0").contains("depth: must be above 0"));
    }
}
