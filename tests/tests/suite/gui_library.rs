//! The library's screen: found, chosen, looked at, spoken of, taken back, written out.
use eframe::egui::{Event, Key, Modifiers, PointerButton, Role};
use egui_kittest::kittest::Queryable;
use palpate_analysis::edited_session;
use palpate_runner::TimeScale;
use palpate_sessions::edits::{DataQuality, EditChange, Edits};
use palpate_tests::flow::WindowFlow;
use palpate_tests::sample_library::{read_original, write};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Sessions in the library of these tests.
const SESSIONS: usize = 21;

/// A library, the folder of each of its sessions, and the window on its library screen.
fn opened() -> (WindowFlow, Vec<PathBuf>) {
    let folder = TempDir::new().unwrap();
    let original = read_original();
    let sessions = (0..SESSIONS).map(|number| write(folder.path(), &original, number));
    let sessions = sessions.collect();
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    flow.wait_for_words(&format!("{SESSIONS} sessions, found in"));
    (flow, sessions)
}

/// The row of a session, by its number.
fn row(number: usize) -> String {
    format!("20260101T000000Z-{number:08x}")
}

fn click_row(flow: &mut WindowFlow, number: usize, modifiers: Modifiers) {
    let name = row(number);
    let row = flow.window.get_by_label_contains(&name);
    match modifiers {
        Modifiers::NONE => row.click(),
        held => row.click_modifiers(held),
    }
    flow.window.run_steps(3);
}

/// Takes a name from a list that is open, once it is there: the catalog may still be reading what was said.
fn pick(flow: &mut WindowFlow, name: &str) {
    flow.wait(name, |window| {
        let mut found = window.query_all_by_role_and_label(Role::Button, name);
        found.next().is_some()
    });
    let button = flow.window.get_by_role_and_label(Role::Button, name);
    button.click_accesskit();
    flow.window.run_steps(2);
}

fn edits(session: &Path) -> Edits {
    let id = session.file_name().unwrap().to_str().unwrap();
    Edits::read(session, id).unwrap()
}

#[test]
fn sessions_are_found_by_words_conditions_and_choices() {
    let (mut flow, _) = opened();
    flow.window.check_accessibility();
    // Latest first: that one is in sight.
    assert!(flow.says(&row(SESSIONS - 1)));
    flow.type_into("find", "pig ada depth>=1cm");
    flow.wait_for_words("3 sessions, found in");
    assert!(flow.says(&row(12)) && !flow.says(&row(13)) && !flow.says(&row(8)));
    // What is wrong with it appears in words, and the list stays.
    flow.type_into("find", "depth>=deep");
    flow.wait_for_words("'depth>=deep'");
    assert!(flow.says("3 sessions, found in"));
    flow.type_into("find", "thickness>=3");
    flow.wait_for_words("named thickness");
    flow.type_into("find", "");
    flow.wait_for_words(&format!("{SESSIONS} sessions, found in"));
    flow.type_into("from", "yesterday");
    flow.wait_for_words("'yesterday'");
    flow.click("Clear search");
    flow.click("verdict is");
    pick(&mut flow, "suspect");
    flow.wait_for_words("2 sessions, found in");
    assert!(flow.says(&row(8)) && flow.says(&row(17)));
    flow.click("operator is");
    pick(&mut flow, "Ada");
    flow.wait_for_words("1 session, found in");
    assert!(flow.says("Session stomach 8, ramp-hold, Ada"));
    flow.click("Clear search");
    flow.wait_for_words(&format!("{SESSIONS} sessions, found in"));
    flow.click("sort by specimen");
    flow.wait("the other order", |window| {
        let top = |number| {
            let name = row(number);
            let row = window.query_by_label_contains(&name);
            row.map(|row| row.rect().top())
        };
        top(0).is_some() && top(0) < top(10)
    });
}

