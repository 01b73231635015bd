//! `palpate crate` and `palpate reproduce`: a study, its numbers, and the numbers again.

use crate::support::{
    answer, assert_prints, assert_refused, assert_says, command, json, palpate, stdout, succeeded,
};
use palpate_sessions::text::sha256_of_file;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// A session that is recorded in the repository.
fn recorded(name: &str) -> String {
    let at = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/sessions").join(name);
    at.canonicalize().unwrap().to_str().unwrap().to_owned()
}

const STUDY: &str = r#"palpate-crate = 1
title = "Two presses on simulated tissue"
description = "Sessions of the simulated lab rig."
licence = "CC-BY-4.0"
files = ["notes.csv"]

[[person]]
name = "Josiah Carberry"
orcid = "0000-0002-1825-0097"
affiliation = "Brown University"

[[step]]
name = "fit"
run = ["fit", "sessions/ramp-hold-lab", "--json", "--picture", "results/fit/fit.svg"]

[[step]]
name = "page"
run = ["report", "sessions/ramp-hold-lab", "--html", "results/page/page.html"]

[[step]]
name = "table"
run = ["export", "sessions/ramp-hold-lab", "--format", "parquet", "--to", "results/table"]

[[step]]
name = "study"
run = ["study", "sessions"]
"#;

/// Makes the crate of [`STUDY`] in a folder, as a folder or a zip file.
fn make(at: &Path, name: &str) -> Value {
    fs::write(at.join("study.toml"), STUDY).unwrap();
    fs::write(at.join("notes.csv"), "a,b\n1,2\n").unwrap();
    let (one, two) = (recorded("ramp-hold-lab"), recorded("hold-until-lab"));
    answer(&palpate(at, &["crate", name, &one, &two, "--study", "study.toml", "--json"]))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        match entry.path() {
            path if path.is_dir() => found.extend(files(&path)),
            path => found.push(path),
        }
    }
    found.sort();
    found
}

/// Changes a file of a crate, and the list of hashes with it, as somebody does who wants other numbers.
fn forge(crate_folder: &Path, name: &str, change: impl Fn(String) -> String) {
    let path = crate_folder.join(name);
    let before = fs::read_to_string(&path).unwrap();
    let after = change(before.clone());
    assert_ne!(before, after, "{name}");
    let sums = crate_folder.join("SHA256SUMS");
    let old = sha256_of_file(&path).unwrap();
    fs::write(&path, after).unwrap();
    let list = fs::read_to_string(&sums).unwrap();
    fs::write(&sums, list.replace(&old, &sha256_of_file(&path).unwrap())).unwrap();
}

#[test]
fn crate_is_computed_again_by_another_user_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = make(at, "crate");
    assert_eq!(made["sessions"], serde_json::json!(["hold-until-lab", "ramp-hold-lab"]));
    // Sessions are whole, and nothing of this computer is in a file that is made.
    let copied = at.join("crate/sessions/ramp-hold-lab/000.mcap");
    let original = Path::new(&recorded("ramp-hold-lab")).join("000.mcap");
    assert_eq!(fs::read(copied).unwrap(), fs::read(original).unwrap());
    let here = at.to_str().unwrap();
    for file in files(&at.join("crate")) {
        if let Ok(text) = fs::read_to_string(&file) {
            assert!(!text.contains(here), "{}", file.display());
        }
    }
    let elsewhere = at.join("other place");
    fs::create_dir(&elsewhere).unwrap();
    fs::rename(at.join("crate"), elsewhere.join("moved")).unwrap();
    let mut other = command(&elsewhere, &["reproduce", "moved", "--out", "again", "--json"]);
    other.env("TZ", "Asia/Kathmandu").env("LC_ALL", "tr_TR.UTF-8").env("LANG", "tr_TR.UTF-8");
    other.env("HOME", &elsewhere).env("COLUMNS", "40").env("RUST_LOG", "trace");
    other.env("SOURCE_DATE_EPOCH", "1");
    let found = answer(&other.output().unwrap());
    assert_eq!((&found["is_equal"], &found["is_exact"]), (&true.into(), &true.into()), "{found:#}");
    let results = found["steps"].as_array().unwrap().iter();
    let results: Vec<&str> = results
        .flat_map(|step| step["files"].as_array().unwrap())
        .map(|file| file["result"].as_str().unwrap())
        .collect();
    assert!(results.len() >= 6 && results.iter().all(|result| *result == "same"), "{found:#}");
    let [one, two] =
        ["moved", "again"].map(|name| elsewhere.join(name).join("results/fit/fit.svg"));
    assert_eq!(fs::read(one).unwrap(), fs::read(two).unwrap());
}

