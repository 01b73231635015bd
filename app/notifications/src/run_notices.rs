//! What a front end with a runner needs: it shows every snapshot, and the rest happens elsewhere.

use crate::housekeeping::{Housekeeping, read_announced};
use crate::notice::CalibrationValidity;
use crate::notifier::{Notifier, Patience, UnsentNotice, lock};
use crate::rules::{Circumstances, NoticeRules};
use crate::settings::{NotificationSettings, SettingsError};
use palpate_model::calibration::Calibration;
use palpate_runner::{RunnerSnapshot, wall_now};
use palpate_sessions::age_days;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use thiserror::Error;

/// Watches runs and sends the notices that the library's settings ask for. Shared between threads; dropped, it takes
/// [`crate::END_WITHIN`] at most.
pub struct RunNotices {
    notifier: Notifier,
    housekeeping: Arc<Housekeeping>,
    library: PathBuf,
    state: Mutex<WatchState>,
}

#[derive(Default)]
struct WatchState {
    rules: NoticeRules,
    calibration: Option<Calibration>,
}

#[derive(Debug, Error)]
pub enum NotificationError {
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error("the thread that sends notifications cannot be started ({0}); close other programs")]
    Thread(#[from] std::io::Error),
}

impl RunNotices {
    /// Starts what the settings of a library ask for; `None` where they ask for nothing.
    pub fn of_library(library: &Path) -> Result<Option<Self>, NotificationError> {
        match NotificationSettings::of_library(library)? {
            Some(settings) if !settings.targets.is_empty() => {
                Ok(Some(Self::start(settings, library, Patience::default())?))
            }
            _ => Ok(None),
        }
    }

    /// Starts with these settings; `library` keeps what was announced.
    pub fn start(
        settings: NotificationSettings,
        library: &Path,
        patience: Patience,
    ) -> std::io::Result<Self> {
        let housekeeping = Arc::new(Housekeeping::default());
        let rules = NoticeRules::new(read_announced(library));
        Ok(Self {
            notifier: Notifier::start_with(settings.targets, patience, Arc::clone(&housekeeping))?,
            housekeeping,
            library: library.to_owned(),
            state: Mutex::new(WatchState { rules, calibration: None }),
        })
    }

    /// The calibration with which forces are read from now on.
    pub fn use_calibration(&self, calibration: &Calibration) {
        lock(&self.state).calibration = Some(calibration.clone());
    }

    /// Looks at a snapshot. It waits for nothing, so that the runner's thread may call it after every snapshot.
    pub fn see(&self, snapshot: &RunnerSnapshot) {
        let now = wall_now().into();
        let run = snapshot.run.as_ref();
        let free_bytes = run.and_then(|run| self.housekeeping.free_bytes(&run.folder));
        let mut state = lock(&self.state);
        let calibration = state.calibration.as_ref().and_then(|one| validity(one, now));
        let announced = state.rules.announced_calibrations().len();
        let given = Circumstances { now, snapshot, free_bytes, calibration: calibration.as_ref() };
        for notice in state.rules.notices(given) {
            self.notifier.send(&notice);
        }
        if state.rules.announced_calibrations().len() != announced {
            let calibrations = state.rules.announced_calibrations().clone();
            self.housekeeping.keep_announced(&self.library, calibrations);
        }
    }

    /// The notices that were given up, the oldest first.
    #[must_use]
    pub fn unsent(&self) -> Vec<UnsentNotice> {
        self.notifier.unsent()
    }

    /// Sends what waits, within [`crate::END_WITHIN`], and returns what could not be sent since the start.
    #[must_use]
    pub fn finish(self) -> Vec<UnsentNotice> {
        self.notifier.finish()
    }
}

/// For how long a calibration is still valid, where it says when it was taken.
#[must_use]
pub fn validity(
    calibration: &Calibration,
    now: chrono::DateTime<chrono::Utc>,
) -> Option<CalibrationValidity> {
    let age = age_days(calibration, now)?;
    Some(CalibrationValidity {
        name: calibration.name.clone(),
        taken: calibration.taken_at.clone().unwrap_or_default(),
        days_left: i64::from(calibration.valid_days()) - age,
    })
}
