//! The rules of ARCHITECTURE.md that a machine can check.

use palpate_test_support::skip;
use palpate_tests::{files_below, workspace};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// Every package of the product.
const PACKAGES: [&str; 21] = [
    "model",
    "model/rheology",
    "model/haptics",
    "model/indentation",
    "model/population",
    "drivers",
    "drivers/emulators",
    "drivers/haptic-devices",
    "sessions",
    "sessions/store",
    "sessions/tables",
    "protocols",
    "protocols/runner",
    "app/figures",
    "app/analysis",
    "app/cli",
    "app/station",
    "app/notifications",
    "app/tissue-view",
    "app/window",
    "app",
];

/// The folders at the top that hold our sources.
const TOPS: [&str; 6] = ["app", "drivers", "model", "protocols", "sessions", "tests"];

/// Every Rust file of the folders with what is in it.
fn sources<'a>(folders: impl IntoIterator<Item = &'a str>) -> Vec<(PathBuf, String)> {
    let files = folders.into_iter().flat_map(|folder| files_below(&workspace().join(folder), "rs"));
    files
        .map(|file| {
            let text = fs::read_to_string(&file).unwrap();
            (file, text)
        })
        .collect()
}

/// No file has a word that is forbidden to it.
fn assert_without(files: &[(PathBuf, String)], words: &[&str]) {
    for (file, text) in files {
        for word in words {
            assert!(!text.contains(word), "{} has {word}", file.display());
        }
    }
}

fn read(path: &str) -> String {
    fs::read_to_string(workspace().join(path)).unwrap_or_else(|err| panic!("{path}: {err}"))
}

/// Names under `[dependencies]` of a package, without the tests' own.
fn dependencies(package: &str) -> BTreeSet<String> {
    read(&format!("{package}/Cargo.toml"))
        .lines()
        .skip_while(|line| line.trim() != "[dependencies]")
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| line.split(['.', ' ', '=']).next().map(str::to_owned))
        .filter(|name| !name.is_empty())
        .collect()
}

#[test]
fn every_member_of_the_workspace_has_a_rule() {
    let manifest = read("Cargo.toml");
    let (_, members) = manifest.split_once("members = [").unwrap();
    let (members, _) = members.split_once(']').unwrap();
    let members: BTreeSet<&str> = members.split('"').skip(1).step_by(2).collect();
    // What tests are made of may use everything.
    let tests = ["tests", "tests/doubles", "tests/support"];
    let known: BTreeSet<&str> = PACKAGES.into_iter().chain(tests).collect();
    assert_eq!(members, known);
    // Their manifests are read as they are written.
    for package in PACKAGES {
        let is_alone = dependencies(package).is_empty();
        assert!(!is_alone, "{package} uses nothing");
    }
}

#[test]
fn engine_reaches_no_file_thread_or_clock() {
    let files = sources(["protocols/src"]);
    assert!(files.len() > 50, "{} files", files.len());
    assert_without(&files, &["std::fs", "std::thread", "std::time", "std::io"]);
}

#[test]
fn only_the_runner_sends_commands_to_a_rig() {
    // Clippy knows the method whatever the value before it is called; here, that clippy has the list.
    let ban = "palpate_drivers::Rig::send";
    let lines = |path: &str| -> BTreeSet<String> {
        let rules = read(path);
        let rules = rules.lines().filter(|line| !line.starts_with('#'));
        rules.map(str::to_owned).collect()
    };
    let everywhere = lines("clippy.toml");
    assert!(everywhere.iter().any(|line| line.contains(ban)));
    let excepted: Vec<String> = files_below(&workspace(), "toml")
        .iter()
        .filter(|file| file.ends_with("clippy.toml"))
        .filter_map(|file| file.strip_prefix(workspace()).ok())
        .map(|file| file.display().to_string())
        .collect();
    assert_eq!(excepted, ["clippy.toml", "drivers/clippy.toml", "tests/clippy.toml"]);
    // Where rigs are made and tested all other rules hold.
    for path in &excepted[1..] {
        let here = lines(path);
        let missing: Vec<&String> = everywhere.difference(&here).collect();
        assert!(missing.iter().all(|line| line.contains(ban)), "{missing:?}");
    }
}

#[test]
fn colours_live_in_the_tokens() {
    let mut files = sources(["app"]);
    assert!(files.len() > 200, "{} files", files.len());
    let all = files.len();
    files.retain(|(file, _)| !file.ends_with("figures/src/tokens.rs"));
    assert_eq!(files.len() + 1, all, "the tokens are one file");
    let literals = [
        "Color32::from_rgb",
        "Color32::from_gray",
        "Color32::RED",
        "Color32::from_hex",
        "Rgba::from",
    ];
    assert_without(&files, &literals);
}

#[test]
fn files_stay_readable() {
    for (file, text) in sources(TOPS) {
        let lines = text.lines().count();
        let is_test = file.components().any(|part| part.as_os_str() == "tests")
            || file.file_stem().is_some_and(|name| {
                let name = name.to_string_lossy();
                name == "tests" || name.ends_with("_tests")
            });
        assert!(
            lines <= if is_test { 800 } else { 500 },
            "{} has {lines} lines; split it or write a decision page",
            file.display()
        );
    }
}

#[test]
fn every_package_takes_the_workspace_lints_and_explains_itself() {
    for package in PACKAGES {
        if package == "app" {
            continue;
        }
        assert!(
            read(&format!("{package}/Cargo.toml")).contains("[lints]\nworkspace = true"),
            "{package}"
        );
        assert!(read(&format!("{package}/src/lib.rs")).starts_with("//! "), "{package}");
    }
    for page in [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "LICENSE-MIT",
        "LICENSE-APACHE",
    ] {
        assert!(!read(page).is_empty());
    }
    assert!(read("README.md").contains("docs/pictures/window.png"), "the README shows the window");
    assert!(workspace().join("docs/pictures/window.png").exists());
}

