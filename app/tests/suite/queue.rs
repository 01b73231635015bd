//! `palpate queue` as a user meets it.

use crate::support::{answer, assert_refused, palpate, succeeded, typed};

#[test]
fn specimens_from_a_table_are_measured_in_a_recorded_order() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let fast = "ramp-hold-short.toml";
    let shown = typed(at, "protocol show ramp-hold");
    succeeded(&shown);
    let text = String::from_utf8(shown.stdout).unwrap();
    std::fs::write(at.join(fast), text).unwrap();
    std::fs::write(
        at.join("list.csv"),
        "specimen;protocol;specimen.thickness_mm\na;ramp-hold-short.toml;12\nb;;\nc;;\n",
    )
    .unwrap();
    succeeded(&typed(at, "queue new pilot --blinded"));
    let added = answer(&typed(at, "queue add --from list.csv --protocol check-home --json"));
    assert_eq!((&added["waiting"], &added["name"]), (&3.into(), &"pilot".into()));
    // Blinded: only the next one, and without its labels.
    assert_eq!(added["specimens"].as_array().unwrap().len(), 1);
    assert!(added["specimens"][0].get("labels").is_none());
    let shuffled = answer(&typed(at, "queue shuffle --seed 5 --json"));
    assert_eq!(shuffled["seeds"][0], 5);
    assert_refused(&typed(at, "queue judge accept"), 2, "no run waits for a verdict");
    for (place, verdict) in ["accept", "repeat", "accept"].into_iter().enumerate() {
        let before = answer(&typed(at, "queue show --json"));
        let next = before["specimens"].as_array().unwrap();
        let next = next.iter().find(|one| one["state"] == "waiting").unwrap();
        let name = next["specimen"].as_str().unwrap().to_owned();
        let run = typed(at, "queue run --time-scale max --json --operator Ada");
        let session = answer(&run);
        assert_eq!(session["ending"], "finish", "{place}");
        assert_refused(&typed(at, "queue run"), 2, "has no verdict yet");
        let folder = session["session"].as_str().unwrap();
        let info = answer(&palpate(at, &["info", folder, "--json"]));
        assert_eq!(info["specimen"], name.as_str());
        if verdict == "repeat" {
            assert_refused(&typed(at, "queue judge repeat"), 2, "give a reason");
        }
        let judged = palpate(at, &["queue", "judge", verdict, "--reason", "slipped", "--json"]);
        let judged = answer(&judged);
        assert_eq!(judged["without_verdict"], 0);
    }
    let end = answer(&typed(at, "queue show --json"));
    let count = |name: &str| end[name].as_u64().unwrap();
    assert_eq!((count("runs"), count("rejected_runs"), count("accepted")), (3, 1, 2));
    assert_refused(&typed(at, "queue new next"), 2, "still wait");
    assert_refused(&typed(at, "queue skip 9 --reason none"), 2, "no specimen number 9");
    let twice = typed(at, "queue add a --protocol check-home");
    assert_refused(&twice, 2, "already has a specimen 'a'");
    assert_refused(&typed(at, "queue add d --protocol nothing"), 2, "neither a built-in protocol");
}

#[test]
fn a_locked_protocol_is_run_as_it_is_and_nobody_sets_its_values() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let locked = ["protocol", "lock", "ramp-hold", "--as", "study 3", "--by", "Grace"];
    let values = ["--set", "depth=6 mm", "--set", "hold=1 s", "--set", "speed=3,0 mm/s", "--json"];
    let locked = answer(&palpate(at, &[&locked[..], &values[..]].concat()));
    assert_eq!(locked["values"]["depth"], "6 mm");
    let listed = answer(&typed(at, "protocol list --json"));
    assert_eq!(listed["locked"][0]["name"], "study 3");
    let wrong = palpate(at, &["run", "study 3", "--set", "depth=9 mm", "--preview"]);
    assert_refused(&wrong, 2, "is locked, so its values cannot be changed");
    succeeded(&palpate(at, &["queue", "add", "pig 1", "--protocol", "study 3"]));
    let run = answer(&typed(at, "queue run --time-scale max --json"));
    let info = answer(&palpate(at, &["info", run["session"].as_str().unwrap(), "--json"]));
    let source = &info["plan"]["source"];
    assert_eq!(source["values"]["depth"], "6 mm", "{info}");
    // The session says which text it was.
    let text = typed(at, "protocol show ramp-hold").stdout;
    let text = String::from_utf8(text).unwrap();
    assert_eq!(source["crc32"], format!("{:08x}", crc32fast::hash(text.as_bytes())));
    assert_refused(
        &palpate(at, &["protocol", "lock", "ramp-hold", "--as", "creep"]),
        2,
        "is a built-in protocol",
    );
}