#[test]
fn sessions_are_chosen_by_keys_and_by_the_pointer_and_reviewed() {
    let (mut flow, sessions) = opened();
    // Nothing has the focus: the list has the keys.
    flow.window.key_press(Key::ArrowDown);
    flow.window.key_press(Key::ArrowDown);
    flow.window.run_steps(3);
    flow.wait_for_words("1 chosen");
    flow.window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowDown);
    flow.window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowDown);
    flow.wait_for_words("3 chosen");
    assert!(flow.says("3 sessions chosen"));
    flow.window.key_press(Key::End);
    flow.window.run_steps(4);
    flow.wait_for_words("1 chosen");
    // Far below: scrolled into sight.
    assert!(flow.says(&row(0)));
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    flow.wait_for_words(&format!("{SESSIONS} chosen"));
    // Keys are the text field's while it is typed in.
    flow.type_into("note", "x");
    flow.window.key_press(Key::ArrowUp);
    flow.window.run_steps(3);
    assert!(flow.says(&format!("{SESSIONS} chosen")));
    flow.window.key_press(Key::Home);
    click_row(&mut flow, 3, Modifiers::NONE);
    assert!(flow.says(", 1 chosen"));
    click_row(&mut flow, 5, Modifiers::COMMAND);
    assert!(flow.says(", 2 chosen"));
    click_row(&mut flow, 8, Modifiers::SHIFT);
    assert!(flow.says(", 4 chosen"));
    // A hand that is fast: the click on a row and the key that chooses all come in one frame.
    let pos = flow.window.get_by_label_contains(&row(8)).rect().center();
    let button = |pressed| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    let key = Event::Key {
        key: Key::A,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::COMMAND,
    };
    flow.type_into("note", "x");
    flow.window.event(Event::PointerMoved(pos));
    flow.window.run_steps(2);
    flow.window.input_mut().events.extend([button(true), button(false), key]);
    flow.window.run_steps(3);
    assert!(flow.says(&format!(", {SESSIONS} chosen")));
    click_row(&mut flow, 3, Modifiers::NONE);
    assert!(flow.says("finished, no sample missing"));
    assert!(flow.says(&format!("palpate replay \"{}\" --window", sessions[3].display())));
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(3);
    assert!(!flow.says("found in"), "the review screen is shown");
}

#[test]
fn what_is_said_is_a_record_and_can_be_taken_back() {
    let (mut flow, sessions) = opened();
    assert!(!flow.is_enabled("Accept") && flow.says("choose sessions first"));
    click_row(&mut flow, 20, Modifiers::NONE);
    click_row(&mut flow, 18, Modifiers::SHIFT);
    flow.type_into("by", "Grace");
    flow.type_into("new tags", "+pilot -absent");
    flow.click("Change tags");
    flow.wait_for_words("tags +pilot -absent on 3 sessions");
    for session in &sessions[18..21] {
        assert!(edits(session).tags().contains("pilot"));
    }
    flow.click("tag is");
    pick(&mut flow, "pilot");
    flow.wait_for_words("3 sessions, 3 chosen, found in");
    flow.click("Undo: tags +pilot -absent on 3 sessions");
    // Nothing has that tag now.
    flow.wait_for_words("0 sessions, found in");
    assert!(edits(&sessions[19]).tags().is_empty());
    assert_eq!(edits(&sessions[19]).all.len(), 3, "both are in the record");
    flow.click("Redo: tags +pilot -absent on 3 sessions");
    flow.wait_for_words("3 sessions, found in");
    flow.click("Clear search");
    flow.wait_for_words(&format!("{SESSIONS} sessions, found in"));
    click_row(&mut flow, 20, Modifiers::NONE);
    assert!(!flow.is_enabled("Suspect") && flow.says("reason first"));
    flow.type_into("reason", "hair under the probe");
    flow.click("Suspect");
    flow.wait_for_words("suspect: hair under the probe");
    flow.type_into("note", "the gel was warm");
    flow.click("Add note");
    flow.wait_for_words("the gel was warm (Grace)");
    flow.type_into("reason", "looked at with the video");
    flow.click("Accept");
    flow.wait_for_words("accepted, by Grace: looked at with the video");
    let written = edits(&sessions[20]);
    let (worth, why) = written.verdict().unwrap();
    assert_eq!((worth, why.by.as_str()), (DataQuality::Suspect, "Grace"));
    assert_eq!(written.notes().count(), 1);
    assert!(written.all.iter().any(|edit| matches!(edit.change, EditChange::Review { .. })));
    flow.window.check_accessibility();
    // Whoever types a note finds the session by it.
    flow.type_into("find", "warm gel");
    flow.wait_for_words("1 session, 1 chosen, found in");
    flow.type_into("find", "");
    flow.wait_for_words(&format!("{SESSIONS} sessions, 1 chosen, found in"));
    flow.click("Undo: verdict suspect on 1 session");
    flow.wait_for_words("valid: finished, no sample missing");
    // The review saw another verdict.
    flow.wait_for_words("outdated, by Grace");
    assert_eq!(edits(&sessions[20]).verdict().unwrap().0, DataQuality::Valid);
    // A verdict that was replaced since is not undone.
    flow.type_into("reason", "hair again");
    flow.click("Rejected");
    flow.wait_for_words("rejected: hair again");
    let subject = palpate_analysis::edits::EditTarget::read(&sessions[20]).unwrap();
    let verdict = DataQuality::Suspect;
    subject.add_edit("Mary", "not that bad", EditChange::Verdict { verdict }).unwrap();
    flow.click("Undo: verdict rejected on 1 session");
    flow.wait_for_words("the verdict was changed after it");
    assert_eq!(edits(&sessions[20]).verdict().unwrap().0, DataQuality::Suspect);
    flow.wait_for_words("suspect: not that bad");
}

