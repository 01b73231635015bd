//! `palpate report SESSION --figure FILE`: one figure as a file.

use super::super::output::Output;
use super::super::{Failure, new_file};
use super::ReportArgs;
use palpate_analysis::report::dossier::{self, SessionFigure, SessionReading};
use palpate_analysis::report::figures::TimeWindow;
use std::path::Path;

pub(super) fn run(
    args: &ReportArgs,
    session: &Path,
    to: &Path,
    output: &Output,
) -> Result<(), Failure> {
    new_file::check("figure", Some(to))?;
    let ending = dossier::FigureFormat::of(to).map_err(Failure::usage)?;
    let window = window(args)?;
    let wanted = SessionReading { session: session.to_path_buf(), analysis: args.analysis.clone() };
    let drawing = dossier::figure(&wanted, args.of, window);
    let drawing = drawing.map_err(super::super::source_failure)?;
    let drawing = drawing.map_err(Failure::failed)?;
    let bytes = ending.bytes(&drawing).map_err(Failure::failed)?;
    new_file::write_bytes("figure", to, &bytes)?;
    let object = serde_json::json!({ "figure": to, "of": args.of.name(),
        "session": session,
    });
    output.answer("report", &object, || format!("{}: drawn", to.display()));
    Ok(())
}

fn window(args: &ReportArgs) -> Result<TimeWindow, Failure> {
    let window = TimeWindow {
        from: args.from.unwrap_or(TimeWindow::WHOLE.from),
        until: args.until.unwrap_or(TimeWindow::WHOLE.until),
    };
    if window.from >= window.until {
        return Err(Failure::usage(
            "--from is not before --until; give two times in s, the earlier with --from",
        ));
    }
    let is_over_samples = matches!(args.of, SessionFigure::ForceTime | SessionFigure::ForceDepth);
    if window != TimeWindow::WHOLE && !is_over_samples {
        return Err(Failure::usage(
            "--from and --until apply only to force-time and force-depth; leave these two options out",
        ));
    }
    Ok(window)
}
