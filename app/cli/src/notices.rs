//! Notifications of a run, where this program is built with them and the library asks for them.

use super::output::Output;
#[cfg(feature = "notifications")]
use palpate_analysis::window_requests::RunWatcher;
use palpate_model::calibration::Calibration;
#[cfg(feature = "notifications")]
use palpate_notifications::{RunNotices, UnsentNotice};
use palpate_runner::RunnerSnapshot;
#[cfg(feature = "notifications")]
use palpate_sessions::library_folder;

/// Notices of the runs of one runner; it does nothing where nothing is asked for.
#[derive(Default)]
pub(super) struct Notices {
    #[cfg(feature = "notifications")]
    sending: Option<RunNotices>,
    /// Why nothing is sent although something is asked for.
    #[cfg(feature = "notifications")]
    refusal: Option<String>,
}

#[cfg(feature = "notifications")]
impl Notices {
    /// What the settings of the library ask for. A mistake in them must not stop a measurement.
    pub fn open(calibration: &Calibration, output: &Output) -> Self {
        let Ok(library) = library_folder() else { return Self::default() };
        match RunNotices::of_library(&library) {
            Ok(Some(sending)) => {
                sending.use_calibration(calibration);
                Self { sending: Some(sending), refusal: None }
            }
            Ok(None) => Self::default(),
            Err(err) => {
                let refusal = format!("no notification is sent: {err}");
                output.note(&refusal);
                Self { sending: None, refusal: Some(refusal) }
            }
        }
    }

    /// Looks at a snapshot, without waiting.
    pub fn see(&self, snapshot: &RunnerSnapshot) {
        if let Some(sending) = &self.sending {
            sending.see(snapshot);
        }
    }

    /// The calibration with which forces are read from now on.
    pub fn use_calibration(&self, calibration: &Calibration) {
        if let Some(sending) = &self.sending {
            sending.use_calibration(calibration);
        }
    }

    /// What could not be sent so far, a sentence each.
    pub fn problems(&self) -> Vec<String> {
        let unsent = self.sending.as_ref().map(RunNotices::unsent).unwrap_or_default();
        self.refusal.iter().cloned().chain(unsent.iter().map(sentence)).collect()
    }

    /// Waits a moment for what is not sent yet, and says what could not be sent.
    pub fn finish(self, output: &Output) {
        let unsent = self.sending.map(RunNotices::finish).unwrap_or_default();
        unsent.iter().for_each(|one| output.note(&sentence(one)));
    }
}

#[cfg(feature = "notifications")]
fn sentence(unsent: &UnsentNotice) -> String {
    let UnsentNotice { notice, target, reason } = unsent;
    format!(
        "the notice '{}' did not reach {target}: {reason}; 'palpate notify --test' tries it",
        notice.kind
    )
}

/// For the window.
#[cfg(feature = "notifications")]
impl RunWatcher for Notices {
    fn see(&self, snapshot: &RunnerSnapshot) {
        Self::see(self, snapshot);
    }

    fn problems(&self) -> Vec<String> {
        Self::problems(self)
    }
}

#[cfg(not(feature = "notifications"))]
#[expect(clippy::unused_self, reason = "it is as the one that sends")]
impl Notices {
    pub fn open(_: &Calibration, _: &Output) -> Self {
        Self::default()
    }

    pub fn see(&self, _: &RunnerSnapshot) {}

    pub fn use_calibration(&self, _: &Calibration) {}

    pub fn problems(&self) -> Vec<String> {
        Vec::new()
    }

    pub fn finish(self, _: &Output) {}
}
