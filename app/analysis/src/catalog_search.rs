//! Queries and updates of the library's catalog, away from the window's thread.

use crate::progress::Progress;
use palpate_runner::Stopwatch;
use palpate_sessions::catalog::{
    Catalog, CatalogChanges, CatalogChoices, CatalogEntry, CatalogError, CatalogPage, CatalogQuery,
    HistoryEvent,
};
use palpate_sessions::edits::{Edit, Edits};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub struct CatalogSearch {
    pub library: PathBuf,
    pub query: CatalogQuery,
    /// Number of sessions, from the first, whose entries are returned as well.
    pub page: usize,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct CatalogSearchResult {
    /// Folders of all sessions found, below the library, in order.
    pub folders: Vec<String>,
    /// Entries of the first of them.
    pub first: Vec<CatalogEntry>,
    /// Values by which sessions can be chosen.
    pub choices: CatalogChoices,
    /// Conditions that can never be met, where nothing is found.
    pub doubts: Vec<String>,
    /// Remarks on the catalog's file.
    pub remarks: Vec<String>,
    /// Duration of the search in s.
    pub seconds: f64,
}

/// Opens the catalog of a library. One that is only in memory is made first.
fn with<T>(
    library: &Path,
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

/// Finds a page of sessions in a catalog; where there are none, also the conditions that none can meet.
pub fn find(
    catalog: &Catalog,
    query: &CatalogQuery,
) -> Result<(CatalogPage, Vec<String>), CatalogError> {
    let found = catalog.find(query)?;
    let doubts = match found.count {
        0 => catalog.condition_warnings(&query.conditions)?,
        _ => Vec::new(),
    };
    Ok((found, doubts))
}

/// Searches what the catalog knows already: see [`update`].
pub fn search(search: &CatalogSearch) -> Result<CatalogSearchResult, String> {
    let watch = Stopwatch::start();
    let mut remarks = Vec::new();
    let mut found = with(&search.library, &mut remarks, |catalog| {
        let folders = catalog.folders(&search.query)?;
        let first = &folders[..folders.len().min(search.page)];
        let is_empty = folders.is_empty();
        Ok(CatalogSearchResult {
            first: catalog.entries(first)?,
            choices: catalog.choices()?,
            doubts: if is_empty {
                catalog.condition_warnings(&search.query.conditions)?
            } else {
                Vec::new()
            },
            folders,
            ..CatalogSearchResult::default()
        })
    })?;
    (found.remarks, found.seconds) = (remarks, watch.seconds());
    Ok(found)
}

pub fn entries((library, folders): &(PathBuf, Vec<String>)) -> Result<Vec<CatalogEntry>, String> {
    with(library, &mut Vec::new(), |catalog| catalog.entries(folders))
}

/// Reads the sessions that are new or have changed.
pub fn update(library: &Path, progress: &dyn Progress) -> Result<CatalogChanges, String> {
    let mut remarks = Vec::new();
    let done = Catalog::with(library, |catalog| {
        remarks.append(&mut catalog.remarks);
        if catalog.is_in_memory() {
            // No other process sees an index in memory: every search builds its own.
            return Ok(CatalogChanges::default());
        }
        catalog.update_while(&mut |done, of| -> ControlFlow<()> {
            progress.report(done, of, "reading sessions")
        })
    });
    let mut changes = done.map_err(|err| err.to_string())?;
    changes.remarks.splice(0..0, remarks);
    Ok(changes)
}

/// Folder below the library of every session in it, by the session's identifier.
pub fn session_folders(
    library: &Path,
    progress: &dyn Progress,
) -> Result<BTreeMap<String, String>, String> {
    update(library, progress)?;
    let all = with(library, &mut Vec::new(), |catalog| catalog.all())?;
    Ok(all.into_iter().map(|entry| (entry.session_id, entry.folder)).collect())
}

/// Edits and analyses of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionHistory {
    /// Notes, in the order made.
    pub notes: Vec<Edit>,
    /// Edits and analyses, oldest first.
    pub events: Vec<HistoryEvent>,
}

pub fn read_session_history(
    (library, entry): &(PathBuf, CatalogEntry),
) -> Result<SessionHistory, String> {
    let folder = library.join(&entry.folder);
    let edits = Edits::read(&folder, &entry.session_id).map_err(|err| err.to_string())?;
    let edited = edits.all.iter().map(|edit| HistoryEvent::from_edit("", edit));
    let analysed = entry.analyses.iter().map(|one| HistoryEvent::from_analysis("", one));
    let mut events: Vec<HistoryEvent> = edited.chain(analysed).collect();
    // Times of one form sort as they are written.
    events.sort_by(|a, b| a.at.cmp(&b.at));
    Ok(SessionHistory { notes: edits.notes().cloned().collect(), events })
}
