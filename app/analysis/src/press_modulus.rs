//! What every Young's modulus of a press rests on, whichever part of the press it is of.

use crate::compliance::ComplianceCorrection;
use crate::material::ValidityRow;
use palpate_indentation::{Indenter, ModulusTerm, Specimen};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Young's modulus of a part of a press, its uncertainty and what was fitted.
#[derive(Clone, Debug, Serialize)]
pub struct PressModulus {
    pub source: PathBuf,
    pub indenter: Indenter,
    pub specimen: Specimen,
    /// In MPa, which is N/mm².
    pub modulus_mpa: f64,
    pub standard_uncertainty_mpa: f64,
    pub total95_mpa: [f64; 2],
    /// The largest first.
    pub budget: Vec<MaterialBudgetRow>,
    /// What the budget does not have, in words.
    pub not_included: Vec<&'static str>,
    /// Samples that were fitted.
    pub samples: usize,
    /// Of the deepest sample from the contact, in mm.
    pub depth_mm: f64,
    pub residual_n: f64,
    /// Standard deviation of a force in N, where it is known.
    pub noise_n: Option<f64>,
    pub validity: Vec<ValidityRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceCorrection>,
    #[serde(skip)]
    pub notes: Vec<String>,
    /// The samples that were fitted, for a plot.
    #[serde(skip)]
    pub curve: Vec<FittedPoint>,
}

/// A sample and the force of what was fitted there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedPoint {
    /// From the contact.
    pub depth_mm: f64,
    pub force_n: f64,
    pub law_n: f64,
}

/// A source of uncertainty of a modulus.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialBudgetRow {
    pub source: &'static str,
    pub mpa: f64,
    /// Share of the variance.
    pub percent: f64,
}

/// Standard uncertainties of a modulus by their sources, and the sources of which nothing is known.
pub(crate) struct ModulusBudget {
    /// In MPa.
    terms: Vec<(&'static str, f64)>,
    pub not_included: Vec<&'static str>,
}

impl ModulusBudget {
    pub fn of(terms: &BTreeMap<ModulusTerm, f64>) -> Self {
        let terms = terms.iter().map(|(term, mpa)| (term.name(), *mpa)).collect();
        Self { terms, not_included: Vec::new() }
    }

    /// Adds what a source does to the modulus; `None` where nothing is known of it.
    pub fn add(&mut self, source: &'static str, mpa: Option<f64>) {
        match mpa {
            Some(mpa) => self.terms.push((source, mpa)),
            None => self.not_included.push(source),
        }
    }

    /// In MPa².
    pub fn variance(&self) -> f64 {
        self.terms.iter().map(|(_, mpa)| mpa * mpa).sum()
    }

    pub fn rows(&self) -> Vec<MaterialBudgetRow> {
        let variance = self.variance();
        let row = |&(source, mpa): &(&'static str, f64)| MaterialBudgetRow {
            source,
            mpa,
            percent: 100.0 * mpa * mpa / variance,
        };
        let mut rows: Vec<MaterialBudgetRow> = self.terms.iter().map(row).collect();
        rows.sort_by(|a, b| b.mpa.total_cmp(&a.mpa));
        rows
    }
}