#[test]
fn damage_is_reported_and_sessions_are_exported() {
    let (mut flow, sessions) = opened();
    let log = |number: usize| sessions[number].join("000.mcap");
    fs::write(log(5), b"no log").unwrap();
    let bytes = fs::read(log(6)).unwrap();
    fs::write(log(6), &bytes[..bytes.len() / 2]).unwrap();
    // In the middle, where the catalog does not look.
    let mut bytes = fs::read(log(7)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(log(7), bytes).unwrap();
    flow.click("Refresh");
    flow.wait_for_words("damaged: ");
    flow.wait_for_words("unfinished");
    let to = flow.folder.path().join("out/tables");
    click_row(&mut flow, 9, Modifiers::NONE);
    click_row(&mut flow, 7, Modifiers::SHIFT);
    assert!(!flow.is_enabled("Export") && flow.says("folder"));
    flow.type_into("to folder", &to.display().to_string());
    flow.click("Export");
    flow.wait_for_words("2 of 3 sessions written");
    assert!(flow.says(&format!("{}: ", row(7))), "what was not exported is listed");
    let text = fs::read_to_string(to.join(format!("{}.csv", row(8)))).unwrap();
    let rows = edited_session::open(&sessions[8]).unwrap().session.rows.len();
    assert_eq!(text.lines().count(), rows + 1);
    // Nothing is written over.
    fs::write(to.join(format!("{}.csv", row(8))), "mine").unwrap();
    flow.click("Export");
    flow.wait_for_words("0 of 3 sessions written");
    flow.wait_for_words("exists already");
    assert_eq!(fs::read_to_string(to.join(format!("{}.csv", row(8)))).unwrap(), "mine");
    let lake = flow.folder.path().join("out/lake");
    flow.type_into("to folder", &lake.display().to_string());
    flow.click("as");
    pick(&mut flow, "one data set (lake)");
    flow.click("Export");
    flow.wait_for_words("2 of 3 sessions added to");
    let listed = palpate_tests::files_below(&lake, "parquet");
    assert_eq!(listed.len(), 6);
    flow.click("Export");
    flow.wait_for_words("0 of 3 sessions added to");
    assert!(flow.says("2 were already there"));
}

#[test]
fn files_of_other_testers_become_sessions() {
    let (mut flow, _) = opened();
    let file = flow.folder.path().join("zug.csv");
    let rows = (0..200).map(|i| {
        let depth = (0.1 * f64::from(i)).min(5.0);
        format!("{},{depth},{}\n", 0.1 * f64::from(i), 0.2 * depth)
    });
    let text = format!("t_s,depth_mm,force_N\n{}", rows.collect::<String>());
    fs::write(&file, text).unwrap();
    assert!(!flow.is_enabled("Import") && flow.says("type or choose a file first"));
    flow.type_into("files", "/nowhere/at-all.csv");
    flow.click("Import");
    flow.wait_for_words("cannot read /nowhere/at-all.csv");
    flow.type_into("files", &file.display().to_string());
    flow.type_into("of what", "gelatine");
    flow.click("Preview import");
    flow.wait_for_words("none (dry run)");
    assert!(flow.says("200 over 19.900 s"));
    assert!(flow.says(&format!("{SESSIONS} sessions, found in")));
    flow.click("Import");
    flow.wait_for_words(&format!("{} sessions, found in", SESSIONS + 1));
    flow.type_into("find", "gelatine zug");
    flow.wait_for_words("1 session, found in");
    flow.window.check_accessibility();
}
