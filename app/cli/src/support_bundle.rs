//! `palpate support-bundle`: one file for support.

use super::Failure;
use super::output::Output;
use chrono::{DateTime, Utc};
use clap::Args;
use palpate_analysis::support_bundle::{BundleError, BundleRequest, make_bundle};
use palpate_analysis::window_requests::WindowOpener;
use palpate_runner::wall_now;
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// Make one file for support: log, versions, settings, state of the sessions; measured data only on request
#[derive(Debug, Args)]
pub struct SupportBundleArgs {
    /// The file to make; palpate-support-TIME.zip in this folder if none is given
    out: Option<PathBuf>,
    /// A rig file to include, without passwords and tokens
    #[arg(long, value_name = "FILE")]
    rig: Vec<PathBuf>,
    /// Include manifests of the library's sessions: operator, specimen, rig, plan
    #[arg(long)]
    with_manifests: bool,
    /// Include a session with all measured data
    #[arg(long, value_name = "SESSION")]
    with_session: Vec<PathBuf>,
}

/// The features of this build.
pub(super) fn features(has_window: bool) -> Vec<&'static str> {
    let parts = [
        ("window", has_window),
        ("emulators", cfg!(feature = "emulators")),
        ("haptics", cfg!(feature = "haptics")),
        ("extremes", cfg!(feature = "extremes")),
        ("notifications", cfg!(feature = "notifications")),
    ];
    let there = parts.into_iter().filter(|(_, is_there)| *is_there);
    there.map(|(name, _)| name).collect()
}

pub(super) fn run(
    args: &SupportBundleArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let to = args.out.clone().unwrap_or_else(|| {
        let time = DateTime::<Utc>::from(wall_now()).format("%Y%m%d-%H%M%S");
        PathBuf::from(format!("palpate-support-{time}.zip"))
    });
    super::new_file::check("bundle", Some(&to))?;
    let request = BundleRequest {
        findings: super::doctor::findings(&library, output)?,
        features: features(windows.is_some()),
        rigs: args.rig.clone(),
        has_manifests: args.with_manifests,
        sessions: args.with_session.clone(),
        to,
        library,
    };
    let files = make_bundle(&request).map_err(|err| match err {
        BundleError::Write { .. } => Failure::failed(err),
        BundleError::Read { .. } | BundleError::Session(_) => Failure::usage(err),
    })?;
    let file = request.to.display().to_string();
    let object = serde_json::json!({ "file": file, "files": files });
    output.answer("support-bundle", &object, || {
        let lines =
            files.iter().map(|one| format!("{}: {}, {} bytes", one.name, one.what, one.bytes));
        let end = format!("{file} holds these {} files", files.len());
        lines.chain([end]).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}
