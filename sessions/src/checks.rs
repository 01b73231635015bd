//! The daily checks of every rig: one line each in `checks/RIG.jsonl` of the library, never changed.

use crate::chain::{self, ChainError, ChainHead};
use chrono::{DateTime, Local, Utc};
use serde::{Deserialize, Serialize};
use std::path::Path;

pub(crate) const CHECKS_FOLDER: &str = "checks";

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckPart {
    /// `run`, `zero`, `weight` or `home`.
    pub what: String,
    pub is_passed: bool,
    pub sentence: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DailyCheck {
    pub at: DateTime<Utc>,
    pub rig: String,
    pub by: String,
    pub session_id: String,
    pub calibration: String,
    pub is_passed: bool,
    pub parts: Vec<CheckPart>,
}

impl DailyCheck {
    /// The failed parts in one sentence; empty if all passed.
    pub fn failures(&self) -> String {
        let failed = self.parts.iter().filter(|part| !part.is_passed);
        let sentences: Vec<&str> = failed.map(|part| part.sentence.as_str()).collect();
        sentences.join("; ")
    }
}

/// Path of a rig's file below the library. Characters unfit for a file name become dashes, and a checksum keeps such names
/// apart.
fn file_of(rig: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let mut name: String = rig.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    if name != rig {
        name += &format!("-{:08x}", crc32fast::hash(rig.as_bytes()));
    }
    format!("{CHECKS_FOLDER}/{name}.jsonl")
}

/// All checks of a rig, oldest first.
pub fn read_checks(library: &Path, rig: &str) -> Result<Vec<DailyCheck>, ChainError> {
    read_checks_since(library, rig, |_| ChainHead::default())
}

/// Like [`read_checks`], and refuses a file that no longer holds the lines of its recorded head; `since` finds the head by
/// the file's path below the library.
pub(crate) fn read_checks_since(
    library: &Path,
    rig: &str,
    since: impl Fn(&str) -> ChainHead,
) -> Result<Vec<DailyCheck>, ChainError> {
    let file = file_of(rig);
    let path = library.join(&file);
    chain::read_since(&path, rig, since(&file))?.records(&path, "a check")
}

pub fn add_check(library: &Path, check: &DailyCheck) -> Result<(), ChainError> {
    // Nothing is added to checks that this version does not understand.
    read_checks(library, &check.rig)?;
    chain::append(&library.join(file_of(&check.rig)), &check.rig, check)
}

/// The last check on the day of `now`, in this computer's time zone.
#[must_use]
pub fn last_check_of_day(checks: &[DailyCheck], now: DateTime<Utc>) -> Option<&DailyCheck> {
    let day = |at: DateTime<Utc>| at.with_timezone(&Local).date_naive();
    checks.iter().rev().find(|check| day(check.at) == day(now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::{Duration, TimeZone};

    fn check(rig: &str, at: DateTime<Utc>, is_passed: bool) -> DailyCheck {
        DailyCheck {
            at,
            rig: rig.into(),
            by: "Ada".into(),
            session_id: "id".into(),
            calibration: "cell".into(),
            is_passed,
            parts: vec![CheckPart {
                what: "zero".into(),
                is_passed,
                sentence: "the empty cell reads 0.3 N".into(),
            }],
        }
    }

    #[test]
    fn last_check_of_the_day_is_found_and_rigs_have_own_files() {
        let library = tempfile::tempdir().unwrap();
        let at = library.path();
        // Local noon, so that no time zone changes the day.
        let noon = Local.with_ymd_and_hms(2026, 3, 5, 12, 0, 0).unwrap().to_utc();
        let hour = Duration::hours(1);
        for one in [
            check("sim:bench 2", noon - hour * 24, false),
            check("sim:bench 2", noon - hour, true),
            check("sim:bench 2", noon, false),
            check("sim:bench-2", noon, true),
            check("../sim", noon, true),
        ] {
            add_check(at, &one).unwrap();
        }
        let own = read_checks(at, "sim:bench 2").unwrap();
        assert_eq!(own.len(), 3);
        let last = last_check_of_day(&own, noon + hour).unwrap();
        assert_eq!((last.at, last.is_passed), (noon, false));
        assert!(last.failures().contains("0.3 N"));
        assert!(last_check_of_day(&own, noon + hour * 24).is_none());
        assert!(
            last_check_of_day(&read_checks(at, "sim:bench-2").unwrap(), noon).unwrap().is_passed
        );
        assert_eq!(read_checks(at, "never").unwrap(), []);
        // A name never leads out of the folder; every file has a head beside it.
        assert_eq!(std::fs::read_dir(at.join("checks")).unwrap().count(), 6);
        let file = at.join(file_of("sim:bench 2"));
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replacen("\"is_passed\":false", "\"is_passed\":true", 1))
            .unwrap();
        let refusal = read_checks(at, "sim:bench 2").unwrap_err().to_string();
        assert!(refusal.starts_with("line 1 of"), "{refusal}");
    }
}
