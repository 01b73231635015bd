//! A library to try palpate with: varied sessions of the simulated rig, recorded as fast as the computer can.

use crate::{AfterStop, PromptResponder, RunRequest, StartedRun, TimeScale, wall_now};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettingError, SimSettings, calibration};
use palpate_model::metadata::{MetadataError, SessionLabels};
use palpate_model::rig::Limits;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::file::{BUILT_IN, check};
use palpate_sessions::{new_session_folder, new_session_id};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The sample library cannot be recorded.
#[derive(Debug, Error)]
pub enum DemonstrationError {
    #[error("the session of {specimen} cannot be recorded ({reason}); choose another folder")]
    Start { specimen: &'static str, reason: String },
    #[error(
        "the session of {specimen} ended early ({reason}); look at what it holds in {}", folder.display()
    )]
    Ended { specimen: &'static str, reason: String, folder: PathBuf },
}

/// A session to record.
#[derive(Clone, Copy, Debug)]
pub struct DemonstrationRun {
    /// Name of a built-in protocol.
    pub protocol: &'static str,
    /// Values of its parameters.
    pub values: &'static [(&'static str, &'static str)],
    pub operator: &'static str,
    pub specimen: &'static str,
    /// Further labels of the session.
    pub about: &'static [(&'static str, &'static str)],
    pub seed: u64,
    pub tissue: DemonstrationTissue,
}

/// What the simulated rig presses on; percent and mm as [`SimSettings`] has them.
#[derive(Clone, Copy, Debug)]
pub struct DemonstrationTissue {
    pub stiffness: &'static str,
    pub softening: &'static str,
    pub preconditioning: &'static str,
    pub thickness: &'static str,
}

type Pairs = &'static [(&'static str, &'static str)];

const USUAL: DemonstrationTissue = DemonstrationTissue {
    stiffness: "100",
    softening: "0",
    preconditioning: "0",
    thickness: "100",
};
const STIFFER: DemonstrationTissue = DemonstrationTissue { stiffness: "112", ..USUAL };
const SOFT: DemonstrationTissue = DemonstrationTissue { stiffness: "40", thickness: "60", ..USUAL };
const SOFTENING: DemonstrationTissue =
    DemonstrationTissue { softening: "20", preconditioning: "3", ..SOFT };

const STOMACH: Pairs = &[("specimen.source", "pig stomach, fundus")];
const LIVER: Pairs = &[("specimen.source", "pig liver"), ("specimen.thickness_mm", "60")];

const STOMACH_RUN: DemonstrationRun = DemonstrationRun {
    protocol: "ramp-hold",
    values: &[],
    operator: "Ada",
    specimen: "stomach 1",
    about: STOMACH,
    seed: 1,
    tissue: USUAL,
};
const LIVER_RUN: DemonstrationRun = DemonstrationRun {
    values: &[("depth", "15 mm")],
    operator: "Grace",
    specimen: "liver 1",
    about: LIVER,
    tissue: SOFT,
    ..STOMACH_RUN
};

/// Two tissues at several speeds and depths, repeats, an unloading, ten cycles, an oscillation and a calibration.
pub const DEMONSTRATION_RUNS: [DemonstrationRun; 12] = [
    DemonstrationRun {
        protocol: "load-cell-calibration",
        specimen: "load cell",
        about: &[],
        ..STOMACH_RUN
    },
    DemonstrationRun { seed: 2, ..STOMACH_RUN },
    DemonstrationRun { seed: 3, values: &[("speed", "1.5 mm/s")], ..STOMACH_RUN },
    DemonstrationRun { seed: 4, specimen: "stomach 2", ..STOMACH_RUN },
    DemonstrationRun {
        seed: 5,
        specimen: "stomach 2",
        values: &[("depth", "20 mm")],
        operator: "Grace",
        ..STOMACH_RUN
    },
    DemonstrationRun { seed: 6, specimen: "stomach 3", tissue: STIFFER, ..STOMACH_RUN },
    DemonstrationRun {
        seed: 7,
        specimen: "stomach 3",
        values: &[("unload", "0.75 mm/s")],
        tissue: STIFFER,
        ..STOMACH_RUN
    },
    DemonstrationRun { seed: 8, ..LIVER_RUN },
    DemonstrationRun { seed: 9, values: &[("depth", "15 mm"), ("speed", "1.5 mm/s")], ..LIVER_RUN },
    DemonstrationRun { seed: 10, specimen: "liver 2", operator: "Ada", ..LIVER_RUN },
    DemonstrationRun {
        protocol: "preconditioning",
        values: &[("depth", "15 mm"), ("rest", "10 s")],
        seed: 11,
        specimen: "liver 3",
        tissue: SOFTENING,
        ..LIVER_RUN
    },
    DemonstrationRun { protocol: "sine", seed: 12, specimen: "stomach 4", ..STOMACH_RUN },
];

