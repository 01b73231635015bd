//! `palpate rig conform`: whether a sidecar keeps to its protocol, and what it may be trusted with.

use super::Failure;
use super::arguments::parse_number;
use super::output::Output;
use super::rig::lock_places;
use clap::Args;
use palpate_drivers::read_rig_text;
use palpate_drivers::rig_file::sidecars;
use palpate_drivers::sidecar::conform::{
    Check, ConformBench, ConformOptions, ConformReport, SpeedTrust, Verdict, run as conform,
};
use palpate_drivers::wire::DeviceAddress;
use palpate_model::Nanos;
use palpate_runner::driver_clock;
use std::time::Duration;

/// Arguments of `palpate rig conform`.
#[derive(Debug, Args)]
pub struct RigConformArgs {
    /// The rig file
    #[arg(value_name = "FILE.toml")]
    file: String,
    /// Move the axis by so many mm from where it stands: positive into the specimen, negative away from it. Without it the
    /// axis does not move, and its checks are skipped
    #[arg(long = "move", value_name = "MM", allow_negative_numbers = true, value_parser = range)]
    range: Option<f64>,
    /// Part of the rig: rig, cell or sensors.NAME; without it the first sidecar of the file
    #[arg(long, value_name = "PART")]
    part: Option<String>,
    /// Watch the samples for so long
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    seconds: f64,
    /// Way that the axis may go beyond an interlock, in mm: the largest speed follows from it
    #[arg(long, value_name = "MM", default_value = "0.5", value_parser = overtravel)]
    overtravel: f64,
}

/// Less than half a millimetre has no room for a cruise; more than 20 mm is more than any check needs.
fn range(text: &str) -> Result<f64, String> {
    let range = parse_number(text).ok().filter(|mm| (0.5..=20.0).contains(&mm.abs()));
    range.ok_or_else(|| "give 0.5 to 20, or -20 to -0.5".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = parse_number(text).ok().filter(|seconds| (1.0..=3600.0).contains(seconds));
    seconds.ok_or_else(|| "give 1 to 3600".to_owned())
}

fn overtravel(text: &str) -> Result<f64, String> {
    let mm = parse_number(text).ok().filter(|mm| (0.01..=10.0).contains(mm));
    mm.ok_or_else(|| "give 0.01 to 10".to_owned())
}

/// The sidecar to be checked.
fn find_part(args: &RigConformArgs) -> Result<(String, DeviceAddress), Failure> {
    let text = read_rig_text(&args.file).map_err(Failure::usage)?;
    let all = sidecars(&args.file, &text).map_err(Failure::usage)?;
    let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    let found = match &args.part {
        None => all.first(),
        Some(part) => all.iter().find(|(name, _)| name == part),
    };
    found.cloned().ok_or_else(|| {
        Failure::usage(match (&args.part, names.is_empty()) {
            (_, true) => {
                format!("{} has no sidecar; give a rig file with device = \"sidecar\"", args.file)
            }
            (part, false) => format!(
                "{} has no sidecar called {}; give one of {}",
                args.file,
                part.as_deref().unwrap_or_default(),
                names.join(", ")
            ),
        })
    })
}

pub(super) fn run(args: &RigConformArgs, output: &Output) -> Result<(), Failure> {
    let (part, place) = find_part(args)?;
    let _locks = lock_places(std::slice::from_ref(&place))?;
    let options = ConformOptions {
        range_mm: args.range,
        watch: Nanos((args.seconds * 1e9) as u64),
        overtravel_mm: args.overtravel,
    };
    let bar = output.bar(0);
    let mut bench = ConformBench {
        open: &mut || place.open(),
        clock: driver_clock(),
        wait: &|time| std::thread::sleep(Duration::from_nanos(time.0)),
        progress: &mut |name| bar.set_message(name.to_owned()),
    };
    let report = conform(&mut bench, &options);
    drop(bar);
    let report = report.map_err(|err| Failure::failed(format!("{}: {err}", args.file)))?;
    let object = serde_json::json!({
        "file": args.file, "part": part, "move_mm": args.range, "is_conform": report.is_conform(), "report": report,
    });
    output.answer("rig conform", &object, || text(&report));
    if report.is_conform() {
        return Ok(());
    }
    let failed = report.checks.iter().filter(|check| check.verdict == Verdict::Fail);
    let names: Vec<&str> = failed.map(|check| check.name).collect();
    Err(Failure::failed(format!(
        "{} fails {}; correct the sidecar and check it again",
        report.device,
        names.join(", ")
    )))
}

fn text(report: &ConformReport) -> String {
    let mut lines = vec![report.device.clone()];
    lines.extend(report.checks.iter().map(check_line));
    lines.push(
        report
            .trust
            .as_ref()
            .map_or_else(|| "The axis was not moved, so no speed follows.".into(), trust_lines),
    );
    lines.join("\n")
}

fn check_line(check: &Check) -> String {
    let verdict = match check.verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "FAIL",
        Verdict::Skipped => "skip",
    };
    let Check { name, what, unit, .. } = check;
    let values = match (check.measured, check.limit) {
        (Some(measured), Some(limit)) => {
            format!(": {} of at most {} {unit}", short(measured), short(limit))
        }
        (Some(measured), None) => format!(": {} {unit}", short(measured)),
        _ => String::new(),
    };
    format!("{verdict}  {name:<18} {what}{values}")
}

/// Three digits, as far as they say something.
fn short(value: f64) -> String {
    let decimals = if value.abs() >= 100.0 || value.fract() == 0.0 { 0 } else { 3 };
    format!("{value:.decimals$}")
}

fn trust_lines(trust: &SpeedTrust) -> String {
    let ms = |seconds: f64| seconds * 1e3;
    let reaction = format!(
        "reaction   {:.2} ms: {:.2} ms between samples, {:.2} ms until a sample has come, {:.2} ms for the longest answer, 0.5 ms of palpate's own",
        ms(trust.reaction_s),
        ms(trust.sample_period_s),
        ms(trust.sample_delay_s),
        ms(trust.answer_s)
    );
    let verdict = if trust.speed_max_mm_s > 0.0 {
        format!(
            "trust      speed_max_mm_s = {:.2}: the axis stands within {} mm of overtravel after an interlock (v T + v^2 / 2a, a = {} mm/s2), and within {:.2} mm after a lost link",
            (trust.speed_max_mm_s * 100.0).floor() / 100.0,
            trust.overtravel_mm,
            trust.acceleration_mm_s2,
            trust.lost_link_mm
        )
    } else {
        "trust      nothing: a check on which the safety of the axis depends has failed".into()
    };
    format!("{reaction}\n{verdict}")
}
