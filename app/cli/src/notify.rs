//! `palpate notify`: who gets which notices, and whether they arrive.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_notifications::{
    Notice, NoticeKind, NotificationSettings, SETTINGS_FILE, Target, TargetTest, test_targets,
};
use palpate_runner::wall_now;
use palpate_sessions::library_folder;
use serde_json::{Value, json};

/// Check the notifications of runs: read their settings, and send a test to every target
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct NotifyArgs {
    /// Read the settings and show what is sent where
    #[arg(long)]
    check: bool,
    /// Send one test to every target, and show whether it arrived
    #[arg(long)]
    test: bool,
}

pub(super) fn run(args: &NotifyArgs, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let settings = NotificationSettings::of_library(&library).map_err(Failure::usage)?;
    let settings = settings.ok_or_else(|| {
        Failure::usage(format!(
            "there is no file {}, so nothing is sent; the guide's page on notifications has an example",
            library.join(SETTINGS_FILE).display()
        ))
    })?;
    match args.test {
        true => test(&settings.targets, output),
        false => {
            let targets: Vec<Value> = settings.targets.iter().map(target_object).collect();
            output.answer("notify", &json!({ "targets": targets }), || settings.text());
            Ok(())
        }
    }
}

fn target_object(target: &Target) -> Value {
    let when = NoticeKind::RULES.into_iter().filter(|kind| target.wants(*kind));
    let when: Vec<&str> = when.map(NoticeKind::name).collect();
    json!({ "way": target.way(), "target": target.name(), "when": when })
}

fn test(targets: &[Target], output: &Output) -> Result<(), Failure> {
    let notice = Notice::test(wall_now().into());
    let tests = test_targets(targets, &notice).map_err(Failure::failed)?;
    let objects: Vec<Value> = tests
        .iter()
        .map(|test| {
            let reason = test.result.as_ref().err();
            json!({ "way": test.way, "target": test.target, "arrived": reason.is_none(), "reason": reason })
        })
        .collect();
    let line = |test: &TargetTest| match &test.result {
        Ok(()) => format!("{}: arrived", test.target),
        Err(reason) => format!("{}: failed: {reason}", test.target),
    };
    output.answer("notify", &json!({ "tests": objects }), || match tests.as_slice() {
        [] => format!("{SETTINGS_FILE} names no target, so nothing is sent"),
        tests => tests.iter().map(line).collect::<Vec<_>>().join("\n"),
    });
    match tests.iter().filter(|test| test.result.is_err()).count() {
        0 => Ok(()),
        failed => Err(Failure::failed(format!(
            "the test did not reach {failed} of {} targets; correct {SETTINGS_FILE} or the servers",
            tests.len()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use palpate_analysis::kept_files::kept_files;
    use palpate_notifications::{
        ANNOUNCED_FILE, ANNOUNCED_VERSION, SETTINGS_FILE, SETTINGS_VERSION,
    };
    use std::path::Path;

    #[test]
    fn list_of_kept_files_has_those_of_notifications() {
        let files = kept_files(Path::new("library"));
        for (name, form) in [
            (SETTINGS_FILE, format!("TOML, palpate-notifications {SETTINGS_VERSION}")),
            (ANNOUNCED_FILE, format!("JSON, version {ANNOUNCED_VERSION}")),
        ] {
            let there = files.iter().any(|one| one.place.ends_with(name) && one.form == form);
            assert!(there, "{name}");
        }
    }
}
