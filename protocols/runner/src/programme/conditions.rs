//! Conditions of a programme that must be the same for its repeats to be comparable.

use super::document::Programme;
use palpate_model::calibration::Calibration;
use palpate_model::rig::{Limits, RigDescription};
use palpate_sessions::text::checksum;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Rig, limits, calibration and protocols of a programme. Pace is not among them: it changes no sample.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditions {
    pub rig: BTreeMap<String, String>,
    /// Settings of a simulated rig; those that are not the usual ones among them.
    pub settings: BTreeMap<String, String>,
    /// Interlock thresholds, as they are written in a session's manifest.
    pub limits: BTreeMap<String, String>,
    /// Name of the calibration it begins with and CRC-32 of its document.
    pub calibration: BTreeMap<String, String>,
    /// CRC-32 of the protocol of every task, by the task's name.
    pub protocols: BTreeMap<String, String>,
}

impl Conditions {
    #[must_use]
    pub fn of(
        programme: &Programme,
        rig: &RigDescription,
        limits: &Limits,
        calibration: &Calibration,
    ) -> Self {
        let pairs = |pairs: [(&str, String); 2]| {
            let pairs = pairs.into_iter();
            pairs.map(|(name, value)| (name.to_owned(), value)).collect()
        };
        let limits = [
            ("travel_max", limits.travel_max.to_string()),
            ("force_max", limits.force_max.to_string()),
            ("force_min", limits.force_min.to_string()),
            ("volts_max", limits.volts_max.to_string()),
            ("force_rate_max", format!("{} N/s", limits.force_rate_max)),
        ];
        let document = serde_json::to_string(calibration).unwrap_or_default();
        let tasks = programme.tasks.iter();
        let sources = tasks.filter_map(|task| {
            let source = task.plan(1, None)?.source?;
            Some((task.name.clone(), source.crc32))
        });
        Self {
            rig: pairs([("name", rig.name.clone()), ("identity", rig.identity.clone())]),
            settings: rig.settings.clone(),
            limits: limits.map(|(name, value)| (name.to_owned(), value)).into(),
            calibration: pairs([
                ("name", calibration.name.clone()),
                ("crc32", checksum(&document)),
            ]),
            protocols: sources.collect(),
        }
    }

    pub fn changes(&self, now: &Self) -> Vec<String> {
        let mut changes = Vec::new();
        let mut compare = |was: &BTreeMap<String, String>,
                           is: &BTreeMap<String, String>,
                           called: &dyn Fn(&str) -> String| {
            let names: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
            for name in names {
                let (was, is) = (was.get(name), is.get(name));
                if was != is {
                    let quoted = |value: Option<&String>| match value {
                        Some(value) => format!("'{value}'"),
                        None => "the default".into(),
                    };
                    changes.push(format!(
                        "{} was {} and is {} now",
                        called(name),
                        quoted(was),
                        quoted(is)
                    ));
                }
            }
        };
        compare(&self.settings, &now.settings, &|name| format!("the rig's setting {name}"));
        compare(&self.rig, &now.rig, &|name| format!("the rig's {name}"));
        compare(&self.limits, &now.limits, &|name| format!("the rig's limit {name}"));
        compare(&self.protocols, &now.protocols, &|task| {
            format!("the CRC-32 of the protocol of task '{task}'")
        });
        if self.calibration != now.calibration {
            let named = |one: &Self| {
                let of = |key: &str| one.calibration.get(key).map_or("", String::as_str);
                format!("'{}' (CRC-32 {})", of("name"), of("crc32"))
            };
            changes.push(format!("the calibration was {} and is {} now", named(self), named(now)));
        }
        changes
    }
}
