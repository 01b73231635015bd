//! Which occurrences are worth a notice: a state machine that reads no clock, no disk and no network.

use crate::notice::{CalibrationValidity, Notice, NoticeKind, NoticeRun, gigabytes};
use chrono::{DateTime, Utc};
use palpate_model::calibration::WARNING_DAYS;
use palpate_model::rig::Phase;
use palpate_protocols::engine::{EndingKind, RunOutcome};
use palpate_runner::{RunView, RunnerSnapshot};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Below so many bytes a disk is low: a day of samples at 1000 a second takes 2.6 GB at 30 bytes each, so that a night
/// is left to make space.
pub const DISK_LOW_BYTES: u64 = 1_000_000_000;

/// A disk that was low counts again once it had so much, so that one at the limit gives one notice.
const DISK_AMPLE_BYTES: u64 = 2 * DISK_LOW_BYTES;

/// Protocols with which an operator moves the probe by hand. They end whenever the operator lets go, so that only their
/// alarms are worth a notice.
pub const MOVES_BY_HAND: [&str; 2] = ["free-jog", "check-home"];

/// What is looked at in one turn.
#[derive(Clone, Copy, Debug)]
pub struct Circumstances<'a> {
    pub now: DateTime<Utc>,
    pub snapshot: &'a RunnerSnapshot,
    /// Free space on the disk of the run, where it is known.
    pub free_bytes: Option<u64>,
    /// The calibration in use, where it says when it was taken.
    pub calibration: Option<&'a CalibrationValidity>,
}

/// Which calibrations were announced, by name and date, and whether as expired.
pub type AnnouncedCalibrations = BTreeSet<(String, bool)>;

/// Gives every notice once.
#[derive(Clone, Debug, Default)]
pub struct NoticeRules {
    run: Option<KnownRun>,
    is_disk_low: bool,
    calibrations: AnnouncedCalibrations,
}

#[derive(Clone, Debug)]
struct KnownRun {
    folder: PathBuf,
    /// The last phase in which it did something.
    phase: Phase,
    is_alarm_sent: bool,
    is_end_sent: bool,
}

impl NoticeRules {
    /// Rules that know what was announced before.
    #[must_use]
    pub fn new(calibrations: AnnouncedCalibrations) -> Self {
        Self { calibrations, ..Self::default() }
    }

    #[must_use]
    pub fn announced_calibrations(&self) -> &AnnouncedCalibrations {
        &self.calibrations
    }

    /// The notices of what is new, the most important first.
    pub fn notices(&mut self, given: Circumstances<'_>) -> Vec<Notice> {
        let mut notices = Vec::new();
        if let Some(view) = &given.snapshot.run {
            self.of_run(given, view, &mut notices);
            self.of_disk(given, view, &mut notices);
        }
        self.of_calibration(given, &mut notices);
        notices.sort_by_key(|notice| notice.kind);
        notices
    }

    fn of_run(&mut self, given: Circumstances<'_>, view: &RunView, notices: &mut Vec<Notice>) {
        let known = match &mut self.run {
            Some(known) if known.folder == view.folder => known,
            other => other.insert(KnownRun {
                folder: view.folder.clone(),
                phase: Phase::Idle,
                is_alarm_sent: false,
                is_end_sent: false,
            }),
        };
        // A run that is first seen after its end did its phases unseen.
        let acts = |phase: &Phase| !matches!(phase, Phase::Stopped | Phase::Ended | Phase::Paused);
        let unseen = view.phases.iter().rev().map(|(_, phase)| phase);
        if let Some(phase) = std::iter::once(&view.phase).chain(unseen).find(|phase| acts(phase)) {
            known.phase = *phase;
        }
        let Some(outcome) = view.outcome.as_ref().or(view.holding.as_ref()) else { return };
        let run = NoticeRun {
            session: session_name(view),
            plan: view.plan_name.clone(),
            phase: known.phase.name().to_owned(),
            outcome: Some(outcome.ending),
            reason: Some(outcome.reason.clone()).filter(|reason| !reason.is_empty()),
        };
        if outcome.ending == EndingKind::Interlock && !known.is_alarm_sent {
            known.is_alarm_sent = true;
            let text = alarm_text(given, &run, outcome);
            notices.push(notice(given, NoticeKind::Alarm, text, Some(run.clone())));
        }
        if known.is_end_sent || MOVES_BY_HAND.contains(&view.plan_name.as_str()) {
            return;
        }
        known.is_end_sent = true;
        let (kind, text) = end_text(given, view, &run, outcome);
        notices.push(notice(given, kind, text, Some(run)));
    }

