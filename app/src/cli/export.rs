//! `palpate export`: a session's samples as a table.

use super::Failure;
use super::output::Output;
use clap::{Args, ValueEnum};
use palpate_protocols::analysed;
use palpate_sessions::export::{ExportError, export_csv, export_parquet};
use palpate_sessions::log::Session;
use std::path::PathBuf;

/// Arguments of `palpate export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Session folder
    session: PathBuf,
    /// Kind of table
    #[arg(long, value_enum)]
    format: Format,
    /// Folder to write to; the file takes the session folder's name
    #[arg(long, value_name = "DIR", default_value = ".")]
    to: PathBuf,
    /// Write the session as this analysis of it reads it: with another calibration, or with stretches
    /// left out, whose forces are empty
    #[arg(long, value_name = "NAME")]
    analysis: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// Comma-separated text, units in the column names
    Csv,
    /// Parquet, units in the file metadata
    Parquet,
}

pub(super) fn run(args: &ExportArgs, output: &Output) -> Result<(), Failure> {
    let opened = analysed::open(&args.session, args.analysis.as_deref());
    let mut opened = opened.map_err(super::source_failure)?;
    opened.blank();
    let session = opened.edited.session;
    session.notes.iter().for_each(|note| output.note(note));
    let name = args
        .session
        .canonicalize()
        .ok()
        .and_then(|path| {
            path.file_stem()
                .map(|name| name.to_string_lossy().into_owned())
        })
        .unwrap_or_else(|| session.manifest.session_id.clone());
    let (extension, write): (_, fn(&Session, &std::path::Path) -> _) = match args.format {
        Format::Csv => ("csv", export_csv),
        Format::Parquet => ("parquet", export_parquet),
    };
    let path = args.to.join(format!("{name}.{extension}"));
    write(&session, &path).map_err(|err| match err {
        ExportError::Exists { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    let object = serde_json::json!({
        "command": "export", "file": path, "rows": session.rows.len(), "format": extension,
    });
    output.result(&object, || {
        format!("{} rows written to {}", session.rows.len(), path.display())
    });
    Ok(())
}
