//! The property that is wanted, the press, the indenter and the specimen as typed.

mod property;
mod shape;

use crate::widgets::{
    QuantityField, UncertainField, choice_ui, quantity_ui, quiet_ui, require, section_ui,
    small_alarm_ui, text_row, tick_box, uncertain_ui,
};
use crate::workbench::ScreenOffers;
use eframe::egui::{Button, Ui};
use palpate_analysis::compliance::ComplianceCorrections;
use palpate_analysis::material::{ErrorSource, MaterialRequest};
use palpate_analysis::property::PropertyRequest;
use palpate_indentation::{Base, ContactLaw, PoissonBasis, Quantity, Specimen};
use property::PropertyForm;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shape::{SHAPES, Shape};
use std::path::{Path, PathBuf};

const BASES: [(Base, &str); 2] =
    [(Base::Bonded, "the specimen sticks to it"), (Base::Frictionless, "the specimen slips on it")];

const LAWS: [(ContactLaw, &str); 3] = [
    (ContactLaw::Layer, "layer on a rigid base"),
    (ContactLaw::Sneddon, "half-space, any shape"),
    (ContactLaw::Hertz, "half-space, shallow sphere"),
];

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum ErrorChoice {
    #[default]
    Recorded,
    Stated,
    Free,
}

const CONTACTS: [(ErrorChoice, &str); 3] = [
    (ErrorChoice::Recorded, "as the session found it"),
    (ErrorChoice::Stated, "with a stated uncertainty"),
    (ErrorChoice::Free, "from the loading alone"),
];

const ZEROS: [(ErrorChoice, &str); 3] = [
    (ErrorChoice::Recorded, "as the session tared it"),
    (ErrorChoice::Stated, "with a stated uncertainty"),
    (ErrorChoice::Free, "from the approach alone"),
];

impl ErrorChoice {
    /// `field` is that of the uncertainty, of this name.
    fn source(self, name: &str, field: &QuantityField) -> Result<ErrorSource, String> {
        Ok(match self {
            Self::Recorded => ErrorSource::Recorded,
            Self::Free => ErrorSource::Free,
            Self::Stated => ErrorSource::Stated(field.named_value(name)?),
        })
    }
}

/// Name of the field of Poisson's ratio, which has room for no more.
const POISSON: &str = "Poisson";

/// What is typed; of it the window keeps everything but the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct MaterialForm {
    #[serde(skip)]
    session: String,
    /// The session that was put into the field last by itself, which the next one in front replaces.
    #[serde(skip)]
    offered: Option<PathBuf>,
    /// The texts that the measured thickness gave the field of the thickness.
    #[serde(skip)]
    measured: Option<[String; 2]>,
    property: PropertyForm,
    shape: Shape,
    radius: UncertainField,
    half_angle: UncertainField,
    edge: UncertainField,
    thickness: UncertainField,
    poisson: UncertainField,
    is_poisson_measured: bool,
    base: Base,
    law: ContactLaw,
    is_depth_limited: bool,
    depth_max: QuantityField,
    contact: ErrorChoice,
    contact_error: QuantityField,
    force_zero: ErrorChoice,
    zero_error: QuantityField,
    /// Depths are corrected with the compliance in force for the session's rig.
    pub is_compliance_corrected: bool,
}

impl Default for MaterialForm {
    fn default() -> Self {
        let empty = || UncertainField::typed(["", "0"]);
        Self {
            session: String::new(),
            offered: None,
            measured: None,
            property: PropertyForm::default(),
            shape: Shape::default(),
            radius: empty(),
            half_angle: empty(),
            edge: empty(),
            thickness: empty(),
            poisson: empty(),
            is_poisson_measured: false,
            base: Base::Bonded,
            law: ContactLaw::Layer,
            is_depth_limited: false,
            depth_max: QuantityField::typed("1".into()),
            contact: ErrorChoice::default(),
            contact_error: QuantityField::typed("0.01".into()),
            force_zero: ErrorChoice::default(),
            zero_error: QuantityField::typed("0".into()),
            is_compliance_corrected: false,
        }
    }
}

impl MaterialForm {
    /// What the next window opens with; none where all is as at first.
    pub fn kept(&self) -> Option<Value> {
        let mut kept = self.clone();
        // What this session measured says nothing of the next one.
        if self.is_thickness_measured() {
            kept.thickness = Self::default().thickness;
        }
        let [kept, usual] = [kept, Self::default()].map(|form| serde_json::to_value(form).ok());
        if kept == usual { None } else { kept }
    }

    /// Takes a session or a table.
    pub fn take(&mut self, path: &Path) {
        self.session = path.display().to_string();
    }

