//! Prediction of what a fit has not seen: another speed, another depth, another specimen, or the rest
//! of the same record.
//!
//! The body is fitted to the other records alone. What the held-out record has of its own, its sensor
//! offset, is found on that record, because no other determines it; the body is not.

use super::facts::{RecordFacts, are_unlike};
use crate::families::Model;
use crate::fit::{FitError, FitOptions, FitSample, fit_body, predict};
use serde::Serialize;
use std::str::FromStr;
use thiserror::Error;

/// Samples that the rest of a record needs to be worth predicting, and its beginning to be fitted.
const REST_MIN: usize = 10;
/// Share of what follows the ramp that a single record's fit sees.
const SEEN: f64 = 1.0 / 3.0;

palpate_model::named! {
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum HoldOut {
        /// Each record in turn; of a single record its last part.
        #[default]
        Auto = "auto",
        /// All records of one speed in turn.
        Speed = "speed",
        /// All records of one depth in turn.
        Depth = "depth",
        /// Each record in turn, taken for a specimen of its own.
        Specimen = "specimen",
        None = "none",
    }
}

/// Nothing can be held out as asked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum HoldOutError {
    #[error("'{0}' cannot be held out; choose auto, speed, depth, specimen or none")]
    Unknown(String),
    #[error(
        "no {what} can be held out, because the {records} record(s) contain only one {what}; add records of another {what}, or hold out 'auto'"
    )]
    AllAlike { what: &'static str, records: usize },
    #[error(
        "no specimen can be held out, because {record} does not state its specimen; give a specimen for each source, or hold out 'auto'"
    )]
    NoSpecimen { record: String },
}

impl FromStr for HoldOut {
    type Err = HoldOutError;

    fn from_str(text: &str) -> Result<Self, HoldOutError> {
        let found = Self::ALL.into_iter().find(|one| one.name() == text);
        found.ok_or_else(|| HoldOutError::Unknown(text.to_owned()))
    }
}

palpate_model::named! {
    /// Difference of a held-out record from the fitted ones.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum HeldOutKind {
        Speed = "an unseen speed",
        Depth = "an unseen depth",
        SpeedAndDepth = "an unseen speed and depth",
        /// Neither speed nor depth: another specimen, or a repetition.
        Specimen = "another specimen or a repetition",
        /// The last part of a record whose first part was seen: nothing but time.
        Rest = "the rest of the record",
    }
}

/// Error of a family over everything held out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoldOutPrediction {
    /// Root mean square over records, each counting the same, in N; the noise of the records is in it.
    pub rms_n: f64,
    /// Standard error of the mean over records, in N; null for one record.
    pub std_error_n: Option<f64>,
    /// Largest error in N.
    pub worst_n: f64,
    /// As `rms_n`, with one factor on the whole body for each record: what is left where the level is the
    /// specimen's own.
    pub scaled_rms_n: f64,
    pub records: Vec<RecordPrediction>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordPrediction {
    pub record: String,
    pub unseen: HeldOutKind,
    /// Root mean square error in N.
    pub rms_n: f64,
    /// Largest error in N.
    pub worst_n: f64,
    /// Factor on the body that fits it best.
    pub scale: f64,
    /// Root mean square error with that factor, in N.
    pub scaled_rms_n: f64,
}

/// Records left out together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fold {
    pub test: Vec<usize>,
    /// Samples of a single record that its fit sees.
    pub cut: Option<usize>,
}

/// Records left out in turn; empty where none can be.
pub(super) fn folds(
    hold_out: HoldOut,
    facts: &[RecordFacts],
    samples: &[&[FitSample]],
) -> Result<Vec<Fold>, HoldOutError> {
    let each = || -> Vec<Fold> {
        let one = |index| Fold { test: vec![index], cut: None };
        (0..facts.len()).map(one).collect()
    };
    let (groups, what) = match hold_out {
        HoldOut::None => return Ok(Vec::new()),
        HoldOut::Auto if facts.len() == 1 => {
            let cut = cut(&facts[0], samples[0]);
            return Ok(cut.map(|cut| Fold { test: vec![0], cut: Some(cut) }).into_iter().collect());
        }
        HoldOut::Auto => return Ok(each()),
        HoldOut::Specimen => (by_specimen(facts)?, "specimen"),
        HoldOut::Speed => {
            (group_alike(facts.iter().map(|one| one.speed_mm_per_s).collect()), "speed")
        }
        HoldOut::Depth => (group_alike(facts.iter().map(|one| one.depth_mm).collect()), "depth"),
    };
    if groups.len() < 2 {
        return Err(HoldOutError::AllAlike { what, records: facts.len() });
    }
    Ok(groups)
}

