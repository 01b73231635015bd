//! `palpate export`: a session's samples as a table.

mod lake;

use super::arguments::parse_number;
use super::output::Output;
use super::{Failure, compliance, read_failure, source_failure};
use clap::{Args, ValueEnum};
use palpate_analysis::analysed_session;
use palpate_analysis::compliance::corrected_depth_columns;
use palpate_analysis::exports::{self, ExportFailure, ExportTarget};
use palpate_model::rig::Phase;
use palpate_sessions::log::Session;
use palpate_tables::export::{
    ExportError, ExtraColumns, LogFacts, SampleSelection, TableExport, TableFormat, dictionary_path,
};
use std::path::PathBuf;

/// Write a session's samples as a table, or add sessions to a lake
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Session folder; several for a lake
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Kind of table
    #[arg(long, value_enum, required_unless_present_any = ["lake", "mcap_full", "bluesky"])]
    format: Option<Kind>,
    /// Add the sessions to this lake, a folder of Parquet files that DuckDB, polars and 'palpate fit' read;
    /// it is made if there is none
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["format", "to", "delimiter", "phase", "cycle", "from", "until", "columns", "decimate", "analysis", "compliance"])]
    lake: Option<PathBuf>,
    /// Write one message per sample to this new MCAP file instead, for Foxglove and PlotJuggler
    #[arg(long, value_name = "OUT.mcap", conflicts_with_all = ["format", "lake", "to", "delimiter", "columns", "compliance"])]
    mcap_full: Option<PathBuf>,
    /// Write the documents of one Bluesky run, with one event per sample, to this new file of JSON lines
    /// instead, for Databroker and Tiled
    #[arg(long, value_name = "OUT.jsonl", conflicts_with_all = ["format", "lake", "mcap_full", "to", "delimiter", "columns", "compliance"])]
    bluesky: Option<PathBuf>,
    /// Folder to write to; the file takes the session folder's name
    #[arg(long, value_name = "DIR", default_value = ".")]
    to: PathBuf,
    /// Character between the cells of CSV, such as ';' or tab
    #[arg(long, value_name = "CHARACTER", default_value = ",", value_parser = delimiter)]
    delimiter: u8,
    /// Only samples of these phases, as in ramp,hold
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = phase)]
    phase: Vec<Phase>,
    /// Only samples of these cycles, as in 1,2; 0 is outside cycles
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    cycle: Vec<u32>,
    /// Only samples at or after this time since the first one
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = seconds)]
    from: Option<f64>,
    /// Only samples at or before this time
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = seconds)]
    until: Option<f64>,
    /// Only these columns, in this order, as in t_s,force_N; also session_id, specimen, sample, tick,
    /// host_ns, status, age_ns and age_within_ns
    #[arg(long, alias = "channel", value_name = "NAMES", value_delimiter = ',')]
    columns: Vec<String>,
    /// Only every N-th of the selected samples, without averaging; the file name states N
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    decimate: Option<u64>,
    /// Apply this analysis of the session: its calibration and its excluded stretches, whose
    /// forces are left empty
    #[arg(long, value_name = "NAME")]
    analysis: Option<String>,
    /// Add depths corrected for machine compliance to the raw ones: last for the compliance in force
    /// for the session's rig, a file, or an id of the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kind {
    /// Comma-separated text, units in the column names
    Csv,
    /// Parquet, units in the file metadata
    Parquet,
    /// Arrow IPC file, units in the schema metadata
    Arrow,
}

fn delimiter(text: &str) -> Result<u8, String> {
    match text.as_bytes() {
        b"tab" => Ok(b'\t'),
        [one @ (b',' | b';' | b'|' | b'\t' | b':')] => Ok(*one),
        _ => Err("give one of these: , ; | : tab".into()),
    }
}

fn phase(text: &str) -> Result<Phase, String> {
    let found = Phase::ALL.iter().find(|phase| phase.name() == text);
    found.copied().ok_or_else(|| {
        let names: Vec<&str> = Phase::ALL.iter().map(|phase| phase.name()).collect();
        format!("the phases are {}", names.join(", "))
    })
}

fn seconds(text: &str) -> Result<f64, String> {
    parse_number(text).map_err(|_| "give a number of seconds".into())
}

impl ExportArgs {
    fn format(&self) -> TableFormat {
        match self.format {
            // Without a lake there is always a format.
            Some(Kind::Csv) | None => TableFormat::Csv(self.delimiter),
            Some(Kind::Parquet) => TableFormat::Parquet,
            Some(Kind::Arrow) => TableFormat::Arrow,
        }
    }

