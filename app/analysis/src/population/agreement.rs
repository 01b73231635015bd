//! How far the sessions of two operators, rigs, sites or storages agree in one place.

use super::curves::{Workers, best_values, read_curves};
use super::design::{Design, name_of};
use super::{PopulationError, keep, parameter_names};
use crate::fit::FitRecipe;
use crate::progress::Progress;
use crate::report::panels::FigurePanels;
use crate::report::text::{counted, table};
use crate::study_table::{StudyTable, WITHIN, left_out_words, read_study};
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotLevel, PlotSeries};
use palpate_figures::uncertain::significant;
use palpate_population::{Agreement, AgreementError, PairedPlace, agreement};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug)]
pub struct AgreementRequest<'a> {
    /// Sessions and folders of sessions, or one lake.
    pub paths: &'a [PathBuf],
    pub recipe: &'a FitRecipe,
    /// Names of parameters of the model; without any, all of them.
    pub parameters: &'a [String],
    /// The entry that differs, such as `operator`.
    pub between: &'a str,
    /// Number of sessions fitted at a time.
    pub jobs: usize,
}

#[derive(Debug, Error)]
pub enum AgreementFailure {
    #[error(transparent)]
    Population(#[from] PopulationError),
    #[error("two of '{name}' cannot be compared; choose from {}", WITHIN.join(", "))]
    UnknownEntry { name: String },
    #[error(
        "two values of {entry} are compared, and these sessions have {found} ({values}); give sessions of two"
    )]
    Values { entry: &'static str, found: usize, values: String },
    #[error("{parameter}: {reason} (animal, specimen and site together)")]
    Places { parameter: String, reason: AgreementError },
}