#[test]
fn one_flipped_byte_in_any_file_is_found_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    make(at, "crate");
    let all = files(&at.join("crate"));
    assert!(all.len() >= 15, "{all:?}");
    for file in all {
        let whole = fs::read(&file).unwrap();
        let mut flipped = whole.clone();
        flipped[whole.len() / 2] ^= 1;
        fs::write(&file, flipped).unwrap();
        let refused = palpate(at, &["reproduce", "crate"]);
        assert_eq!(refused.status.code(), Some(1), "{}: {}", file.display(), stdout(&refused));
        let name = file.strip_prefix(at.join("crate")).unwrap().to_str().unwrap();
        // A flipped byte of the list names the file of its line.
        if name != "SHA256SUMS" {
            assert_prints(&refused, name);
            assert_says(&refused, "not the file that the crate was made with");
        }
        fs::write(&file, whole).unwrap();
    }
    fs::write(at.join("crate/more.txt"), "").unwrap();
    assert_refused(&palpate(at, &["reproduce", "crate"]), 1, "more.txt is not listed");
}

#[test]
fn forged_number_is_found_by_computing_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    make(at, "crate");
    let output = at.join("crate/results/fit/output.json");
    let fit: Value = serde_json::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let value = fit["parameters"][0]["value"].as_f64().unwrap();
    let [old, new] = [value, value * (1.0 + 1e-9)].map(|value| format!("\"value\": {value}"));
    let line = fs::read_to_string(&output).unwrap().lines().position(|one| one.contains(&old));
    forge(&at.join("crate"), "results/fit/output.json", |text| text.replacen(&old, &new, 1));
    let refused = palpate(at, &["reproduce", "crate", "--json"]);
    assert_eq!(refused.status.code(), Some(1));
    let text = stdout(&refused);
    let found: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    let step = &found["steps"][0];
    let differs =
        step["files"].as_array().unwrap().iter().find(|file| file["result"] == "different");
    let differs = differs.unwrap_or_else(|| panic!("{found:#}"));
    assert_eq!(differs["line"].as_u64(), line.map(|line| line as u64 + 1), "{differs:#}");
    assert!(differs["in_crate"].as_str().unwrap().contains(&new), "{differs:#}");
    assert!(differs["now"].as_str().unwrap().contains(&old), "{differs:#}");
}

/// A crate of an earlier version is computed with the bounds; what differs by more comes with the changelog.
#[test]
fn older_crate_is_compared_within_bounds_and_explained_by_the_changelog() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    make(at, "crate");
    let own = at.join("crate");
    forge(&own, "ro-crate-metadata.json", |text| {
        let version = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
        text.replace(&version, "\"version\": \"0.1.0\"")
    });
    let output = own.join("results/fit/output.json");
    let fit: Value = serde_json::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let value = fit["parameters"][0]["value"].as_f64().unwrap();
    let nearly = value * (1.0 + 1e-8);
    let words = |value: f64| format!("\"value\": {value}");
    forge(&own, "results/fit/output.json", |text| text.replacen(&words(value), &words(nearly), 1));
    let found = answer(&palpate(at, &["reproduce", "crate", "--json"]));
    assert_eq!((&found["made_by"], &found["is_exact"]), (&"older".into(), &false.into()));
    assert_eq!(found["changes"], serde_json::json!([]));
    let other = words(value * 1.01);
    forge(&own, "results/fit/output.json", |text| text.replacen(&words(nearly), &other, 1));
    let refused = palpate(at, &["reproduce", "crate"]);
    assert_refused(&refused, 1, "step 'fit' gives other results");
    assert_prints(&refused, "made by palpate 0.1.0");
    assert_prints(&refused, "changes since the crate was made");
    assert_prints(&refused, "0.2.0, ");
    // A newer one says so.
    forge(&own, "ro-crate-metadata.json", |text| {
        text.replace("\"version\": \"0.1.0\"", "\"version\": \"99.0.0\"")
    });
    assert_says(&palpate(at, &["reproduce", "crate"]), "a newer palpate made the crate");
}

/// Functions of the mathematics library that round otherwise make another class of computer.
#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
#[test]
fn crate_of_another_class_of_computer_is_equal_within_the_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    make(at, "crate");
    let mut other = command(at, &["reproduce", "crate", "--json"]);
    let found =
        answer(&other.env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4").output().unwrap());
    let functions = |with: &str| found[with]["computer"]["functions"].clone();
    let is_same = functions("made_with") == functions("computed_with");
    let says = ["is_equal", "is_same_computer", "is_exact"].map(|key| found[key].as_bool());
    assert_eq!(says, [true, is_same, is_same].map(Some), "{found:#}");
}