    fn of_disk(&mut self, given: Circumstances<'_>, view: &RunView, notices: &mut Vec<Notice>) {
        let Some(free) = given.free_bytes else { return };
        if free >= DISK_AMPLE_BYTES {
            self.is_disk_low = false;
        }
        if free >= DISK_LOW_BYTES || self.is_disk_low || view.outcome.is_some() {
            return;
        }
        self.is_disk_low = true;
        let run = NoticeRun {
            session: session_name(view),
            plan: view.plan_name.clone(),
            phase: view.phase.name().to_owned(),
            outcome: None,
            reason: None,
        };
        let text = format!(
            "{}: only {} are free on the disk of session {}; make space before the run needs it",
            rig(given),
            gigabytes(free),
            run.session
        );
        notices.push(Notice {
            free_bytes: Some(free),
            ..notice(given, NoticeKind::Disk, text, Some(run))
        });
    }

    fn of_calibration(&mut self, given: Circumstances<'_>, notices: &mut Vec<Notice>) {
        let Some(calibration) = given.calibration.filter(|one| one.days_left < WARNING_DAYS) else {
            return;
        };
        let is_expired = calibration.days_left < 0;
        let key = format!("{}, {}", calibration.name, calibration.taken);
        if !self.calibrations.insert((key, is_expired)) {
            return;
        }
        let name = format!("{}: the calibration \"{}\"", rig(given), calibration.name);
        let text = match calibration.days_left {
            left if left < 0 => {
                format!("{name} expired {} day(s) ago; take a new calibration", -left)
            }
            left => format!("{name} is valid for {left} more day(s); plan a new calibration"),
        };
        notices.push(Notice {
            calibration: Some(calibration.clone()),
            ..notice(given, NoticeKind::Calibration, text, None)
        });
    }
}

fn rig<'a>(given: Circumstances<'a>) -> &'a str {
    &given.snapshot.rig.description.name
}

fn session_name(view: &RunView) -> String {
    view.folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn notice(
    given: Circumstances<'_>,
    kind: NoticeKind,
    text: String,
    run: Option<NoticeRun>,
) -> Notice {
    Notice {
        kind,
        time: given.now,
        rig: rig(given).to_owned(),
        text,
        run,
        free_bytes: None,
        calibration: None,
    }
}

fn alarm_text(given: Circumstances<'_>, run: &NoticeRun, outcome: &RunOutcome) -> String {
    format!(
        "{}: an interlock stopped {} during {}: {}; session {}",
        rig(given),
        run.plan,
        run.phase,
        outcome.reason,
        run.session
    )
}

fn end_text(
    given: Circumstances<'_>,
    view: &RunView,
    run: &NoticeRun,
    outcome: &RunOutcome,
) -> (NoticeKind, String) {
    let start = format!("{}: {}", rig(given), run.plan);
    let session = &run.session;
    match (outcome.ending, &view.log_error) {
        (EndingKind::Finish, None) => {
            (NoticeKind::Ended, format!("{start} is complete; session {session}"))
        }
        (EndingKind::Finish, Some(_)) => (
            NoticeKind::Failed,
            format!(
                "{start} is complete, but its log is not as it was recorded; check session {session} with palpate doctor"
            ),
        ),
        (ending, _) => {
            let waits = match view.outcome {
                Some(_) => "",
                None => "; it waits for a retract or an end",
            };
            let (phase, reason) = (&run.phase, &outcome.reason);
            let text = format!(
                "{start} ended early ({ending}) during {phase}: {reason}{waits}; session {session}"
            );
            (NoticeKind::Failed, text)
        }
    }
}

#[cfg(test)]
#[path = "rules_tests.rs"]
mod tests;
