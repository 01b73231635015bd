//! `palpate window`: the workbench on a rig.

use super::output::Output;
use super::rig::{OpenRig, RigArgs, open, open_in_window};
use super::{Failure, NO_WINDOW};
use clap::Args;
use palpate_analysis::window_requests::{RigOpener, WindowOpener, WorkbenchRequest};
use palpate_protocols::plans::RampHold;
use palpate_runner::TimeScale;
use std::sync::Arc;

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
    bench.doubts.iter().for_each(|doubt| output.note(doubt));
    windows.workbench(request(bench, args.rig.time_scale)?).map_err(Failure::Failed)
}

fn request(bench: OpenRig, scale: TimeScale) -> Result<WorkbenchRequest, Failure> {
    let gate = super::run::gate(&RampHold::default().plan(), &bench)?;
    let OpenRig { rig, calibration, limits, locks, .. } = bench;
    let to_acknowledge = gate.to_acknowledge();
    let open_rig = Some(opener());
    Ok(WorkbenchRequest { rig, calibration, limits, to_acknowledge, scale, locks, open_rig })
}

/// Opens a rig that is chosen in the window. Nobody reads the terminal then, so doubts must be acknowledged.
fn opener() -> RigOpener {
    Arc::new(|name| {
        let opened = open_in_window(name).and_then(|mut bench| {
            let doubts = std::mem::take(&mut bench.doubts);
            let mut request = request(bench, RigArgs::default().time_scale)?;
            request.to_acknowledge.extend(doubts);
            Ok(request)
        });
        opened.map_err(|failure| failure.sentence().to_owned())
    })
}
