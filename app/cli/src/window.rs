//! `palpate window`: the workbench on a rig.

use super::output::Output;
use super::rig::{OpenRig, RigArgs, open};
use super::{Failure, NO_WINDOW};
use clap::Args;
use palpate_analysis::window_requests::{WindowOpener, WorkbenchRequest};
use palpate_protocols::plans::RampHold;

/// Open the window
#[derive(Debug, Default, Args)]
pub struct WindowArgs {
    #[command(flatten)]
    rig: RigArgs,
}

pub(super) fn run(
    args: &WindowArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    let windows = windows.ok_or_else(|| Failure::usage(NO_WINDOW))?;
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
        })
        .map_err(Failure::Failed)
}