impl DemonstrationRun {
    /// Records the session into a new folder of the library and returns that folder.
    pub fn record(&self, library: &Path) -> Result<PathBuf, DemonstrationError> {
        let failed = |reason: String| DemonstrationError::Start { specimen: self.specimen, reason };
        let folder = new_session_folder(library, &new_session_id(wall_now().into()));
        let settings = self.settings().map_err(|err| failed(err.to_string()))?;
        let request = self.request(&settings, folder.clone()).map_err(failed)?;
        let rig = Box::new(SimRig::new(settings));
        let started = StartedRun::start(rig, TimeScale::Max, request);
        let started = started.map_err(|err| failed(err.to_string()))?;
        started.wait_for_start().map_err(|err| failed(err.to_string()))?;
        let reason = match started.wait_for_end(|_| ()) {
            Ok(snapshot) => match snapshot.run.as_ref().and_then(|run| run.outcome.clone()) {
                Some(outcome) if outcome.ending == EndingKind::Finish => return Ok(folder),
                outcome => outcome.map_or(String::new(), |outcome| outcome.reason),
            },
            Err(err) => err.to_string(),
        };
        Err(DemonstrationError::Ended { specimen: self.specimen, reason, folder })
    }

    fn settings(&self) -> Result<SimSettings, SimSettingError> {
        let DemonstrationTissue { stiffness, softening, preconditioning, thickness } = self.tissue;
        Ok(SimSettings {
            seed: self.seed,
            stiffness: stiffness.parse()?,
            softening: softening.parse()?,
            preconditioning: preconditioning.parse()?,
            thickness: thickness.parse()?,
            ..SimSettings::default()
        })
    }

    fn labels(&self) -> Result<SessionLabels, MetadataError> {
        let mut labels = SessionLabels::default();
        let own = [("operator", self.operator), ("specimen", self.specimen)];
        let probe = [("indenter", "blunt 12 mm probe")];
        own.iter()
            .chain(&probe)
            .chain(self.about)
            .try_for_each(|(name, value)| labels.set(name, value))?;
        Ok(labels)
    }

    fn request(&self, settings: &SimSettings, folder: PathBuf) -> Result<RunRequest, String> {
        let rig = SimRig::new(*settings);
        let limits = Limits::for_travel(rig.description().travel);
        let calibration = calibration(settings.profile);
        let curve = calibration.curve().map_err(|err| err.to_string())?;
        let known = BUILT_IN.iter().find(|(name, _)| *name == self.protocol);
        let text = known.map_or("", |(_, text)| text);
        let values = self.values.iter().map(|(name, value)| ((*name).into(), (*value).into()));
        let checked = check(text, &values.collect(), rig.description(), &limits, &curve);
        let first = checked.problems.iter().find(|problem| problem.is_error());
        let (_, written, _) =
            checked.plan.ok_or_else(|| first.map_or(String::new(), ToString::to_string))?;
        Ok(RunRequest {
            plan: written.plan,
            calibration,
            limits,
            out: Some(folder),
            labels: self.labels().map_err(|err| err.to_string())?,
            is_acknowledged: true,
            to_acknowledge: Vec::new(),
            after_stop: AfterStop::Close,
            answers: PromptResponder::Confirm,
            leader: None,
        })
    }
}
