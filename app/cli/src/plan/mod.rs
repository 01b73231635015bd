//! `palpate plan`: the shortest protocol that will tell what is wanted.

mod picture;
mod text;

use super::Failure;
use super::last_fit::{self, KnownFit};
use super::output::Output;
use super::rig::{OpenRig, RigArgs};
use clap::Args;
use palpate_analysis::source;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::plans::RampHold;
use palpate_protocols::preview::{Preview, preview};
use palpate_rheology::expected::{
    Curves, ExpectedError, Family, Memory, Noise, Proposal, Rig, Target, Unknowns, curves, shortest,
};
use palpate_rheology::fit::{FitOptions, fit};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// How much stiffer than the assumed body a specimen may be, as in the preview of a run, before the
/// interlock stops it.
const STIFFER: f64 = 1.35;
/// The white noise of the simulated rig's straight cell, in N.
const NOISE_ASSUMED: Newtons = Newtons(0.02);

/// Arguments of `palpate plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Half-width of a 95 % interval, as tau=1% or mu1=2%; may be repeated
    #[arg(long, value_name = "NAME=PERCENT", default_value = "tau=1%")]
    within: Vec<String>,
    /// Body and noise: a session, a table, or what 'palpate fit --json' printed; without it the last fit
    #[arg(long, value_name = "SESSION|TABLE|FIT.json")]
    like: Option<PathBuf>,
    /// Noise that is independent from sample to sample, in mN; without it that of the fit
    #[arg(long, value_name = "MN")]
    noise_mn: Option<f64>,
    /// Slow noise on top: standard deviation in mN and correlation time in s
    #[arg(long, value_name = "SD_MN,SECONDS")]
    memory: Option<String>,
    /// What is known and need not be fitted, f0 or f_offset; may be repeated
    #[arg(long, value_name = "NAME")]
    known: Vec<String>,
    /// Samples per second
    #[arg(long, value_name = "HZ", default_value = "1000")]
    rate: f64,
    /// Depth from contact in mm
    #[arg(long, value_name = "MM", default_value = "30")]
    depth: f64,
    /// Highest force in N; without it what leaves a specimen a third stiffer below the interlock
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
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Body and noise, and where they are from.
struct Assumed {
    body: ModifiedKelvin,
    noise: Newtons,
    source: String,
}

#[derive(Serialize)]
struct PlanReport {
    command: &'static str,
    body: ModifiedKelvin,
    body_source: String,
    noise: Noise,
    unknowns: Unknowns,
    rig: Rig,
    targets: Vec<Target>,
    proposals: Vec<Offer>,
    curves: Curves,
}

/// A proposal, and whether and how this program can run it.
#[derive(Serialize)]
struct Offer {
    #[serde(flatten)]
    proposal: Proposal,
    /// One for every press; none where no plan exists.
    commands: Vec<String>,
    /// What the runs will ask to be acknowledged.
    acknowledgements: Vec<String>,
    /// With homing, finding contact and leaving the tissue, in s; none where no plan exists.
    run_s: Option<f64>,
}

pub(super) fn run(args: &PlanArgs, output: &Output) -> Result<(), Failure> {
    let targets = targets(&args.within)?;
    let unknowns = unknowns(&args.known)?;
    let bench = super::rig::open(&RigArgs::default())?;
    let rig = rig_of(args, &bench)?;
    let assumed = assumed(args.like.as_deref(), output)?;
    let noise = Noise {
        white: args
            .noise_mn
            .map_or(assumed.noise, |noise| Newtons(noise * 1e-3)),
        memory: args.memory.as_deref().map(memory).transpose()?,
    };
    let proposals = shortest(&assumed.body, &noise, unknowns, &targets, &rig).map_err(failure)?;
    let drawn = drawn(&proposals);
    let curves = curves(&assumed.body, &noise, unknowns, &rig, drawn).map_err(failure)?;
    let report = PlanReport {
        command: "plan",
        body: assumed.body,
        body_source: assumed.source,
        noise,
        unknowns,
        rig,
        targets,
        proposals: proposals
            .into_iter()
            .map(|proposal| offer(proposal, &bench, rig.depth))
            .collect(),
        curves,
    };
    if let Some(file) = &args.picture {
        palpate_sessions::atomic::replace(file, picture::svg(&report).as_bytes()).map_err(
            |err| {
                Failure::failed(format!(
                    "the picture cannot be written: {err}, {}",
                    file.display()
                ))
            },
        )?;
    }
    output.result(&report, || text::text(&report));
    Ok(())
}

