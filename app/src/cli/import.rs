//! `palpate import`: files of other programs become sessions.

use super::Failure;
use super::output::Output;
use crate::report::imported;
use clap::Args;
use palpate_protocols::runner::wall_now;
use palpate_sessions::import::{
    ColumnChoice, Decimal, Delimiter, Fault, Foreign, ForeignError, ForeignPart, Format, KeepError,
    Kept, TextEncoding, Told, UnitChoice, ZeroChoice, folder_name, keep, open_foreign,
};
use palpate_sessions::{Imported, Labels, library_folder, new_session_folder, new_session_id};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Arguments of `palpate import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// Files: delimited text, a Mach-1's, a rheometer's, or a workbook (.xlsx, .xls)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Folder for the new session folders; without it they go to the library (~/palpate or PALPATE_HOME)
    #[arg(long, value_name = "FOLDER")]
    into: Option<PathBuf>,
    /// Only tell how the files would be read
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    how: ToldArgs,
    /// Who measured
    #[arg(long, default_value = "")]
    operator: String,
    /// What was indented
    #[arg(long, default_value = "")]
    specimen: String,
    /// With which probe
    #[arg(long, default_value = "")]
    indenter: String,
    /// Tell more of the specimen, probe or series, such as specimen.thickness_mm=12; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    about: Vec<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// What is told of the files; all else is detected.
#[derive(Debug, Args)]
struct ToldArgs {
    /// Layout: table, mach-1, rheometer or workbook
    #[arg(long)]
    format: Option<Format>,
    /// What stands between cells: tab, comma, semicolon, space or one character
    #[arg(long, value_name = "NAME")]
    delimiter: Option<Delimiter>,
    /// Encoding, such as utf-8, utf-16le or windows-1252
    #[arg(long, value_name = "NAME")]
    encoding: Option<TextEncoding>,
    /// Decimal sign: point or comma
    #[arg(long, value_name = "SIGN")]
    decimal: Option<Decimal>,
    /// Names of all columns in order, where the file has none, as in t_s,depth_mm,force_N
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    columns: Vec<String>,
    /// Which column is time, depth, force or signal, by name or number; -NAME turns its sign
    #[arg(long = "column", value_name = "QUANTITY=NAME")]
    column: Vec<ColumnChoice>,
    /// Unit of time, depth, force or signal
    #[arg(long = "unit", value_name = "QUANTITY=UNIT")]
    unit: Vec<UnitChoice>,
    /// Depth or force that counts as zero: that of the first row, or a number in mm or N
    #[arg(long = "zero", value_name = "QUANTITY=first|NUMBER")]
    zero: Vec<ZeroChoice>,
    /// Line of the column names
    #[arg(long, value_name = "N")]
    header_row: Option<usize>,
    /// Line of the units; 0 if there is none
    #[arg(long, value_name = "N")]
    units_row: Option<usize>,
    /// Sheet, block or interval wanted, by name or number; may be repeated [default: all]
    #[arg(long = "part", visible_aliases = ["sheet", "block"], value_name = "NAME|N")]
    part: Vec<String>,
    /// Rows to leave out instead of refusing the file: missing, repeated, backward
    #[arg(long, value_name = "FAULT,...", value_delimiter = ',')]
    skip: Vec<Fault>,
}

impl ToldArgs {
    fn told(&self) -> Told {
        Told {
            format: self.format,
            delimiter: self.delimiter,
            encoding: self.encoding,
            decimal: self.decimal,
            names: self.columns.clone(),
            columns: self.column.clone(),
            units: self.unit.clone(),
            zeros: self.zero.clone(),
            header_row: self.header_row,
            units_row: self.units_row,
            parts: self.part.clone(),
            skip: self.skip.clone(),
        }
    }
}

#[derive(Serialize)]
struct Report {
    command: &'static str,
    is_dry_run: bool,
    files: Vec<FileReport>,
}

#[derive(Serialize)]
struct FileReport {
    file: PathBuf,
    parts: Vec<PartReport>,
    left_out: Vec<String>,
}

#[derive(Serialize)]
struct PartReport {
    session: Option<PathBuf>,
    samples: usize,
    duration_s: f64,
    #[serde(flatten)]
    imported: Imported,
}

pub(super) fn run(args: &ImportArgs, output: &Output) -> Result<(), Failure> {
    let told = args.how.told();
    let labels = labels(args)?;
    let read = |path: &PathBuf| open_foreign(path, &told).map_err(foreign_failure);
    let mut report = Report {
        command: "import",
        is_dry_run: args.dry_run,
        files: Vec::new(),
    };
    // Every file is read before the first session is made: a refusal leaves nothing behind.
    let bar = output.count_bar(args.files.len() as u64 * if args.dry_run { 1 } else { 2 });
    let mut taken = BTreeSet::new();
    for path in &args.files {
        bar.set_message(path.display().to_string());
        let foreign = read(path)?;
        check_folders(args.into.as_deref(), &foreign, &mut taken)?;
        report.files.push(told_of(path, foreign));
        bar.inc(1);
    }
    if !args.dry_run {
        for (path, file) in args.files.iter().zip(&mut report.files) {
            bar.set_message(path.display().to_string());
            let foreign = read(path)?;
            for (part, told) in foreign.parts.iter().zip(&mut file.parts) {
                let session = make(part, &foreign.bytes, args.into.as_deref(), &labels)?;
                told.session = Some(session);
            }
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    output.result(&report, || {
        let files = report.files.iter().map(text);
        files.collect::<Vec<_>>().join("\n\n")
    });
    Ok(())
}

fn labels(args: &ImportArgs) -> Result<Labels, Failure> {
    let mut labels = Labels {
        operator: args.operator.clone(),
        specimen: args.specimen.clone(),
        indenter: args.indenter.clone(),
        ..Labels::default()
    };
    super::tell(&mut labels, &args.about)?;
    Ok(labels)
}

fn foreign_failure(err: ForeignError) -> Failure {
    match err {
        ForeignError::Io { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

/// Refuses folders that are there already or would be made twice.
fn check_folders(
    into: Option<&Path>,
    foreign: &Foreign,
    taken: &mut BTreeSet<PathBuf>,
) -> Result<(), Failure> {
    let Some(into) = into else { return Ok(()) };
    for part in &foreign.parts {
        let folder = into.join(folder_name(&part.imported));
        if folder.exists() || !taken.insert(folder.clone()) {
            return Err(Failure::usage(format!(
                "{} is there already or would be made twice; choose another folder with --into",
                folder.display()
            )));
        }
    }
    Ok(())
}

fn make(
    part: &ForeignPart,
    original: &[u8],
    into: Option<&Path>,
    labels: &Labels,
) -> Result<PathBuf, Failure> {
    let at = wall_now().into();
    let session_id = new_session_id(at);
    let folder = match into {
        Some(into) => into.join(folder_name(&part.imported)),
        None => new_session_folder(&library_folder().map_err(Failure::usage)?, &session_id),
    };
    let kept = Kept {
        folder: &folder,
        original,
        session_id,
        at,
        software_version: env!("CARGO_PKG_VERSION"),
        labels: labels.clone(),
    };
    keep(part, kept).map_err(|err| match err {
        KeepError::Times { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    Ok(folder)
}

fn told_of(path: &Path, foreign: Foreign) -> FileReport {
    let parts = foreign.parts.into_iter().map(|part| {
        let ends = [part.samples.first(), part.samples.last()];
        let [first, last] = ends.map(|one| one.map_or(0.0, |one| one.t));
        PartReport {
            session: None,
            samples: part.samples.len(),
            duration_s: last - first,
            imported: part.imported,
        }
    });
    FileReport {
        file: path.into(),
        parts: parts.collect(),
        left_out: foreign.left_out,
    }
}

fn text(file: &FileReport) -> String {
    let mut lines = vec![file.file.display().to_string()];
    for part in &file.parts {
        let rows = format!("{} over {:.3} s", part.samples, part.duration_s);
        lines.extend(imported::lines(&part.imported, &rows));
        lines.push(match &part.session {
            Some(session) => format!("  session       {}", session.display()),
            None => "  session       none made: a dry run".into(),
        });
    }
    let left_out = file.left_out.iter();
    lines.extend(left_out.map(|reason| format!("  left out      {reason}")));
    lines.join("\n")
}
