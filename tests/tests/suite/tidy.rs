//! The rules of ARCHITECTURE.md that a machine can check.

use palpate_test_support::skip;
use palpate_tests::{files_below, workspace};
use std::collections::BTreeSet;
use std::fs;

/// Every package of the product.
const PACKAGES: [&str; 14] = [
    "model",
    "model/rheology",
    "model/haptics",
    "drivers",
    "drivers/emulators",
    "sessions",
    "sessions/tables",
    "protocols",
    "protocols/runner",
    "app/figures",
    "app/analysis",
    "app/cli",
    "app/window",
    "app",
];

/// The folders at the top that hold our sources.
const TOPS: [&str; 6] = ["app", "drivers", "model", "protocols", "sessions", "tests"];

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
fn engine_reaches_no_file_thread_or_clock() {
    let files = files_below(&workspace().join("protocols/src"), "rs");
    assert!(files.len() > 50, "{} files", files.len());
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for forbidden in ["std::fs", "std::thread", "std::time", "std::io"] {
            assert!(
                !text.contains(forbidden),
                "{} uses {forbidden}",
                file.display()
            );
        }
    }
}

#[test]
fn only_the_runner_sends_commands_to_a_rig() {
    // Clippy knows the method whatever the value before it is called; here, that clippy is told.
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
    assert_eq!(
        excepted,
        ["clippy.toml", "drivers/clippy.toml", "tests/clippy.toml"]
    );
    // Where rigs are made and tested all other rules hold.
    for path in &excepted[1..] {
        let here = lines(path);
        let missing: Vec<&String> = everywhere.difference(&here).collect();
        assert!(missing.iter().all(|line| line.contains(ban)), "{missing:?}");
    }
}

#[test]
fn colours_live_in_the_tokens() {
    let files = files_below(&workspace().join("app"), "rs");
    assert!(files.len() > 200, "{} files", files.len());
    for file in files {
        if file.ends_with("figures/src/tokens.rs") {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        for literal in [
            "Color32::from_rgb",
            "Color32::from_gray",
            "Color32::RED",
            "Color32::from_hex",
            "Rgba::from",
        ] {
            assert!(
                !text.contains(literal),
                "{} has a colour of its own: {literal}",
                file.display()
            );
        }
    }
}

#[test]
fn doubles_are_for_tests_only() {
    for package in ["app", "protocols", "sessions"] {
        for file in files_below(&workspace().join(package).join("src"), "rs") {
            let text = fs::read_to_string(&file).unwrap();
            assert!(
                !text.contains("palpate_drivers::doubles"),
                "{} names a test double",
                file.display()
            );
        }
    }
}

#[test]
fn files_stay_readable() {
    for package in TOPS {
        for file in files_below(&workspace().join(package), "rs") {
            let lines = fs::read_to_string(&file).unwrap().lines().count();
            assert!(
                lines <= 800,
                "{} has {lines} lines; split it or write a decision page",
                file.display()
            );
        }
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
        assert!(
            read(&format!("{package}/src/lib.rs")).starts_with("//! "),
            "{package}"
        );
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
    assert!(
        read("README.md").contains("docs/pictures/window.png"),
        "the README shows the window"
    );
    assert!(workspace().join("docs/pictures/window.png").exists());
}

#[test]
fn every_dependency_has_its_reason() {
    let reasons = read("docs/dependencies.md");
    for package in PACKAGES {
        for name in dependencies(package)
            .iter()
            .filter(|name| !name.starts_with("palpate-"))
        {
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
    let banned = [
        ["#[ign", "ore"].concat(),
        ["unsafe", " {"].concat(),
        ["to", "do!("].concat(),
    ];
    for package in TOPS {
        for file in files_below(&workspace().join(package), "rs") {
            let text = fs::read_to_string(&file).unwrap();
            for word in &banned {
                assert!(
                    !text.contains(word.as_str()),
                    "{} has {word}",
                    file.display()
                );
            }
        }
    }
}

#[test]
fn the_soak_script_names_its_parts() {
    if skip::lacks_program("python3") {
        return;
    }
    let script = workspace().join("scripts/soak");
    let help = std::process::Command::new("python3")
        .arg(&script)
        .arg("--help")
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&help.stdout);
    assert!(help.status.success(), "{told}");
    for part in [
        "bodies", "select", "coverage", "extremes", "haptics", "runs", "contact",
    ] {
        let is_named = told.lines().any(|line| line.trim_start().starts_with(part));
        assert!(is_named, "{part}: {told}");
    }
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
    let sources: Vec<(String, String)> = TOPS
        .into_iter()
        .flat_map(|package| files_below(&workspace().join(package), "rs"))
        .map(|file| {
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            (name, fs::read_to_string(&file).unwrap())
        })
        .collect();
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
            let is_there = |one: &(String, String)| one.0 == source && one.1.contains(&function);
            if !sources.iter().any(is_there) {
                gone.push(format!("{}: {span}", file.display()));
            }
        }
    }
    assert!(gone.is_empty(), "{}", gone.join("\n"));
    assert!(count > 50, "only {count} looked at");
}
