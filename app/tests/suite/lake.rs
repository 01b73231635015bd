//! Parts of sessions as tables, and many sessions as a lake that is fitted part by part.

use crate::support::{
    answer, assert_prints, assert_refused, json, palpate, short_run, split_words, stderr, stdout,
    succeeded,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

#[test]
fn a_part_of_a_session_is_what_the_whole_table_has_there() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "demo", &[]));
    succeeded(&palpate(at, &["export", "demo", "--format", "csv"]));
    let whole = fs::read_to_string(at.join("demo.csv")).unwrap();
    let header: Vec<&str> = whole.lines().next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|one| *one == name).unwrap();
    let (t, force, phase) = (place("t_s"), place("force_N"), place("phase"));
    let part = split_words(
        "export demo --format csv --phase ramp,hold --from 60 --columns t_s,force_N --decimate 10 --delimiter ; --json",
    );
    let printed = answer(&palpate(at, &part));
    assert_eq!((&printed["every"], &printed["is_part"]), (&10.into(), &true.into()));
    let thinned = fs::read_to_string(at.join("demo.every10.csv")).unwrap();
    let expected: Vec<String> = whole
        .lines()
        .skip(1)
        .enumerate()
        .map(|(number, line)| (number, line.split(',').collect::<Vec<_>>()))
        .filter(|(_, cells)| ["ramp", "hold"].contains(&cells[phase]))
        .filter(|(_, cells)| cells[t].parse::<f64>().unwrap() >= 60.0)
        .step_by(10)
        .map(|(number, cells)| format!("{number};{};{}", cells[t], cells[force]))
        .collect();
    assert!(expected.len() > 10);
    assert_eq!(printed["rows"], expected.len());
    let found: Vec<&str> = thinned.lines().collect();
    assert_eq!(found[0], "sample_every_10;t_s;force_N");
    assert_eq!(found[1..], expected);
    let dictionary =
        fs::read_to_string(printed["dictionary"].as_str().map(|name| at.join(name)).unwrap());
    assert!(dictionary.unwrap().contains("one of every 10 "));

    succeeded(&palpate(at, &["export", "demo", "--format", "arrow"]));
    for (args, says) in [
        (vec!["--format", "csv", "--phase", "run"], "ramp"),
        (vec!["--format", "csv", "--columns", "force"], "force_N"),
        (vec!["--format", "csv", "--from", "2", "--until", "1"], "--until"),
        (vec!["--format", "csv", "--decimate", "1"], "2"),
        (vec!["--format", "csv", "--delimiter", "1"], "tab"),
        (vec!["--lake", "x", "--phase", "ramp"], "--phase"),
        (vec![], "--format"),
        (vec!["demo", "--format", "csv"], "--lake"),
    ] {
        let mut all = vec!["export", "demo"];
        all.extend(args);
        let refused = palpate(at, &all);
        assert_eq!(refused.status.code(), Some(2), "{all:?}");
        assert!(stderr(&refused).contains(says), "{all:?}: {}", stderr(&refused));
    }
}

/// Every file below a folder with its content, by its path there.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn below(top: &Path, folder: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).expect("the folder can be read") {
            let path = entry.expect("the folder can be read").path();
            if path.is_dir() {
                below(top, &path, found);
            } else {
                let name = path.strip_prefix(top).expect("it is below").to_owned();
                found.insert(name, fs::read(&path).expect("the file can be read"));
            }
        }
    }
    let mut found = BTreeMap::new();
    below(folder, folder, &mut found);
    found
}

fn copy(from: &Path, to: &Path) {
    for (name, content) in contents(from) {
        let path = to.join(name);
        fs::create_dir_all(path.parent().expect("it has a folder")).expect("a folder is made");
        fs::write(path, content).expect("the file is written");
    }
}

