//! `palpate report --check PAGE`: compares files with the hashes in a page.

use super::super::Failure;
use super::super::output::Output;
use palpate_analysis::report::dossier::{FileClaim, claims, compare};
use palpate_analysis::report::text::counted;
use palpate_analysis::source::SourceError;
use palpate_sessions::SessionSummary;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Checked {
    session_id: String,
    session: PathBuf,
    /// Files that are as they were.
    same: usize,
    differences: Vec<String>,
}

pub(super) fn run(page: &Path, sessions: &[PathBuf], output: &Output) -> Result<(), Failure> {
    let text = palpate_sessions::text::read(page).map_err(Failure::usage)?;
    let (found, is_whole) =
        claims(&text).map_err(|err| Failure::usage(format!("{}: {err}", page.display())))?;
    let mut by_session: BTreeMap<(&str, &str), Vec<&FileClaim>> = BTreeMap::new();
    for claim in &found {
        let key = (claim.session_id.as_str(), claim.folder.as_str());
        by_session.entry(key).or_default().push(claim);
    }
    let named = named(sessions)?;
    if let Some((path, id)) =
        named.iter().find(|(_, id)| by_session.keys().all(|(known, _)| known != id))
    {
        return Err(Failure::usage(format!(
            "the page does not describe {} (session {id}); give only sessions that the page describes",
            path.display()
        )));
    }
    let mut checked = Vec::new();
    for ((id, folder), mut own) in by_session {
        let place = named.iter().find(|(_, known)| known == id);
        let session = match place {
            Some((path, _)) => path.clone(),
            None => find_near_page(page, folder, id)?,
        };
        // A session compared with itself stands in the page twice.
        own.dedup_by(|a, b| a == b);
        let compared = compare(&own, &session)
            .map_err(|err| super::super::source_failure(SourceError::from(err)))?;
        checked.push(Checked {
            session_id: id.to_owned(),
            session,
            same: compared.same,
            differences: compared.differences,
        });
    }
    let count: usize = checked.iter().map(|one| one.differences.len()).sum();
    let object = serde_json::json!({ "page": page, "is_page_whole": is_whole, "sessions": checked,
    });
    output.answer("report", &object, || {
        let mut lines = vec![match is_whole {
            true => format!("{}: the page is unchanged", page.display()),
            false => format!("{}: the page was changed after it was made", page.display()),
        }];
        for one in &checked {
            let same = counted(one.same, "file");
            lines.push(format!("{}: {same} as described", one.session.display()));
            lines.extend(one.differences.iter().map(|line| format!("  {line}")));
        }
        lines.join("\n")
    });
    match (is_whole, count) {
        (true, 0) => Ok(()),
        (false, 0) => Err(Failure::failed(
            "the page was changed after it was made; make a new page from the sessions",
        )),
        (_, count) => Err(Failure::failed(format!(
            "{} from what the page describes; make a new page, or restore the files from a backup",
            match count {
                1 => "1 file differs".to_owned(),
                _ => format!("{count} files differ"),
            }
        ))),
    }
}

/// The sessions named, with their ids.
fn named(sessions: &[PathBuf]) -> Result<Vec<(PathBuf, String)>, Failure> {
    let id = |path: &PathBuf| {
        let summary = SessionSummary::read(path).map_err(super::super::read_failure)?;
        Ok((path.clone(), summary.manifest.session_id))
    };
    sessions.iter().map(id).collect()
}

/// The session's folder next to the page, or the folder of the page.
fn find_near_page(page: &Path, folder: &str, id: &str) -> Result<PathBuf, Failure> {
    let here = page.parent().filter(|here| !here.as_os_str().is_empty());
    let here = here.unwrap_or(Path::new("."));
    // A manipulated page must not lead elsewhere.
    let is_name = Path::new(folder).file_name() == Some(folder.as_ref());
    let sibling = is_name.then(|| here.join(folder));
    let places = sibling.into_iter().chain([here.to_path_buf()]);
    let is_it = |place: &PathBuf| {
        place.is_dir()
            && SessionSummary::read(place).is_ok_and(|summary| summary.manifest.session_id == id)
    };
    // A log that has become unreadable is still compared, if it is where it was.
    let mut places = places.collect::<Vec<_>>().into_iter();
    let found = places.clone().find(is_it).or_else(|| {
        let first = places.next()?;
        (is_name && first.is_dir()).then_some(first)
    });
    found.ok_or_else(|| {
        Failure::usage(format!(
            "session {id} is not in the page's folder; give the path of the session after --check FILE.html"
        ))
    })
}
