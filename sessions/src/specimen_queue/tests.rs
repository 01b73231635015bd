use super::*;
use std::fs;
use std::time::UNIX_EPOCH;

fn specimen(name: &str) -> QueuedSpecimen {
    QueuedSpecimen {
        specimen: name.into(),
        protocol: "ramp-hold".into(),
        labels: Default::default(),
    }
}

fn add(names: &[&str]) -> QueueChange {
    QueueChange::Added { specimens: names.iter().map(|name| specimen(name)).collect() }
}

fn change(library: &Path, change: QueueChange) -> Result<SpecimenQueue, QueueError> {
    SpecimenQueue::change(library, UNIX_EPOCH, "Ada", "a reason", change)
}

fn names(queue: &SpecimenQueue) -> Vec<&str> {
    let waiting = queue.items.iter().filter(|item| item.state == SpecimenState::Waiting);
    waiting.map(|item| item.wanted.specimen.as_str()).collect()
}

#[test]
fn a_day_with_a_repeat_a_skip_and_a_rejection_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path();
    let queue = change(library, add(&["a", "b", "c", "d"])).unwrap();
    assert_eq!(queue.name, USUAL_NAME);
    let begin = |number, session: &str| QueueChange::Begun { number, session: session.into() };
    let judge = |number, verdict| QueueChange::Judged { number, verdict };
    for one in [
        begin(1, "s1"),
        judge(1, QueueVerdict::Repeat),
        QueueChange::Skipped { number: 2 },
        begin(1, "s2"),
        judge(1, QueueVerdict::Accept),
        QueueChange::Moved { number: 4, place: 1 },
        begin(4, "s3"),
        judge(4, QueueVerdict::Reject),
        begin(3, "s4"),
    ] {
        change(library, one).unwrap();
    }
    // As after a crash: what was begun waits for a verdict.
    let queue = SpecimenQueue::read(library).unwrap();
    let open = queue.open_run_of(library, &library.join("s4")).unwrap();
    assert_eq!(open.wanted.specimen, "c");
    assert!(queue.open_run_of(library, &library.join("s3")).is_none());
    let counts = QueueCounts {
        waiting: 0,
        without_verdict: 1,
        accepted: 1,
        rejected: 1,
        skipped: 1,
        runs: 4,
        rejected_runs: 2,
    };
    assert_eq!(queue.counts(), counts);
    let queue = change(library, QueueChange::Restored { number: 2 }).unwrap();
    assert_eq!(names(&queue), ["b"]);
    assert_eq!(queue.items.last().unwrap().reason, "a reason");
}

#[test]
fn every_prefix_of_the_journal_is_a_queue() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path();
    let queue = change(library, add(&["a", "b", "c"])).unwrap();
    change(library, queue.shuffle(7)).unwrap();
    change(library, QueueChange::Begun { number: 2, session: "s".into() }).unwrap();
    change(library, QueueChange::Judged { number: 2, verdict: QueueVerdict::Accept }).unwrap();
    let path = library.join(QUEUE_FOLDER).join(JOURNAL_FILE);
    let whole = fs::read(&path).unwrap();
    for cut in 0..=whole.len() {
        fs::write(&path, &whole[..cut]).unwrap();
        // A power cut comes before the head is written.
        let _ = fs::remove_file(library.join(QUEUE_FOLDER).join("journal.jsonl.head"));
        let queue = SpecimenQueue::read(library).unwrap();
        let lines = whole[..cut].iter().filter(|byte| **byte == b'\n').count();
        assert_eq!(queue.items.len(), if lines < 2 { 0 } else { 3 }, "{cut}");
        assert_eq!(queue.seeds.len(), usize::from(lines > 2), "{cut}");
    }
}

#[test]
fn refused_changes_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path();
    change(library, add(&["a", "b"])).unwrap();
    let path = library.join(QUEUE_FOLDER).join(JOURNAL_FILE);
    let before = fs::read(&path).unwrap();
    let begin = |number| QueueChange::Begun { number, session: "s".into() };
    for (wrong, words) in [
        (add(&["c", "a"]), "already has a specimen 'a'"),
        (add(&["c", " "]), "specimen 2 has no name"),
        (begin(3), "no specimen number 3"),
        (QueueChange::Judged { number: 1, verdict: QueueVerdict::Accept }, "is waiting, and only"),
        (QueueChange::Restored { number: 1 }, "skipped, accepted or rejected"),
        (QueueChange::Moved { number: 1, place: 3 }, "no place among the 2"),
        (QueueChange::Shuffled { seed: 1, order: vec![1, 1] }, "shuffle again"),
        (start("next", false), "still wait in the queue 'specimens'"),
    ] {
        let refusal = change(library, wrong).unwrap_err().to_string();
        assert!(refusal.contains(words), "{refusal}");
        assert_eq!(fs::read(&path).unwrap(), before);
    }
    let silent =
        SpecimenQueue::change(library, UNIX_EPOCH, "", " ", QueueChange::Skipped { number: 1 });
    assert!(matches!(silent, Err(QueueError::Refused(QueueRefusal::NoReason))));
    change(library, begin(2)).unwrap();
    let refusal = change(library, begin(1)).unwrap_err().to_string();
    assert!(refusal.contains("number 2 has no verdict yet"), "{refusal}");
}

#[test]
fn a_seed_gives_one_order_and_seeds_give_every_order_equally_often() {
    let mut queue = SpecimenQueue::default();
    queue.add(&["a", "b", "c", "d"].map(specimen)).unwrap();
    assert_eq!(queue.shuffle(1), queue.shuffle(1));
    const DRAWS: u64 = 24_000;
    let mut counts = std::collections::BTreeMap::<Vec<u32>, u32>::new();
    for seed in 0..DRAWS {
        let QueueChange::Shuffled { order, .. } = queue.shuffle(seed) else { unreachable!() };
        *counts.entry(order).or_default() += 1;
    }
    assert_eq!(counts.len(), 24);
    // Seeds are fixed, so this either always holds or never: five standard deviations of a binomial count, 5 * 31.
    assert!(counts.values().all(|count| count.abs_diff(1000) < 155), "{counts:?}");
}

#[test]
fn a_changed_line_and_a_later_version_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path();
    let later = QueueChange::Started { queue_version: 2, name: "x".into(), is_blinded: false };
    let refusal = change(library, later).unwrap_err().to_string();
    assert!(refusal.contains("update palpate"), "{refusal}");
    change(library, add(&["a", "b"])).unwrap();
    let path = library.join(QUEUE_FOLDER).join(JOURNAL_FILE);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"a\"", "\"z\"", 1)).unwrap();
    let refusal = SpecimenQueue::read(library).unwrap_err().to_string();
    assert!(refusal.contains("was changed"), "{refusal}");
}
