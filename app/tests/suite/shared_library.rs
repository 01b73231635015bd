//! `palpate library` and `palpate find --store`: sessions of one computer in a store, on another computer.

use crate::support::{
    answer, assert_prints, assert_refused, assert_says, palpate, short_run, stdout, succeeded,
    typed,
};
use std::fs;
use std::path::Path;

/// The address of a store in a folder.
fn store(at: &Path) -> String {
    format!("file://{}", at.join("store").display())
}

#[cfg(unix)]
#[test]
fn what_one_computer_pushes_another_finds_and_pulls() {
    let (here, there) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (here, there) = (here.path(), there.path());
    let store = store(here);
    succeeded(&short_run(here, "library/sessions/a", &["--specimen", "liver 1"]));
    succeeded(&short_run(here, "elsewhere", &["--specimen", "liver 2"]));

    // Nothing is there yet, and looking makes nothing.
    for looks in [["library", "pull"], ["library", "verify"], ["library", "compact"]] {
        let words = match looks[1] {
            "pull" => vec![looks[0], looks[1], &store, "--out", "x"],
            _ => vec![looks[0], looks[1], &store],
        };
        assert_refused(&palpate(there, &words), 2, "there is no table of sessions at");
    }
    assert_refused(
        &palpate(there, &["find", "--store", &store]),
        2,
        "there is no table of sessions at",
    );
    assert!(!here.join("store").exists());

    let pushed = answer(&palpate(here, &["library", "push", &store, "--json"]));
    assert_eq!(pushed["pushed"].as_array().unwrap().len(), 1, "{pushed}");
    let again = answer(&palpate(here, &["library", "push", &store, "--json"]));
    assert_eq!((&again["known"], &again["bytes"]), (&1.into(), &0.into()));
    let other = answer(&palpate(here, &["library", "push", &store, "elsewhere", "--json"]));
    assert_eq!(other["pushed"].as_array().unwrap().len(), 1, "{other}");

    let found = answer(&palpate(there, &["find", "--store", &store, "specimen:liver", "--json"]));
    assert_eq!((&found["count"], &found["library"]), (&2.into(), &store.as_str().into()));
    let id = found["sessions"].as_array().unwrap().iter().find(|one| one["specimen"] == "liver 1");
    let id = id.unwrap()["session_id"].as_str().unwrap();
    succeeded(&palpate(there, &["library", "pull", &store, id, "--out", "pulled"]));
    let log = "000.mcap";
    let own = fs::read(here.join("library/sessions/a").join(log)).unwrap();
    assert_eq!(fs::read(there.join("pulled").join(id).join(log)).unwrap(), own);
    succeeded(&palpate(there, &["library", "verify", &store, "--deep"]));

    // A store out of reach is searched as it was last seen.
    fs::rename(here.join("store"), here.join("away")).unwrap();
    let found = palpate(there, &["find", "--store", &store]);
    succeeded(&found);
    assert_says(&found, "what was last seen of the store: there is no table of sessions at");
    assert_prints(&found, "liver 2");
    fs::rename(here.join("away"), here.join("store")).unwrap();

    let compact = answer(&palpate(there, &["library", "compact", &store, "--json"]));
    assert_eq!((&compact["before"], &compact["after"]), (&2.into(), &1.into()));
    let object = fs::read_dir(here.join("store/objects")).unwrap().next().unwrap().unwrap().path();
    fs::remove_dir_all(object).unwrap();
    let failed = palpate(there, &["library", "verify", &store]);
    assert_refused(&failed, 1, "push these sessions by their folders");
    assert_prints(&failed, "it is missing");
    succeeded(&palpate(here, &["library", "push", &store, "library/sessions/a", "elsewhere"]));
    succeeded(&palpate(there, &["library", "verify", &store, "--deep"]));
}

