//! The material, the device, the loop and the hand as typed.

use crate::widgets::{
    NamedControl, QuantityField, check_rate, form_label, quantity_ui, quiet_ui, require,
    section_ui, text_row,
};
use crate::workbench::ScreenOffers;
use eframe::egui::{Button, Ui};
use palpate_analysis::haptics::{HapticSettings, THESIS};
use palpate_haptics::{DriveKind, Period, TorqueSettings};
use palpate_model::units::{Depth, MmPerS, Newtons};
use std::path::{Path, PathBuf};

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

/// Friction of the source's motor at the rack in N, the first text of its field.
fn usual_friction() -> String {
    format!("{:.3}", TorqueSettings::default().friction().0)
}

impl Default for HapticsForm {
    fn default() -> Self {
        let usual = HapticSettings::source(Period::MILLISECOND);
        Self {
            body: THESIS.into(),
            is_current: false,
            damping: QuantityField::new(0.0),
            friction: QuantityField::typed(usual_friction()),
            rate: QuantityField::new(usual.period.hz()),
            delay: QuantityField::new(0.0),
            depth: QuantityField::new(usual.deepest.0),
            speed: QuantityField::new(usual.speed.0),
        }
    }
}

impl HapticsForm {
    /// Takes a session or a table whose fit is felt.
    pub fn take(&mut self, path: &Path) {
        self.body = path.display().to_string();
    }

    /// Checks every field.
    pub fn check(&mut self) {
        let not_negative = |value: f64| require(value >= 0.0, "must be 0 or more");
        let up_to = |value: f64, most: f64| {
            require(value > 0.0 && value <= most, format!("must be above 0 and at most {most}"))
        };
        self.damping.check(not_negative);
        self.friction.check(not_negative);
        self.rate.check(check_rate);
        let most = f64::from(HapticSettings::DELAY_MAX);
        self.delay.check(|delay| {
            let is_valid = (0.0..=most).contains(&delay) && delay.fract() == 0.0;
            require(is_valid, format!("must be a whole number from 0 to {most}"))
        });
        self.depth.check(|depth| up_to(depth, HapticSettings::DEPTH_MAX));
        self.speed.check(|speed| up_to(speed, HapticSettings::SPEED_MAX));
    }

    /// The source of the material and the setting, or the first thing that is wrong.
    pub fn request(&self) -> Result<(PathBuf, HapticSettings), String> {
        let body = self.body.trim();
        let words = format!("type the path of a session folder or of a table, or '{THESIS}'");
        require(!body.is_empty(), words)?;
        let rate = self.rate.named_value("rate")?;
        let period = Period::of_rate(rate).map_err(|err| err.to_string())?;
        let usual = HapticSettings::source(period);
        let friction = self.friction.named_value("friction")?;
        let setting = HapticSettings {
            period,
            drive: match self.is_current {
                false => usual.drive,
                true => DriveKind::Current { amps_per_volt: 1.0 },
            },
            // N s/m in catalogues, N s/mm in the model.
            damping: 1e-3 * self.damping.named_value("damping")?,
            // Unchanged it is the motor's own, to the last digit.
            friction: (self.friction.text != usual_friction()).then_some(Newtons(friction)),
            delay: self.delay.named_value("delay")? as usize,
            deepest: Depth(self.depth.named_value("depth")?),
            speed: MmPerS(self.speed.named_value("speed")?),
        };
        Ok((PathBuf::from(body), setting))
    }

    /// Draws the fields; true when the button of the session dialog is pressed.
    pub fn ui(&mut self, ui: &mut Ui, offers: &ScreenOffers) -> bool {
        section_ui(ui, "Material");
        text_row(ui, "body", "a session's folder, a table, or 'thesis'", &mut self.body);
        let mut is_dialog_pressed = false;
        ui.horizontal_wrapped(|ui| {
            if ui.button("Source thesis").clicked() {
                self.body = THESIS.into();
            }
            for (name, session) in [("In review", &offers.review), ("In library", &offers.library)]
            {
                let button = ui.add_enabled(session.is_some(), Button::new(name));
                if let (true, Some(session)) = (button.clicked(), session) {
                    self.take(session);
                }
            }
            is_dialog_pressed = ui.button("Choose a session...").clicked();
        });
        section_ui(ui, "Device");
        ui.horizontal(|ui| {
            form_label(ui, "drive");
            ui.radio_value(&mut self.is_current, false, "voltage").named("voltage");
            ui.radio_value(&mut self.is_current, true, "current").named("current");
        });
        let damps = match self.is_current {
            false => "the motor's back-EMF adds damping",
            true => "the motor adds no damping",
        };
        quiet_ui(ui, damps);
        quantity_ui(ui, "damping", "N s/m, own", &mut self.damping);
        quantity_ui(ui, "friction", "N", &mut self.friction);
        section_ui(ui, "Loop");
        quantity_ui(ui, "rate", "ticks a second", &mut self.rate);
        quantity_ui(ui, "delay", "ticks", &mut self.delay);
        section_ui(ui, "Hand");
        quantity_ui(ui, "depth", "mm, stroke", &mut self.depth);
        quantity_ui(ui, "speed", "mm/s", &mut self.speed);
        is_dialog_pressed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unchanged_form_is_the_source_device() {
        let mut form = HapticsForm::default();
        form.check();
        let (body, setting) = form.request().unwrap();
        assert_eq!(body, Path::new(THESIS));
        assert_eq!(setting, HapticSettings::source(Period::MILLISECOND));
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
        let (_, setting) = form.request().unwrap();
        let expected = HapticSettings {
            period: Period::of_rate(2000.0).unwrap(),
            drive: DriveKind::Current { amps_per_volt: 1.0 },
            damping: 0.5e-3,
            friction: Some(Newtons(0.0)),
            delay: 2,
            deepest: Depth(25.0),
            speed: MmPerS(80.0),
        };
        assert_eq!(setting, expected);
    }

    #[test]
    fn impossible_values_are_refused_by_name() {
        let refusal = |change: fn(&mut HapticsForm) -> &mut QuantityField, text: &str| {
            let mut form = HapticsForm::default();
            change(&mut form).text = text.into();
            form.check();
            form.request().unwrap_err()
        };
        assert!(refusal(|form| &mut form.rate, "100").contains("250 Hz"));
        assert!(refusal(|form| &mut form.delay, "1.5").contains("delay: must be a whole"));
        assert!(refusal(|form| &mut form.delay, "17").contains("0 to 16"));
        assert!(refusal(|form| &mut form.damping, "-1").contains("damping: must be 0"));
        assert!(refusal(|form| &mut form.depth, "0").contains("depth: must be above 0"));
    }
}
