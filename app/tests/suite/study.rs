//! Animals and specimens typed once, in sessions, edits, searches, lakes and the table of a study.

use crate::support::{answer, assert_prints, assert_refused, json, palpate, short_run, succeeded};
use std::fs;
use std::path::Path;

const STUDY: &str = r#"palpate-study = 1

[animal.pig-3]
species = "pig"
sex = "female"
age_days = 180
specimens = ["liver 1", "liver 2"]

[specimen."liver 2"]
site = "left lobe"
"#;

fn write_study(at: &Path, text: &str) {
    fs::create_dir_all(at.join("library")).unwrap();
    fs::write(at.join("library/study.toml"), text).unwrap();
}

#[test]
fn a_session_that_names_its_specimen_gets_the_animal_from_the_study() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_study(at, STUDY);
    succeeded(&short_run(at, "two", &["--specimen", "liver 2"]));
    let about = json(&palpate(at, &["info", "two", "--json"]))["about"].clone();
    assert_eq!(about["animal.name"], "pig-3");
    assert_eq!(
        (&about["animal.age_days"], &about["specimen.site"]),
        (&180.0.into(), &"left lobe".into())
    );
    // A session stands alone.
    fs::remove_file(at.join("library/study.toml")).unwrap();
    assert_eq!(json(&palpate(at, &["info", "two", "--json"]))["about"], about);

    write_study(at, STUDY);
    for (about, says) in [
        ("animal.name=pig-4", "line 7 of study.toml"),
        ("animal.sex=male", "line 3 of study.toml"),
        ("animal.sex=f", "female, male, mixed"),
    ] {
        let refused = short_run(at, "never", &["--specimen", "liver 1", "--about", about]);
        assert_refused(&refused, 2, says);
    }
    write_study(at, &STUDY.replace("sex = \"female\"", "sex = \"f\""));
    let refused = short_run(at, "never", &["--specimen", "liver 1"]);
    assert_refused(&refused, 2, "study.toml, line 5");
    assert!(!at.join("never").exists());
}

#[test]
fn entries_are_added_later_beside_the_log_and_found_in_searches_and_lakes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["one", "two"] {
        let out = format!("library/sessions/{name}");
        succeeded(&short_run(at, &out, &["--specimen", &format!("liver {name}")]));
    }
    let [one, two] = ["one", "two"].map(|name| format!("library/sessions/{name}"));
    let log = fs::read(crate::support::log_file(&at.join(&one))).unwrap();
    let about = |words: &[&str]| palpate(at, &[&["about"], words].concat());

    assert_refused(&about(&[&one]), 2, "study.toml");
    assert_refused(&about(&[&one, "animal.name=a"]), 2, "--reason");
    assert_refused(&about(&["animal.name=a", "--reason", "x"]), 2, "give sessions");
    assert_refused(&about(&[&one, "animal.colour=a", "--reason", "x"]), 2, "animal.species");
    let why = ["--reason", "from the notebook", "--json"];
    let entries = ["animal.name=pig-3", "animal.age_days=180", "animal.sex=female"];
    let entered = answer(&about(&[&[one.as_str(), &two], &entries[..], &why].concat()));
    assert_eq!(entered["sessions"][1]["entries"]["animal.age_days"], 180.0);
    // The second time there is nothing to write, and the log is as it was.
    let again = answer(&about(&[&[one.as_str(), &two], &entries[..], &why].concat()));
    assert_eq!(again["sessions"][0]["entries"], serde_json::json!({}));
    assert_eq!(fs::read(crate::support::log_file(&at.join(&one))).unwrap(), log);
    let assert_found = |condition: &str, count: u64| {
        let found = json(&palpate(at, &["find", "--where", condition, "--json"]));
        assert_eq!(found["count"], count, "{condition}");
    };
    assert_found("animal.age_days>100", 2);
    assert_found("about.animal.sex=female", 2);
    // What was entered before is replaced with all that described it, and stays in the history.
    succeeded(&about(
        &[&[one.as_str(), &two, "specimen=liver", "animal.name=b"], &why[..2]].concat(),
    ));

    let info = json(&palpate(at, &["info", &one, "--json"]));
    assert_eq!((&info["specimen"], &info["about"]["animal.name"]), (&"liver".into(), &"b".into()));
    assert_eq!(info["edits"].as_array().unwrap().len(), 3, "{info}");
    assert_found("animal.name=b", 2);
    assert_found("animal.age_days>100", 0);

    succeeded(&palpate(at, &["export", "library", "--lake", "lake"]));
    let of_folder = json(&palpate(at, &["study", "library", "--json"]));
    let of_lake = json(&palpate(at, &["study", "lake", "--json"]));
    for table in [&of_folder, &of_lake] {
        let rows = table["sessions"].as_array().unwrap();
        assert_eq!(rows.len(), 2, "{table}");
        assert_eq!((&rows[0]["animal"], &rows[0]["specimen"]), (&"b".into(), &"liver".into()));
        assert!(rows[0]["covariates"]["animal.age_days"].is_null());
        assert!(rows[0]["covariates"]["animal.treatment"].is_null());
    }
    assert_eq!(of_folder["sessions"][0]["session_id"], of_lake["sessions"][0]["session_id"]);
    let first = &of_folder["problems"][0];
    assert_eq!((&first["problem"], &first["animal"]), (&"one-animal".into(), &"b".into()));
    assert_prints(&palpate(at, &["study", "lake"]), "all sessions are of animal 'b'");
}

#[test]
fn sessions_that_contradict_each_other_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (name, sex) in [("one", "animal.sex=male"), ("two", "animal.sex=female")] {
        succeeded(&short_run(at, name, &["--specimen", "liver", "--about", sex]));
    }
    let about = |words: &[&str]| palpate(at, &[&["about"], words, &["--reason", "x"]].concat());
    let refused = about(&["one", "two", "animal.name=a"]);
    assert_refused(&refused, 2, "animal.sex of animal 'a' is 'male' in one and 'female' in two");
    let info = json(&palpate(at, &["info", "one", "--json"]));
    assert!(info["about"].get("animal.name").is_none(), "{info}");
    // Corrected together, they agree.
    succeeded(&about(&["one", "two", "animal.name=a", "animal.sex=female"]));
    write_study(at, "palpate-study = 1\n[animal.b]\nspecimens = [\"liver\"]\n");
    assert_refused(&about(&["one"]), 2, "line 3 of study.toml");
    succeeded(&about(&["two", "animal.name=b"]));
    let table = json(&palpate(at, &["study", "one", "two", "--json"]));
    let sentence = table["problems"][0]["sentence"].as_str().unwrap();
    assert!(sentence.contains("belongs to animal 'a' in one and to 'b' in two"), "{sentence}");
}
