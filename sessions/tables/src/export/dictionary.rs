//! The data dictionary beside a table.

use super::columns::ColumnInfo;
use super::select::SampleSelection;
use palpate_sessions::manifest::Manifest;
use std::path::{Path, PathBuf};

/// `NAME.columns.md` beside the table.
#[must_use]
pub fn dictionary_path(table: &Path) -> PathBuf {
    let name = table.file_name().unwrap_or(table.as_os_str());
    table.with_file_name(format!("{}.columns.md", name.to_string_lossy()))
}

pub(super) fn dictionary(
    table: &Path,
    manifest: &Manifest,
    notes: &[String],
    columns: &[ColumnInfo],
    selection: &SampleSelection,
) -> String {
    let name = table.file_name().unwrap_or(table.as_os_str());
    let mut lines = vec![
        format!("# Columns of {}", cell(&name.to_string_lossy())),
        String::new(),
        format!(
            "Session {}, recorded with palpate {}. {}",
            cell(&manifest.session_id),
            cell(&manifest.software_version),
            selection.sentence()
        ),
        String::new(),
        "| column | unit | type | meaning | origin |".into(),
        "|---|---|---|---|---|".into(),
    ];
    lines.extend(columns.iter().map(|one| {
        format!(
            "| {} | {} | {} | {} | {} |",
            cell(&one.name),
            one.unit,
            one.kind,
            one.meaning,
            one.how
        )
    }));
    if !notes.is_empty() {
        lines.push(String::new());
        lines.extend(notes.iter().map(|note| format!("* {}", cell(note))));
    }
    lines.push(String::new());
    lines.join("\n")
}

/// A text for a cell of a Markdown table.
fn cell(text: &str) -> String {
    text.replace(['\n', '\r'], " ").replace('|', "\\|")
}
