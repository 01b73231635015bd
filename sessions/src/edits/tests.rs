use super::*;
use chrono::TimeZone;

fn edit(reason: &str, change: EditChange) -> Edit {
    Edit {
        at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
        by: "Ada".into(),
        reason: reason.into(),
        change,
    }
}

fn verdict(verdict: DataQuality) -> EditChange {
    EditChange::Verdict { verdict }
}

#[test]
fn last_verdict_and_correction_count_and_all_edits_stay() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let contact = |number, mm| EditChange::Contact {
        number,
        position_mm: Position(mm),
        was_mm: Position(41.0),
    };
    let edits = [
        edit("it finished", verdict(DataQuality::Valid)),
        edit("by eye", contact(1, 41.25)),
        edit("hair on the probe", verdict(DataQuality::Rejected)),
        edit("again, with the video", contact(1, 0.1 + 0.2)),
        edit("the gel was warm", EditChange::Note),
    ];
    for one in &edits {
        add_edit(at, "id", one).unwrap();
    }
    let read = Edits::read(at, "id").unwrap();
    assert_eq!(read.all, edits);
    let (quality, edit) = read.verdict().unwrap();
    assert_eq!((quality, edit.reason.as_str()), (DataQuality::Rejected, "hair on the probe"));
    assert_eq!(read.contact(1).unwrap().0, Position(0.1 + 0.2));
    assert!(read.contact(2).is_none());
    let notes: Vec<&str> = read.notes().map(|one| one.reason.as_str()).collect();
    assert_eq!(notes, ["the gel was warm"]);
    // A segment belongs to the same session; a file of another name to none.
    assert_eq!(Edits::read(&at.join("001.mcap"), "id").unwrap(), read);
    assert_eq!(Edits::read(&at.join("alone.mcap"), "id").unwrap(), Edits::default());
}

#[test]
fn last_entry_counts_and_keeps_its_type() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let about = |pairs: &[(&str, &str)]| {
        let mut entries = SessionMetadata::default();
        pairs.iter().for_each(|(name, value)| entries.set(name, value).unwrap());
        EditChange::About { entries }
    };
    let age = about(&[("animal.age_days", "180"), ("specimen", "liver 1")]);
    add_edit(at, "id", &edit("notebook", age)).unwrap();
    add_edit(at, "id", &edit("typing error", about(&[("specimen", "liver 2")]))).unwrap();
    let read = Edits::read(at, "id").unwrap();
    let mut labels = SessionLabels { operator: "Ada".into(), ..SessionLabels::default() };
    read.apply_to_labels(&mut labels);
    assert_eq!((labels.operator.as_str(), labels.specimen.as_str()), ("Ada", "liver 2"));
    assert_eq!(labels.about.get("animal.age_days").unwrap(), 180.0);
    assert_eq!(read.about("specimen").unwrap().reason, "typing error");
    assert_eq!(read.about("animal.age_days").unwrap().reason, "notebook");
    assert!(read.about("animal.sex").is_none());
}

#[test]
fn tags_are_single_words_and_can_be_removed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let words = |words: &[&str]| words.iter().map(ToString::to_string).collect();
    let tags =
        |add: &[&str], remove: &[&str]| EditChange::Tags { add: words(add), remove: words(remove) };
    add_edit(at, "id", &edit("", tags(&["pilot", "µ-gel"], &[]))).unwrap();
    add_edit(at, "id", &edit("", tags(&["good"], &["pilot", "none"]))).unwrap();
    let read = Edits::read(at, "id").unwrap();
    assert_eq!(read.tags(), BTreeSet::from(["good", "µ-gel"]));
    for tag in ["", "two words", "a\u{0}", &"x".repeat(41)] {
        let refused = add_edit(at, "id", &edit("", tags(&[], &[tag])));
        assert!(matches!(refused, Err(EditError::Tag { .. })), "{tag:?}");
    }
}

#[test]
fn review_is_outdated_when_a_reviewed_file_changes() {
    let input =
        |what: &str, sha256: &str| AnalysisInput { what: what.into(), sha256: sha256.into() };
    let seen = vec![input("000.mcap", "a"), input("analyses.jsonl", "b")];
    let decision = ReviewDecision::Accepted;
    let review = EditChange::Review { decision, seen: seen.clone() };
    let mut edits = Edits::default();
    assert_eq!(edits.review(&seen), None);
    edits.all = vec![edit("before", verdict(DataQuality::Suspect)), edit("I looked", review)];
    let changed = |edits: &Edits, now: &[AnalysisInput]| edits.review(now).unwrap().changed;
    assert!(changed(&edits, &seen).is_empty());
    assert!(changed(&edits, &seen[1..]).is_empty());
    assert_eq!(changed(&edits, &seen[..1]), ["analyses.jsonl"]);
    assert_eq!(changed(&edits, &[]), ["analyses.jsonl"]);
    let other = [input("000.mcap", "c"), input("001.mcap", "d"), seen[1].clone()];
    assert_eq!(changed(&edits, &other), ["000.mcap", "001.mcap"]);
    let other = [input("001.mcap", "d"), seen[1].clone()];
    assert_eq!(changed(&edits, &other), ["001.mcap", "000.mcap"]);
    let tags = EditChange::Tags { add: vec!["good".into()], remove: Vec::new() };
    edits.all.push(edit("", tags));
    edits.all.push(edit("seen by two", EditChange::Note));
    assert!(changed(&edits, &seen).is_empty());
    edits.all.push(edit("after", verdict(DataQuality::Valid)));
    assert_eq!(changed(&edits, &seen), [EDITS_FILE]);
}

#[test]
fn edit_needs_a_reason_a_folder_and_an_ended_recording() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let none = add_edit(at, "id", &edit(" ", verdict(DataQuality::Valid))).unwrap_err();
    assert!(none.to_string().contains("needs a reason"));
    let no_folder = add_edit(&at.join("x"), "id", &edit("why", verdict(DataQuality::Valid)));
    assert!(no_folder.unwrap_err().to_string().contains("choose a session folder"));
    let held = HolderLock::acquire(&at.join(LOCK_FILE)).unwrap();
    let busy = add_edit(at, "id", &edit("why", verdict(DataQuality::Valid))).unwrap_err();
    let id = std::process::id().to_string();
    assert!(busy.to_string().contains(&id), "{busy}");
    // A short lock of another edit is waited for.
    std::thread::scope(|scope| {
        scope.spawn(|| add_edit(at, "id", &edit("why", verdict(DataQuality::Valid))).unwrap());
        std::thread::sleep(std::time::Duration::from_millis(100));
        drop(held);
    });
    assert_eq!(Edits::read(at, "id").unwrap().all.len(), 1);
}

#[test]
fn nothing_is_added_to_edits_of_an_unknown_kind() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let path = at.join(EDITS_FILE);
    let of_tomorrow = serde_json::json!({"at": "2026-03-05T14:15:07Z", "by": "Ada", "reason": "", "edit": "hologram"});
    chain::append(&path, "id", &of_tomorrow).unwrap();
    let before = std::fs::read(&path).unwrap();
    let refused = add_edit(at, "id", &edit("why", EditChange::Note)).unwrap_err();
    assert!(matches!(&refused, EditError::Chain(err) if err.is_newer()), "{refused:?}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
}