/// Records of one specimen, together.
fn by_specimen(facts: &[RecordFacts]) -> Result<Vec<Fold>, HoldOutError> {
    let mut groups: Vec<(&str, Fold)> = Vec::new();
    for (index, one) in facts.iter().enumerate() {
        let Some(specimen) = &one.specimen else {
            return Err(HoldOutError::NoSpecimen { record: one.record.clone() });
        };
        match groups.iter_mut().find(|(known, _)| known == specimen) {
            Some((_, group)) => group.test.push(index),
            None => groups.push((specimen, Fold { test: vec![index], cut: None })),
        }
    }
    Ok(groups.into_iter().map(|(_, group)| group).collect())
}

/// Records whose numbers are alike, together.
fn group_alike(values: Vec<f64>) -> Vec<Fold> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut groups: Vec<Fold> = Vec::new();
    for index in order {
        match groups.last_mut() {
            Some(group) if !are_unlike(values[group.test[0]], values[index]) => {
                group.test.push(index);
            }
            _ => groups.push(Fold { test: vec![index], cut: None }),
        }
    }
    groups
}

/// Samples up to a third of the time after the ramp; `None` where too few lie on either side.
fn cut(facts: &RecordFacts, samples: &[FitSample]) -> Option<usize> {
    let (arrival, end) = (samples.get(facts.arrival)?.t.0, samples.last()?.t.0);
    let until = arrival + SEEN * (end - arrival);
    let cut = samples.partition_point(|sample| sample.t.0 <= until);
    let counted = |part: &[FitSample]| part.iter().filter(|one| one.is_measured()).count();
    let (seen, rest) = samples.split_at(cut);
    (counted(seen) >= REST_MIN && counted(rest) >= REST_MIN).then_some(cut)
}

/// Difference of a record from those that a fold leaves.
fn classify_unseen(facts: &[RecordFacts], record: usize, test: &[usize]) -> HeldOutKind {
    let train = || (0..facts.len()).filter(|index| !test.contains(index));
    let one = &facts[record];
    let is_new = |value: fn(&RecordFacts) -> f64| {
        train().all(|index| are_unlike(value(&facts[index]), value(one)))
    };
    match (is_new(|one| one.speed_mm_per_s), is_new(|one| one.depth_mm)) {
        (true, true) => HeldOutKind::SpeedAndDepth,
        (true, false) => HeldOutKind::Speed,
        (false, true) => HeldOutKind::Depth,
        (false, false) => HeldOutKind::Specimen,
    }
}

/// How a family's body of the records that a fold leaves predicts those it takes.
pub(super) fn predict_fold(
    options: &FitOptions,
    records: &[(&str, &[FitSample])],
    facts: &[RecordFacts],
    fold: &Fold,
) -> Result<Vec<RecordPrediction>, FitError> {
    let train: Vec<(&str, &[FitSample])> = match fold.cut {
        Some(cut) => vec![(records[0].0, &records[0].1[..cut])],
        None => {
            let training = records.iter().enumerate();
            training
                .filter(|(index, _)| !fold.test.contains(index))
                .map(|(_, record)| *record)
                .collect()
        }
    };
    let body: Model = fit_body(&train, options)?;
    let one = |&index: &usize| {
        let (name, samples) = records[index];
        let all = 0..samples.len();
        let (own, score) = match fold.cut {
            Some(cut) => (0..cut, cut..samples.len()),
            None => (all.clone(), all),
        };
        let predicted = predict(&body, samples, own, score)?;
        Ok(RecordPrediction {
            record: name.to_owned(),
            unseen: match fold.cut {
                Some(_) => HeldOutKind::Rest,
                None => classify_unseen(facts, index, &fold.test),
            },
            rms_n: predicted.rms,
            worst_n: predicted.worst,
            scale: predicted.scale,
            scaled_rms_n: predicted.scaled_rms,
        })
    };
    fold.test.iter().map(one).collect()
}

