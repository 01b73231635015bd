//! Steps of a crate, each carried out by this program as a process of its own: without the time zone, language and
//! settings of whoever runs it.

use super::parse_options;
use palpate_analysis::research_object::{StepOutput, StepPlace, StepRunner};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Variables that a process needs to start at all, and those that choose functions of the C library.
const KEPT: [&str; 9] = [
    "PATH",
    "HOME",
    "TMPDIR",
    "TEMP",
    "TMP",
    "SystemRoot",
    "USERPROFILE",
    "LD_LIBRARY_PATH",
    "GLIBC_TUNABLES",
];

/// The variable that dates what a program makes (<https://reproducible-builds.org/specs/source-date-epoch/>).
pub(super) const DATE: &str = "SOURCE_DATE_EPOCH";

/// This program.
pub(super) struct OwnProgram(PathBuf);

impl OwnProgram {
    pub fn find() -> Result<Self, super::Failure> {
        std::env::current_exe().map(Self).map_err(|err| {
            super::Failure::failed(format!(
                "this program does not find its own file ({err}); start it by its full path"
            ))
        })
    }
}

impl StepRunner for OwnProgram {
    fn check(&self, words: &[String]) -> Result<(), String> {
        let Some((command, options)) = words.split_first() else { return Ok(()) };
        parse_options(command, options).map(drop).map_err(|err| err.sentence().to_owned())
    }

    fn run(&self, words: &[String], place: &StepPlace<'_>) -> Result<StepOutput, String> {
        let kept = KEPT.into_iter().filter_map(|name| Some((name, std::env::var_os(name)?)));
        let ran = Command::new(&self.0)
            .args(words)
            .current_dir(place.folder)
            .env_clear()
            .envs(kept)
            .env("TZ", "UTC")
            .env("LC_ALL", "C")
            .env("PALPATE_HOME", place.library)
            .env(DATE, place.made_at.timestamp().to_string())
            .stdin(Stdio::null())
            .output();
        let ran = ran.map_err(|err| format!("{} does not start ({err})", self.0.display()))?;
        Ok(StepOutput { is_done: ran.status.success(), output: ran.stdout, remarks: ran.stderr })
    }
}
