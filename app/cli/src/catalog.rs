//! `palpate catalog`: rebuilds the index of `palpate find`, or compares it with the sessions.

use super::Failure;
use super::output::{Bar, Output, merged};
use clap::Subcommand;
use palpate_runner::Stopwatch;
use palpate_sessions::catalog::{CATALOG_FILE, Catalog, CatalogError, CatalogMismatch};
use palpate_sessions::library_folder;
use serde::Serialize;
use std::path::Path;

/// Rebuild the catalog of the library, or check it
#[derive(Debug, Subcommand)]
pub enum CatalogCommand {
    /// Rebuild the catalog from the sessions of the library
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
struct Unreadable {
    folder: String,
    reason: String,
}

fn rebuild(library: &Path, output: &Output) -> Result<(), Failure> {
    let watch = Stopwatch::start();
    let mut bar = LateBar::new(output, "reading sessions");
    let (changes, entries) = use_catalog(library, output, |catalog| {
        let changes = catalog.rebuild(&mut |done, of| bar.show(done, of))?;
        Ok((changes, catalog.all()?))
    })?;
    drop(bar);
    let unreadable = entries
        .into_iter()
        .filter_map(|entry| Some(Unreadable { folder: entry.folder, reason: entry.trouble? }));
    let unreadable: Vec<Unreadable> = unreadable.collect();
    let (file, seconds) = (library.join(CATALOG_FILE).display().to_string(), watch.seconds());
    let object = serde_json::json!({ "file": file, "unreadable": unreadable, "seconds": seconds });
    note_all(&changes.remarks, output);
    output.answer("catalog rebuild", &merged(object, &changes), || {
        let head = format!(
            "{} sessions read in {seconds:.2} s; catalog written to {file}",
            changes.sessions
        );
        let bad = unreadable.iter().map(|one| format!("{}: {}", one.folder, one.reason));
        [head].into_iter().chain(bad).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}

fn check(library: &Path, output: &Output) -> Result<(), Failure> {
    let mut bar = LateBar::new(output, "comparing");
    let (sessions, doubts) = use_catalog(library, output, |catalog| {
        let doubts = catalog.check(&mut |done, of| bar.show(done, of))?;
        Ok((catalog.all()?.len(), doubts))
    })?;
    drop(bar);
    let file = library.join(CATALOG_FILE).display().to_string();
    let object = serde_json::json!({ "file": file, "sessions": sessions, "doubts": doubts });
    output.answer("catalog check", &object, || match doubts.as_slice() {
        [] => format!("the catalog agrees with all {sessions} sessions of the library"),
        doubts => {
            let line = |one: &CatalogMismatch| format!("{}: {}", one.folder, one.sentence);
            doubts.iter().map(line).collect::<Vec<_>>().join("\n")
        }
    });
    match doubts.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!(
            "the catalog is out of date for {count} sessions; 'palpate find' reads the changed sessions again, 'palpate catalog rebuild' reads all sessions again"
        ))),
    }
}

/// Brings the catalog up to date and does some work with it.
pub(super) fn use_updated_catalog<T>(
    library: &Path,
    output: &Output,
    mut work: impl FnMut(&mut Catalog) -> Result<T, CatalogError>,
) -> Result<T, Failure> {
    let mut bar = LateBar::new(output, "reading sessions");
    let (changes, done) = use_catalog(library, output, |catalog| {
        let changes = catalog.update(&mut |done, of| bar.show(done, of))?;
        Ok((changes, work(catalog)?))
    })?;
    drop(bar);
    note_all(&changes.remarks, output);
    Ok(done)
}

fn use_catalog<T>(
    library: &Path,
    output: &Output,
    mut work: impl FnMut(&mut Catalog) -> Result<T, CatalogError>,
) -> Result<T, Failure> {
    let mut remarks = Vec::new();
    let done = Catalog::with(library, |catalog| {
        remarks.append(&mut catalog.remarks);
        work(catalog)
    });
    note_all(&remarks, output);
    done.map_err(Failure::failed)
}

fn note_all(remarks: &[String], output: &Output) {
    remarks.iter().for_each(|remark| output.note(remark));
}

/// A progress bar that appears once the work has taken a second.
struct LateBar<'a> {
    output: &'a Output,
    message: &'static str,
    watch: Stopwatch,
    bar: Option<Bar>,
}

/// Longest work without a bar, in s.
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