impl HoldOutPrediction {
    /// Records together; `None` without any.
    pub(super) fn of(records: Vec<RecordPrediction>) -> Option<Self> {
        if records.is_empty() {
            return None;
        }
        let count = records.len() as f64;
        let root_mean = |value: fn(&RecordPrediction) -> f64| {
            (records.iter().map(|one| value(one).powi(2)).sum::<f64>() / count).sqrt()
        };
        let errors: Vec<f64> = records.iter().map(|one| one.rms_n).collect();
        Some(Self {
            rms_n: root_mean(|one| one.rms_n),
            std_error_n: std_error(&errors),
            worst_n: records.iter().fold(0.0, |all, one| all.max(one.worst_n)),
            scaled_rms_n: root_mean(|one| one.scaled_rms_n),
            records,
        })
    }

    /// Standard error of the mean difference of two families over the same records, in N; `None` for
    /// one record.
    pub(super) fn difference_error(&self, other: &Self) -> Option<f64> {
        let pairs = self.records.iter().zip(&other.records);
        let differences: Vec<f64> = pairs.map(|(one, two)| one.rms_n - two.rms_n).collect();
        std_error(&differences)
    }
}

/// Standard error of a mean; `None` for fewer than two values.
fn std_error(values: &[f64]) -> Option<f64> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (square / (count - 1.0) / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(speed: f64, depth: f64) -> RecordFacts {
        RecordFacts {
            record: String::new(),
            samples: 0,
            depth_mm: depth,
            speed_mm_per_s: speed,
            peak_n: 1.0,
            arrival: 0,
            specimen: None,
        }
    }

    #[test]
    fn held_out_kind_follows_speed_and_depth() {
        let mut facts = [facts(1.0, 10.0), facts(1.02, 20.0), facts(5.0, 20.5), facts(1.0, 20.0)];
        for (one, specimen) in facts.iter_mut().zip(["A", "B", "A", "B"]) {
            one.specimen = Some(specimen.into());
        }
        assert_eq!(classify_unseen(&facts, 0, &[0]), HeldOutKind::Depth);
        assert_eq!(classify_unseen(&facts, 1, &[1]), HeldOutKind::Specimen);
        assert_eq!(classify_unseen(&facts, 2, &[2]), HeldOutKind::Speed);
        let tests = |hold_out| -> Vec<Vec<usize>> {
            let folds = folds(hold_out, &facts, &[&[] as &[FitSample]; 4]).unwrap();
            folds.into_iter().map(|fold| fold.test).collect()
        };
        assert_eq!(tests(HoldOut::Speed), [vec![0, 3, 1], vec![2]]);
        assert_eq!(tests(HoldOut::Depth), [vec![0], vec![1, 3, 2]]);
        assert_eq!(tests(HoldOut::Auto).len(), 4);
        assert!(tests(HoldOut::None).is_empty());
        assert_eq!(tests(HoldOut::Specimen), [vec![0, 2], vec![1, 3]]);
        let mut nameless = facts.clone();
        nameless[1].specimen = None;
        let refused = folds(HoldOut::Specimen, &nameless, &[&[] as &[FitSample]; 4]).unwrap_err();
        assert!(matches!(refused, HoldOutError::NoSpecimen { .. }));
        let alone = folds(HoldOut::Speed, &facts[..2], &[&[] as &[FitSample]; 2]).unwrap_err();
        let (what, records) = ("speed", 2);
        assert_eq!(alone, HoldOutError::AllAlike { what, records });
    }

    #[test]
    fn standard_error_of_a_mean_is_exact() {
        assert_eq!(std_error(&[1.0]), None);
        // Variance 1 of 1, 2, 3; its mean errs by 1 over the root of 3.
        assert!((std_error(&[1.0, 2.0, 3.0]).unwrap() - 3f64.sqrt().recip()).abs() < 1e-15);
    }
}
