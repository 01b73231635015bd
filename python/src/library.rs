//! The sessions of a library.

use crate::error::refused;
use palpate_analysis::catalog_search;
use palpate_sessions::catalog::{Catalog, CatalogEntry};
use palpate_sessions::library_folder;
use pyo3::prelude::*;
use std::path::PathBuf;

/// The library without a name: `PALPATE_HOME` or `~/palpate`.
#[pyfunction]
pub fn default_library() -> PyResult<PathBuf> {
    library_folder().map_err(refused)
}

/// An entry without content, as JSON: the fields of every entry, in order.
#[pyfunction]
pub fn entry_fields() -> PyResult<String> {
    serde_json::to_string(&CatalogEntry::default()).map_err(refused)
}

/// Sessions as `palpate find --json` lists them, and remarks. `options` are those of that command; without `is_paged`
/// all sessions are on one page.
#[pyfunction]
pub fn find(
    py: Python<'_>,
    library: PathBuf,
    line: String,
    options: Vec<String>,
    is_paged: bool,
) -> PyResult<(String, Vec<String>)> {
    // A catalog would be made in a folder that is not there.
    if !library.is_dir() {
        return Err(refused(format!(
            "{} is not a folder; give the folder of a library",
            library.display()
        )));
    }
    let mut query =
        palpate_cli::find_query(&line, &options).map_err(|err| refused(err.sentence()))?;
    if !is_paged {
        (query.skip, query.limit) = (0, None);
    }
    py.detach(|| {
        let mut remarks = Vec::new();
        let found = Catalog::with(&library, |catalog| {
            remarks.append(&mut catalog.remarks);
            remarks.extend(catalog.update(&mut |_, _| {})?.remarks);
            catalog_search::find(catalog, &query)
        });
        let (page, doubts) = found.map_err(refused)?;
        remarks.extend(doubts);
        let text = serde_json::to_string(&page.entries).map_err(refused)?;
        Ok((text, remarks))
    })
}
