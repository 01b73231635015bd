//! The daily check: the cell's zero, one known weight, the way home. A rig that failed today touches no
//! tissue unless the operator acknowledges it.

mod trends;

use crate::source::{SourceError, calibration_of, decisions, records};
use palpate_model::calibration::{Calibration, KnownWeight, WeightCheck};
use palpate_model::units::Volts;
use palpate_protocols::engine::{Effect, EndingKind, Record};
use palpate_protocols::file::is_built_in;
use palpate_protocols::plans::{Plan, RampHold, Step};
use palpate_protocols::weight_readings::{WeightReading, WeightReadings};
use palpate_runner::RunView;
use palpate_sessions::checks::{CheckPart, DailyCheck, add_check, last_check_of_day, read_checks};
use palpate_sessions::{ChainError, Session};
use serde::Deserialize;
use std::path::Path;
use std::time::SystemTime;

pub use trends::{CONTROL_CHECKS, PastCheck, control_limits, past_checks, trends};

/// Name of the built-in protocol. A file may have it too: [`is_daily_check`] distinguishes them.
pub const DAILY_CHECK: &str = "daily-check";
/// Protocols that jog between two homings: the check itself, and the one that looks for what it found.
const HOMING_CHECKS: [&str; 2] = [DAILY_CHECK, "check-home"];
/// The empty cell may read so much of the greatest calibrated force: the 1 % that ASTM E4 allows a force.
const ZERO_SHARE: f64 = 0.01;
/// Two homings may differ by so many pulses: the switch closes between two of them.
const HOME_PULSES: i64 = 1;

/// Whether a plan is the built-in daily check, and not a file of its name.
#[must_use]
pub fn is_daily_check(plan: &Plan) -> bool {
    plan.name == DAILY_CHECK && is_built_in_plan(plan)
}

/// The same of a run.
#[must_use]
pub fn is_daily_check_run(run: &RunView) -> bool {
    run.plan_name == DAILY_CHECK && is_built_in(&run.plan_name, run.plan_crc32.as_deref())
}

fn is_built_in_plan(plan: &Plan) -> bool {
    is_built_in(&plan.name, plan.source.as_ref().map(|source| source.crc32.as_str()))
}

fn part(what: &str, found: Result<(bool, String), String>) -> CheckPart {
    let (is_passed, sentence) = found.unwrap_or_else(|missing| (false, missing));
    CheckPart { what: what.into(), is_passed, sentence }
}

fn records_of(decisions: &[(u64, Effect)]) -> Vec<&Record> {
    records(decisions).map(|(_, record)| record).collect()
}

/// Judges a session of the daily check. What was not done has not passed.
pub fn assess_daily_check(session: &Session) -> Result<Vec<CheckPart>, SourceError> {
    let calibration = calibration_of(session)?;
    let decisions = decisions(session)?;
    let records = records_of(&decisions);
    let mut parts = vec![
        part("zero", zero(&calibration, &records)),
        part("weight", weight(&calibration, &records)),
        part("home", home(&records)),
    ];
    let unfinished = match &session.end {
        Some(end) if end.outcome == EndingKind::Finish.name() => None,
        Some(end) => Some(format!("the check did not finish: {}", end.reason)),
        None => Some("the check was interrupted; repeat it".to_owned()),
    };
    parts.extend(unfinished.map(|reason| part("run", Err(reason))));
    Ok(parts)
}

/// A session of the daily check with its judgement.
pub fn judge_daily_check(session: &Session, now: SystemTime) -> Result<DailyCheck, SourceError> {
    let parts = assess_daily_check(session)?;
    let manifest = &session.manifest;
    Ok(DailyCheck {
        at: now.into(),
        rig: manifest.rig.as_ref().map_or_else(String::new, |rig| rig.name.clone()),
        by: manifest.operator.clone(),
        session_id: manifest.session_id.clone(),
        calibration: calibration_of(session)?.name,
        is_passed: parts.iter().all(|part| part.is_passed),
        parts,
    })
}

/// Judges the session in a folder and keeps its result for the day, if it is a daily check that was not stopped. With it
/// comes what must be acknowledged before a run from now on.
pub fn keep_daily_check(
    library: Option<&Path>,
    folder: &Path,
    now: SystemTime,
) -> Result<Option<(DailyCheck, Vec<String>)>, String> {
    let session = Session::open(folder).map_err(|err| err.to_string())?;
    let ending = session.end.as_ref().map(|end| end.outcome.as_str());
    let is_stopped = [EndingKind::Stop.name(), EndingKind::Halt.name()].map(Some).contains(&ending);
    // What has no plan, such as an import, is no check.
    let plan = Plan::deserialize(&session.manifest.plan).ok();
    if is_stopped || !plan.is_some_and(|plan| is_daily_check(&plan)) {
        return Ok(None);
    }
    let library = library.ok_or("there is no library that could keep it")?;
    let check = judge_daily_check(&session, now).map_err(|err| err.to_string())?;
    // Only a simulated rig has settings that reproduce it.
    let rig = session.manifest.rig.as_ref();
    let is_virtual = rig.is_some_and(|rig| !rig.settings.is_empty());
    add_check(library, &check).map_err(|err| err.to_string())?;
    let touching = RampHold::default().plan();
    let gate = DailyCheckGate::of(&touching, Some(library), &check.rig, is_virtual, now);
    let gate = gate.map_err(|err| err.to_string())?;
    Ok(Some((check, gate.to_acknowledge())))
}