#[test]
fn every_dependency_has_its_reason() {
    // The first column of its table; letters within another name are no reason.
    let page = read("docs/dependencies.md");
    let reasons: BTreeSet<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(" | ").next())
        .flat_map(|names| names.split(", "))
        .collect();
    for package in PACKAGES {
        for name in dependencies(package).iter().filter(|name| !name.starts_with("palpate-")) {
            assert!(
                reasons.contains(name.as_str()),
                "{name}, used by {package}, has no reason in docs/dependencies.md"
            );
        }
    }
}

#[test]
fn no_test_is_ignored_and_no_page_is_unsafe() {
    // Written in two halves so that this file does not find itself.
    let banned = [["#[ign", "ore"].concat(), ["unsafe", " {"].concat(), ["to", "do!("].concat()];
    assert_without(&sources(TOPS), &banned.each_ref().map(String::as_str));
}

#[test]
fn the_soak_script_names_its_parts() {
    if skip::lacks_program("python3") {
        return;
    }
    let script = workspace().join("scripts/soak");
    let help = std::process::Command::new("python3").arg(&script).arg("--help").output().unwrap();
    let help_text = String::from_utf8_lossy(&help.stdout);
    assert!(help.status.success(), "{help_text}");
    for part in ["bodies", "select", "coverage", "extremes", "haptics", "runs", "contact"] {
        let is_named = help_text.lines().any(|line| line.trim_start().starts_with(part));
        assert!(is_named, "{part}: {help_text}");
    }
}

#[test]
fn gate_fails_where_a_test_was_skipped_without_reason() {
    if skip::lacks_program("python3") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("skipped");
    // The gate's script runs in python3, which therefore is here.
    for (line, code, count) in [
        ("program\tpython3\tsuite::one\tnot on the path\n", 1, 1),
        ("program\tno-such-program\tsuite::one\tgone\n", 0, 1),
        ("command\ttrue\tsuite::one\tfailed\n", 1, 1),
        ("command\tfalse\tsuite::one\tfailed\n", 0, 1),
        ("", 0, 0),
    ] {
        fs::write(&list, line).unwrap();
        let judged = std::process::Command::new("python3")
            .arg(workspace().join("scripts/skipped"))
            .arg(&list)
            .output()
            .unwrap();
        let summary = String::from_utf8_lossy(&judged.stdout);
        assert_eq!(judged.status.code(), Some(code), "{line}: {summary}");
        assert!(summary.contains(&format!("{count} tests skipped")), "{summary}");
        assert_eq!(summary.contains("suite::one"), count == 1, "{summary}");
    }
}

#[test]
fn gate_expects_the_renderer_that_it_installs() {
    assert!(read("scripts/skipped").contains(&format!("\"{}\"", skip::HAS_RENDERER)));
    assert!(read("scripts/install-test-tools").contains("mesa-vulkan-drivers"));
}

#[test]
fn what_documents_point_to_exists() {
    let tops: Vec<String> = TOPS
        .into_iter()
        .chain(["benches", "docs", "examples", "python", "scripts"])
        .map(|top| format!("{top}/"))
        .collect();
    let mut gone = Vec::new();
    let mut count = 0;
    for file in files_below(&workspace(), "md") {
        let folder = file.parent().unwrap();
        let text = fs::read_to_string(&file).unwrap();
        // `[words](path)` from where the document is, and `path` in a code span from the top.
        let links = text.split("](").skip(1).filter_map(|rest| {
            let (path, _) = rest.split_once(')')?;
            let path = path.split('#').next()?;
            (!path.is_empty() && !path.contains("://")).then_some((folder, path))
        });
        let top = workspace();
        let spans = text.split('`').skip(1).step_by(2).filter_map(|span| {
            let path = span.split_whitespace().next()?.trim_end_matches('/');
            let is_ours = tops.iter().any(|top| span.starts_with(top.as_str()));
            // Not a pattern, nor with a name to be filled in.
            let is_plain = !path.contains(['*', '<', '{', '$']) && !path.contains("NAME");
            (is_ours && is_plain).then_some((top.as_path(), path))
        });
        for (from, path) in links.chain(spans) {
            count += 1;
            if !from.join(path).exists() {
                gone.push(format!("{}: {path}", file.display()));
            }
        }
    }
    assert!(gone.is_empty(), "{}", gone.join("\n"));
    assert!(count > 100, "only {count} looked at");
}

#[test]
fn tests_that_documents_name_exist() {
    let sources = sources(TOPS);
    let (mut gone, mut count) = (Vec::new(), 0);
    for file in files_below(&workspace().join("docs"), "md") {
        let text = fs::read_to_string(&file).unwrap();
        // `file.rs: name` in a code span.
        for span in text.split('`').skip(1).step_by(2) {
            let Some((source, name)) = span.split_once(".rs: ") else {
                continue;
            };
            count += 1;
            let (source, function) = (format!("{source}.rs"), format!("fn {name}("));
            let is_there = |(path, text): &(PathBuf, String)| {
                path.file_name().is_some_and(|found| *found == *source) && text.contains(&function)
            };
            if !sources.iter().any(is_there) {
                gone.push(format!("{}: {span}", file.display()));
            }
        }
    }
    assert!(gone.is_empty(), "{}", gone.join("\n"));
    assert!(count > 50, "only {count} looked at");
}
