//! `palpate protocol`: lists, checks, shows and previews protocols.

mod text;

use super::output::{Output, merged};
use super::rig::{OpenRig, RigArgs};
use super::{Failure, new_file, programme};
use clap::{Args, Subcommand};
use palpate_analysis::edits::author;
use palpate_analysis::protocol_sources::{
    ProtocolSource, find_protocol, lock_protocol, locked_protocols,
};
use palpate_analysis::report::plan_picture;
use palpate_protocols::file::{
    BUILT_IN, Protocol, ProtocolCheck, ProtocolProblem, check, nearest_built_in, reference,
};
use palpate_protocols::plans::PlannedStep;
use palpate_protocols::preview::{Preview, outline};
use palpate_runner::Stopwatch;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// List, check, show or preview protocols
#[derive(Debug, Subcommand)]
pub enum ProtocolCommand {
    /// List the built-in protocols
    List,
    /// Find every mistake in files of protocols and programmes, each with its line
    Check(ProtocolCheckArgs),
    /// Print a protocol's file, to read or to copy
    Show(ProtocolShowArgs),
    /// Preview a protocol step by step before anything moves
    Preview(ProtocolPreviewArgs),
    /// Lock a protocol with its values under a name, for people who are to run it and change nothing
    Lock(ProtocolLockArgs),
    /// Print the words of the protocol language
    Words,
}

/// Arguments of `palpate protocol lock`.
#[derive(Debug, Args)]
pub struct ProtocolLockArgs {
    /// A built-in protocol, a file, or a locked protocol
    #[arg(value_name = "NAME|FILE")]
    protocol: String,
    /// Name under which it is run; the one before of this name is superseded
    #[arg(long = "as", value_name = "NAME")]
    name: String,
    #[command(flatten)]
    values: ValueArgs,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

/// Arguments of `palpate protocol check`.
#[derive(Debug, Args)]
pub struct ProtocolCheckArgs {
    /// Protocol files, programme files, or names of built-in protocols
    #[arg(required = true, value_name = "NAME|FILE")]
    files: Vec<String>,
    #[command(flatten)]
    rig: RigArgs,
}

/// Arguments of `palpate protocol show`.
#[derive(Debug, Args)]
pub struct ProtocolShowArgs {
    /// A built-in protocol or a file
    #[arg(value_name = "NAME|FILE")]
    protocol: String,
    /// Print the steps with loops written out instead
    #[arg(long)]
    steps: bool,
    #[command(flatten)]
    values: ValueArgs,
}

/// Arguments of `palpate protocol preview`.
#[derive(Debug, Args)]
pub struct ProtocolPreviewArgs {
    /// A built-in protocol or a file
    #[arg(value_name = "NAME|FILE")]
    protocol: String,
    #[command(flatten)]
    values: ValueArgs,
    /// Draw depth and expected force over time into a new SVG file
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    rig: RigArgs,
}

pub(super) fn run(command: &ProtocolCommand, output: &Output) -> Result<(), Failure> {
    match command {
        ProtocolCommand::List => list(output),
        ProtocolCommand::Check(args) => run_check(args, output),
        ProtocolCommand::Show(args) => show(args, output),
        ProtocolCommand::Preview(args) => preview(args, output),
        ProtocolCommand::Lock(args) => lock(args, output),
        ProtocolCommand::Words => {
            let text = reference();
            let object = serde_json::json!({ "text": text });
            output.answer("protocol words", &object, || text.trim_end().to_owned());
            Ok(())
        }
    }
}

/// Values of parameters.
#[derive(Clone, Debug, Args)]
pub struct ValueArgs {
    /// Another value of a parameter, such as depth=20mm or speeds="0.75 mm/s, 1.5 mm/s"; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_pair)]
    set: Vec<(String, String)>,
}

impl ValueArgs {
    /// By name; the later of two values for one name holds.
    pub fn values(&self) -> BTreeMap<String, String> {
        self.set.iter().cloned().collect()
    }
}

/// `name=value`, or one sentence.
pub(super) fn parse_pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("this is not NAME=VALUE; give for example depth=20mm".into()),
    }
}

/// A built-in protocol, a file, or a locked protocol of the library.
fn read_source(name: &str) -> Result<ProtocolSource, Failure> {
    let library = palpate_sessions::library_folder().ok();
    match find_protocol(name, library.as_deref()).map_err(Failure::usage)? {
        Some(source) => Ok(source),
        None => {
            let hint = match nearest_built_in(name) {
                Some(near) => format!("did you mean '{near}'?"),
                None => "'palpate protocol list' lists the protocols".into(),
            };
            Err(Failure::usage(format!(
                "'{name}' is neither a built-in protocol nor a file nor a locked protocol; {hint}"
            )))
        }
    }
}