/// The agreement of two values of an entry, for each parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgreementReport {
    pub entry: &'static str,
    /// The two values; differences are the second less the first.
    pub values: [String; 2],
    pub parameters: Vec<ParameterAgreement>,
    /// Sessions that could not be fitted, with the reason.
    pub not_fitted: BTreeMap<String, String>,
    /// Sessions that are rejected or press no specimen.
    pub left_out: usize,
    /// Sessions that lack the entry.
    pub without_entry: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterAgreement {
    pub parameter: String,
    /// In logarithms of the parameter.
    #[serde(flatten)]
    pub agreement: Agreement,
    /// Mean of both values and their difference in each place, in logarithms.
    pub places: Vec<PlaceDifference>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaceDifference {
    pub place: String,
    pub mean: f64,
    pub difference: f64,
}

/// Compares the best values of the sessions of each place.
///
/// # Errors
/// The entry has more or fewer than two values, or fewer than three places have both. A session that has no logarithm of a
/// parameter counts as not fitted.
pub fn agreements(
    request: &AgreementRequest<'_>,
    progress: &dyn Progress,
) -> Result<AgreementReport, AgreementFailure> {
    let entry = WITHIN.into_iter().find(|entry| *entry == request.between);
    let name = || request.between.to_owned();
    let entry = entry.ok_or_else(|| AgreementFailure::UnknownEntry { name: name() })?;
    let names = parameter_names(&request.recipe.options, request.parameters)?;
    let mut table = read_study(request.paths).map_err(PopulationError::from)?;
    // The design of the places: every session must say where it was, without a contradiction.
    let levels = ["animal", "specimen"].map(str::to_owned);
    Design::of(&table, &levels, &[]).map_err(PopulationError::from)?;
    let values = two_values(&table, entry)?;
    let without_entry = table.rows.iter().filter(|row| name_of(row, entry).is_none()).count();
    let workers = Workers { jobs: request.jobs, progress };
    let mut not_fitted = BTreeMap::new();
    let curves = read_curves(request.paths, request.recipe, &table, &workers)?;
    let curves = keep(&mut table, curves, &mut not_fitted)?;
    let best = best_values(&names, &request.recipe.options, &curves, &workers)?;
    let best = keep(&mut table, best, &mut not_fitted)?;
    let parameters = names.into_iter().enumerate().map(|(k, parameter)| {
        let places = places(&table, entry, &values, &best, k);
        let agreement = agreement(&places)
            .map_err(|reason| AgreementFailure::Places { parameter: parameter.clone(), reason })?;
        let paired = places.iter().filter_map(PlaceDifference::of).collect();
        Ok(ParameterAgreement { parameter, agreement, places: paired })
    });
    let parameters = parameters.collect::<Result<Vec<_>, AgreementFailure>>()?;
    let left_out = table.left_out.len();
    Ok(AgreementReport { entry, values, parameters, not_fitted, left_out, without_entry })
}

fn two_values(table: &StudyTable, entry: &'static str) -> Result<[String; 2], AgreementFailure> {
    let values: BTreeSet<String> =
        table.rows.iter().filter_map(|row| name_of(row, entry)).collect();
    let values: Vec<String> = values.into_iter().collect();
    values.try_into().map_err(|values: Vec<String>| AgreementFailure::Values {
        entry,
        found: values.len(),
        values: values.join(", "),
    })
}

/// The logarithms of a parameter in each place, by the values of the entry.
fn places(
    table: &StudyTable,
    entry: &str,
    values: &[String; 2],
    best: &[Vec<f64>],
    parameter: usize,
) -> Vec<PairedPlace> {
    let mut places: BTreeMap<String, PairedPlace> = BTreeMap::new();
    for (row, best) in table.rows.iter().zip(best) {
        // Two sites are two places, unless they are what is compared.
        let site = row.site.clone().filter(|_| entry != "specimen.site");
        let path: Vec<String> =
            [row.animal.clone(), row.specimen.clone(), site].into_iter().flatten().collect();
        let name = path.join(" / ");
        let place = places.entry(name.clone()).or_insert_with(|| PairedPlace {
            name,
            first: Vec::new(),
            second: Vec::new(),
        });
        match name_of(row, entry) {
            Some(own) if own == values[0] => place.first.push(best[parameter]),
            Some(_) => place.second.push(best[parameter]),
            None => {}
        }
    }
    places.into_values().collect()
}

impl PlaceDifference {
    fn of(place: &PairedPlace) -> Option<Self> {
        let mean = |values: &[f64]| {
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        let (first, second) = (mean(&place.first)?, mean(&place.second)?);
        let place = place.name.clone();
        Some(Self { place, mean: 0.5 * (first + second), difference: second - first })
    }
}

impl AgreementReport {
    /// A table of factors, a row for each parameter.
    #[must_use]
    pub fn text(&self) -> String {
        let factor = |logarithm: f64| significant(logarithm.exp(), 3);
        let ends = |[low, high]: [f64; 2]| format!("{} to {}", factor(low), factor(high));
        let row = |one: &ParameterAgreement| {
            let Agreement { places, bias, bias_interval, limits, limit_intervals, .. } =
                one.agreement;
            vec![
                one.parameter.clone(),
                places.to_string(),
                format!("{} ({})", factor(bias), ends(bias_interval)),
                format!("{} ({})", factor(limits[0]), ends(limit_intervals[0])),
                format!("{} ({})", factor(limits[1]), ends(limit_intervals[1])),
            ]
        };
        let [first, second] = &self.values;
        let mut text = format!("{}: {second} over {first}\n\n", self.entry);
        text += &table(
            "parameter | places | factor (95 % interval) | lower limit (95 % interval) | upper limit (95 % interval)",
            self.parameters.iter().map(row),
        );
        text.push_str(
            "\n\n95 % of single sessions in one place differ by a factor between the limits",
        );
        for (session, reason) in &self.not_fitted {
            let _ = write!(text, "\n{session} was not fitted: {reason}");
        }
        if self.without_entry > 0 {
            let sessions = counted(self.without_entry, "session");
            let _ = write!(text, "\n{sessions} without {} left out", self.entry);
        }
        if let Some(words) = left_out_words(self.left_out) {
            let _ = write!(text, "\n{words}");
        }
        text
    }

    /// The factor between both over their geometric mean, with bias and limits, for each parameter.
    #[must_use]
    pub fn figure(&self) -> FigurePanels {
        let [first, second] = &self.values;
        FigurePanels {
            title: format!("Agreement of {first} and {second}"),
            words: "factor over geometric mean of each place, with bias and limits of agreement"
                .into(),
            plots: self.parameters.iter().map(|one| self.plot(one)).collect(),
            columns: self.parameters.len().min(2),
            legend: Vec::new(),
        }
    }

    fn plot(&self, one: &ParameterAgreement) -> Plot {
        let points = one.places.iter().map(|place| [place.mean.exp(), place.difference.exp()]);
        let [low, high] = one.agreement.limits.map(f64::exp);
        let level = |at, is_dashed| PlotLevel { is_dashed, ..PlotLevel::plain(at, Ink::Limit) };
        let [first, second] = &self.values;
        let y = PlotAxis::logarithmic(&format!("{second} / {first}"));
        let x = PlotAxis::logarithmic(&format!("geometric mean of {}", one.parameter));
        Plot {
            levels: vec![
                level(low, true),
                level(one.agreement.bias.exp(), false),
                level(high, true),
                PlotLevel::plain(1.0, Ink::Line),
            ],
            ..Plot::new(&one.parameter, x, y).with([PlotSeries::dots(
                "",
                Ink::Series,
                4.0,
                points.collect(),
            )])
        }
    }
}
