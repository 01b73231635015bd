//! The files that a page describes: their hashes are written into it and read back for comparison.

use palpate_figures::drawing::escape;
use palpate_sessions::analyses::{
    ANALYSES_FILE, AnalysisError, AnalysisInput, read_session_inputs,
};
use palpate_sessions::text::{sha256, sha256_of_file};
use std::path::Path;

const ROW: &str = "<tr data-session=\"";
/// Start of the line with the date, the only one that depends on when the page is made.
pub(super) const MADE: &str = "<p class=\"made\">";
/// Start and end of the line with the page's own hash.
pub const SEAL: &str = "<!-- SHA-256 of this page without this line and the line of its date: ";
const SEAL_END: &str = " -->\n";

/// A file that a page lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileClaim {
    pub session_id: String,
    pub folder: String,
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

pub(super) fn attributes(session_id: &str, folder: &str, file: &AnalysisInput) -> String {
    format!(
        "{}{}\" data-folder=\"{}\" data-file=\"{}\" data-sha256=\"{}\"",
        ROW.trim_start_matches("<tr"),
        escape(session_id),
        escape(folder),
        escape(&file.what),
        escape(&file.sha256)
    )
}

/// The page with its own hash.
pub(super) fn sealed(page: &str) -> String {
    format!("{page}{SEAL}{}{SEAL_END}", own_hash(page))
}

fn own_hash(page: &str) -> String {
    let lines = page.split_inclusive('\n');
    let hashed = lines.filter(|line| !line.starts_with(MADE) && !line.starts_with(SEAL));
    sha256(hashed.collect::<String>().as_bytes())
}

/// Files that a page lists, and whether the page itself is unchanged.
pub fn claims(page: &str) -> Result<(Vec<FileClaim>, bool), String> {
    let no_page = "the file is not a report page; give a report page";
    let seal = page.rsplit_once(SEAL).ok_or(no_page)?.1;
    let stated = seal.strip_suffix(SEAL_END).unwrap_or_default();
    let rows = page.split(ROW).skip(1).map(|row| {
        let (row, _) = row.split_once('>')?;
        let parts: Vec<&str> = row.split('"').collect();
        let [session, f, folder, w, file, h, hash, _] = parts.as_slice() else { return None };
        let names = [*f, *w, *h].map(str::trim);
        (names == ["data-folder=", "data-file=", "data-sha256="]).then(|| FileClaim {
            session_id: unescape(session),
            folder: unescape(folder),
            file: unescape(file),
            sha256: unescape(hash),
        })
    });
    let claims: Option<Vec<FileClaim>> = rows.collect();
    let claims = claims.filter(|claims| !claims.is_empty()).ok_or(no_page)?;
    Ok((claims, own_hash(page) == stated))
}

fn unescape(text: &str) -> String {
    let plain = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'")];
    let text = plain.iter().fold(text.to_owned(), |text, (code, plain)| text.replace(code, plain));
    text.replace("&amp;", "&")
}

/// Comparison of a session's files with those that a page lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileComparison {
    /// Number of unchanged files.
    pub same: usize,
    /// A sentence for each other file.
    pub differences: Vec<String>,
}

pub fn compare(claims: &[&FileClaim], session: &Path) -> Result<FileComparison, AnalysisError> {
    let mut now = read_session_inputs(session)?;
    let analyses = session.join(ANALYSES_FILE);
    if analyses.is_file() {
        let hash = sha256_of_file(&analyses);
        now.push(AnalysisInput {
            what: ANALYSES_FILE.to_owned(),
            sha256: hash.map_err(|source| AnalysisError::Input { path: analyses, source })?,
        });
    }
    let mut compared = FileComparison::default();
    for claim in claims {
        match now.iter().find(|one| one.what == claim.file) {
            Some(one) if one.sha256 == claim.sha256 => compared.same += 1,
            Some(_) => compared
                .differences
                .push(format!("{} differs from what the page describes", claim.file)),
            None => compared.differences.push(format!("{} is missing", claim.file)),
        }
    }
    for one in &now {
        if claims.iter().all(|claim| claim.file != one.what) {
            let sentence = format!("{} is not listed on the page", one.what);
            compared.differences.push(sentence);
        }
    }
    Ok(compared)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(what: &str, sha256: &str) -> AnalysisInput {
        AnalysisInput { what: what.into(), sha256: sha256.into() }
    }

    #[test]
    fn what_is_written_is_read_back_whatever_a_folder_is_called() {
        let folder = "a \"b\" <c> & 'd' &lt;";
        let row = attributes("id", folder, &input("000.mcap", "beef"));
        let page = sealed(&format!("<p class=\"made\">now</p>\n<tr{row}><td></td></tr>\n"));
        let (found, is_whole) = claims(&page).unwrap();
        let expected = FileClaim {
            session_id: "id".into(),
            folder: folder.into(),
            file: "000.mcap".into(),
            sha256: "beef".into(),
        };
        assert_eq!((found, is_whole), (vec![expected], true));
        assert!(claims(&page.replace(">now<", ">then<")).unwrap().1);
        assert!(!claims(&page.replace("beef", "feed")).unwrap().1);
        for other in ["", "<html></html>", SEAL, &sealed("no rows\n")] {
            assert!(claims(other).unwrap_err().contains("not a report page"));
        }
    }
}