    /// Takes the session in front, until another one is typed.
    pub fn follow(&mut self, front: Option<&PathBuf>) {
        let is_own = match &self.offered {
            Some(offered) => Path::new(&self.session) == offered,
            None => self.session.is_empty(),
        };
        if let Some(front) = front.filter(|front| is_own && self.offered.as_ref() != Some(front)) {
            self.take(front);
            self.offered = Some(front.clone());
        }
    }

    /// The path typed.
    pub fn source(&self) -> &Path {
        Path::new(self.session.trim())
    }

    /// Takes the thickness that the session measured. Where it measured none, one that was typed stays, and one that the
    /// session before measured does not.
    pub fn take_thickness(&mut self, measured: Option<Quantity>) {
        let was_measured = self.is_thickness_measured();
        let round = |value: f64| format!("{}", (value * 1e4).round() / 1e4);
        self.measured = measured.map(|one| [one.value, one.standard_uncertainty].map(round));
        if let Some(texts) = &self.measured {
            self.thickness = UncertainField::typed(texts.each_ref().map(String::as_str));
        } else if was_measured {
            self.thickness = Self::default().thickness;
        }
    }

    /// Limits the depth in mm.
    pub fn limit_depth(&mut self, depth_mm: f64) {
        self.is_depth_limited = true;
        self.depth_max = QuantityField::typed(depth_mm.to_string());
    }

    /// Checks every field.
    pub fn check(&mut self) {
        let shape = self.shape;
        let possible = |size, edge| {
            let indenter = shape.indenter(quantity(size), quantity(edge));
            indenter.shape().map(|_| ()).map_err(|err| err.to_string())
        };
        let size_field = if shape.has_radius() { &mut self.radius } else { &mut self.half_angle };
        // An edge that passes with any size, and the size that the edge must fit.
        size_field.check(|size| possible(size, [f64::MIN_POSITIVE, 0.0]));
        let size = size_field.named_values("size").unwrap_or([1.0, 0.0]);
        self.edge.check(|edge| possible(size, edge));
        // What is not checked here is one that passes.
        let one = Quantity { value: 0.5, standard_uncertainty: 0.0 };
        let specimen = Specimen {
            thickness_mm: one,
            base: self.base,
            poisson_ratio: one,
            poisson_basis: PoissonBasis::Assumed,
        };
        let possible =
            |specimen: Specimen| specimen.layer().map(|_| ()).map_err(|err| err.to_string());
        self.thickness
            .check(|pair| possible(Specimen { thickness_mm: quantity(pair), ..specimen }));
        self.poisson.check(|pair| possible(Specimen { poisson_ratio: quantity(pair), ..specimen }));
        self.depth_max.check(|depth| require(depth > 0.0, "must be above 0"));
        self.property.check();
        for error in [&mut self.contact_error, &mut self.zero_error] {
            error.check(|error| require(error >= 0.0, "must be 0 or more"));
        }
    }

    /// What is to be found, its depths as they were measured, or the first thing that is wrong.
    pub fn request(&self) -> Result<PropertyRequest, String> {
        Ok(PropertyRequest { press: self.press()?, property: self.property.property()? })
    }

    fn press(&self) -> Result<MaterialRequest, String> {
        let source = self.source();
        require(!source.as_os_str().is_empty(), "choose a session first")?;
        let (name, size) = self.size();
        let size = quantity(size.named_values(name)?);
        let edge = match self.shape.edge() {
            Some((name, _)) => quantity(self.edge.named_values(name)?),
            None => quantity([0.0; 2]),
        };
        let is_measured = self.is_thickness_measured();
        let thickness = quantity(self.thickness.named_values("thickness")?);
        let poisson_ratio = quantity(self.poisson.named_values(POISSON)?);
        self.law_verdict()?;
        let wanted = self.property.choice;
        let is_limited = self.is_depth_limited && wanted.is_loading();
        let depth_max_mm = is_limited.then(|| self.depth_max.named_value("depth")).transpose()?;
        self.contact_verdict()?;
        let force_zero = match wanted.has_force_zero() {
            true => self.force_zero.source("force zero", &self.zero_error)?,
            false => ErrorSource::Recorded,
        };
        Ok(MaterialRequest {
            source: source.to_owned(),
            columns: None,
            analysis: None,
            is_rejected_included: false,
            corrections: ComplianceCorrections::none(None),
            law: self.law,
            indenter: self.shape.indenter(size, edge),
            thickness_mm: (!is_measured).then_some(thickness),
            base: self.base,
            poisson_ratio,
            poisson_basis: match self.is_poisson_measured {
                true => PoissonBasis::Measured,
                false => PoissonBasis::Assumed,
            },
            depth_max_mm,
            contact: self.contact.source("contact", &self.contact_error)?,
            force_zero,
        })
    }

