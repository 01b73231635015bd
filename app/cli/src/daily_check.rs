//! `palpate daily-check`: the check that enables a rig for the day.

use super::Failure;
use super::arguments::parse_number;
use super::output::Output;
use super::rig::RigArgs;
use clap::Args;
use palpate_analysis::daily::{DAILY_CHECK, judge_daily_check};
use palpate_model::metadata::SessionLabels;
use palpate_model::metadata::SessionMetadata;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::file::built_in;
use palpate_protocols::plans::Plan;
use palpate_runner::{AfterStop, PromptResponder, RunRequest, wall_now};
use palpate_sessions::checks::{CheckPart, DailyCheck, add_check};
use palpate_sessions::{Session, library_folder};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Check zero, one known weight and homing; the result holds for the day
#[derive(Debug, Args)]
pub struct DailyCheckArgs {
    /// The known weight in g
    #[arg(long, value_name = "G", default_value = "840", value_parser = parse_number)]
    mass: f64,
    #[command(flatten)]
    rig: RigArgs,
    /// Session folder, new or empty; without it a new one in the library (~/palpate or PALPATE_HOME)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Operator
    #[arg(long, default_value = "")]
    operator: String,
}

pub(super) fn run(args: &DailyCheckArgs, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let labels = SessionLabels {
        operator: args.operator.clone(),
        specimen: String::new(),
        indenter: String::new(),
        about: SessionMetadata::default(),
    };
    let plan = plan(args.mass, &labels)?;
    let bench = super::rig::open(&args.rig)?;
    bench.from_library.iter().chain(&bench.doubts).for_each(|words| output.note(words));
    let refusal = bench.calibration.check_refusal(args.mass);
    if let Some(reason) = refusal.map_err(Failure::usage)? {
        return Err(Failure::usage(reason));
    }
    let request = RunRequest {
        plan,
        calibration: bench.calibration,
        limits: bench.limits,
        out: args.out.clone(),
        labels,
        is_acknowledged: false,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: if bench.rig.is_virtual() {
            PromptResponder::Confirm
        } else {
            PromptResponder::Operator
        },
        leader: None,
    };
    let snapshot =
        super::run::execute(bench.rig, args.rig.time_scale, request, &mut |_| Ok(()), output)?;
    let Some(view) = &snapshot.run else {
        return Err(Failure::failed(
            "the thread that runs protocols ended before the check began; start the check again",
        ));
    };
    let ended = view.outcome.as_ref();
    let is_stopped = |ending| matches!(ending, EndingKind::Stop | EndingKind::Halt);
    if let Some(outcome) = ended.filter(|outcome| is_stopped(outcome.ending)) {
        return Err(Failure::failed(format!(
            "the check ended early ({}), so no result is saved for today; run the check again",
            outcome.reason
        )));
    }
    let session = Session::open(&view.folder).map_err(super::read_failure)?;
    let check = judge_daily_check(&session, wall_now()).map_err(super::source_failure)?;
    add_check(&library, &check).map_err(Failure::failed)?;
    let folder = view.folder.display().to_string();
    let object = serde_json::json!({
        "rig": check.rig, "session": folder, "calibration": check.calibration,
        "is_passed": check.is_passed, "parts": check.parts,
    });
    output.answer("daily-check", &object, || text(&check, &folder));
    match check.is_passed {
        true => Ok(()),
        false => Err(Failure::failed(format!(
            "rig {} failed its daily check: {}",
            check.rig,
            check.failures()
        ))),
    }
}

fn plan(mass_g: f64, labels: &SessionLabels) -> Result<Plan, Failure> {
    let values = BTreeMap::from([("mass".to_owned(), format!("{mass_g} g"))]);
    let Some(protocol) = built_in(DAILY_CHECK) else {
        return Err(Failure::failed("this build of palpate has no daily check"));
    };
    let planned = protocol.and_then(|protocol| Ok((protocol.plan(&values)?, protocol)));
    let (plan, protocol) = planned.map_err(|problems| {
        let first = problems.first().map(ToString::to_string);
        Failure::usage(first.unwrap_or_default())
    })?;
    let labels_checked = protocol.check_labels(labels);
    labels_checked.map_err(|reason| Failure::usage(format!("{reason}; add --operator")))?;
    Ok(plan)
}

fn text(check: &DailyCheck, folder: &str) -> String {
    let word = |is_passed| if is_passed { "pass" } else { "FAIL" };
    let mut lines = vec![format!("{}: {} in {folder}", check.rig, word(check.is_passed))];
    let part =
        |part: &CheckPart| format!("{:<7} {}: {}", part.what, word(part.is_passed), part.sentence);
    lines.extend(check.parts.iter().map(part));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_mass_is_that_of_the_protocol() {
        use clap::Parser;
        #[derive(Parser)]
        struct Line {
            #[command(flatten)]
            args: DailyCheckArgs,
        }
        let line = Line::parse_from(["daily-check"]);
        let protocol = built_in(DAILY_CHECK).unwrap().unwrap();
        let named = |one: &&palpate_protocols::file::ProtocolParameter| one.name == "mass";
        let mass = protocol.parameters.iter().find(named).unwrap();
        assert_eq!(mass.default.text, format!("{} g", line.args.mass));
    }
}
