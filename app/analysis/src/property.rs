//! The properties of a material that a press shows, found in one way for every front end.

use crate::dynamic::{DynamicError, DynamicReport, DynamicRequest, dynamic};
use crate::material::{MaterialError, MaterialReport, MaterialRequest, material};
use crate::relaxation::{RelaxationError, RelaxationReport, RelaxationRequest, relaxation};
use crate::unloading::{UnloadingError, UnloadingReport, unloading};
use palpate_indentation::{Quantity, RelaxationFamily};
use serde::Serialize;
use thiserror::Error;

/// A property with the options that are its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Property {
    /// Young's modulus of the loading.
    Modulus,
    /// Young's modulus of the unloading.
    Unloading,
    /// The relaxation modulus of ramp and hold.
    Relaxation {
        /// `None` takes as many terms of a Prony series as the record is worth.
        family: Option<RelaxationFamily>,
    },
    /// Storage and loss modulus of sines.
    Dynamic {
        /// Takes all of the record as one sine of this frequency in Hz; `None` takes the sines of a session.
        frequency_hz: Option<f64>,
        /// What moves between load cell and specimen, in g.
        moving_mass_g: Option<Quantity>,
    },
}

/// A press and the property that is wanted of it.
#[derive(Debug)]
pub struct PropertyRequest {
    pub press: MaterialRequest,
    pub property: Property,
}

/// A property and all it rests on; serialized as its own report.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum PropertyReport {
    Modulus(MaterialReport),
    Unloading(UnloadingReport),
    Relaxation(RelaxationReport),
    Dynamic(DynamicReport),
}

#[derive(Debug, Error)]
pub enum PropertyError {
    #[error(transparent)]
    Modulus(#[from] MaterialError),
    #[error(transparent)]
    Unloading(#[from] UnloadingError),
    #[error(transparent)]
    Relaxation(#[from] RelaxationError),
    #[error(transparent)]
    Dynamic(#[from] DynamicError),
}

/// The property of a session or a table.
pub fn find_property(request: &PropertyRequest) -> Result<PropertyReport, PropertyError> {
    let press = &request.press;
    Ok(match request.property {
        Property::Modulus => PropertyReport::Modulus(material(press)?),
        Property::Unloading => PropertyReport::Unloading(unloading(press)?),
        Property::Relaxation { family } => {
            PropertyReport::Relaxation(relaxation(RelaxationRequest { press, family })?)
        }
        Property::Dynamic { frequency_hz, moving_mass_g } => {
            let request = DynamicRequest { press, frequency_hz, moving_mass_g };
            PropertyReport::Dynamic(dynamic(request)?)
        }
    })
}

impl PropertyReport {
    /// Remarks on the data.
    pub fn notes(&self) -> &[String] {
        match self {
            Self::Modulus(report) => &report.press.notes,
            Self::Unloading(report) => &report.press.notes,
            Self::Relaxation(report) => &report.notes,
            Self::Dynamic(report) => &report.notes,
        }
    }
}
