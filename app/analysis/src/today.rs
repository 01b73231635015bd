//! What a technician asks first: was the rig checked today, which calibration is in use, is there space, what was measured.

use crate::catalog_search::{CatalogSearch, search, update};
use crate::daily::{CONTROL_CHECKS, past_checks, trends};
use crate::progress::Progress;
use chrono::{DateTime, Local, NaiveTime, Utc};
use palpate_model::control_chart::READINGS_MIN;
use palpate_sessions::catalog::{CatalogEntry, CatalogOrder, CatalogQuery};
use palpate_sessions::checks::{DailyCheck, read_checks};
use palpate_sessions::folder::free_bytes;
use std::path::Path;

/// Sessions of a day that are listed.
const SESSIONS_MAX: usize = 200;

#[derive(Clone, Debug, PartialEq)]
pub struct TodayFacts {
    /// The rig's last daily check, and whether it is of today.
    pub check: Option<(DailyCheck, bool)>,
    /// What the control charts of the daily checks warn of.
    pub warnings: Vec<String>,
    /// Free space in bytes on the disk of the library.
    pub free_bytes: u64,
    /// Sessions that began today, newest first.
    pub sessions: Vec<CatalogEntry>,
}

/// Reads the facts of the day of `now` in this computer's time zone.
pub fn read_today(
    library: &Path,
    rig: &str,
    now: DateTime<Utc>,
    progress: &dyn Progress,
) -> Result<TodayFacts, String> {
    let checks = read_checks(library, rig).map_err(|err| err.to_string())?;
    let day = |at: DateTime<Utc>| at.with_timezone(&Local).date_naive();
    let check = checks.last().map(|check| (check.clone(), day(check.at) == day(now)));
    update(library, progress)?;
    // Fewer have no limits, and their sessions need not be read.
    let past = match checks.len() > READINGS_MIN {
        true => past_checks(library, rig, CONTROL_CHECKS, progress)?,
        false => Vec::new(),
    };
    let warnings = trends(&past).into_iter().filter(|(_, is_warning)| *is_warning);
    let warnings = warnings.map(|(words, _)| words).collect();
    let midnight = day(now).and_time(NaiveTime::MIN).and_local_timezone(Local);
    let query = CatalogQuery {
        // Where clocks change at midnight the day has no start; then the last 24 h count.
        since: Some(
            midnight
                .earliest()
                .map_or(now - chrono::TimeDelta::hours(24), |at| at.with_timezone(&Utc)),
        ),
        order: CatalogOrder::Started,
        ..CatalogQuery::default()
    };
    let found = search(&CatalogSearch { library: library.to_owned(), query, page: SESSIONS_MAX })?;
    let free_bytes = free_bytes(library).map_err(|err| err.to_string())?;
    Ok(TodayFacts { check, warnings, free_bytes, sessions: found.first })
}
