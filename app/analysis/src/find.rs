//! The library's catalog asked and brought up to date, away from the window's thread.

use crate::progress::Progress;
use palpate_runner::Stopwatch;
use palpate_sessions::catalog::{Catalog, CatalogError, Changes, Choices, Entry, Event, Query};
use palpate_sessions::edits::{Edit, Edits};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;

#[derive(Clone, Debug)]
pub struct Search {
    pub library: PathBuf,
    /// What is looked for.
    pub query: Query,
    /// So many of the first are told with all that is known of them.
    pub page: usize,
}

/// What a search found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Folders of all that was found, below the library, in order.
    pub folders: Vec<String>,
    /// What is known of the first of them.
    pub first: Vec<Entry>,
    /// By what sessions can be chosen.
    pub choices: Choices,
    /// Why nothing was found, where a condition can never be met.
    pub doubts: Vec<String>,
    /// What happened to the catalog's file.
    pub remarks: Vec<String>,
    /// How long it took, in s.
    pub seconds: f64,
}

/// Opens the catalog of a library. One that is only in memory is made first.
fn with<T>(
    library: &std::path::Path,
    remarks: &mut Vec<String>,
    mut work: impl FnMut(&mut Catalog) -> Result<T, CatalogError>,
) -> Result<T, String> {
    let done = Catalog::with(library, |catalog| {
        remarks.append(&mut catalog.remarks);
        if catalog.is_in_memory() {
            catalog.update(&mut |_, _| {})?;
        }
        work(catalog)
    });
    done.map_err(|err| err.to_string())
}

/// Searches what the catalog knows already: see [`update`].
pub fn search(search: &Search) -> Result<Found, String> {
    let watch = Stopwatch::start();
    let mut remarks = Vec::new();
    let mut found = with(&search.library, &mut remarks, |catalog| {
        let folders = catalog.folders(&search.query)?;
        let first = &folders[..folders.len().min(search.page)];
        let doubts = match folders.is_empty() {
            true => catalog.doubts(&search.query.conditions)?,
            false => Vec::new(),
        };
        Ok(Found {
            first: catalog.entries(first)?,
            choices: catalog.choices()?,
            doubts,
            folders,
            ..Found::default()
        })
    })?;
    found.remarks = remarks;
    found.seconds = watch.seconds();
    Ok(found)
}

/// What is known of these sessions.
pub fn entries((library, folders): &(PathBuf, Vec<String>)) -> Result<Vec<Entry>, String> {
    with(library, &mut Vec::new(), |catalog| catalog.entries(folders))
}

/// Reads the sessions that are new or have changed.
pub fn update(library: &std::path::Path, progress: &dyn Progress) -> Result<Changes, String> {
    let mut remarks = Vec::new();
    let done = Catalog::with(library, |catalog| {
        remarks.append(&mut catalog.remarks);
        if catalog.is_in_memory() {
            // Nobody else sees that one: every search makes its own.
            return Ok(Changes::default());
        }
        catalog.update_while(&mut |done, of| -> ControlFlow<()> {
            progress.tell(done, of, "reading sessions")
        })
    });
    let mut changes = done.map_err(|err| err.to_string())?;
    changes.remarks.splice(0..0, remarks);
    Ok(changes)
}

/// Folder below the library of every session in it, by the session's identifier.
pub fn session_folders(
    library: &std::path::Path,
    progress: &dyn Progress,
) -> Result<BTreeMap<String, String>, String> {
    update(library, progress)?;
    let all = with(library, &mut Vec::new(), |catalog| catalog.all())?;
    let pairs = all.into_iter().map(|entry| (entry.session_id, entry.folder));
    Ok(pairs.collect())
}

/// What happened with a session, and what was said of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// The remarks, in the order made.
    pub notes: Vec<Edit>,
    /// Everything said and made, oldest first.
    pub events: Vec<Event>,
}

/// Reads what was said of a session in this library.
pub fn told((library, entry): &(PathBuf, Entry)) -> Result<Told, String> {
    let folder = library.join(&entry.folder);
    let edits = Edits::read(&folder, &entry.session_id).map_err(|err| err.to_string())?;
    let said = edits.all.iter().map(|edit| Event::said("", edit));
    let made = entry.analyses.iter().map(|one| Event::made("", one));
    let mut events: Vec<Event> = said.chain(made).collect();
    // Times of one form sort as they are written.
    events.sort_by(|a, b| a.at.cmp(&b.at));
    Ok(Told { notes: edits.notes().cloned().collect(), events })
}
