//! The shortest protocol that determines given parameters to given precision, for a body like a known one.

use crate::fit::{KnownFit, KnownFitError, is_poorly_identified};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::plans::RampHold;
use palpate_protocols::preview::{Preview, preview};
use palpate_rheology::expected::{
    CorrelatedNoise, DesignLimits, ExpectedError, FreeOffsets, Measurement, MeasurementNoise,
    PrecisionCurves, PrecisionTarget, ProtocolFamily, ProtocolProposal, compute_precision_curves,
    find_shortest_protocols,
};
use palpate_rheology::fit::ExpectedSignal;
use serde::Serialize;
use std::path::Path;
use thiserror::Error;

/// How much stiffer than the assumed body a specimen may be, as in the preview of a run, before the
/// interlock stops it.
const STIFFER: f64 = 1.35;
/// The white noise of the simulated rig's straight cell, in N.
const NOISE_ASSUMED: Newtons = Newtons(0.02);

#[derive(Clone, Copy, Debug)]
pub struct PlanningRig<'a> {
    pub rig: &'a RigDescription,
    pub limits: &'a Limits,
    /// Volts to newtons of its load cell.
    pub curve: &'a CalibrationCurve,
}

/// The precision to reach, and the limits of the rig.
pub struct PlanRequest<'a> {
    pub targets: Vec<PrecisionTarget>,
    /// Offsets that are fitted as well.
    pub unknowns: FreeOffsets,
    /// Noise that is independent from sample to sample; without it that of the fit.
    pub white: Option<Newtons>,
    pub memory: Option<CorrelatedNoise>,
    pub sample_rate_hz: f64,
    pub depth: Depth,
    /// Highest force; without it what leaves a specimen a third stiffer below the interlock.
    pub force_max: Option<Newtons>,
    /// Fastest speed; without it the rig's.
    pub speed_max: Option<MmPerS>,
    pub duration_max: Seconds,
    /// The command for one press, in the words of the front end.
    pub command: &'a dyn Fn(&RampHold) -> String,
}

#[derive(Debug, Error)]
pub enum PlanFailure {
    #[error("a speed of {} mm/s is above {most}, the maximum of rig {rig}; choose a lower speed", wanted.0)]
    TooFast { wanted: MmPerS, most: MmPerS, rig: String },
    #[error("a force of {} N is above {most}, the force at which the interlock stops a run; choose a lower force", wanted.0)]
    TooStrong { wanted: Newtons, most: Newtons },
    #[error(transparent)]
    Expected(#[from] ExpectedError),
}

/// Body and noise that a plan assumes.
#[derive(Clone, Debug)]
pub struct PlanAssumptions {
    pub body: ModifiedKelvin,
    pub noise: Newtons,
    /// What the load cell of the run with that fit reported; `None` where it was no session.
    pub signal: Option<ExpectedSignal>,
    /// Origin of body and noise, in words.
    pub source: String,
    /// Whether the relaxation time is too uncertain for a plan.
    pub is_hardly_known: bool,
    pub notes: Vec<String>,
}

/// The assumptions of a plan: a recording or a fit; without one the last fit, else the source thesis.
pub fn plan_assumptions(like: Option<&Path>) -> Result<PlanAssumptions, KnownFitError> {
    let (known, source, notes) = if let Some(like) = like {
        let (known, notes) = KnownFit::of(like, None)?;
        (known, like.display().to_string(), notes)
    } else if let Some(known) = KnownFit::last()? {
        let known = known.with_signal();
        let of = known.source.as_deref().unwrap_or("an unnamed record");
        let source = format!("the last fit, of {of}");
        (known, source, Vec::new())
    } else {
        return Ok(PlanAssumptions {
            body: ModifiedKelvin::THESIS,
            noise: NOISE_ASSUMED,
            signal: None,
            source: "the pig stomach of the source thesis, because no fit is remembered yet".into(),
            is_hardly_known: false,
            notes: Vec::new(),
        });
    };
    Ok(PlanAssumptions {
        body: known.body()?,
        noise: Newtons(known.rmse_n),
        signal: known.signal.clone(),
        is_hardly_known: is_poorly_identified(&known.parameters),
        source,
        notes,
    })
}

/// A plan: its assumptions, the proposals, and the precision of other protocols.
#[derive(Clone, Debug, Serialize)]
pub struct PlanReport {
    pub body: ModifiedKelvin,
    pub body_source: String,
    /// What the load cell reports, where that is known; noise of the force and unknowns then do not count.
    pub signal: Option<PlannedSignal>,
    pub noise: MeasurementNoise,
    pub unknowns: FreeOffsets,
    pub rig: DesignLimits,
    pub targets: Vec<PrecisionTarget>,
    pub proposals: Vec<PlanOffer>,
    /// Intervals against hold, cycles and sampling rate.
    pub curves: PrecisionCurves,
}

/// What the load cell is expected to report.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlannedSignal {
    /// Noise of one sample in V.
    pub noise_v: f64,
    /// Random walk of the zero in V over one second.
    pub walk_v: f64,
    /// Standard uncertainty of the contact position.
    pub contact_error_mm: f64,
}

