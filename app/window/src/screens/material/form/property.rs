//! The property that is wanted, and what is typed for it alone.

use super::quantity;
use crate::widgets::{
    QuantityField, UncertainField, choice_ui, quantity_ui, require, tick_box, uncertain_ui,
};
use eframe::egui::Ui;
use palpate_analysis::property::Property;
use palpate_indentation::RelaxationFamily;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum PropertyChoice {
    #[default]
    Modulus,
    Unloading,
    Relaxation,
    Dynamic,
}

const PROPERTIES: [(PropertyChoice, &str); 4] = [
    (PropertyChoice::Modulus, "modulus of the loading"),
    (PropertyChoice::Unloading, "modulus of the unloading"),
    (PropertyChoice::Relaxation, "relaxation modulus"),
    (PropertyChoice::Dynamic, "dynamic moduli"),
];

/// Exponentials up to as many as are tried, and the fractional Zener model.
const FAMILIES: [(Option<RelaxationFamily>, &str); 7] = [
    (None, "as many as are seen"),
    (Some(RelaxationFamily::Prony { terms: 1 }), "1"),
    (Some(RelaxationFamily::Prony { terms: 2 }), "2"),
    (Some(RelaxationFamily::Prony { terms: 3 }), "3"),
    (Some(RelaxationFamily::Prony { terms: 4 }), "4"),
    (Some(RelaxationFamily::Prony { terms: 5 }), "5"),
    (Some(RelaxationFamily::Fractional), "of a fractional Zener model"),
];

impl PropertyChoice {
    pub const fn is_loading(self) -> bool {
        matches!(self, Self::Modulus)
    }

    /// The method of an unloading stands on a half-space.
    pub const fn has_law(self) -> bool {
        !matches!(self, Self::Unloading)
    }

    pub const fn has_force_zero(self) -> bool {
        matches!(self, Self::Modulus | Self::Unloading)
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct PropertyForm {
    pub choice: PropertyChoice,
    family: Option<RelaxationFamily>,
    is_one_sine: bool,
    frequency: QuantityField,
    has_moving_mass: bool,
    moving_mass: UncertainField,
}

impl Default for PropertyForm {
    fn default() -> Self {
        Self {
            choice: PropertyChoice::default(),
            family: None,
            is_one_sine: false,
            frequency: QuantityField::typed("1".into()),
            has_moving_mass: false,
            moving_mass: UncertainField::typed(["", "0"]),
        }
    }
}

impl PropertyForm {
    pub fn check(&mut self) {
        self.frequency.check(|frequency| require(frequency > 0.0, "must be above 0"));
        self.moving_mass.check(|[mass, error]| {
            require(mass >= 0.0 && error >= 0.0, "must be 0 or more, and its uncertainty too")
        });
    }

    /// The property that is wanted, or what is wrong.
    pub fn property(&self) -> Result<Property, String> {
        Ok(match self.choice {
            PropertyChoice::Modulus => Property::Modulus,
            PropertyChoice::Unloading => Property::Unloading,
            PropertyChoice::Relaxation => Property::Relaxation { family: self.family },
            PropertyChoice::Dynamic => {
                let frequency = || self.frequency.named_value("frequency");
                let mass = || self.moving_mass.named_values("moving mass").map(quantity);
                Property::Dynamic {
                    frequency_hz: self.is_one_sine.then(frequency).transpose()?,
                    moving_mass_g: self.has_moving_mass.then(mass).transpose()?,
                }
            }
        })
    }

    /// Draws the list of properties.
    pub fn choice_ui(&mut self, ui: &mut Ui) {
        choice_ui(ui, "property", &mut self.choice, &PROPERTIES);
    }

    /// Draws what the chosen property needs alone.
    pub fn ui(&mut self, ui: &mut Ui) {
        match self.choice {
            PropertyChoice::Modulus | PropertyChoice::Unloading => {}
            PropertyChoice::Relaxation => {
                choice_ui(ui, "terms", &mut self.family, &FAMILIES);
            }
            PropertyChoice::Dynamic => {
                tick_box(ui, &mut self.is_one_sine, "the whole record is one sine");
                if self.is_one_sine {
                    quantity_ui(ui, "frequency", "Hz", &mut self.frequency);
                }
                let words = "a mass moves below the load cell";
                tick_box(ui, &mut self.has_moving_mass, words);
                if self.has_moving_mass {
                    let wanted = "of probe and rod, with its standard uncertainty";
                    uncertain_ui(ui, ["moving mass", "g", wanted], &mut self.moving_mass);
                }
            }
        }
    }
}