/// Mass in g and signal of every reading, in order.
fn readings(records: &[&Record]) -> Vec<(f64, Volts)> {
    let readings = WeightReadings::of(records.iter().copied());
    let pair = |one: &WeightReading| (one.mass_g(), one.volts());
    readings.all().iter().map(pair).collect()
}

/// Deviation of a force and its limit, both in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DailyCheckDeviation {
    /// Measured less expected.
    pub newtons: f64,
    /// Largest magnitude that passes.
    pub limit: f64,
}

/// The signal of the empty cell and how far its force is from zero.
fn zero_of(
    calibration: &Calibration,
    records: &[&Record],
) -> Result<(Volts, DailyCheckDeviation), String> {
    let (_, volts) = readings(records)
        .into_iter()
        .find(|(mass_g, _)| *mass_g == 0.0)
        .ok_or("the check has no reading of the empty load cell; repeat the check")?;
    let curve = calibration.curve().map_err(|err| err.to_string())?;
    let (_, heaviest) = curve.force_range();
    let deviation = DailyCheckDeviation {
        newtons: curve.newtons_from_volts(volts).0,
        limit: ZERO_SHARE * heaviest.0,
    };
    Ok((volts, deviation))
}

fn zero(calibration: &Calibration, records: &[&Record]) -> Result<(bool, String), String> {
    let (volts, DailyCheckDeviation { newtons, limit }) = zero_of(calibration, records)?;
    let is_passed = newtons.abs() <= limit;
    let side = if is_passed { "within" } else { "beyond" };
    let sentence = format!(
        "the empty load cell reads {volts:.4} ({newtons:+.3} N), which is {side} the limit of {limit:.3} N"
    );
    let advice = "remove what touches the probe; if nothing does, calibrate the load cell again";
    Ok(advised(is_passed, sentence, advice))
}

/// Adds advice to the sentence of a part that failed.
fn advised(is_passed: bool, sentence: String, advice: &str) -> (bool, String) {
    (is_passed, if is_passed { sentence } else { format!("{sentence}; {advice}") })
}

fn weight_of(calibration: &Calibration, records: &[&Record]) -> Result<WeightCheck, String> {
    let mut tare = None;
    let known = readings(records).into_iter().find(|(mass_g, volts)| {
        if *mass_g == 0.0 {
            tare = Some(*volts);
        }
        *mass_g > 0.0
    });
    let (Some((mass_g, volts)), Some(tare)) = (known, tare) else {
        return Err("the check has no reading of a known weight; repeat the check".into());
    };
    let refusal = calibration.check_refusal(mass_g);
    if let Some(reason) = refusal.map_err(|err| err.to_string())? {
        return Err(reason);
    }
    calibration
        .check(&KnownWeight { mass_g, tolerance_g: None, volts, tare, limit_percent: None })
        .map_err(|err| err.to_string())
}

fn weight(calibration: &Calibration, records: &[&Record]) -> Result<(bool, String), String> {
    let result = weight_of(calibration, records)?;
    let doubts: Vec<String> = result.doubts.iter().map(|doubt| format!("; {doubt}")).collect();
    Ok((result.is_passed, result.sentence + &doubts.concat()))
}

fn home(records: &[&Record]) -> Result<(bool, String), String> {
    let missed = records.iter().find_map(|record| match record {
        Record::HomeChecked { missed_pulses } => Some(*missed_pulses),
        _ => None,
    });
    let missed = missed.ok_or("the check needs two homings, but the axis did not reach the home switch both times; repeat the check")?;
    let sentence =
        format!("two homings differ by {missed} pulses; the limit is {HOME_PULSES} pulses");
    let advice = "check the home switch, its cable and whether the slider moves freely";
    Ok(advised(missed.abs() <= HOME_PULSES, sentence, advice))
}

/// Effect of the daily check on a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DailyCheckGate {
    Open,
    Note(String),
    /// The operator must acknowledge it, which is recorded.
    Acknowledge(String),
}