#[test]
fn zip_file_is_computed_again_and_sealed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = recorded("ramp-hold-lab");
    let made = answer(&palpate(at, &["crate", "crate.zip", &session, "--json"]));
    assert_eq!(made["steps"], serde_json::json!(["report", "fit-1"]));
    let found = answer(&palpate(at, &["reproduce", "crate.zip", "--json"]));
    assert_eq!((&found["is_exact"], &found["is_repacked"]), (&true.into(), &false.into()));
    let whole = fs::read(at.join("crate.zip")).unwrap();
    // Beside what is in files: in a time, in the list of names, in the seal.
    for place in [10, whole.len() - 200, whole.len() - 1] {
        let mut flipped = whole.clone();
        flipped[place] ^= 1;
        fs::write(at.join("flipped.zip"), flipped).unwrap();
        let refused = palpate(at, &["reproduce", "flipped.zip"]);
        assert_eq!(refused.status.code(), Some(1), "byte {place}: {}", stdout(&refused));
    }
    let mut zip = zip::ZipWriter::new(fs::File::create(at.join("hostile.zip")).unwrap());
    zip.start_file("../escaped", zip::write::SimpleFileOptions::default()).unwrap();
    zip.finish().unwrap();
    assert_refused(&palpate(at, &["reproduce", "hostile.zip"]), 1, "leads out of the crate");
    assert!(!at.join("escaped").exists() && !at.parent().unwrap().join("escaped").exists());
}

#[test]
fn step_that_does_more_than_compute_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = recorded("ramp-hold-lab");
    let head = "palpate-crate = 1\ntitle = \"t\"\n[[step]]\nname = \"a\"\nrun = ";
    for (run, code, fact) in [
        ("[\"run\", \"ramp-hold\"]", 2, "line 5: step 'a': 'run' cannot be a step"),
        ("[\"fit\", \"sessions\", \"--save\", \"x\"]", 2, "'--save' of 'fit'"),
        ("[\"fit\", \"/etc\"]", 2, "leads out of the crate"),
        ("[\"fit\", \"sessions\", \"--colour\"]", 2, "--colour"),
        ("[\"fit\", \"sessions/none\"]", 1, "step 'a' failed"),
        (
            "[\"report\", \"sessions/ramp-hold-lab\", \"--figure\", \"other.svg\"]",
            1,
            "step 'a' wrote other.svg",
        ),
        (
            "[\"report\", \"sessions/ramp-hold-lab\", \"--figure\", \"sessions/ramp-hold-lab/x.svg\"]",
            1,
            "step 'a' wrote sessions/ramp-hold-lab/x.svg",
        ),
    ] {
        fs::write(at.join("study.toml"), format!("{head}{run}\n")).unwrap();
        let refused = palpate(at, &["crate", "out", &session, "--study", "study.toml"]);
        assert_refused(&refused, code, fact);
        assert!(!at.join("out").exists(), "{run}");
    }
    // Nothing that was begun is left.
    assert_eq!(
        fs::read_dir(at).unwrap().flatten().filter(|one| one.file_name() != "library").count(),
        1
    );
    assert_refused(&palpate(at, &["reproduce", "study.toml"]), 1, "not a zip file");
    assert_refused(&palpate(at, &["reproduce", "."]), 2, "not a crate");
}

#[test]
fn completeness_says_what_a_reader_will_miss() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = make(at, "crate");
    let findings = made["findings"].as_array().unwrap();
    let entries: Vec<&str> = findings.iter().filter_map(|one| one["entry"].as_str()).collect();
    for entry in ["indenter.diameter_mm", "specimen.hydration", "specimen.time_since_death_h"] {
        assert!(entries.contains(&entry), "{findings:#?}");
    }
    let page = fs::read_to_string(at.join("crate/index.html")).unwrap();
    assert!(page.contains("specimen.hydration is missing") && page.contains("10.1089/ten.tec"));
    let metadata = fs::read_to_string(at.join("crate/ro-crate-metadata.json")).unwrap();
    let metadata: Value = serde_json::from_str(&metadata).unwrap();
    let graph = metadata["@graph"].as_array().unwrap();
    let root = graph.iter().find(|one| one["@id"] == "./").unwrap();
    assert_eq!(root["author"]["@id"], "https://orcid.org/0000-0002-1825-0097");
    // Every id that is named is described, but for addresses of vocabularies.
    let ids: Vec<&str> = graph.iter().map(|one| one["@id"].as_str().unwrap()).collect();
    for part in
        root["hasPart"].as_array().unwrap().iter().chain(root["mentions"].as_array().unwrap())
    {
        assert!(ids.contains(&part["@id"].as_str().unwrap()), "{part}");
    }
    // Entries that are added are no longer missed.
    let session = at.join("crate/sessions/ramp-hold-lab");
    let copy = at.join("mine");
    fs::create_dir(&copy).unwrap();
    fs::copy(session.join("000.mcap"), copy.join("000.mcap")).unwrap();
    let words = [
        "about",
        "mine",
        "specimen.hydration=saline",
        "animal.species=pig",
        "specimen.source=pig liver",
        "--reason",
        "notebook",
        "--by",
        "Ada",
    ];
    succeeded(&palpate(at, &words));
    let made = json(&palpate(at, &["crate", "better", "mine", "--json"]));
    let found = made["findings"].to_string();
    assert!(!found.contains("specimen.hydration") && found.contains("no licence"), "{found}");
    let metadata = fs::read_to_string(at.join("better/ro-crate-metadata.json")).unwrap();
    assert!(metadata.contains("NCBITaxon_9823") && metadata.contains("UBERON_0002107"));
}
