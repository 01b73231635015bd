//! The words of what a replay and a programme refuse.

use palpate_runner::programme::{CalibrationSessionError, ProgrammeRunError, ProgressError};
use palpate_runner::replay::ReplayError;
use palpate_runner::study::StudyError;
use palpate_test_support::assert_messages;

#[test]
fn replay_errors_have_their_words() {
    let detail = || "line 3".to_owned();
    assert_messages! {
        ReplayError::Imported { file: "old.csv".into() } => ["old.csv"],
        ReplayError::Manifest { what: "plan", detail: detail() } => ["plan", "line 3"],
        ReplayError::Input { order: 7, detail: detail() } => ["input 7", "line 3"],
    }
}

#[test]
fn programme_errors_have_their_words() {
    let name = || "week".to_owned();
    let task = || "ramp".to_owned();
    let incomplete =
        || CalibrationSessionError::Incomplete { session: "s-1".into(), ending: "stop".into() };
    assert_messages! {
        ProgressError::Other(name()) => ["'week'"],
        ProgressError::Changed(name()) => ["'week'"],
        ProgressError::Conditions { programme: name(), changes: vec!["the rig was sim".into(), "the depth was 3 mm".into()] } => ["'week'", "sim", "3 mm"],
        ProgressError::Headless => ["new folder"],
        CalibrationSessionError::NoReadings("s-1".into()) => ["s-1", "load-cell-calibration"],
        incomplete() => ["s-1", "stop"],
        ProgrammeRunError::Refused { task: task(), reason: "the depth is too great".into() } => ["'ramp'", "the depth is too great"],
        ProgrammeRunError::Ended { task: task(), repeat: 2, ending: "stop".into(), reason: "by hand".into() } => ["'ramp'", "repeat 2", "stop", "by hand"],
        ProgrammeRunError::Calibrating { task: task(), source: incomplete() } => ["'ramp'", "s-1"],
        ProgrammeRunError::NoRunner => ["incomplete"],
    }
}

#[test]
fn study_errors_have_their_words() {
    let contradiction = StudyError::Contradiction {
        key: "animal.sex".into(),
        given: "male".into(),
        known: "female".into(),
        subject: "animal 'pig-3'".into(),
        line: 3,
    };
    assert_messages! {
        contradiction => ["animal.sex is 'male'", "line 3 of study.toml", "'female'", "'pig-3'"],
    }
}