/// Whether a plan may touch something, so that the rig's daily check has a say in it.
#[must_use]
pub fn needs_daily_check(plan: &Plan) -> bool {
    let may_jog = HOMING_CHECKS.contains(&plan.name.as_str()) && is_built_in_plan(plan);
    let is_touching = |step: &Step| step.may_touch() && !(may_jog && matches!(step, Step::Jog(_)));
    plan.steps.iter().any(|planned| is_touching(&planned.step))
}

/// In every sentence of the gate, and in no other.
const OF_TODAY: &str = "daily check today";

impl DailyCheckGate {
    /// Whether it said a sentence that is to be acknowledged.
    #[must_use]
    pub fn has_said(sentence: &str) -> bool {
        sentence.contains(OF_TODAY)
    }

    /// The gate before the run of a plan on a rig. Plans that cannot touch tissue, such as a calibration or
    /// the check itself, are always open. Without a library nothing was ever checked.
    pub fn of(
        plan: &Plan,
        library: Option<&Path>,
        rig: &str,
        is_virtual: bool,
        now: SystemTime,
    ) -> Result<Self, ChainError> {
        if !needs_daily_check(plan) {
            return Ok(Self::Open);
        }
        let checks = library.map_or(Ok(Vec::new()), |library| read_checks(library, rig))?;
        let none = format!("rig {rig} had no {OF_TODAY}");
        Ok(match last_check_of_day(&checks, now.into()) {
            Some(check) if check.is_passed => Self::Open,
            Some(check) => Self::Acknowledge(format!(
                "rig {rig} failed its {OF_TODAY} ({}); repair the rig and repeat '{DAILY_CHECK_COMMAND}'",
                check.failures()
            )),
            None if is_virtual => {
                Self::Note(format!("{none}; '{DAILY_CHECK_COMMAND}' runs the check"))
            }
            None => Self::Acknowledge(format!("{none}; run '{DAILY_CHECK_COMMAND}' first")),
        })
    }

    pub fn to_acknowledge(&self) -> Vec<String> {
        match self {
            Self::Acknowledge(sentence) => vec![sentence.clone()],
            Self::Open | Self::Note(_) => Vec::new(),
        }
    }
}