/// The text of a built-in protocol, of a file, or of a locked protocol.
pub(super) fn read_text(name: &str) -> Result<String, Failure> {
    Ok(read_source(name)?.text)
}

/// The same, unless it is a programme.
fn read_protocol(name: &str) -> Result<ProtocolSource, Failure> {
    if programme::is_programme(name) {
        return Err(Failure::usage(format!(
            "{name} is a programme, not a protocol; 'palpate run {name} --preview' shows its runs"
        )));
    }
    read_source(name)
}

/// A protocol expanded for a rig, or its first error; warnings become notes.
pub(super) fn load_checked(
    name: &str,
    values: &BTreeMap<String, String>,
    bench: &OpenRig,
    output: &Output,
) -> Result<(Protocol, palpate_protocols::file::ExpandedProtocol, Preview), Failure> {
    let source = read_protocol(name)?;
    let values = source.values(name, values).map_err(Failure::usage)?;
    let ProtocolCheck { plan, problems } = check_on(&source.text, &values, bench)?;
    let errors: Vec<&ProtocolProblem> =
        problems.iter().filter(|problem| problem.is_error()).collect();
    if let Some(first) = errors.first() {
        let more = match errors.len() {
            1 => String::new(),
            count => format!("; 'palpate protocol check {name}' lists {} more", count - 1),
        };
        return Err(Failure::usage(format!("{name}, {first}{more}")));
    }
    let notes = plan.as_ref().map(|(_, _, preview)| &preview.notes);
    for problem in &problems {
        // The preview prints it too.
        if notes.is_some_and(|notes| notes.contains(&problem.message)) {
            continue;
        }
        output.note(&format!("{name}, {problem}"));
    }
    plan.ok_or_else(|| {
        Failure::failed(format!("the protocol {name} cannot be expanded into a plan"))
    })
}

fn check_on(
    text: &str,
    values: &BTreeMap<String, String>,
    bench: &OpenRig,
) -> Result<ProtocolCheck, Failure> {
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let rig = bench.rig.description();
    Ok(check(text, values, rig, &bench.limits, &curve))
}

fn head(protocol: &Protocol) -> serde_json::Value {
    serde_json::json!({
        "name": protocol.name, "version": protocol.version, "title": protocol.title,
        "about": protocol.about, "source": protocol.source, "ask": protocol.ask,
        "parameters": protocol.parameters,
    })
}

fn list(output: &Output) -> Result<(), Failure> {
    let protocols: Result<Vec<Protocol>, Failure> =
        BUILT_IN.iter().map(|(name, text)| read(name, text)).collect();
    let protocols = protocols?;
    let heads: Vec<_> = protocols.iter().map(head).collect();
    let library = palpate_sessions::library_folder();
    let (locked, unreadable) =
        library.map_or_else(|_| Default::default(), |it| locked_protocols(&it));
    unreadable.iter().for_each(|reason| output.note(reason));
    let names = locked.iter().map(
        |one| serde_json::json!({ "name": one.document.name, "by": one.document.by, "id": one.id }),
    );
    let object = serde_json::json!({ "protocols": heads, "locked": names.collect::<Vec<_>>() });
    output.answer("protocol list", &object, || text::list(&protocols, &locked));
    Ok(())
}

fn lock(args: &ProtocolLockArgs, output: &Output) -> Result<(), Failure> {
    let library = palpate_sessions::library_folder().map_err(Failure::usage)?;
    let (source, by) = (read_protocol(&args.protocol)?, author(args.by.as_deref()));
    let stored = lock_protocol(&library, &args.name, &source, &args.values.values(), &by);
    let stored = stored.map_err(Failure::usage)?;
    let object = serde_json::json!({
        "name": stored.document.name, "by": by, "id": stored.id, "values": stored.document.values,
        "supersedes": stored.document.supersedes,
    });
    output.answer("protocol lock", &object, || {
        format!(
            "locked as {}: 'palpate run {}' runs it, and nobody can set its values",
            stored.id, stored.document.name
        )
    });
    Ok(())
}

fn read(name: &str, text: &str) -> Result<Protocol, Failure> {
    Protocol::read(text).map_err(|problems| Failure::usage(text::sentences(name, &problems)))
}

