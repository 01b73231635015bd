//! What a reader or a reviewer will miss in a crate, after published recommendations on what to report.

use super::contents::CrateSession;
use super::study_file::CrateStudy;
use super::terms;
use crate::report::text::counted;
use palpate_model::calibration::CalibrationUse;
use palpate_model::metadata::{METADATA_KEYS, plain_value};
use palpate_protocols::plans::{Plan, Step};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// A published recommendation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Recommendation {
    /// In the form of a list of references.
    pub citation: &'static str,
    pub url: &'static str,
    /// As it is named in a sentence.
    #[serde(skip)]
    pub short: &'static str,
}

const ARRIVE: Recommendation = Recommendation {
    citation: "Percie du Sert N, et al. The ARRIVE guidelines 2.0: Updated guidelines for reporting animal research. PLoS Biology 18(7), e3000410 (2020)",
    url: "https://doi.org/10.1371/journal.pbio.3000410",
    short: "ARRIVE 2.0",
};
const MESOSCALE: Recommendation = Recommendation {
    citation: "Rubiano A, Galitz C, Simmons CS. Mechanical characterization by mesoscale indentation: advantages and pitfalls for tissue and scaffolds. Tissue Engineering Part C 25(10), 619-629 (2019)",
    url: "https://doi.org/10.1089/ten.tec.2018.0372",
    short: "Rubiano et al. 2019",
};
const EX_VIVO: Recommendation = Recommendation {
    citation: "Malik FA, et al. Variability of tissue mechanical response in Sus domesticus porcine models from in vivo to ex vivo conditions. PLoS ONE 17(5), e0268608 (2022)",
    url: "https://doi.org/10.1371/journal.pone.0268608",
    short: "Malik et al. 2022",
};
const INDENTATION: Recommendation = Recommendation {
    citation: "ISO 14577-1:2015, Metallic materials - Instrumented indentation test for hardness and materials parameters - Part 1: Test method",
    url: "https://www.iso.org/standard/56626.html",
    short: "ISO 14577-1",
};
const MACHINE: Recommendation = Recommendation {
    citation: "ISO 14577-2:2015, Metallic materials - Instrumented indentation test for hardness and materials parameters - Part 2: Verification and calibration of testing machines",
    url: "https://www.iso.org/standard/56627.html",
    short: "ISO 14577-2",
};
const FAIR: Recommendation = Recommendation {
    citation: "Wilkinson MD, et al. The FAIR Guiding Principles for scientific data management and stewardship. Scientific Data 3, 160018 (2016)",
    url: "https://doi.org/10.1038/sdata.2016.18",
    short: "FAIR",
};

/// Something that a reader will miss.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What is missing, in one sentence.
    pub sentence: String,
    /// Sessions without it, by the names in the crate; empty where it is of the whole crate.
    pub sessions: Vec<String>,
    /// Metadata entry that says it, if one does.
    pub entry: Option<&'static str>,
    pub recommendation: Recommendation,
}

/// Entries that a reader expects, and who recommends them.
const ENTRIES: [(&str, Recommendation); 15] = [
    ("indenter.tip", INDENTATION),
    ("indenter.diameter_mm", INDENTATION),
    ("indenter.material", INDENTATION),
    ("operator", INDENTATION),
    ("animal.name", ARRIVE),
    ("animal.species", ARRIVE),
    ("animal.sex", ARRIVE),
    ("animal.age_days", ARRIVE),
    ("specimen.source", MESOSCALE),
    ("specimen.hydration", MESOSCALE),
    ("specimen.thickness_mm", MESOSCALE),
    ("specimen.temperature_c", MESOSCALE),
    ("specimen.mounting", MESOSCALE),
    ("specimen.time_since_death_h", EX_VIVO),
    ("specimen.storage", EX_VIVO),
];