#[test]
fn wrong_addresses_names_and_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let store = store(at);
    for address in ["/srv/store", "http://lab", "s3:/lab", "file:///"] {
        let refused = palpate(at, &["library", "push", address]);
        assert_refused(&refused, 2, "give s3://BUCKET/FOLDER or file:///FOLDER");
    }
    assert_refused(&palpate(at, &["library", "push", &store, "."]), 2, "is not a session");
    succeeded(&palpate(at, &["library", "push", &store]));
    let unknown = palpate(at, &["library", "pull", &store, "nothing", "--out", "x"]);
    assert_refused(&unknown, 2, "no session nothing is in the store");
    assert!(!at.join("x").exists());
}

/// Results of workers that share a lake: each once, whoever added it, and again after a lost store.
#[cfg(unix)]
#[test]
fn fits_moduli_and_populations_of_a_lake_are_in_a_store_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let store = store(at);
    let (one, two) = ("runs/one", "runs/two");
    fs::create_dir_all(at.join("runs")).unwrap();
    for (animal, out) in [one, two].into_iter().enumerate() {
        for (lobe, press) in [(1, 1), (1, 2), (2, 1)] {
            let seed = (10 * animal + 3 * lobe + press).to_string();
            let specimen = format!("liver {animal} lobe {lobe}");
            let animal = format!("animal.name={animal}");
            let words = ["--specimen", &specimen, "--seed", &seed, "--about", &animal];
            succeeded(&short_run(at, &format!("{out}-{lobe}-{press}"), &words));
        }
    }
    succeeded(&palpate(at, &["export", "runs", "--lake", "lake"]));
    let fit = |shard: &str, more: &[&str]| {
        let words = ["fit", "lake", "--shard", shard, "--store", &store, "--json"];
        answer(&palpate(at, &[&words, more].concat()))
    };
    let outcome = |answer: &serde_json::Value| {
        let number = |key: &str| answer["store"][key].as_u64().unwrap();
        (number("added"), number("known"))
    };
    let (first, rest) = (outcome(&fit("1/2", &[])), outcome(&fit("2/2", &[])));
    assert_eq!((first.0 + rest.0, first.1 + rest.1), (6, 0));
    assert_eq!(outcome(&fit("1/1", &[])), (0, 6));
    // Another family is another computation.
    assert_eq!(outcome(&fit("1/1", &["--family", "prony-1"])), (6, 0));

    let line = format!(
        "material lake --indenter flat-punch --radius 10 --thickness 25 --poisson 0.49 --depth-max 1.5 --store {store} --json"
    );
    let moduli = typed(at, &line);
    assert_eq!(outcome(&answer(&moduli)), (6, 0));
    let words = ["population", "lake", "--two-stage", "--stored", "--parameters", "mu1"];
    let population = || palpate(at, &[&words[..], &["--store", &store, "--json"]].concat());
    assert_eq!(outcome(&answer(&population())), (1, 0));
    assert_eq!(outcome(&answer(&population())), (0, 1));
    let verified = palpate(at, &["library", "verify", &store, "--deep"]);
    assert_prints(&verified, "all 0 session versions and 19 results in the store are whole");

    // A fit of other settings is no fit of this command.
    let other = palpate(at, &["fit", "lake", "--fixed", "mu3=0", "--store", &store, "--json"]);
    assert_eq!(other.status.code(), Some(1));
    let printed = stdout(&other);
    let first = printed.lines().next().unwrap();
    assert_eq!(outcome(&serde_json::from_str(first).unwrap()), (0, 0));

    // Joined files have the same results; a lost table is made from the lake again, and a lost object is found.
    let (compacted, lost) = (palpate(at, &["library", "compact", &store]), at.join("store/fits"));
    succeeded(&compacted);
    fs::remove_dir_all(lost).unwrap();
    assert_eq!(outcome(&fit("1/1", &[])), (6, 0));

    fs::remove_dir_all(at.join("store/objects")).unwrap();
    assert_refused(&palpate(at, &["library", "verify", &store]), 1, "the store has 13 faults");

    assert_refused(&palpate(at, &["fit", one, "--store", &store]), 2, "--store needs a lake");
    let wrong = palpate(at, &["fit", "lake", "--store", "/srv/store"]);
    assert_refused(&wrong, 2, "is not the address of a store");
}
