//! `palpate catalog`: the file in which `palpate find` looks, made anew or compared with the sessions.

use super::Failure;
use super::output::{Bar, Output};
use clap::Subcommand;
use palpate_runner::Stopwatch;
use palpate_sessions::catalog::{CATALOG_FILE, Catalog, CatalogError, Changes, Doubt};
use palpate_sessions::library_folder;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Make the catalog of the library anew, or check it
#[derive(Debug, Subcommand)]
pub enum CatalogCommand {
    /// Make the catalog anew from the sessions of the library
    Rebuild,
    /// Read every session and compare it with the catalog
    Check,
}

pub(super) fn run(command: &CatalogCommand, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    match command {
        CatalogCommand::Rebuild => rebuild(&library, output),
        CatalogCommand::Check => check(&library, output),
    }
}

#[derive(Serialize)]
struct RebuildReport {
    file: PathBuf,
    #[serde(flatten)]
    changes: Changes,
    unreadable: Vec<Unreadable>,
    seconds: f64,
}

#[derive(Serialize)]
struct Unreadable {
    folder: String,
    reason: String,
}

fn rebuild(library: &Path, output: &Output) -> Result<(), Failure> {
    let watch = Stopwatch::start();
    let mut bar = LateBar::new(output, "reading sessions");
    let (changes, entries) = with(library, output, |catalog| {
        let changes = catalog.rebuild(&mut |done, of| bar.show(done, of))?;
        Ok((changes, catalog.all()?))
    })?;
    drop(bar);
    let unreadable = entries
        .into_iter()
        .filter_map(|entry| Some(Unreadable { folder: entry.folder, reason: entry.trouble? }));
    let report = RebuildReport {
        file: library.join(CATALOG_FILE),
        changes,
        unreadable: unreadable.collect(),
        seconds: watch.seconds(),
    };
    say(&report.changes.remarks, output);
    output.answer("catalog rebuild", &report, || {
        let mut lines = vec![format!(
            "{} sessions read in {:.2} s, {}",
            report.changes.sessions,
            report.seconds,
            report.file.display()
        )];
        let bad = report.unreadable.iter();
        lines.extend(bad.map(|one| format!("{}: {}", one.folder, one.reason)));
        lines.join("\n")
    });
    Ok(())
}

#[derive(Serialize)]
struct CheckReport {
    file: PathBuf,
    sessions: usize,
    doubts: Vec<Doubt>,
}

fn check(library: &Path, output: &Output) -> Result<(), Failure> {
    let mut bar = LateBar::new(output, "comparing");
    let (sessions, doubts) = with(library, output, |catalog| {
        let doubts = catalog.check(&mut |done, of| bar.show(done, of))?;
        Ok((catalog.all()?.len(), doubts))
    })?;
    drop(bar);
    let report = CheckReport { file: library.join(CATALOG_FILE), sessions, doubts };
    output.answer("catalog check", &report, || match report.doubts.as_slice() {
        [] => format!("the catalog agrees with its {sessions} sessions"),
        doubts => {
            let line = |one: &Doubt| format!("{}: {}", one.folder, one.sentence);
            doubts.iter().map(line).collect::<Vec<_>>().join("\n")
        }
    });
    match report.doubts.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!(
            "the catalog is behind in {count} sessions; 'palpate find' reads what changed, 'palpate catalog rebuild' everything"
        ))),
    }
}

/// Brings the catalog up to date and does some work with it.
pub(super) fn with_updated<T>(
    library: &Path,
    output: &Output,
    mut work: impl FnMut(&mut Catalog) -> Result<T, CatalogError>,
) -> Result<T, Failure> {
    let mut bar = LateBar::new(output, "reading sessions");
    let (changes, done) = with(library, output, |catalog| {
        let changes = catalog.update(&mut |done, of| bar.show(done, of))?;
        Ok((changes, work(catalog)?))
    })?;
    drop(bar);
    say(&changes.remarks, output);
    Ok(done)
}

fn with<T>(
    library: &Path,
    output: &Output,
    mut work: impl FnMut(&mut Catalog) -> Result<T, CatalogError>,
) -> Result<T, Failure> {
    let mut remarks = Vec::new();
    let done = Catalog::with(library, |catalog| {
        remarks.append(&mut catalog.remarks);
        work(catalog)
    });
    say(&remarks, output);
    done.map_err(Failure::failed)
}

fn say(remarks: &[String], output: &Output) {
    remarks.iter().for_each(|remark| output.note(remark));
}

/// A progress bar that comes once the work has taken a second.
struct LateBar<'a> {
    output: &'a Output,
    message: &'static str,
    watch: Stopwatch,
    bar: Option<Bar>,
}

/// Seconds of work that nobody needs a bar for.
const SHORT_S: f64 = 1.0;

impl<'a> LateBar<'a> {
    fn new(output: &'a Output, message: &'static str) -> Self {
        Self { output, message, watch: Stopwatch::start(), bar: None }
    }

    fn show(&mut self, done: usize, of: usize) {
        if self.bar.is_none() && self.watch.seconds() > SHORT_S {
            let bar = self.output.count_bar(of as u64);
            bar.set_message(self.message);
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(done as u64);
        }
    }
}