/// A wish that no protocol grants was tried and failed; all else is wrong use.
fn failure(err: ExpectedError) -> Failure {
    match err {
        ExpectedError::Unreachable { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

/// `tau=1%`, with or without the sign.
fn targets(within: &[String]) -> Result<Vec<Target>, Failure> {
    let mut targets: Vec<Target> = Vec::new();
    for pair in within {
        let parsed = pair.split_once('=').and_then(|(name, value)| {
            let value = value.trim().trim_end_matches('%').trim_end();
            Some((name.trim(), value.parse::<f64>().ok()?))
        });
        let Some((name, percent)) = parsed else {
            return Err(Failure::usage(format!(
                "--within {pair} is not NAME=PERCENT, as in --within tau=1%"
            )));
        };
        let target = Target::new(name, percent).map_err(Failure::usage)?;
        if targets.iter().any(|one| one.parameter == target.parameter) {
            return Err(Failure::usage(format!(
                "{} is given twice; say once how well it shall be known",
                target.parameter
            )));
        }
        targets.push(target);
    }
    Ok(targets)
}

fn unknowns(known: &[String]) -> Result<Unknowns, Failure> {
    let mut unknowns = Unknowns::default();
    for name in known {
        match name.trim() {
            "f0" => unknowns.f0 = false,
            "f_offset" => unknowns.f_offset = false,
            other => {
                return Err(Failure::usage(format!(
                    "--known {other} is not possible; f0 and f_offset can be known beforehand"
                )));
            }
        }
    }
    Ok(unknowns)
}

fn memory(text: &str) -> Result<Memory, Failure> {
    let parsed = text
        .split_once(',')
        .and_then(|(sd, time)| Some((sd.trim().parse().ok()?, time.trim().parse().ok()?)));
    let Some((sd_mn, secs)) = parsed else {
        return Err(Failure::usage(format!(
            "--memory {text} is not SD_MN,SECONDS, as in --memory 10,0.5"
        )));
    };
    let sd_mn: f64 = sd_mn;
    Ok(Memory {
        sd: Newtons(sd_mn * 1e-3),
        time: Seconds(secs),
    })
}

fn rig_of(args: &PlanArgs, bench: &OpenRig) -> Result<Rig, Failure> {
    let description = bench.rig.description();
    let fastest = description.speed_max;
    let interlock = bench.limits.force_max;
    let rig = Rig {
        speed_quantum: description.speed_quantum,
        speed_max: args.speed_max.map_or(fastest, MmPerS),
        depth: Depth(args.depth),
        force_max: args
            .force_max
            .map_or(Newtons(interlock.0 / STIFFER), Newtons),
        duration_max: Seconds(args.time_max),
        sample_rate_hz: args.rate,
    };
    if rig.speed_max > fastest {
        return Err(Failure::usage(format!(
            "--speed-max {} is more than the {fastest} of rig {}",
            rig.speed_max.0, description.name
        )));
    }
    if rig.force_max > interlock {
        return Err(Failure::usage(format!(
            "--force-max {} is more than the {interlock} at which the interlock stops a run",
            rig.force_max.0
        )));
    }
    Ok(rig)
}

fn assumed(like: Option<&Path>, output: &Output) -> Result<Assumed, Failure> {
    let from_fit = |known: &KnownFit, source: String| {
        known.doubt().iter().for_each(|doubt| output.note(doubt));
        Ok(Assumed {
            body: known.body().map_err(Failure::usage)?,
            noise: Newtons(known.rmse_n),
            source,
        })
    };
    let Some(like) = like else {
        return match last_fit::recall()? {
            Some(known) => {
                let of = known.source.as_deref().unwrap_or("an unnamed record");
                from_fit(&known, format!("the last fit, of {of}"))
            }
            None => Ok(Assumed {
                body: ModifiedKelvin::THESIS,
                noise: NOISE_ASSUMED,
                source: "pig stomach of the source thesis, since no fit is remembered".into(),
            }),
        };
    };
    let source = like.display().to_string();
    if like
        .extension()
        .is_some_and(|extension| extension == "json")
    {
        return from_fit(&last_fit::read(like)?, source);
    }
    let record = source::read(like).map_err(super::source_failure)?;
    record.notes.iter().for_each(|note| output.note(note));
    let report = fit(&record.samples, &FitOptions::default())
        .map_err(|err| Failure::failed(format!("{err}, in {source}")))?;
    last_fit::doubt(&report.parameters)
        .iter()
        .for_each(|doubt| output.note(doubt));
    Ok(Assumed {
        body: report
            .kelvin()
            .ok_or_else(|| Failure::failed("the fit is of another body"))?,
        noise: Newtons(report.rmse_n),
        source,
    })
}

/// The ramp and hold whose sampling rate is drawn: the proposed one, else that of the thesis.
fn drawn(proposals: &[Proposal]) -> (MmPerS, Seconds) {
    let proposed = proposals.iter().find_map(|proposal| match proposal.family {
        Family::RampHold { speed, hold } => Some((speed, hold)),
        _ => None,
    });
    let usual = RampHold::default();
    proposed.unwrap_or((usual.speed, usual.hold))
}

fn offer(proposal: Proposal, bench: &OpenRig, depth: Depth) -> Offer {
    let presses = match proposal.family {
        Family::RampHold { speed, hold } => vec![(speed, hold)],
        Family::TwoSpeeds { speeds, hold, .. } => speeds.map(|speed| (speed, hold)).to_vec(),
        Family::Cycles { .. } => Vec::new(),
    };
    let runs: Option<Vec<(String, Preview)>> = presses
        .into_iter()
        .map(|(speed, hold)| {
            run_of(
                RampHold {
                    speed,
                    depth,
                    hold,
                    ..RampHold::default()
                },
                bench,
            )
        })
        .collect();
    let (commands, previews): (Vec<String>, Vec<Preview>) =
        runs.unwrap_or_default().into_iter().unzip();
    let mut acknowledgements: Vec<String> = previews
        .iter()
        .flat_map(|preview| preview.acknowledgements.clone())
        .collect();
    acknowledgements.dedup();
    let secs = previews.iter().map(|preview| preview.expected.0);
    Offer {
        run_s: (!previews.is_empty()).then(|| secs.sum()),
        commands,
        acknowledgements,
        proposal,
    }
}

/// The command of one press and its preview, unless the rig would refuse it.
fn run_of(params: RampHold, bench: &OpenRig) -> Option<(String, Preview)> {
    let curve = bench.calibration.curve().ok()?;
    let rig = bench.rig.description();
    let preview = preview(&params.plan(), rig, &bench.limits, &curve, false);
    let command = format!(
        "palpate run ramp-hold --speed {} --depth {} --hold {}",
        text::plain(params.speed.0),
        text::plain(params.depth.0),
        text::plain(params.hold.0)
    );
    preview.refusals.is_empty().then_some((command, preview))
}
