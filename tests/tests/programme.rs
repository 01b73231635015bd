//! Programmes: task after task, the calibration they measure, and going on after a crash.
#![expect(clippy::unwrap_used, reason = "a test whose set-up fails must fail")]

use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_model::units::Newtons;
use palpate_protocols::programme::{Done, Entry, Event, Laboratory, Programme, RunError, run};
use palpate_protocols::runner::{Answers, Runner, TimeScale};
use palpate_sessions::journal::JOURNAL_FILE;
use palpate_sessions::text::checksum;
use palpate_tests::workspace;
use std::path::Path;
use std::sync::mpsc::sync_channel;

fn programme(text: &str) -> Programme {
    Programme::read(text, &|name| Err(format!("no protocol '{name}'"))).unwrap()
}

/// Carries a programme out in a folder on a rig just switched on.
fn carry_out(text: &str, folder: &Path) -> Result<Done, RunError> {
    let rig = SimRig::new(SimSettings::default());
    let description = rig.description().clone();
    let calibration = rig.calibration();
    let (wake, woken) = sync_channel(1);
    let runner = Runner::start(Box::new(rig), TimeScale::Max, None, move || {
        let _ = wake.try_send(());
    })
    .unwrap();
    let laboratory = Laboratory {
        runner: &runner,
        woken: &woken,
        rig: &description,
        limits: Limits::for_travel(description.travel),
        calibration,
        folder,
        answers: Answers::Confirm,
        indenter: String::new(),
        gate: &|_| Ok(Vec::new()),
    };
    let mut begun = 0;
    let done = run(
        &programme(text),
        &checksum(text),
        laboratory,
        &mut |event| {
            begun += u32::from(matches!(event, Event::Begun { .. }));
        },
    );
    assert!(begun > 0 || done.is_err() || done.as_ref().unwrap().was_continued);
    done
}

const JOGS: &str = r#"
palpate-programme = 1
name = "jogs"
title = "Jogs"
acknowledge = true

[[task]]
name = "jog"
protocol = "free-jog"
repeats = 3

[[task]]
name = "jog-again"
protocol = "free-jog"
"#;

#[test]
fn a_crash_at_any_line_of_the_journal_goes_on_at_the_right_repeat() {
    let whole = tempfile::tempdir().unwrap();
    let done = carry_out(JOGS, whole.path()).unwrap();
    assert_eq!(done.progress.runs.len(), 4);
    let journal = std::fs::read_to_string(whole.path().join(JOURNAL_FILE)).unwrap();
    let lines: Vec<&str> = journal.lines().collect();
    assert_eq!(lines.len(), 9, "{journal}");
    for kept in 0..lines.len() {
        // What a crash leaves: whole lines, half a line, and the folders of runs that had begun.
        let folder = tempfile::tempdir().unwrap();
        let mut text: String = lines[..kept]
            .iter()
            .flat_map(|line| [*line, "\n"])
            .collect();
        text += &lines[kept][..lines[kept].len() / 2];
        std::fs::write(folder.path().join(JOURNAL_FILE), &text).unwrap();
        let entries = lines[..kept]
            .iter()
            .map(|line| serde_json::from_str(line).unwrap());
        let entries: Vec<Entry> = entries.collect();
        for entry in &entries {
            if let Entry::Begun { session, .. } = entry {
                std::fs::create_dir_all(folder.path().join(session)).unwrap();
                std::fs::write(folder.path().join(session).join("000.mcap"), "broken").unwrap();
            }
        }
        let is_interrupted = matches!(entries.last(), Some(Entry::Begun { .. }));
        let again = carry_out(JOGS, folder.path()).unwrap();
        let finished = |task| again.progress.finished(task).len();
        assert_eq!((finished(0), finished(1)), (3, 1), "{kept}");
        let attempts = again.progress.runs.len() - 4;
        assert_eq!(attempts, usize::from(is_interrupted), "{kept}");
        let second = again.progress.runs.iter().filter(|run| run.0.attempt == 2);
        assert_eq!(second.count(), attempts, "{kept}");
        assert_eq!(again.was_continued, kept > 1, "{kept}");
    }
}

#[test]
fn a_crash_before_the_journal_knew_of_a_run_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("jog/02")).unwrap();
    std::fs::write(folder.path().join("jog/02/000.mcap"), "broken").unwrap();
    let done = carry_out(JOGS, folder.path()).unwrap();
    let second = done.progress.runs.iter().find(|run| run.0.repeat == 2);
    assert_eq!(second.unwrap().0.attempt, 2);
    // Two programmes in one folder would spoil each other.
    let held = palpate_sessions::HolderLock::acquire(&folder.path().join("lock")).unwrap();
    let refusal = carry_out(JOGS, folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("in use by"), "{refusal}");
    drop(held);
}

#[test]
fn another_or_a_changed_programme_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    carry_out(JOGS, folder.path()).unwrap();
    let changed = JOGS.replace("repeats = 3", "repeats = 4");
    let refusal = carry_out(&changed, folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("was changed since"), "{refusal}");
    let other = JOGS.replace("name = \"jogs\"", "name = \"other\"");
    let refusal = carry_out(&other, folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("holds the programme 'jogs'"), "{refusal}");
}

#[test]
fn weights_on_the_simulated_cell_give_its_curve_back() {
    let text = r#"
palpate-programme = 1
name = "weights"
title = "Weights"

[[task]]
name = "cell"
protocol = "load-cell-calibration"
calibrates = true
"#;
    let folder = tempfile::tempdir().unwrap();
    let done = carry_out(text, folder.path()).unwrap();
    let (measured, truth) = (done.calibration, Calibration::thesis());
    assert_eq!(measured.name, "cell");
    // Every weight of the thesis, twice up and twice down.
    assert_eq!(measured.series.len(), 4);
    let points = measured.points().unwrap();
    assert_eq!(points.len(), truth.steps.len());
    let curve = measured.curve().unwrap();
    for step in &truth.steps {
        let volts = curve.volts_from_newtons(step.newtons());
        // The cell drifts by up to 0.2 mV a minute over some minutes; a converter's count is 0.3 mV.
        assert!(
            (volts.0 - step.volts.0).abs() < 3e-3,
            "{} g: {volts}",
            step.mass_g
        );
    }
    let quality = measured.quality().unwrap();
    assert!(!quality.flat.is_empty(), "the flat stretch is not told");
    assert!(curve.is_extrapolated(Newtons(10.5)));
}

#[test]
fn every_mistake_is_told_with_its_line() {
    let wrong = r#"
palpate-programme = 1
name = "wrong"
title = "Wrong"

[[task]]
name = "a b"
protocol = "ramp-hold"
set = { speeed = "1 mm/s" }

[[task]]
name = "two"
protocol = "nothing"
repeats = 0
validates = "three"
"#;
    let refusal = Programme::read(wrong, &|name| Err(format!("no protocol '{name}'"))).unwrap_err();
    let text = refusal.to_string();
    for part in [
        "line 6: a task cannot be called 'a b'",
        "speeed",
        "line 11: 0 repeats",
        "no protocol 'nothing'",
        "no task 'three'",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let text = Programme::read("palpate-programme = 1\nnmae = 3", &|_| Err(String::new()));
    assert!(text.unwrap_err().to_string().starts_with("line 2:"));
}

#[test]
fn the_day_in_the_laboratory_is_a_programme() {
    let text = std::fs::read_to_string(workspace().join("examples/day-in-the-lab.toml")).unwrap();
    assert!(Programme::is_meant(&text));
    assert_eq!(programme(&text).session_count(), 10);
}
