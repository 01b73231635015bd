//! `palpate window`: the workbench on a rig.

use super::output::Output;
use super::rig::{OpenRig, RigArgs, open};
use super::{Failure, NO_WINDOW};
use clap::Args;
use palpate_analysis::window_requests::{WindowOpener, WorkbenchRequest};
use palpate_protocols::plans::RampHold;
use std::path::{Path, PathBuf, absolute};

/// Open the window
#[derive(Debug, Default, Args)]
pub struct WindowArgs {
    /// Sessions to review, each by its folder or a log in it; protocols and tables open too
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    rig: RigArgs,
}

pub(super) fn run(
    args: &WindowArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    let windows = windows.ok_or_else(|| Failure::usage(NO_WINDOW))?;
    let to_open = args.paths.iter().map(|path| existing(path)).collect::<Result<_, _>>()?;
    let bench = open(&args.rig)?;
    let gate = super::run::gate(&RampHold::default().plan(), &bench)?;
    let OpenRig { rig, calibration, doubts, limits, _locks } = bench;
    doubts.iter().for_each(|doubt| output.note(doubt));
    windows
        .workbench(WorkbenchRequest {
            rig,
            calibration,
            limits,
            to_acknowledge: gate.to_acknowledge(),
            scale: args.rig.time_scale,
            to_open,
        })
        .map_err(Failure::Failed)
}

/// The absolute path of what is to be shown.
fn existing(path: &Path) -> Result<PathBuf, Failure> {
    match path.exists() {
        true => absolute(path).map_err(Failure::usage),
        false => Err(Failure::usage(format!(
            "there is no file or folder {}; give a session, a protocol or a table",
            path.display()
        ))),
    }
}