/// What was found in one file of a protocol or a programme.
#[derive(Serialize)]
pub(super) struct FileReport {
    pub(super) file: String,
    /// Name in the file; none if it cannot be read.
    pub(super) name: Option<String>,
    pub(super) problems: Vec<ProtocolProblem>,
    pub(super) expected_s: Option<f64>,
}

fn run_check(args: &ProtocolCheckArgs, output: &Output) -> Result<(), Failure> {
    let bench = super::rig::open(&args.rig)?;
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let watch = Stopwatch::start();
    let nothing = BTreeMap::new();
    let mut files = Vec::new();
    let mut wrong = 0;
    for file in &args.files {
        if programme::is_programme(file) {
            let report = programme::check(file, &bench)?;
            wrong += usize::from(report.problems.iter().any(ProtocolProblem::is_error));
            files.push(report);
            continue;
        }
        let text = read_text(file)?;
        let checked = check(&text, &nothing, bench.rig.description(), &bench.limits, &curve);
        wrong += usize::from(!checked.is_sound());
        let (name, expected_s) = match checked.plan {
            Some((protocol, _, preview)) => (Some(protocol.name), Some(preview.expected.0)),
            None => (None, None),
        };
        files.push(FileReport { file: file.clone(), name, problems: checked.problems, expected_s });
    }
    let object = serde_json::json!({ "files": files,
        "seconds": watch.seconds(),
    });
    output.answer("protocol check", &object, || text::check(&files));
    match wrong {
        0 => Ok(()),
        1 => Err(Failure::usage("1 file cannot run; correct the errors listed above")),
        _ => Err(Failure::usage(format!(
            "{wrong} files cannot run; correct the errors listed above"
        ))),
    }
}

fn show(args: &ProtocolShowArgs, output: &Output) -> Result<(), Failure> {
    let file = read_text(&args.protocol)?;
    let values = args.values.values();
    if !args.steps && values.is_empty() {
        // A file with mistakes is shown too, so that they can be found.
        let protocol = Protocol::read(&file).ok();
        let object = serde_json::json!({ "protocol": protocol.as_ref().map(head),
            "text": file,
        });
        output.answer("protocol show", &object, || file.trim_end().to_owned());
        return Ok(());
    }
    let source = read_protocol(&args.protocol)?;
    let protocol = read(&args.protocol, &source.text)?;
    let values = source.values(&args.protocol, &values).map_err(Failure::usage)?;
    let written = protocol
        .write_out(&values)
        .map_err(|problems| Failure::usage(text::sentences(&args.protocol, &problems)))?;
    let steps: &[PlannedStep] = &written.plan.steps;
    let object = serde_json::json!({ "protocol": head(&protocol),
        "steps": steps,
        "lines": written.lines,
    });
    output.answer("protocol show", &object, || text::steps(&written));
    Ok(())
}

fn preview(args: &ProtocolPreviewArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("plot", args.plot.as_deref())?;
    let bench = super::rig::open(&args.rig)?;
    let (protocol, written, preview) =
        load_checked(&args.protocol, &args.values.values(), &bench, output)?;
    let plan = &written.plan;
    let nothing = BTreeMap::new();
    let after =
        |index: usize| -> f64 { preview.steps[..=index].iter().map(|step| step.expected.0).sum() };
    // The index is that of the step before the checkpoint.
    let checkpoints = plan.checkpoints_from(0).map(|(step_index, name)| {
        serde_json::json!({ "name": name, "step_index": step_index, "after_s": after(step_index) })
    });
    let object = serde_json::json!({
        "protocol": head(&protocol),
        "values": plan.source.as_ref().map_or(&nothing, |source| &source.values),
        "checkpoints": checkpoints.collect::<Vec<_>>(),
    });
    output.answer("protocol preview", &merged(object, &preview), || {
        text::preview(&protocol, &written, &preview)
    });
    new_file::write("plot", args.plot.as_deref(), || {
        // A protocol without contact has no curve of depth and force.
        if preview.force_band[1].0 <= 0.0 {
            return plan_picture::of_steps(&protocol.title, &preview.steps);
        }
        let curve = bench.calibration.curve();
        let points = curve.map_or(Vec::new(), |curve| {
            outline(plan, bench.rig.description(), &bench.limits, &curve)
        });
        plan_picture::of_plan(&protocol.title, &points)
    })
}
