//! `palpate window`: the workbench on a rig.

use super::output::Output;
use super::rig::{OpenRig, RigArgs, open, open_in_window};
use super::{Failure, NO_WINDOW};
use clap::Args;
use palpate_analysis::window_requests::{RigOpener, RunWatcher, WindowOpener, WorkbenchRequest};
use palpate_model::calibration::Calibration;
use palpate_protocols::plans::RampHold;
use palpate_runner::TimeScale;
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;

/// Open the window
#[derive(Debug, Default, Args)]
pub struct WindowArgs {
    /// Sessions to review, each by its folder or a log in it; protocols and tables open too
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    rig: RigArgs,
    #[cfg(feature = "station")]
    #[command(flatten)]
    serve: super::station::ServeBesideArgs,
}

pub(super) fn run(
    args: &WindowArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    let windows = windows.ok_or_else(|| Failure::usage(NO_WINDOW))?;
    let to_open = args.paths.iter().map(|path| existing(path)).collect::<Result<_, _>>()?;
    let bench = open(&args.rig)?;
    bench.from_library.iter().chain(&bench.doubts).for_each(|words| output.note(words));
    // Doubts about a calibration that the command line does not name must be acknowledged before a run.
    let doubts = if args.rig.calibration.is_none() { bench.doubts.clone() } else { Vec::new() };
    let request = request(bench, args.rig.time_scale, output)?;
    let request = WorkbenchRequest { to_open, doubts, ..request };
    #[cfg(feature = "station")]
    let request = WorkbenchRequest { station: args.serve.settings()?, ..request };
    windows.workbench(request).map_err(Failure::Failed)
}

fn request(bench: OpenRig, scale: TimeScale, output: &Output) -> Result<WorkbenchRequest, Failure> {
    let gate = super::run::gate(&RampHold::default().plan(), &bench)?;
    let OpenRig { rig, calibration, built_in, limits, locks, .. } = bench;
    Ok(WorkbenchRequest {
        watcher: watcher(&calibration, output),
        built_in,
        to_acknowledge: gate.to_acknowledge(),
        locks,
        open_rig: Some(opener()),
        ..WorkbenchRequest::of(rig, calibration, limits, scale)
    })
}

#[cfg(feature = "notifications")]
fn watcher(calibration: &Calibration, output: &Output) -> Option<Arc<dyn RunWatcher>> {
    Some(Arc::new(super::notices::Notices::open(calibration, output)))
}

#[cfg(not(feature = "notifications"))]
fn watcher(_: &Calibration, _: &Output) -> Option<Arc<dyn RunWatcher>> {
    None
}

/// Opens a rig that is chosen in the window. Nobody reads the terminal then, so doubts must be acknowledged.
fn opener() -> RigOpener {
    Arc::new(|name| {
        let opened = open_in_window(name).and_then(|mut bench| {
            let doubts = std::mem::take(&mut bench.doubts);
            let output = Output::kept();
            let request = request(bench, RigArgs::default().time_scale, &output)?;
            Ok(WorkbenchRequest { doubts, ..request })
        });
        opened.map_err(|failure| failure.sentence().to_owned())
    })
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
