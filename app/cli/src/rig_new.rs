//! `palpate rig new`: a folder with a sidecar that works, to begin with.

use super::Failure;
use super::output::Output;
use clap::Args;
use clap::builder::PossibleValuesParser;
use clap::builder::TypedValueParser;
use palpate_drivers::sidecar::skeleton::{SkeletonLanguage, is_skeleton_name, skeleton};
use palpate_sessions::atomic;
use std::path::Path;

/// Arguments of `palpate rig new`.
#[derive(Debug, Args)]
pub struct RigNewArgs {
    /// Name of the rig, and of the new folder
    #[arg(value_name = "NAME")]
    name: String,
    /// Language of the sidecar: python, arduino or rust
    #[arg(long, default_value = "python", value_parser = language_parser())]
    language: SkeletonLanguage,
}

fn language_parser() -> impl TypedValueParser<Value = SkeletonLanguage> {
    let words = SkeletonLanguage::ALL.map(SkeletonLanguage::word);
    PossibleValuesParser::new(words).map(|word| {
        let all = SkeletonLanguage::ALL.into_iter();
        // The parser accepts only their words.
        all.rev().find(|one| one.word() == word).unwrap_or(SkeletonLanguage::Python)
    })
}

pub(super) fn run(args: &RigNewArgs, output: &Output) -> Result<(), Failure> {
    let name = &args.name;
    if !is_skeleton_name(name) {
        return Err(Failure::usage(format!(
            "'{name}' cannot be the name of a rig; give up to 32 letters, digits, '-' and '_', a letter first"
        )));
    }
    let folder = Path::new(name);
    if folder.exists() {
        return Err(Failure::usage(format!("{name} exists already; give the rig another name")));
    }
    let files = skeleton(name, args.language);
    for file in &files {
        let to = folder.join(&file.path);
        let parent = to.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent)
            .and_then(|()| atomic::create(&to, file.text.as_bytes()))
            .map_err(|err| {
                Failure::failed(format!(
                    "{} cannot be written ({err}); choose a folder that you may write to",
                    to.display()
                ))
            })?;
    }
    let paths: Vec<String> = files.iter().map(|file| format!("{name}/{}", file.path)).collect();
    let object = serde_json::json!({
        "name": name, "language": args.language.word(), "rig_file": format!("{name}/{name}.toml"), "files": paths,
    });
    output.answer("rig new", &object, || {
        format!(
            "{}\nThe rig file is {name}/{name}.toml; {name}/README.md says what to do next.",
            paths.join("\n")
        )
    });
    Ok(())
}
