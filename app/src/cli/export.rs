//! `palpate export`: a session's samples as a table.

use super::output::Output;
use super::{Failure, compliance};
use clap::{Args, ValueEnum};
use palpate_protocols::compliance::columns;
use palpate_protocols::edited;
use palpate_sessions::export::{Beside, ExportError, export_csv, export_parquet};
use palpate_sessions::log::Session;
use std::path::{Path, PathBuf};

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
    /// Add depths less what the rig gave way, beside the raw ones: last for the compliance in force
    /// for the session's rig, a file, or an id of the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
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
    let edited = edited::open(&args.session).map_err(super::source_failure)?;
    let session = edited.session;
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
    let (compliance, beside) = beside(args, &session)?;
    let (extension, write): (_, fn(&Session, &Beside, &Path) -> _) = match args.format {
        Format::Csv => ("csv", export_csv),
        Format::Parquet => ("parquet", export_parquet),
    };
    let path = args.to.join(format!("{name}.{extension}"));
    write(&session, &beside, &path).map_err(|err| match err {
        ExportError::Exists { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    let object = serde_json::json!({
        "command": "export", "file": path, "rows": session.rows.len(), "format": extension, "compliance": compliance,
    });
    output.result(&object, || {
        let corrected = compliance.as_ref().map_or(String::new(), |id| {
            format!(", depths corrected with {id} beside the raw ones")
        });
        let rows = session.rows.len();
        format!("{rows} rows written to {}{corrected}", path.display())
    });
    Ok(())
}

/// The columns asked for beside the session's own, and the compliance they are made with.
fn beside(args: &ExportArgs, session: &Session) -> Result<(Option<String>, Beside), Failure> {
    let Some(name) = &args.compliance else {
        return Ok((None, Beside::default()));
    };
    let corrections = compliance::corrections(Some(name))?;
    let rig = session.manifest.rig.as_ref().map(|rig| rig.name.as_str());
    let kept = corrections.of_rig(rig);
    let kept = kept.map_err(|err| super::source_failure(err.into()))?;
    let Some((kept, _)) = kept else {
        return Ok((None, Beside::default()));
    };
    let columns = columns(session, kept).map_err(super::source_failure)?;
    Ok((Some(kept.id.clone()), columns))
}
