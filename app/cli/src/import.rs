//! `palpate import`: imports files of other programs as sessions.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::imports::{ImportFailure, ImportRequest, import, text};
use palpate_model::metadata::SessionLabels;
use palpate_tables::import::{
    ColumnChoice, DecimalSign, Delimiter, ForeignError, ForeignFormat, ImportOptions, RowFault,
    StoreImportError, TextEncoding, UnitChoice, ZeroChoice,
};
use std::path::PathBuf;

/// Import files of other programs as sessions
#[derive(Debug, Args)]
pub struct ImportArgs {
    #[arg(required = true, help = format!("Files: {}", ForeignFormat::sources()))]
    files: Vec<PathBuf>,
    /// Folder for the new session folders; without it they go to the library (~/palpate or PALPATE_HOME)
    #[arg(long, value_name = "FOLDER")]
    into: Option<PathBuf>,
    /// Only report how the files would be read
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    layout: LayoutArgs,
    /// Operator
    #[arg(long, default_value = "")]
    operator: String,
    /// Specimen
    #[arg(long, default_value = "")]
    specimen: String,
    /// Indenter
    #[arg(long, default_value = "")]
    indenter: String,
    /// Details of specimen, probe or series, such as specimen.thickness_mm=12; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    about: Vec<String>,
}

/// What is given about the layout of the files; all else is detected.
#[derive(Debug, Args)]
struct LayoutArgs {
    #[arg(long, help = format!("Layout: {}", ForeignFormat::names()))]
    format: Option<ForeignFormat>,
    /// Separator of cells: tab, comma, semicolon, space or one character
    #[arg(long, value_name = "NAME")]
    delimiter: Option<Delimiter>,
    /// Encoding, such as utf-8, utf-16le or windows-1252
    #[arg(long, value_name = "NAME")]
    encoding: Option<TextEncoding>,
    /// Decimal sign: point or comma
    #[arg(long, value_name = "SIGN")]
    decimal: Option<DecimalSign>,
    /// Names of all columns in order, where the file has none, as in t_s,depth_mm,force_N
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    columns: Vec<String>,
    /// Column of time, depth, force or signal, by name or number; -NAME changes its sign
    #[arg(long = "column", value_name = "QUANTITY=NAME")]
    column: Vec<ColumnChoice>,
    /// Unit of time, depth, force or signal
    #[arg(long = "unit", value_name = "QUANTITY=UNIT")]
    unit: Vec<UnitChoice>,
    /// Depth or force that counts as zero: that of the first row, or a number in mm or N
    #[arg(long = "zero", value_name = "QUANTITY=first|NUMBER")]
    zero: Vec<ZeroChoice>,
    /// Number of the line with the column names
    #[arg(long, value_name = "N")]
    header_row: Option<usize>,
    /// Number of the line with the units; 0 if there is none
    #[arg(long, value_name = "N")]
    units_row: Option<usize>,
    /// Sheet, block or interval to read, by name or number; may be repeated [default: all]
    #[arg(long = "part", visible_aliases = ["sheet", "block"], value_name = "NAME|N")]
    part: Vec<String>,
    /// Rows to skip instead of refusing the file: missing, repeated, backward
    #[arg(long, value_name = "FAULT,...", value_delimiter = ',')]
    skip: Vec<RowFault>,
}

impl LayoutArgs {
    fn known_layout(&self) -> ImportOptions {
        ImportOptions {
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

pub(super) fn run(args: &ImportArgs, output: &Output) -> Result<(), Failure> {
    let request = ImportRequest {
        files: args.files.clone(),
        layout: args.layout.known_layout(),
        labels: labels(args)?,
        into: args.into.clone(),
        library: None,
        is_dry_run: args.dry_run,
    };
    let files = import(&request, &output.count_bar(0));
    let files = files.map_err(import_failure)?;
    let object = serde_json::json!({ "is_dry_run": args.dry_run, "files": files });
    output.answer("import", &object, || files.iter().map(text).collect::<Vec<_>>().join("\n\n"));
    Ok(())
}

fn labels(args: &ImportArgs) -> Result<SessionLabels, Failure> {
    let mut labels = SessionLabels {
        operator: args.operator.clone(),
        specimen: args.specimen.clone(),
        indenter: args.indenter.clone(),
        ..SessionLabels::default()
    };
    super::add_labels(&mut labels, &args.about)?;
    Ok(labels)
}

fn import_failure(err: ImportFailure) -> Failure {
    match err {
        ImportFailure::Foreign(ForeignError::Io { .. }) => Failure::failed(err),
        ImportFailure::Keep(StoreImportError::Times { .. }) => Failure::usage(err),
        ImportFailure::Keep(_) => Failure::failed(err),
        ImportFailure::Taken(_) => Failure::usage(format!("{err} with --into")),
        ImportFailure::Foreign(_) => {
            Failure::usage(format!("{err}; 'palpate import --help' lists the options"))
        }
        _ => Failure::usage(err),
    }
}