/// All that is missing in a crate.
pub(super) fn check(study: &CrateStudy, sessions: &[CrateSession]) -> Vec<Finding> {
    let mut findings = of_study(study);
    findings.extend(ENTRIES.iter().filter_map(|(name, by)| missing_entry(name, *by, sessions)));
    findings.extend(unknown_words(sessions));
    findings.extend(calibrations(sessions));
    findings.extend(unfinished(sessions));
    findings.extend(rejections(sessions));
    findings.extend(missing_repeats(sessions));
    findings
}

fn whole(sentence: &str, recommendation: Recommendation) -> Finding {
    let sentence = sentence.to_owned();
    Finding { sentence, sessions: Vec::new(), entry: None, recommendation }
}

fn of_study(study: &CrateStudy) -> Vec<Finding> {
    let mut findings = Vec::new();
    if study.licence.is_none() {
        findings.push(whole("the crate states no licence, so others may not use the data", FAIR));
    }
    if study.people.is_empty() {
        findings.push(whole("the crate names no person who answers for the data", FAIR));
    }
    let nameless = study.people.iter().filter(|one| one.orcid.is_none());
    findings.extend(nameless.map(|one| {
        whole(
            &format!("{} has no ORCID, so the name may be that of another person", one.name),
            FAIR,
        )
    }));
    if study.description.is_empty() {
        findings.push(whole("the crate has no description", FAIR));
    }
    findings
}

fn missing_entry(
    name: &'static str,
    recommendation: Recommendation,
    sessions: &[CrateSession],
) -> Option<Finding> {
    let key = METADATA_KEYS.iter().find(|key| key.name == name)?;
    let without = sessions.iter().filter(|one| !one.labels.is_set(name) && !is_known(name, one));
    let without: Vec<String> = without.map(|one| one.name.clone()).collect();
    (!without.is_empty()).then(|| Finding {
        sentence: format!("{name} is missing ({})", key.meaning),
        sessions: without,
        entry: Some(name),
        recommendation,
    })
}

/// Whether the session itself says what the entry would: one that found the base has measured the thickness.
fn is_known(name: &str, session: &CrateSession) -> bool {
    if name != "specimen.thickness_mm" {
        return false;
    }
    let plan = serde_json::from_value::<Plan>(session.manifest.plan.clone());
    plan.is_ok_and(|plan| plan.steps.iter().any(|one| matches!(one.step, Step::FindBase(_))))
}