pub const DAILY_CHECK_COMMAND: &str = "palpate daily-check";

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_protocols::file::Protocol;

    fn weighed(mass_g: f64, volts: f64) -> Record {
        Record::Weighed {
            mass_g,
            is_loading: true,
            repeat: 1,
            volts: Volts(volts),
            noise: Volts(0.001),
            slope_v_per_s: 0.0,
            samples: 1000,
            waited: palpate_model::units::Seconds(1.0),
        }
    }

    #[test]
    fn each_part_passes_up_to_its_limit_and_no_further() {
        let calibration = Calibration::thesis();
        let curve = calibration.curve().unwrap();
        let volts =
            |newtons: f64| curve.volts_from_newtons(palpate_model::units::Newtons(newtons)).0;
        let heaviest = curve.force_range().1.0;
        // 0 g lies at the first point, 800 g between 740 g and 840 g.
        let weight_n = 0.8 * 9.80665;
        for (zero_n, error, missed, expected) in [
            (0.0, 0.0, 0, [true, true, true]),
            (0.0099 * heaviest, 0.0, 1, [true, true, true]),
            (0.0101 * heaviest, 0.0, -1, [false, true, true]),
            (-0.0101 * heaviest, 0.0, 2, [false, true, false]),
            (0.0, 0.0098, 0, [true, true, true]),
            (0.0, -0.0102, -2, [true, false, false]),
        ] {
            let zero_volts = volts(zero_n);
            let shift = zero_volts - volts(0.0);
            let records = [
                weighed(0.0, zero_volts),
                weighed(800.0, volts(weight_n * (1.0 + error)) + shift),
                Record::HomeChecked { missed_pulses: missed },
            ];
            let records: Vec<&Record> = records.iter().collect();
            let (_, off) = zero_of(&calibration, &records).unwrap();
            assert!((off.newtons - zero_n).abs() < 1e-9);
            assert!((off.limit - 0.01 * heaviest).abs() < 1e-12, "{off:?}");
            let read = weight_of(&calibration, &records).unwrap();
            assert!((read.error_n - error * weight_n).abs() < 1e-9, "{read:?}");
            let parts = [
                zero(&calibration, &records).unwrap(),
                weight(&calibration, &records).unwrap(),
                home(&records).unwrap(),
            ];
            assert_eq!(parts.clone().map(|(passed, _)| passed), expected, "{parts:?}");
        }
        assert!(zero(&calibration, &[]).is_err());
        assert!(weight(&calibration, &[&weighed(200.0, 1.7)]).is_err());
        // On the flat stretch even a right reading tells nothing.
        let right = weighed(500.0, volts(0.5 * 9.80665));
        let refusal = weight(&calibration, &[&weighed(0.0, volts(0.0)), &right]).unwrap_err();
        assert!(refusal.contains("500 g with a standard uncertainty of 0.508 N"), "{refusal}");
        assert!(home(&[]).is_err());
    }

    #[test]
    fn the_usual_weight_is_one_that_the_thesis_s_cell_knows_without_a_doubt() {
        let protocol = palpate_protocols::file::built_in(DAILY_CHECK).unwrap().unwrap();
        let plan = protocol.plan(&std::collections::BTreeMap::new()).unwrap();
        let masses = plan.steps.iter().filter_map(|one| match &one.step {
            Step::Weigh(weigh) if weigh.mass_g > 0.0 => Some(weigh.mass_g),
            _ => None,
        });
        let calibration = Calibration::thesis();
        let curve = calibration.curve().unwrap();
        let mut results = Vec::new();
        for mass_g in masses {
            let weight = palpate_model::units::Newtons(mass_g * 9.80665e-3);
            let records = [
                weighed(0.0, curve.volts_from_newtons(palpate_model::units::Newtons(0.0)).0),
                weighed(mass_g, curve.volts_from_newtons(weight).0),
            ];
            let records: Vec<&Record> = records.iter().collect();
            results.push(super::weight(&calibration, &records).unwrap());
        }
        let [(true, sentence)] = &results[..] else {
            panic!("one known weight that reads right: {results:?}");
        };
        assert!(sentence.ends_with("within the limit of 1 %"), "{sentence}");
    }

    #[test]
    fn a_failed_check_closes_the_gate_until_one_passes() {
        let library = tempfile::tempdir().unwrap();
        let at = Some(library.path());
        let now = palpate_runner::wall_now();
        let plan = RampHold::default().plan();
        let gate = |is_virtual| DailyCheckGate::of(&plan, at, "bench", is_virtual, now).unwrap();
        assert!(matches!(gate(true), DailyCheckGate::Note(_)));
        assert!(matches!(gate(false), DailyCheckGate::Acknowledge(_)));
        let mut check = DailyCheck {
            at: now.into(),
            rig: "bench".into(),
            by: "Ada".into(),
            session_id: "id".into(),
            calibration: "cell".into(),
            is_passed: false,
            parts: vec![part("home", Ok((false, "two homings differ".into())))],
        };
        add_check(library.path(), &check).unwrap();
        let DailyCheckGate::Acknowledge(why) = gate(true) else {
            panic!("a failed check is to be acknowledged");
        };
        assert!(why.contains("two homings differ") && why.contains("palpate daily-check"), "{why}");
        // The remedy itself is never refused.
        let calibration = Plan::of("load-cell-calibration", 1, Vec::new());
        assert_eq!(
            DailyCheckGate::of(&calibration, at, "bench", false, now).unwrap(),
            DailyCheckGate::Open
        );
        // Of the built-in protocols, those that cannot touch stay open.
        let built_in = |name: &str, values: &[(&str, &str)]| {
            let protocol = palpate_protocols::file::built_in(name).unwrap().unwrap();
            let own = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
            protocol.plan(&values.iter().map(own).collect()).unwrap()
        };
        let is_open = |plan: &Plan| {
            let gate = DailyCheckGate::of(plan, at, "bench", false, now).unwrap();
            gate == DailyCheckGate::Open
        };
        let names = palpate_protocols::file::BUILT_IN.iter().map(|(name, _)| *name);
        let open: Vec<&str> = names.filter(|name| is_open(&built_in(name, &[]))).collect();
        assert_eq!(open, ["daily-check", "load-cell-calibration", "check-home"]);
        assert!(is_open(&built_in("free-jog", &[("distance", "-5 mm")])));
        // Nor does the name of the check open what it does not do, nor what another file of that name does.
        let plan = Plan { name: DAILY_CHECK.into(), ..RampHold::default().plan() };
        assert!(!is_open(&plan));
        assert!(is_daily_check(&built_in(DAILY_CHECK, &[])));
        let (_, text) = palpate_protocols::file::BUILT_IN
            .iter()
            .find(|(name, _)| *name == DAILY_CHECK)
            .unwrap();
        let own = Protocol::read(&text.replace("20 mm", "90 mm").replace("max = \"30 mm\", ", ""));
        let own = own.unwrap().plan(&std::collections::BTreeMap::new()).unwrap();
        assert_eq!(own.name, DAILY_CHECK);
        assert!(!is_daily_check(&own) && !is_open(&own));
        check.is_passed = true;
        add_check(library.path(), &check).unwrap();
        assert_eq!(gate(false), DailyCheckGate::Open);
    }
}