#[test]
fn a_lake_is_fitted_in_parts_as_its_sessions_are_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for seed in 1..=5 {
        let out = format!("runs/{seed}");
        fs::create_dir_all(at.join("runs")).unwrap();
        succeeded(&short_run(at, &out, &["--seed", &seed.to_string()]));
    }
    let printed = palpate(at, &["export", "runs", "--lake", "lake", "--json"]);
    succeeded(&printed);
    assert_eq!((&json(&printed)["added"], &json(&printed)["were_there"]), (&5.into(), &0.into()));
    let before = contents(&at.join("lake"));
    // Of each: samples, events, the session itself, and the checksums of the three.
    assert_eq!(before.len(), 20);
    let again = palpate(at, &["export", "runs", "--lake", "lake", "--json"]);
    succeeded(&again);
    assert_eq!((&json(&again)["added"], &json(&again)["were_there"]), (&0.into(), &5.into()));
    assert!(contents(&at.join("lake")) == before, "the lake changed");
    for name in ["serial", "parts", "killed"] {
        copy(&at.join("lake"), &at.join(name));
    }

    let serial = palpate(at, &["fit", "serial", "--jobs", "1", "--json"]);
    succeeded(&serial);
    assert_eq!(json(&serial)["made"], 5);
    let expected = contents(&at.join("serial"));
    assert_eq!(expected.len(), 25);

    // The same numbers, to the last digit, as of the sessions themselves.
    let direct = palpate(at, &["fit", "runs", "--json"]);
    succeeded(&direct);
    for line in stdout(&direct).lines() {
        let mut direct: Value = serde_json::from_str(line).unwrap();
        let source = direct.as_object_mut().unwrap().remove("source").unwrap();
        let info = palpate(at, &["info", source.as_str().unwrap(), "--json"]);
        let id = json(&info)["session_id"].as_str().unwrap().to_owned();
        let file = at.join(format!("serial/v1/fits/model=modified-kelvin/{id}.json"));
        let kept: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
        let kept = kept["fit"].as_object().unwrap();
        for (key, value) in direct.as_object().unwrap() {
            assert_eq!(kept.get(key), Some(value), "{id}: {key}");
        }
    }

    // Three processes at the same time.
    let parts: Vec<_> = (1..=3).map(|number| begin(at, "parts", &format!("{number}/3"))).collect();
    for mut part in parts {
        assert!(part.wait().unwrap().success());
    }
    assert!(contents(&at.join("parts")) == expected, "the parts are not the whole");

    // One that is killed as soon as it has done something, and run again.
    let mut first = begin(at, "killed", "1/1");
    let fits = at.join("killed/v1/fits/model=modified-kelvin");
    // Waits two minutes at most.
    let is_begun = (0..120_000).any(|_| {
        std::thread::sleep(Duration::from_millis(1));
        fs::read_dir(&fits).is_ok_and(|mut names| names.next().is_some())
    });
    assert!(is_begun, "nothing is fitted");
    first.kill().unwrap();
    first.wait().unwrap();
    let left = contents(&at.join("killed")).len();
    println!("killed with {left} files of 25");
    let again = palpate(at, &["fit", "killed", "--json"]);
    succeeded(&again);
    assert!(contents(&at.join("killed")) == expected, "the kill shows");

    let other = palpate(at, &["fit", "killed", "--fixed", "f_offset=0"]);
    assert_refused(&other, 1, "with different content");
    for (args, says) in [
        (["fit", "lake", "--shard", "4/3"], "i/n"),
        (["fit", "runs", "--shard", "1/3"], "not a lake"),
    ] {
        let refused = palpate(at, &args);
        assert_eq!(refused.status.code(), Some(2), "{args:?}");
        assert!(stderr(&refused).contains(says), "{}", stderr(&refused));
    }
}

fn begin(at: &Path, lake: &str, shard: &str) -> std::process::Child {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["fit", lake, "--shard", shard, "--jobs", "1"])
        .current_dir(at)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("palpate starts")
}

#[test]
fn what_cannot_be_fitted_is_listed_and_the_rest_is_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "good", &[]));
    succeeded(&short_run(at, "bad", &["--seed", "9"]));
    succeeded(&palpate(at, &["export", "good", "bad", "--lake", "lake"]));
    let info = json(&palpate(at, &["info", "bad", "--json"]));
    let id = info["session_id"].as_str().unwrap();
    let names = contents(&at.join("lake"));
    let file = format!("{id}.parquet");
    let samples = names.keys().find(|name| name.starts_with("v1/samples") && name.ends_with(&file));
    fs::write(at.join("lake").join(samples.unwrap()), "no table").unwrap();
    let fit = palpate(at, &["fit", "lake", "--json"]);
    assert_eq!(fit.status.code(), Some(1));
    let text = stdout(&fit);
    let printed: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    assert_eq!(printed["made"], 1);
    assert_eq!(printed["failed"][0]["session_id"], id);
}

#[test]
fn shells_and_man_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for shell in ["bash", "zsh", "fish"] {
        let script = palpate(at, &["completions", shell]);
        succeeded(&script);
        for word in ["daily-check", "completions", "shard"] {
            assert!(stdout(&script).contains(word), "{shell}: {word}");
        }
    }
    let page = palpate(at, &["man"]);
    succeeded(&page);
    assert_prints(&page, ".TH palpate 1");
    fs::create_dir(at.join("man1")).unwrap();
    succeeded(&palpate(at, &["man", "--to", "man1"]));
    let export = fs::read_to_string(at.join("man1/palpate-export.1")).unwrap();
    assert!(export.contains("decimate"), "{export}");
    let nowhere = palpate(at, &["man", "--to", "no/such"]);
    assert_eq!(nowhere.status.code(), Some(1));
}