/// Words for which no identifier is known.
fn unknown_words(sessions: &[CrateSession]) -> Vec<Finding> {
    let mut unknown: BTreeMap<(&'static str, String), Vec<String>> = BTreeMap::new();
    for session in sessions {
        let words = |name| session.labels.value(name).as_ref().map(plain_value);
        let mut check = |name, is_known: fn(&str) -> bool| {
            if let Some(words) = words(name).filter(|words| !is_known(words)) {
                unknown.entry((name, words)).or_default().push(session.name.clone());
            }
        };
        check("animal.species", |words| terms::species(words).is_some());
        check("specimen.source", |words| terms::organ(words).is_some());
    }
    let sentence = |name: &str, words: &str| match name {
        "animal.species" => format!(
            "no identifier of the NCBI Taxonomy is known for the species '{words}', so only its words are in the crate"
        ),
        _ => format!(
            "no identifier of UBERON is known for the organ of '{words}', so only its words are in the crate"
        ),
    };
    unknown
        .into_iter()
        .map(|((name, words), sessions)| Finding {
            sentence: sentence(name, &words),
            sessions,
            entry: Some(name),
            recommendation: FAIR,
        })
        .collect()
}

fn calibrations(sessions: &[CrateSession]) -> Vec<Finding> {
    let mut by_sentence: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for session in sessions {
        let Some(calibration) = session.read_calibration() else {
            let sentence = "the calibration of the load cell is not in the session".to_owned();
            by_sentence.entry(sentence).or_default().push(session.name.clone());
            continue;
        };
        let rig = session.manifest.rig.as_ref().map_or("", |rig| rig.name.as_str());
        let age_days = session.calibration_age_days(&calibration);
        let bench = CalibrationUse { rig, age_days, ..CalibrationUse::default() };
        for doubt in calibration.validity_warnings(&bench) {
            // What to do about it at the rig comes behind the semicolon; here the session is over.
            let doubt = doubt.split(';').next().unwrap_or_default();
            let sentence = format!("when it was recorded, {doubt}");
            by_sentence.entry(sentence).or_default().push(session.name.clone());
        }
    }
    of_sentences(by_sentence, MACHINE)
}

fn of_sentences(
    by_sentence: BTreeMap<String, Vec<String>>,
    recommendation: Recommendation,
) -> Vec<Finding> {
    let found = by_sentence.into_iter();
    found
        .map(|(sentence, sessions)| Finding { sentence, sessions, entry: None, recommendation })
        .collect()
}

fn unfinished(sessions: &[CrateSession]) -> Vec<Finding> {
    let open: Vec<String> =
        sessions.iter().filter(|one| !one.is_ended).map(|one| one.name.clone()).collect();
    let sentence = "the recording was interrupted, so the session ends before its plan".to_owned();
    let found = (!open.is_empty()).then_some(Finding {
        sentence,
        sessions: open,
        entry: None,
        recommendation: INDENTATION,
    });
    found.into_iter().collect()
}

/// Rejected sessions are in the crate, but no step counts them: a reader wants to know why.
fn rejections(sessions: &[CrateSession]) -> Vec<Finding> {
    let mut by_sentence: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for session in sessions {
        if let Some(reason) = session.rejection() {
            let sentence = format!("it is rejected and does not count: {reason}");
            by_sentence.entry(sentence).or_default().push(session.name.clone());
        }
    }
    of_sentences(by_sentence, ARRIVE)
}

/// Repeats that a series has and the crate lacks.
fn missing_repeats(sessions: &[CrateSession]) -> Vec<Finding> {
    let mut series: BTreeMap<[String; 3], (BTreeSet<u64>, u64)> = BTreeMap::new();
    for session in sessions {
        let words = |name| session.labels.value(name).as_ref().map(plain_value).unwrap_or_default();
        let count = |name| session.labels.value(name).and_then(|value| value.as_u64());
        let Some(repeat) = count("series.repeat") else { continue };
        let place = ["specimen", "specimen.site", "series.id"].map(words);
        let (found, planned) = series.entry(place).or_default();
        found.insert(repeat);
        *planned = (*planned).max(count("series.repeats").unwrap_or_default()).max(repeat);
    }
    let missing = series.into_iter().filter_map(|([specimen, site, id], (found, planned))| {
        let absent: Vec<String> =
            (1..=planned).filter(|one| !found.contains(one)).map(|one| one.to_string()).collect();
        if absent.is_empty() {
            return None;
        }
        let named = [("site", site), ("series", id)].into_iter();
        let place: String = named
            .filter(|(_, name)| !name.is_empty())
            .map(|(what, name)| format!(", {what} '{name}'"))
            .collect();
        let sentence = format!(
            "{} of specimen '{specimen}'{place} {} not in the crate: {}",
            counted(absent.len(), "repeat"),
            if absent.len() == 1 { "is" } else { "are" },
            absent.join(", ")
        );
        Some(whole(&sentence, ARRIVE))
    });
    missing.collect()
}

/// Names of sessions in a sentence, so many that it stays short.
const NAMES_MAX: usize = 5;

impl Finding {
    /// The sentence with its sessions, of so many in the crate, and who recommends to report it.
    #[must_use]
    pub fn text(&self, of: usize) -> String {
        let shown = &self.sessions[..self.sessions.len().min(NAMES_MAX)];
        let more = self.sessions.len() - shown.len();
        let sessions = match (shown.is_empty(), more) {
            (true, _) => String::new(),
            _ if of > 1 && self.sessions.len() == of => format!(": all {of} sessions"),
            (false, 0) => format!(": {}", shown.join(", ")),
            (false, more) => format!(": {} and {more} more", shown.join(", ")),
        };
        format!("{}{sessions} [{}]", self.sentence, self.recommendation.short)
    }
}
