//! `palpate plan`: the shortest protocol for a target uncertainty.

mod text;

use super::arguments::parse_number;
use super::output::Output;
use super::rig::RigArgs;
use super::{Failure, known_fit_failure};
use clap::Args;
use palpate_analysis::plan::{PlanFailure, PlanRequest, PlanningRig, plan, plan_assumptions};
use palpate_analysis::report::plan_plot;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_rheology::expected::{CorrelatedNoise, ExpectedError, FreeOffsets, PrecisionTarget};
use std::path::PathBuf;

/// Propose the shortest protocol that determines parameters to a target uncertainty
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Half-width of a 95 % interval, as tau=1% or mu1=2%; may be repeated
    #[arg(long, value_name = "NAME=PERCENT", default_value = "tau=1%")]
    within: Vec<String>,
    /// Model and noise: a session, a table, or the output of 'palpate fit --json'; without it the last fit
    #[arg(long, value_name = "SESSION|TABLE|FIT.json")]
    like: Option<PathBuf>,
    /// White noise in mN, independent from sample to sample; without it the white noise of the fit
    #[arg(long, value_name = "MN")]
    noise_mn: Option<f64>,
    /// Autocorrelated noise in addition: standard deviation in mN and correlation time in s
    #[arg(long, value_name = "SD_MN,SECONDS")]
    memory: Option<String>,
    /// A parameter that is known and need not be fitted, f0 or f_offset; may be repeated
    #[arg(long, value_name = "NAME")]
    known: Vec<String>,
    /// Samples per second
    #[arg(long, value_name = "HZ", default_value = "1000")]
    rate: f64,
    /// Depth from contact in mm
    #[arg(long, value_name = "MM", default_value = "30")]
    depth: f64,
    /// Highest force in N; without it chosen so that a specimen a third stiffer stays below the interlock limit
    #[arg(long, value_name = "N")]
    force_max: Option<f64>,
    /// Fastest speed in mm/s; without it the rig's
    #[arg(long, value_name = "MM_PER_S")]
    speed_max: Option<f64>,
    /// Longest protocol in s
    #[arg(long, value_name = "SECONDS", default_value = "3600")]
    time_max: f64,
    /// Also draw intervals against hold, cycles and sampling rate
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

const GUESS: &str =
    "the fit determines tau_eps poorly, so the plan is uncertain; give a better record with --like";

pub(super) fn run(args: &PlanArgs, output: &Output) -> Result<(), Failure> {
    let request = PlanRequest {
        targets: targets(&args.within)?,
        unknowns: unknowns(&args.known)?,
        white: args.noise_mn.map(|noise| Newtons(noise * 1e-3)),
        memory: args.memory.as_deref().map(memory).transpose()?,
        sample_rate_hz: args.rate,
        depth: Depth(args.depth),
        force_max: args.force_max.map(Newtons),
        speed_max: args.speed_max.map(MmPerS),
        duration_max: Seconds(args.time_max),
        command: &text::command,
    };
    let bench = super::rig::open(&RigArgs::default())?;
    let assumed = plan_assumptions(args.like.as_deref()).map_err(known_fit_failure)?;
    assumed.notes.iter().for_each(|note| output.note(note));
    if assumed.is_hardly_known {
        output.note(GUESS);
    }
    let bench = PlanningRig {
        rig: bench.rig.description(),
        limits: &bench.limits,
        curve: &bench.calibration.curve().map_err(Failure::usage)?,
    };
    let report = plan(request, assumed, bench).map_err(failure)?;
    if let Some(file) = &args.picture {
        palpate_sessions::atomic::replace(file, plan_plot::picture(&report).as_bytes()).map_err(
            |err| {
                Failure::failed(format!(
                    "the picture {} cannot be written ({err}); choose a folder that you may write to",
                    file.display()
                ))
            },
        )?;
    }
    output.answer("plan", &report, || text::text(&report));
    Ok(())
}

/// An unreachable target is a failure, all else is wrong use.
fn failure(err: PlanFailure) -> Failure {
    match err {
        PlanFailure::Expected(ExpectedError::Unreachable { .. }) => Failure::failed(err),
        PlanFailure::TooFast { .. } => Failure::usage(format!("--speed-max: {err}")),
        PlanFailure::TooStrong { .. } => Failure::usage(format!("--force-max: {err}")),
        err => Failure::usage(err),
    }
}

/// `tau=1%`, with or without the sign.
fn targets(within: &[String]) -> Result<Vec<PrecisionTarget>, Failure> {
    let mut targets: Vec<PrecisionTarget> = Vec::new();
    for pair in within {
        let parsed = pair.split_once('=').and_then(|(name, value)| {
            let value = value.trim().trim_end_matches('%').trim_end();
            Some((name.trim(), parse_number(value).ok()?))
        });
        let Some((name, percent)) = parsed else {
            return Err(Failure::usage(format!(
                "--within {pair} is not NAME=PERCENT; give for example --within tau=1%"
            )));
        };
        let target = PrecisionTarget::new(name, percent).map_err(Failure::usage)?;
        if targets.iter().any(|one| one.parameter == target.parameter) {
            return Err(Failure::usage(format!(
                "{} is given twice; give it once",
                target.parameter
            )));
        }
        targets.push(target);
    }
    Ok(targets)
}

fn unknowns(known: &[String]) -> Result<FreeOffsets, Failure> {
    let mut unknowns = FreeOffsets::default();
    for name in known {
        match name.trim() {
            "f0" => unknowns.f0 = false,
            "f_offset" => unknowns.f_offset = false,
            other => {
                return Err(Failure::usage(format!(
                    "--known {other} is not allowed; give f0 or f_offset"
                )));
            }
        }
    }
    Ok(unknowns)
}

fn memory(text: &str) -> Result<CorrelatedNoise, Failure> {
    let parsed = text
        .split_once(',')
        .and_then(|(sd, time)| Some((sd.trim().parse().ok()?, time.trim().parse().ok()?)));
    let Some((sd_mn, secs)) = parsed else {
        return Err(Failure::usage(format!(
            "--memory {text} is not SD,TIME; give a standard deviation in mN and a time in s, for example --memory 10,0.5"
        )));
    };
    let sd_mn: f64 = sd_mn;
    Ok(CorrelatedNoise { sd: Newtons(sd_mn * 1e-3), time: Seconds(secs) })
}