    fn target(&self) -> ExportTarget {
        match (&self.mcap_full, &self.bluesky) {
            (Some(path), _) => ExportTarget::Messages(path.clone()),
            (None, Some(path)) => ExportTarget::Documents(path.clone()),
            (None, None) => ExportTarget::Table(self.format(), self.to.clone()),
        }
    }

    fn selection(&self) -> Result<SampleSelection, Failure> {
        if let (Some(from), Some(until)) = (self.from, self.until)
            && from > until
        {
            return Err(Failure::usage(format!(
                "--from {from} is after --until {until}; give the earlier time with --from"
            )));
        }
        Ok(SampleSelection {
            phases: self.phase.clone(),
            cycles: self.cycle.clone(),
            columns: self.columns.clone(),
            from_s: self.from,
            to_s: self.until,
            every: self.decimate,
        })
    }
}

pub(super) fn run(args: &ExportArgs, output: &Output) -> Result<(), Failure> {
    if let Some(lake) = &args.lake {
        return lake::run(lake, &args.sessions, output);
    }
    let [session] = args.sessions.as_slice() else {
        return Err(Failure::usage(
            "a table holds one session; give one session, or add several sessions to a lake with --lake FOLDER",
        ));
    };
    let selection = args.selection()?;
    let target = args.target();
    target.sweep();
    let mut compliance = None;
    let written = if args.analysis.is_some() || args.compliance.is_some() {
        let opened = analysed_session::open(session, args.analysis.as_deref());
        let mut opened = opened.map_err(source_failure)?;
        opened.blank();
        let read = opened.edited.session;
        let extra;
        (compliance, extra) = extra_columns(args, &read)?;
        let table = TableExport {
            manifest: &read.manifest,
            notes: &read.notes,
            extra: &extra,
            selection: &selection,
        };
        let mut feed = |visit: &mut dyn FnMut(&[_])| {
            visit(&read.rows);
            Ok(())
        };
        let log = LogFacts { entries: &read.entries, end: read.end.as_ref() };
        let written = target.write(session, &table, log, &mut feed);
        written.map_err(failure)?
    } else {
        // An export that needs one sample at a time keeps none.
        let bar = output.share_bar();
        let written = exports::export(session, &selection, &target, &mut |done, of| {
            bar.set_length(of);
            bar.set_position(done);
        });
        drop(bar);
        written.map_err(export_failure)?
    };
    written.notes.iter().for_each(|note| output.note(note));
    let (format, what, dictionary) = match &target {
        ExportTarget::Messages(_) => ("mcap", "messages", None),
        ExportTarget::Documents(_) => ("bluesky", "events", None),
        ExportTarget::Table(format, _) => {
            (format.ending(), "rows", Some(dictionary_path(&written.path)))
        }
    };
    let object = serde_json::json!({ "file": written.path, "rows": written.rows, "format": format,
        "dictionary": dictionary, "is_part": selection.is_partial(),
        "every": selection.every.unwrap_or(1), "compliance": compliance,
    });
    output.answer("export", &object, || {
        let corrected = compliance
            .as_ref()
            .map_or(String::new(), |id| format!(", with raw depths and depths corrected by {id}"));
        let every = selection
            .every
            .map_or(String::new(), |every| format!(", one of every {every} selected samples"));
        format!("{} {what} written to {}{every}{corrected}", written.rows, written.path.display())
    });
    Ok(())
}

pub(super) fn export_failure(err: ExportFailure) -> Failure {
    match err {
        ExportFailure::Source(err) => source_failure(err),
        ExportFailure::Export(err) => failure(err),
        ExportFailure::BeingRecorded(_) => Failure::usage(err),
    }
}

pub(super) fn failure(err: ExportError) -> Failure {
    match err {
        ExportError::Exists { .. } | ExportError::Columns(_) | ExportError::BadName { .. } => {
            Failure::usage(err)
        }
        ExportError::Read(err) => read_failure(err),
        _ => Failure::failed(err),
    }
}

/// Columns added to those of the session, and the id of the compliance they are made with.
fn extra_columns(
    args: &ExportArgs,
    session: &Session,
) -> Result<(Option<String>, ExtraColumns), Failure> {
    let sensors = ExtraColumns::of_sensors(&session.manifest, &session.entries);
    let Some(name) = &args.compliance else {
        return Ok((None, sensors));
    };
    let corrections = compliance::corrections(Some(name))?;
    let rig = session.manifest.rig.as_ref().map(|rig| rig.name.as_str());
    let saved = corrections.of_rig(rig);
    let saved = saved.map_err(|err| source_failure(err.into()))?;
    let Some((saved, _)) = saved else {
        return Ok((None, sensors));
    };
    let columns = corrected_depth_columns(session, saved).map_err(source_failure)?;
    Ok((Some(saved.id.clone()), columns))
}
