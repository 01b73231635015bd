//! A property of the material of a press, with the report of `palpate material --json`.

use crate::error::refused;
use crate::fit::corrections;
use numpy::{IntoPyArray, PyArray1};
use palpate_analysis::edits::author;
use palpate_analysis::material::{ErrorSource, MaterialRequest};
use palpate_analysis::press_modulus::FittedPoint;
use palpate_analysis::property::{Property, PropertyReport, PropertyRequest, find_property};
use palpate_analysis::report::property::property_text;
use palpate_analysis::session_actions::{Attribution, MaterialToStore};
use palpate_indentation::{PoissonBasis, RelaxationFamily};
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// What a property is asked for; quantities and words are JSON.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MaterialOptions {
    indenter: String,
    thickness: Option<String>,
    poisson: String,
    poisson_measured: bool,
    base: String,
    law: String,
    depth_max: Option<f64>,
    contact_error: Option<String>,
    zero_error: Option<String>,
    property: String,
    family: Option<String>,
    terms: Option<usize>,
    frequency: Option<f64>,
    moving_mass: Option<String>,
    analysis: Option<String>,
    include_rejected: bool,
    compliance: Option<String>,
    save: Option<String>,
    by: Option<String>,
    reason: String,
}

fn read<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(refused)
}

/// The word `free`, or a number in JSON.
fn error_source(text: Option<&str>) -> PyResult<ErrorSource> {
    Ok(match text {
        None => ErrorSource::Recorded,
        Some("free") => ErrorSource::Free,
        Some(number) => ErrorSource::Stated(read(number)?),
    })
}

impl MaterialOptions {
    fn request(&self, source: PathBuf) -> PyResult<PropertyRequest> {
        let corrections = corrections(self.compliance.as_deref())?;
        let press = MaterialRequest {
            source,
            columns: None,
            analysis: self.analysis.clone(),
            is_rejected_included: self.include_rejected,
            corrections,
            law: read(&self.law)?,
            indenter: read(&self.indenter)?,
            thickness_mm: self.thickness.as_deref().map(read).transpose()?,
            base: read(&self.base)?,
            poisson_ratio: read(&self.poisson)?,
            poisson_basis: match self.poisson_measured {
                true => PoissonBasis::Measured,
                false => PoissonBasis::Assumed,
            },
            depth_max_mm: self.depth_max,
            contact: error_source(self.contact_error.as_deref())?,
            force_zero: error_source(self.zero_error.as_deref())?,
        };
        Ok(PropertyRequest { press, property: self.property()? })
    }

    fn property(&self) -> PyResult<Property> {
        Ok(match self.property.as_str() {
            "modulus" => Property::Modulus,
            "unloading" => Property::Unloading,
            "relaxation" => Property::Relaxation { family: self.family()? },
            "dynamic" => Property::Dynamic {
                frequency_hz: self.frequency,
                moving_mass_g: self.moving_mass.as_deref().map(read).transpose()?,
            },
            other => return Err(refused(format!("'{other}' is not a property"))),
        })
    }
}

impl MaterialOptions {
    fn family(&self) -> PyResult<Option<RelaxationFamily>> {
        match (self.family.as_deref(), self.terms) {
            (Some("fractional"), None) => Ok(Some(RelaxationFamily::Fractional)),
            (Some("fractional"), Some(_)) => {
                Err(refused("terms belongs to the family prony; leave it out"))
            }
            (None | Some("prony"), terms) => {
                Ok(terms.map(|terms| RelaxationFamily::Prony { terms }))
            }
            (Some(other), _) => Err(refused(format!(
                "'{other}' is not a family of relaxation moduli; choose prony or fractional"
            ))),
        }
    }
}

type Array<'py> = Bound<'py, PyArray1<f64>>;
type Curve<'py> = (Array<'py>, Array<'py>, Array<'py>);
type MaterialTuple<'py> = (String, String, Option<Curve<'py>>, Vec<String>);

/// The report in JSON and in words; of a Young's modulus its curve as depths in mm, forces and forces of what was fitted in N;
/// and remarks.
#[pyfunction]
pub fn fit_material(
    py: Python<'_>,
    source: PathBuf,
    options: MaterialOptions,
) -> PyResult<MaterialTuple<'_>> {
    let request = options.request(source)?;
    let report = py.detach(|| find_property(&request)).map_err(refused)?;
    if let Some(name) = &options.save {
        let who = Attribution { by: author(options.by.as_deref()), reason: options.reason.clone() };
        MaterialToStore::of(&request, &report).store(name, &who).map_err(refused)?;
    }
    let curve = match &report {
        PropertyReport::Modulus(report) => Some(&report.press.curve),
        PropertyReport::Unloading(report) => Some(&report.press.curve),
        PropertyReport::Relaxation(_) | PropertyReport::Dynamic(_) => None,
    };
    let curve = curve.map(|curve| {
        let column = |of: fn(&FittedPoint) -> f64| {
            curve.iter().map(of).collect::<Vec<f64>>().into_pyarray(py)
        };
        (column(|one| one.depth_mm), column(|one| one.force_n), column(|one| one.law_n))
    });
    let text = serde_json::to_string(&report).map_err(refused)?;
    Ok((text, property_text(&report), curve, report.notes().to_vec()))
}
