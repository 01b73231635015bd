//! `palpate study`: sessions as a table of animals, specimens, sites and repeats, and what is missing in it.

use super::output::Output;
use super::{Failure, sources_failure};
use clap::Args;
use palpate_analysis::study_table::{StudyReadError, read_study};
use palpate_tables::lake::LakeError;
use std::path::PathBuf;

/// Show which animal, specimen, site and repeat each session is, and what the table lacks
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Sessions, folders of sessions, or one lake
    #[arg(required = true, value_name = "SESSION|FOLDER|LAKE")]
    sources: Vec<PathBuf>,
}

pub(super) fn run(args: &StudyArgs, output: &Output) -> Result<(), Failure> {
    let study = read_study(&args.sources).map_err(failure)?;
    let problems: Vec<_> = study
        .problems
        .iter()
        .map(|problem| {
            let mut object = serde_json::json!(problem);
            object["sentence"] = problem.to_string().into();
            object
        })
        .collect();
    let object = serde_json::json!({
        "sessions": study.rows, "left_out": study.left_out, "problems": problems,
    });
    output.answer("study", &object, || study.text());
    Ok(())
}

pub(super) fn failure(err: StudyReadError) -> Failure {
    match err {
        StudyReadError::Recordings(err) => sources_failure(err),
        StudyReadError::Lake(err @ (LakeError::NoLake { .. } | LakeError::Newer { .. })) => {
            Failure::usage(err)
        }
        StudyReadError::Lake(err) => Failure::failed(err),
    }
}
