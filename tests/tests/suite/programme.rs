//! Programmes: task after task, the calibration they measure, and going on after a crash.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_model::units::Newtons;
use palpate_protocols::file::{ProblemSeverity, ProtocolProblem};
use palpate_runner::programme::{
    Programme, ProgrammeEntry, ProgrammeError, ProgrammeEvent, ProgrammeResult, ProgrammeRunError,
    ProgrammeSetup, run_programme,
};
use palpate_runner::study::Study;
use palpate_runner::{PromptResponder, Runner, TimeScale};
use palpate_sessions::journal::JOURNAL_FILE;
use palpate_sessions::text::checksum;
use palpate_tests::workspace;
use serde_json::Value;
use std::path::Path;
use std::sync::mpsc::sync_channel;

fn programme(text: &str) -> Programme {
    Programme::read(text, &|name| Err(format!("no protocol '{name}'"))).unwrap()
}

/// Carries a programme out in a folder on a rig just switched on.
fn carry_out(text: &str, folder: &Path) -> Result<ProgrammeResult, ProgrammeRunError> {
    let whole = programme(text);
    carry_out_on(&whole, text, folder, SimSettings::default(), &|_, _| {})
}

/// As [`carry_out`] on a rig with these settings; `change` may change what the laboratory takes for granted.
fn carry_out_on(
    whole: &Programme,
    text: &str,
    folder: &Path,
    settings: SimSettings,
    change: &dyn Fn(&mut Limits, &mut Calibration),
) -> Result<ProgrammeResult, ProgrammeRunError> {
    let rig = SimRig::new(settings);
    let description = rig.description().clone();
    let mut calibration = rig.calibration();
    let mut limits = Limits::for_travel(description.travel);
    change(&mut limits, &mut calibration);
    let (wake, woken) = sync_channel(1);
    let runner = Runner::start(Box::new(rig), TimeScale::Max, None, move || {
        let _ = wake.try_send(());
    })
    .unwrap();
    let laboratory = ProgrammeSetup {
        runner: &runner,
        woken: &woken,
        rig: &description,
        limits,
        calibration,
        folder,
        answers: PromptResponder::Confirm,
        gate: &|_| Ok(Vec::new()),
    };
    let mut begun = 0;
    let done = run_programme(whole, &checksum(text), laboratory, &mut |event| {
        begun += u32::from(matches!(event, ProgrammeEvent::Begun { .. }));
    });
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
        let mut text: String = lines[..kept].iter().flat_map(|line| [*line, "\n"]).collect();
        text += &lines[kept][..lines[kept].len() / 2];
        std::fs::write(folder.path().join(JOURNAL_FILE), &text).unwrap();
        let entries = lines[..kept].iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let entries: Vec<ProgrammeEntry> =
            entries.map(|line| serde_json::from_value(line["body"].clone()).unwrap()).collect();
        for entry in &entries {
            if let ProgrammeEntry::Begun { session, .. } = entry {
                std::fs::create_dir_all(folder.path().join(session)).unwrap();
                std::fs::write(folder.path().join(session).join("000.mcap"), "broken").unwrap();
            }
        }
        let is_interrupted = matches!(entries.last(), Some(ProgrammeEntry::Begun { .. }));
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
fn a_session_that_was_closed_counts_though_its_line_in_the_journal_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(JOURNAL_FILE);
    let whole = carry_out(JOGS, folder.path()).unwrap();
    let journal = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = journal.split_inclusive('\n').collect();
    // Killed behind the last log, and behind the second repeat's.
    for (kept, runs) in [(lines.len() - 1, 4), (4, 2)] {
        std::fs::write(&path, lines[..kept].concat()).unwrap();
        // A kill comes before the head, too.
        std::fs::remove_file(folder.path().join("journal.jsonl.head")).unwrap();
        if runs == 2 {
            for session in ["jog/03", "jog-again/01"] {
                std::fs::remove_dir_all(folder.path().join(session)).unwrap();
            }
        }
        let again = carry_out(JOGS, folder.path()).unwrap();
        assert!(again.was_continued);
        assert_eq!(again.progress, whole.progress, "{kept}");
        let journal = std::fs::read_to_string(&path).unwrap();
        assert_eq!(journal.lines().count(), lines.len());
        // The line that was lost stands there again, word for word.
        assert_eq!(journal.split_inclusive('\n').nth(kept), Some(lines[kept]));
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
    assert!(refusal.contains("was changed after"), "{refusal}");
    let other = JOGS.replace("name = \"jogs\"", "name = \"other\"");
    let refusal = carry_out(&other, folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("'jogs'"), "{refusal}");
}

#[test]
fn under_other_conditions_a_programme_does_not_go_on_and_says_what_changed() {
    const FILE: &str = r#"
palpate = 1
name = "mine"
version = 1
title = "Mine"
about = "A test."
source = "none"
procedure.steps = [{ do = "self-test" }, { do = "jog", distance = "DISTANCE", speed = "3 mm/s" }]
"#;
    const TEXT: &str = r#"
palpate-programme = 1
name = "mine"
title = "Mine"

[[task]]
name = "press"
protocol = "mine.toml"
repeats = 2
"#;
    let with = |distance: &str| {
        Programme::read(TEXT, &|_| Ok(FILE.replace("DISTANCE", distance))).unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let usual = SimSettings::default();
    let same: &dyn Fn(&mut Limits, &mut Calibration) = &|_, _| {};
    carry_out_on(&with("1 mm"), TEXT, folder.path(), usual, same).unwrap();
    // Only its first repeat is known: there is something to go on with.
    let path = folder.path().join(JOURNAL_FILE);
    let journal = std::fs::read_to_string(&path).unwrap();
    let first: String = journal.split_inclusive('\n').take(3).collect();
    std::fs::write(&path, &first).unwrap();
    std::fs::remove_file(folder.path().join("journal.jsonl.head")).unwrap();

    let ideal = SimSettings { profile: SimProfile::Ideal, ..usual };
    let seed = SimSettings { seed: 7, ..usual };
    let softer = SimSettings { softening: "40".parse().unwrap(), ..usual };
    let lower: &dyn Fn(&mut Limits, &mut Calibration) = &|limits, _| limits.force_max.0 = 5.0;
    let other: &dyn Fn(&mut Limits, &mut Calibration) =
        &|_, calibration| calibration.steps[3].mass_g += 1.0;
    for (distance, settings, change, words) in [
        ("1 mm", ideal, same, "profile was 'lab'"),
        ("1 mm", seed, same, "seed was '0'"),
        ("1 mm", softer, same, "softening was"),
        ("1 mm", usual, lower, "force_max was '9"),
        ("1 mm", usual, other, "'Thesis load cell'"),
        ("2 mm", usual, same, "task 'press'"),
    ] {
        let went_on = carry_out_on(&with(distance), TEXT, folder.path(), settings, change);
        let refusal = went_on.unwrap_err().to_string();
        assert!(refusal.contains(words), "{words}: {refusal}");
        assert!(refusal.contains("'mine'"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), first, "something ran");
    }
    // A journal of an older palpate knows no conditions and no checksums, and goes on.
    let bodies = first.lines().map(|line| {
        let line: Value = serde_json::from_str(line).unwrap();
        line["body"].clone()
    });
    let mut bodies: Vec<Value> = bodies.collect();
    let head = bodies[0].as_object_mut().unwrap();
    assert!(head.remove("conditions").is_some());
    let plain: String = bodies.iter().map(|body| format!("{body}\n")).collect();
    std::fs::write(&path, plain).unwrap();
    let done = carry_out_on(&with("1 mm"), TEXT, folder.path(), usual, same).unwrap();
    assert_eq!(done.progress.finished(0).len(), 2);
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
        assert!((volts.0 - step.volts.0).abs() < 3e-3, "{} g: {volts}", step.mass_g);
    }
    let quality = measured.quality().unwrap();
    assert!(!quality.flat.is_empty(), "the flat stretch is not reported");
    assert!(curve.is_extrapolated(Newtons(10.5)));
}

#[test]
fn every_mistake_is_reported_with_its_line() {
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

[[task]]
name = "three"
protocol = "ramp-hold"
sett = { depth = "10 mm" }
repeats = "two"
rest_s = -3
specimen = "two"
calibrates = 1

[[task]]
name = "three"
set = { depth = { mm = 10 } }
validates = "two"

[simulated]
softening = 40
stifness = 3

[specimen.7]
name = "stomach"
"#;
    let refusal = Programme::read(wrong, &|name| Err(format!("no protocol '{name}'"))).unwrap_err();
    // None twice, none that follows from another alone.
    let expected = [
        (7, "'a b'"),
        (9, "'speeed'"),
        (13, "'nothing'"),
        (14, "0 repeats"),
        (15, "'three'"),
        (20, "'sett'; did you mean 'set'?"),
        (21, "repeats cannot be \"two\""),
        (22, "-3 s"),
        (23, "specimen cannot be \"two\""),
        (24, "calibrates cannot be 1"),
        (26, "'protocol'"),
        (27, "'three'"),
        (28, "depth"),
        (33, "'stifness'"),
    ];
    assert_problems(&refusal, &expected);
    let refused = |text: &str| Programme::read(text, &|_| Err(String::new())).unwrap_err();
    let refusal = refused("palpate-programme = 1\nnmae = 3");
    assert_problems(&refusal, &[(1, "'title'"), (1, "'task'"), (2, "'nmae'")]);
    let refusal = refused("palpate-programme = 2\nname = 3\n[task]\nname = \"x\"\n");
    let expected = [(1, "version 2"), (2, "name cannot be 3"), (3, "[[task]]")];
    assert!(expected.iter().all(|one| has_problem(&refusal, one)));
}

/// Whether a problem of that line has that fact.
fn has_problem(refusal: &ProgrammeError, (line, fact): &(u32, &str)) -> bool {
    let is_it = |one: &ProtocolProblem| one.line == *line && one.message.contains(fact);
    refusal.0.iter().any(is_it)
}

/// These problems were found and no other.
fn assert_problems(refusal: &ProgrammeError, expected: &[(u32, &str)]) {
    for one in expected {
        assert!(has_problem(refusal, one), "{one:?}: {refusal}");
    }
    assert_eq!(refusal.0.len(), expected.len(), "{refusal}");
}

#[test]
fn what_could_never_work_is_refused_with_its_line() {
    let whole = |first: &str, second: &str| {
        let text = format!(
            "palpate-programme = 1\nname = \"x\"\ntitle = \"X\"\n[[task]]\nname = \"one\"\n{first}\n[[task]]\nname = \"two\"\n{second}\n"
        );
        Programme::read(&text, &|name| Err(format!("no protocol '{name}'")))
    };
    let press = "protocol = \"ramp-hold\"";
    let compared = "protocol = \"ramp-hold\"\nvalidates = \"one\"";
    assert!(whole(press, compared).is_ok());
    assert!(whole("protocol = \"creep\"", compared).is_ok());
    let weighing = "protocol = \"load-cell-calibration\"\ncalibrates = true";
    let cycles = "protocol = \"preconditioning\"";
    let with_key = |key: &str| format!("{press}\n{key}");
    for (first, second, line, fact) in [
        (weighing, compared.into(), 8, "'one' calibrates"),
        ("protocol = \"zeroing\"", compared.into(), 7, "zeroing"),
        ("protocol = \"sine\"", compared.into(), 7, "sine"),
        (cycles, compared.into(), 7, "10 cycles"),
        (press, "protocol = \"zeroing\"\nvalidates = \"one\"".into(), 7, "model of task 'one'"),
        (press, "protocol = \"zeroing\"\ncalibrates = true".into(), 7, "zeroing"),
        (press, with_key("specimen = \"two\""), 10, "[specimen.2]"),
        (press, with_key("specimen = -1"), 10, "specimen cannot be -1"),
        (press, with_key("rest_s = \"3 min\""), 10, "rest_s"),
        (press, with_key("calibrates = \"yes\""), 10, "calibrates"),
        (press, "protocol = 3".to_owned(), 9, "protocol cannot be 3"),
    ] {
        let refusal = whole(first, &second).unwrap_err();
        assert!(has_problem(&refusal, &(line, fact)), "{line} {fact}: {refusal}");
    }
}

#[test]
fn the_day_in_the_laboratory_is_a_programme() {
    let text = std::fs::read_to_string(workspace().join("examples/day-in-the-lab.toml")).unwrap();
    assert!(Programme::is_programme_text(&text));
    assert_eq!(programme(&text).session_count(), 10);
    assert_eq!(programme(&text).open_questions(&Study::default()).unwrap(), []);
}

const LABELLED: &str = r#"
palpate-programme = 1
name = "labelled"
title = "Told"
purpose = "A test."

[about]
operator = "Ada"
specimen = "stomach 7"
specimen-source = "x"

[specimen.2]
name = "stomach 8, fundus"
thickness_mm = 11

[[task]]
name = "weights"
protocol = "load-cell-calibration"
calibrates = true

[[task]]
name = "there"
protocol = "zeroing"

[[task]]
name = "first"
protocol = "creep"
specimen = 1

[[task]]
name = "second"
protocol = "creep"
specimen = 2
repeats = 3

[[task]]
name = "again"
protocol = "sine"
"#;

#[test]
fn labels_of_a_programme_reach_the_right_sessions_and_missing_ones_are_asked_for() {
    let text = LABELLED.replace("specimen-source = \"x\"\n", "");
    let mut whole = programme(&text);
    // Without a source the two protocols that ask for it say so, each at its line.
    let asked = whole.open_questions(&Study::default()).unwrap();
    assert_eq!(asked.len(), 3, "{asked:?}");
    assert_eq!((asked[0].line, asked[0].severity), (24, ProblemSeverity::Warning));
    for (question, task) in asked.iter().zip(["'first'", "'second'"]) {
        let message = &question.message;
        assert!(message.contains(task) && message.contains("specimen.source"), "{asked:?}");
    }
    whole.set_label("specimen.source", "pig").unwrap();
    assert_eq!(whole.open_questions(&Study::default()).unwrap(), []);
    let labels = |task, repeat| whole.labels(task, repeat).unwrap();
    // The scale has weights on it; then there is the specimen that is there, then each by its number.
    let names: Vec<String> = (0..5).map(|task| labels(task, 1).specimen).collect();
    let wanted =
        ["", "stomach 7", "stomach 7, specimen 1", "stomach 8, fundus", "stomach 8, fundus"];
    assert_eq!(names, wanted);
    let (first, second) = (labels(2, 1), labels(3, 2));
    assert_eq!((first.operator.as_str(), second.operator.as_str()), ("Ada", "Ada"));
    assert_eq!(first.about.get("specimen.thickness_mm"), None);
    assert_eq!(second.about.get("specimen.thickness_mm"), Some(&11.0.into()));
    assert_eq!(second.about.get("specimen.source"), Some(&"pig".into()));
    assert_eq!(second.about.get("series.repeat"), Some(&2.into()));
    assert_eq!(second.about.get("series.id"), Some(&"labelled/second".into()));
    // The command line holds over the file, and two specimens stay two.
    whole.set_label("operator", "Grace").unwrap();
    whole.set_label("specimen", "rabbit").unwrap();
    let (first, second) = (whole.labels(2, 1).unwrap(), whole.labels(3, 1).unwrap());
    assert_eq!(first.operator, "Grace");
    assert_eq!(
        (first.specimen.as_str(), second.specimen.as_str()),
        ("rabbit, specimen 1", "rabbit, specimen 2")
    );
    for (key, value, words) in
        [("series.repeat", "2", "series"), ("specimen.colour", "red", "is not a metadata entry")]
    {
        let refusal = whole.set_label(key, value).unwrap_err();
        assert!(refusal.contains(words), "{refusal}");
    }
}

#[test]
fn impossible_labels_are_refused_with_their_line() {
    let wrong = |from: &str, to: &str| {
        let text = LABELLED.replace(from, to);
        let refusal = Programme::read(&text, &|name| Err(format!("no protocol '{name}'")));
        refusal.unwrap_err()
    };
    let source = "specimen-source = \"x\"";
    let table = "specimen-source = \"x\"\n\n[specimen.2]";
    for (from, to, line, fact) in [
        ("", "", 10, "'specimen-source'"),
        ("specimen-source", "series.repeat", 10, "series"),
        (source, "indenter.diameter_mm = 0", 10, "cannot be '0'"),
        (source, "\"operator\" = \"x\"", 10, "duplicate key"),
        (source, "signal = [1]", 10, "signal"),
        (table, "[specimen.two]", 10, "'two'"),
        (table, "[specimen.9]", 10, "[specimen.9]"),
        (
            "\n[about]\noperator = \"Ada\"\nspecimen = \"stomach 7\"\nspecimen-source = \"x\"\n",
            "about = \"For a test.\"\n",
            6,
            "[about]",
        ),
    ] {
        let refusal = wrong(from, to);
        assert!(has_problem(&refusal, &(line, fact)), "{to}: {refusal}");
    }
    let twice = wrong("purpose", "operator = \"Bo\"\npurpose");
    assert!(twice.to_string().contains("operator"), "{twice}");
}

#[test]
fn the_programme_of_the_guide_is_one() {
    let page = std::fs::read_to_string(workspace().join("docs/guide/programmes.md")).unwrap();
    let text = page.split("```toml").nth(1).unwrap().split("```").next().unwrap();
    let labelled = programme(text);
    let labels = |task| labelled.labels(task, 1).unwrap();
    let (first, second) = (labels(0), labels(1));
    assert_eq!((first.operator.as_str(), first.specimen.as_str()), ("Ada", "specimen 1"));
    assert_eq!(second.specimen, "stomach 8, fundus");
    assert!(second.is_set("specimen.source") && second.is_set("specimen.thickness_mm"));
}

#[test]
fn the_probe_leaves_the_tissue_before_a_specimen_is_looked_after_anew() {
    let whole = programme(&LABELLED.replace("specimen-source = \"x\"\n", ""));
    let words = |remount| -> Vec<String> {
        let plan = whole.tasks[2].plan(1, remount).unwrap();
        let steps = plan.steps.iter().take(4);
        steps.map(|one| format!("{:?}", one.step)).collect()
    };
    let fresh = words(None);
    assert!(fresh[0].starts_with("Prompt"), "{fresh:?}");
    // What broke off may have left it there, and the axis does not know where it is.
    let again = words(Some(1));
    for (at, name) in ["SelfTest", "Home", "Prompt", "SelfTest"].iter().enumerate() {
        assert!(again[at].starts_with(name), "{again:?}");
    }
    assert_eq!(again[2..], fresh[..2]);
}
