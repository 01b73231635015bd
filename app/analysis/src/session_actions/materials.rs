//! A property of the material of a session, and its stored form.

use super::actions::keep;
use super::{Attribution, SessionActionError};
use crate::analysed_session;
use crate::material_lake::error_setting;
use crate::property::{Property, PropertyReport, PropertyRequest};
use crate::report::property::property_text;
use palpate_indentation::RelaxationFamily;
use palpate_sessions::analyses::{Analysis, AnalysisContent, MATERIAL_VERSION};
use serde_json::{Value, json};
use std::path::PathBuf;

/// A property that can be stored with its session.
#[derive(Clone, Debug)]
pub struct MaterialToStore {
    session: PathBuf,
    based_on: Option<String>,
    settings: Value,
    results: Value,
    words: String,
}

impl MaterialToStore {
    #[must_use]
    pub fn of(request: &PropertyRequest, report: &PropertyReport) -> Self {
        let press = &request.press;
        // Everything else that was asked for is in the report.
        let mut settings = json!({
            "depth_max_mm": press.depth_max_mm,
            "contact": error_setting(press.contact),
            "force_zero": error_setting(press.force_zero),
            "include_rejected": press.is_rejected_included,
        });
        match request.property {
            Property::Modulus | Property::Unloading => {}
            Property::Relaxation { family } => {
                settings["terms"] = match family {
                    Some(RelaxationFamily::Prony { terms }) => json!(terms),
                    _ => Value::Null,
                };
            }
            Property::Dynamic { frequency_hz, .. } => {
                settings["frequency_hz"] = json!(frequency_hz);
            }
        }
        Self {
            session: press.source.clone(),
            based_on: press.analysis.clone(),
            settings,
            results: json!(report),
            words: property_text(report),
        }
    }

    /// Stores it as an analysis of this name beside its session.
    pub fn store(self, name: &str, who: &Attribution) -> Result<Analysis, SessionActionError> {
        let opened = analysed_session::open(&self.session, self.based_on.as_deref())?;
        let inputs = opened.inputs(&self.session, self.based_on.as_deref())?;
        let what = AnalysisContent::Material {
            material_version: MATERIAL_VERSION,
            based_on: self.based_on,
            settings: self.settings,
            results: self.results,
            words: self.words,
        };
        let id = &opened.edited.session.manifest.session_id;
        keep(&self.session, id, name, inputs, what, who)
    }
}
