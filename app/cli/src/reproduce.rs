//! `palpate reproduce`: the numbers and figures of a crate, computed again and compared.

use super::arguments::date_of_pages;
use super::make_crate::failure;
use super::output::{Output, merged};
use super::steps::OwnProgram;
use super::{Failure, new_file};
use clap::Args;
use palpate_analysis::report::text::counted;
use palpate_analysis::research_object::{
    ComparedFile, FileResult, ProgramAge, RELATIVE_BOUND, ReproduceRequest, Reproduction,
    StepComparison, reproduce,
};
use std::path::PathBuf;

/// Compute every number and figure of a crate again, and compare
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Folder or zip file that 'palpate crate' made
    #[arg(value_name = "CRATE")]
    from: PathBuf,
    /// Keep what is computed in this new folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

pub(super) fn run(args: &ReproduceArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("folder", args.out.as_deref())?;
    let request =
        ReproduceRequest { from: &args.from, to: args.out.as_deref(), now: date_of_pages() };
    let bar = output.count_bar(0);
    let found = reproduce(&request, &OwnProgram::find()?, &bar);
    drop(bar);
    let found = found.map_err(failure)?;
    let object = serde_json::json!({
        "crate": args.from, "out": args.out, "is_equal": found.is_equal(), "is_exact": found.is_exact(),
    });
    output.answer("reproduce", &merged(object, &found), || text(&found));
    match found.is_equal() {
        true => Ok(()),
        false => Err(Failure::failed(verdict(&found))),
    }
}

fn verdict(found: &Reproduction) -> String {
    match (found.faults.as_slice(), found.first_difference()) {
        ([first, others @ ..], _) => format!(
            "the crate is not as it was made: {first}{}; fetch it again",
            match others.len() {
                0 => String::new(),
                more => format!(", and {} like it", counted(more, "fault")),
            }
        ),
        ([], Some((step, file))) => format!(
            "step '{}' gives other results: {}; {}",
            step.step,
            difference(file),
            match found.made_by {
                ProgramAge::Older => "the entries of the changelog above say what has changed",
                ProgramAge::Newer => "a newer palpate made the crate, so update palpate",
                _ => "compare both files, which --out FOLDER keeps",
            }
        ),
        ([], None) => "the crate differs".to_owned(),
    }
}

fn difference(file: &ComparedFile) -> String {
    let name = &file.file;
    match &file.result {
        FileResult::Different { line: 0, in_crate, now } => {
            format!("{name} has {in_crate} in the crate and {now} now")
        }
        FileResult::Different { line, in_crate, now } => {
            format!("line {line} of {name} has '{in_crate}' in the crate and '{now}' now")
        }
        FileResult::NotComputed => format!("{name} is in the crate and not computed now"),
        FileResult::NotInCrate => format!("{name} is computed now and not in the crate"),
        FileResult::Same | FileResult::WithinBounds { .. } => format!("{name} is equal"),
    }
}

fn text(found: &Reproduction) -> String {
    if !found.faults.is_empty() {
        return found.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    }
    let mut lines = vec![
        format!("{}: {} as listed", found.title, counted(found.files, "file")),
        origins(found),
    ];
    if found.is_repacked {
        lines.push("another program packed the zip file, so its files are checked and the bytes around them are not".to_owned());
    }
    lines.extend(found.steps.iter().map(step_line));
    if !found.changes.is_empty() {
        lines.push("changes since the crate was made, by the changelog:".to_owned());
        let changes = found.changes.iter();
        lines
            .extend(changes.map(|one| format!("  {}, {}: {}", one.version, one.section, one.text)));
    }
    if found.is_equal() {
        lines.push("equal".to_owned());
    }
    lines.join("\n")
}

fn origins(found: &Reproduction) -> String {
    let (made, here) = (&found.made_with, &found.computed_with);
    let program = match found.made_by {
        ProgramAge::Same => format!("made by palpate {}, as this one", made.version),
        ProgramAge::Older => {
            format!("made by palpate {}, computed by {}", made.version, here.version)
        }
        ProgramAge::Newer => format!(
            "made by palpate {}, which is newer than this palpate {}",
            made.version, here.version
        ),
        ProgramAge::OtherBuild => {
            format!("made by another build of palpate {}", made.version)
        }
    };
    let computer = match found.is_same_computer {
        true => format!("on a computer of this class ({})", here.computer),
        false => format!("on {}, computed on {}", made.computer, here.computer),
    };
    let compared = match found.is_exact() {
        true => "every byte counts".to_owned(),
        false => format!("numbers may differ by {RELATIVE_BOUND:e} of themselves"),
    };
    format!("{program}, {computer}: {compared}")
}

fn step_line(step: &StepComparison) -> String {
    if let Some(first) = step.first_difference() {
        return format!("{}: differs; {}", step.step, difference(first));
    }
    let shares = step.files.iter().filter_map(|one| match one.result {
        FileResult::WithinBounds { largest } => Some(largest),
        _ => None,
    });
    let files = counted(step.files.len(), "file");
    match shares.reduce(f64::max) {
        None => format!("{}: {files} the same to the bit", step.step),
        Some(largest) => format!(
            "{}: {files} within the bounds, the largest difference {largest:.1e} of the number",
            step.step
        ),
    }
}