    fn size(&self) -> (&'static str, &UncertainField) {
        match self.shape.has_radius() {
            true => ("radius", &self.radius),
            false => ("half angle", &self.half_angle),
        }
    }

    fn is_thickness_measured(&self) -> bool {
        self.measured.as_ref().is_some_and(|texts| *texts == self.thickness.texts())
    }

    fn law_verdict(&self) -> Result<(), String> {
        let is_hertz = self.law == ContactLaw::Hertz && self.property.choice.has_law();
        let is_possible = !is_hertz || self.shape == Shape::Sphere;
        require(is_possible, "this law describes a sphere only; choose another law")
    }

    /// Only a loading shows where contact is.
    fn contact_verdict(&self) -> Result<(), String> {
        let is_known = self.property.choice.is_loading() || self.contact != ErrorChoice::Free;
        require(is_known, "only the modulus of a loading finds the contact; choose another one")
    }

    /// Draws the fields; true when the button of the session dialog is pressed.
    pub fn ui(&mut self, ui: &mut Ui, offers: &ScreenOffers) -> bool {
        section_ui(ui, "Press");
        self.property.choice_ui(ui);
        text_row(ui, "session", "a session's folder, or a table", &mut self.session);
        let mut is_dialog_pressed = false;
        ui.horizontal_wrapped(|ui| {
            for (name, session) in [("In review", &offers.review), ("In library", &offers.library)]
            {
                let button = ui.add_enabled(session.is_some(), Button::new(name));
                if let (true, Some(session)) = (button.clicked(), session) {
                    self.take(session);
                }
            }
            is_dialog_pressed = ui.button("Choose a session...").clicked();
        });
        self.indenter_ui(ui);
        self.specimen_ui(ui);
        self.law_ui(ui);
        is_dialog_pressed
    }

    fn indenter_ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "Indenter");
        choice_ui(ui, "shape", &mut self.shape, &SHAPES);
        match self.shape.has_radius() {
            true => {
                let wanted = "the radius with its standard uncertainty, 0 for exact";
                uncertain_ui(ui, ["radius", "mm", wanted], &mut self.radius);
            }
            false => {
                let wanted = "between axis and flank, with its standard uncertainty";
                uncertain_ui(ui, ["half angle", "°", wanted], &mut self.half_angle);
            }
        }
        if let Some((name, wanted)) = self.shape.edge() {
            uncertain_ui(ui, [name, "mm", wanted], &mut self.edge);
        }
    }

    fn specimen_ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "Specimen");
        let wanted = "the session measured none; type it with its standard uncertainty";
        uncertain_ui(ui, ["thickness", "mm", wanted], &mut self.thickness);
        if self.is_thickness_measured() {
            quiet_ui(ui, "as the session measured it by touching the base");
        }
        choice_ui(ui, "base", &mut self.base, &BASES);
        let wanted =
            "Poisson's ratio, 0 to 0.5; the modulus changes with it, so there is no default";
        uncertain_ui(ui, [POISSON, "", wanted], &mut self.poisson);
        tick_box(ui, &mut self.is_poisson_measured, "measured on this tissue, not assumed");
    }

    fn law_ui(&mut self, ui: &mut Ui) {
        let wanted = self.property.choice;
        section_ui(ui, if wanted.has_law() { "Law" } else { "Contact" });
        if wanted.has_law() {
            choice_ui(ui, "law", &mut self.law, &LAWS);
        }
        if let Err(reason) = self.law_verdict() {
            small_alarm_ui(ui, reason);
        }
        if wanted.is_loading() {
            tick_box(ui, &mut self.is_depth_limited, "a part of the loading only");
            if self.is_depth_limited {
                quantity_ui(ui, "depth", "mm, greatest", &mut self.depth_max);
            }
        }
        self.property.ui(ui);
        // What the loading alone shows stands last.
        let count = if wanted.is_loading() { CONTACTS.len() } else { CONTACTS.len() - 1 };
        choice_ui(ui, "contact", &mut self.contact, &CONTACTS[..count]);
        if let Err(reason) = self.contact_verdict() {
            small_alarm_ui(ui, reason);
        }
        if self.contact == ErrorChoice::Stated {
            quantity_ui(ui, "uncertainty", "mm, standard", &mut self.contact_error);
        }
        if wanted.has_force_zero() {
            choice_ui(ui, "force zero", &mut self.force_zero, &ZEROS);
            if self.force_zero == ErrorChoice::Stated {
                quantity_ui(ui, "zero error", "N, standard", &mut self.zero_error);
            }
        }
        tick_box(ui, &mut self.is_compliance_corrected, "correct depths for machine compliance");
    }
}

const fn quantity([value, standard_uncertainty]: [f64; 2]) -> Quantity {
    Quantity { value, standard_uncertainty }
}

#[cfg(test)]
mod tests;