/// A proposal with the commands that run it.
#[derive(Clone, Debug, Serialize)]
pub struct PlanOffer {
    #[serde(flatten)]
    pub proposal: ProtocolProposal,
    /// One for every press; empty where no plan exists.
    pub commands: Vec<String>,
    pub acknowledgements: Vec<String>,
    /// With homing, finding contact and leaving the tissue, in s; none where no plan exists.
    pub run_s: Option<f64>,
}

pub fn plan(
    request: PlanRequest<'_>,
    assumed: PlanAssumptions,
    bench: PlanningRig<'_>,
) -> Result<PlanReport, PlanFailure> {
    let rig = request.rig(bench)?;
    let noise =
        MeasurementNoise { white: request.white.unwrap_or(assumed.noise), memory: request.memory };
    let (body, unknowns) = (assumed.body, request.unknowns);
    // Whoever states a noise or what is known plans with that.
    let is_stated =
        request.white.is_some() || request.memory.is_some() || unknowns != FreeOffsets::default();
    let signal = assumed.signal.as_ref().filter(|_| !is_stated);
    let measurement = match signal {
        Some(signal) => Measurement::Signal(signal),
        None => Measurement::Forces { noise, unknowns },
    };
    let proposals = find_shortest_protocols(&body, measurement, &request.targets, &rig)?;
    let curves = compute_precision_curves(&body, measurement, &rig, drawn(&proposals))?;
    let offers = proposals.into_iter();
    let offers = offers.map(|proposal| offer(proposal, bench, rig.depth, request.command));
    Ok(PlanReport {
        proposals: offers.collect(),
        body,
        signal: signal.map(|signal| PlannedSignal {
            noise_v: signal.noise().0,
            walk_v: signal.walk(),
            contact_error_mm: signal.contact_error_mm(),
        }),
        body_source: assumed.source,
        noise,
        unknowns,
        rig,
        targets: request.targets,
        curves,
    })
}

impl PlanRequest<'_> {
    fn rig(&self, bench: PlanningRig<'_>) -> Result<DesignLimits, PlanFailure> {
        let (fastest, interlock) = (bench.rig.speed_max, bench.limits.force_max);
        let third = Newtons(interlock.0 / STIFFER);
        let rig = DesignLimits {
            speed_quantum: bench.rig.speed_quantum,
            speed_max: self.speed_max.unwrap_or(fastest),
            depth: self.depth,
            force_max: self.force_max.unwrap_or(third),
            duration_max: self.duration_max,
            sample_rate_hz: self.sample_rate_hz,
        };
        if rig.speed_max > fastest {
            return Err(PlanFailure::TooFast {
                wanted: rig.speed_max,
                most: fastest,
                rig: bench.rig.name.clone(),
            });
        }
        if rig.force_max > interlock {
            return Err(PlanFailure::TooStrong { wanted: rig.force_max, most: interlock });
        }
        Ok(rig)
    }
}

/// The ramp and hold whose sampling rate is drawn: the proposed one, else that of the thesis.
fn drawn(proposals: &[ProtocolProposal]) -> (MmPerS, Seconds) {
    let proposed = proposals.iter().find_map(|proposal| match proposal.family {
        ProtocolFamily::RampHold { speed, hold } => Some((speed, hold)),
        _ => None,
    });
    let usual = RampHold::default();
    proposed.unwrap_or((usual.speed, usual.hold))
}

fn offer(
    proposal: ProtocolProposal,
    bench: PlanningRig<'_>,
    depth: Depth,
    command: &dyn Fn(&RampHold) -> String,
) -> PlanOffer {
    let presses = match proposal.family {
        ProtocolFamily::RampHold { speed, hold } => vec![(speed, hold)],
        ProtocolFamily::TwoSpeeds { speeds, hold, .. } => {
            speeds.map(|speed| (speed, hold)).to_vec()
        }
        ProtocolFamily::Cycles { .. } => Vec::new(),
    };
    // A proposal of which the rig refuses one press cannot be run.
    let run = |(speed, hold)| {
        let press = RampHold { speed, depth, hold, ..RampHold::default() };
        let preview = preview(&press.plan(), bench.rig, bench.limits, bench.curve, false);
        preview.refusals.is_empty().then(|| (command(&press), preview))
    };
    let runs: Option<Vec<(String, Preview)>> = presses.into_iter().map(run).collect();
    let (commands, previews): (Vec<String>, Vec<Preview>) =
        runs.unwrap_or_default().into_iter().unzip();
    let all = previews.iter().flat_map(|one| one.acknowledgements.clone());
    let mut acknowledgements: Vec<String> = all.collect();
    acknowledgements.dedup();
    let secs = previews.iter().map(|preview| preview.expected.0);
    PlanOffer {
        run_s: (!previews.is_empty()).then(|| secs.sum()),
        commands,
        acknowledgements,
        proposal,
    }
}
