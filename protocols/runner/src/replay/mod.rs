//! Replay: the recorded inputs of a session drive the same engine again.
//!
//! Decisions (commands, records, endings) must be equal where the engine version is; derived
//! numbers must agree within a stated tolerance whatever the version.

use crate::{LiveFeed, to_json};
use palpate_model::Nanos;
use palpate_model::estimate::{Identifiability, LiveEstimate};
use palpate_protocols::engine::{self, ENGINE_VERSION, Effect, EngineInput, EngineState};
use palpate_sessions::log::Session;
use palpate_sessions::record::{EntryKind, LogEntry, SampleRow};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

mod player;
mod source;
mod wording;

pub use player::Player;
use source::{RecordedInput, read_config, read_inputs, read_sample};

/// Force and depth come from the same arithmetic on the same raw numbers; `exp` and friends may
/// differ in the last digits between platforms, which depth (under 200 mm) and force (under 50 N)
/// turn into less than this, in mm and N.
pub const TOLERANCE_DERIVED: f64 = 1e-9;

/// Residuals of the live fit; relative. Its Gram matrices keep about eight digits.
pub const TOLERANCE_LIVE_RMSE: f64 = 1e-6;

/// Parameters of the live fit, in standard errors: too little to see on the display. A
/// parameter that is not identified has no value to agree on.
pub const TOLERANCE_LIVE_SIGMAS: f64 = 0.01;

/// Both for answers recorded before there were verdicts, which came from a coarser interpolation
/// between relaxation times: in the recorded session of the lab profile the residual is off by up
/// to 2e-4 and tau by 0.14 standard errors.
pub const TOLERANCE_LIVE_OLD: (f64, f64) = (1e-3, 0.5);

/// Standard errors of the live fit; relative. They are curvatures of the residual sum, which keep
/// about four digits less than the sum itself.
pub const TOLERANCE_LIVE_ERROR: f64 = 1e-4;

#[derive(Debug, Error)]
pub enum ReplayError {
    /// No rig recorded it, so no engine decided anything.
    #[error(
        "the session was imported from {file} and has no decisions to replay; its numbers can be checked against the original kept beside it"
    )]
    Imported { file: String },
    /// The manifest's plan or calibration is not what this version knows.
    #[error(
        "the session's {what} cannot be understood ({detail}); use the version of palpate that wrote the session"
    )]
    Manifest {
        what: &'static str,
        /// The parser's words.
        detail: String,
    },
    /// A recorded input is not what this version knows.
    #[error(
        "input {order} of the session cannot be understood ({detail}); use the version of palpate that wrote the session"
    )]
    Input {
        order: u64,
        /// The parser's words.
        detail: String,
    },
}

/// The first place where recorded and recomputed differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayDifference {
    pub at_s: f64,
    /// Samples before it.
    pub after_sample: u64,
    /// What differs: `decision`, `force_N`, `depth_mm`, `phase` or `live fit`.
    pub what: String,
    pub decision: Option<usize>,
    /// What the protocol was doing, in its words, such as `step 6 of 8, ramp, cycle 2`.
    pub step: String,
    pub recorded: Value,
    pub now: Value,
}

impl ReplayDifference {
    pub fn recorded_words(&self) -> String {
        wording::describe_value(&self.recorded)
    }

    pub fn now_words(&self) -> String {
        wording::describe_value(&self.now)
    }
}

/// A decision that is allowed to differ, for a reviewed reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blessing {
    pub decision: usize,
    pub now: Value,
    pub reason: String,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayReport {
    pub samples: u64,
    pub decisions: usize,
    /// Whether decisions were compared: the engine version is the recorded one.
    pub is_same_engine: bool,
    pub blessed: usize,
    /// Largest difference of a derived force, in N.
    pub force_difference_n: f64,
    /// Largest difference of a derived depth, in mm.
    pub depth_difference_mm: f64,
    pub first_difference: Option<ReplayDifference>,
}

/// The blessings of a session, from `blessed.json` in its folder; none if there is no such file.
pub fn blessings_of(folder: &Path) -> Result<Vec<Blessing>, String> {
    let folder = if folder.is_file() { folder.parent().unwrap_or(folder) } else { folder };
    let path = folder.join("blessed.json");
    let Some(text) = palpate_sessions::text::read_if_present(&path).map_err(|err| {
        format!(
            "the list of allowed differences cannot be read ({err}); check the file {}",
            path.display()
        )
    })?
    else {
        return Ok(Vec::new());
    };
    let blessings: Vec<Blessing> = serde_json::from_str(&text).map_err(|err| {
        format!(
            "the list of allowed differences cannot be understood ({err}); correct the file {}",
            path.display()
        )
    })?;
    match blessings.iter().find(|blessing| blessing.reason.trim().is_empty()) {
        Some(blessing) => Err(format!(
            "the difference of decision {} is allowed without a reason; write the reason into {}",
            blessing.decision,
            path.display()
        )),
        None => Ok(blessings),
    }
}

pub fn replay(session: &Session, blessings: &[Blessing]) -> Result<ReplayReport, ReplayError> {
    let config = Arc::new(read_config(session)?);
    let mut inputs = read_inputs(session)?;
    let mut run = Replay {
        live: LiveFeed::new(&config),
        state: Some(EngineState::new(config)),
        recorded: session
            .entries
            .iter()
            .filter(|entry| entry.kind == EntryKind::Decision)
            .collect(),
        is_finished: session.end.is_some(),
        expected_live: VecDeque::new(),
        blessings,
        report: ReplayReport {
            samples: session.rows.len() as u64,
            decisions: 0,
            is_same_engine: session.manifest.engine_version == ENGINE_VERSION,
            blessed: 0,
            force_difference_n: 0.0,
            depth_difference_mm: 0.0,
            first_difference: None,
        },
    };
    for (i, row) in session.rows.iter().enumerate() {
        run.feed_inputs(&mut inputs, i as u64);
        run.feed_row(i as u64, row);
    }
    run.feed_inputs(&mut inputs, u64::MAX);
    run.finish();
    Ok(run.report)
}

struct Replay<'a> {
    state: Option<EngineState>,
    live: LiveFeed,
    recorded: Vec<&'a LogEntry>,
    is_finished: bool,
    expected_live: VecDeque<LiveEstimate>,
    blessings: &'a [Blessing],
    report: ReplayReport,
}

impl Replay<'_> {
    /// Feeds the inputs that came before sample `index`.
    fn feed_inputs(&mut self, inputs: &mut VecDeque<RecordedInput>, index: u64) {
        while let Some(next) = inputs.pop_front_if(|next| next.after_sample <= index) {
            if let EngineInput::LiveFit(estimate) = &next.input {
                // Before there were verdicts, an answer waited until all parameters were known.
                while estimate.verdicts.is_empty()
                    && self
                        .expected_live
                        .front()
                        .is_some_and(|again| again.samples < estimate.samples)
                {
                    self.expected_live.pop_front();
                }
                let recomputed = self.expected_live.pop_front();
                if !recomputed.as_ref().is_some_and(|again| is_same_fit(estimate, again)) {
                    let (recorded, now) = (to_json(estimate), to_json(&recomputed));
                    self.differ(next.now, index, "live fit", None, recorded, now);
                }
            }
            self.step(next.now, next.after_sample, next.input);
        }
    }

    fn feed_row(&mut self, index: u64, row: &SampleRow) {
        let Some(reading) = read_sample(row) else {
            return;
        };
        self.step(row.host, index + 1, EngineInput::Reading(reading));
        let Some(state) = &self.state else { return };
        let derived = *state.derived();
        let (phase, cycle) = (state.phase(), state.cycle());
        if let Some(estimate) = self.live.push(&reading, state) {
            self.expected_live.push_back(estimate);
        }
        let (report, mut differences) = (&mut self.report, Vec::new());
        for (what, recorded, now, largest) in [
            ("force_N", row.force, derived.force.map(|it| it.0), &mut report.force_difference_n),
            ("depth_mm", row.depth, derived.depth.map(|it| it.0), &mut report.depth_difference_mm),
        ] {
            let difference = recorded.zip(now).map(|(recorded, now)| (recorded - now).abs());
            *largest = largest.max(difference.unwrap_or(0.0));
            let is_same = difference.map_or(recorded == now, |it| it <= TOLERANCE_DERIVED);
            differences.extend((!is_same).then(|| (what, to_json(&recorded), to_json(&now))));
        }
        for (what, recorded, now) in differences {
            self.differ(row.host, index, what, None, recorded, now);
        }
        // Labels follow decisions: they are the engine's, not arithmetic.
        if self.report.is_same_engine
            && self.report.blessed == 0
            && (row.phase, row.cycle) != (phase, cycle)
        {
            self.differ(row.host, index, "phase", None, to_json(&row.phase), to_json(&phase));
        }
    }

    fn step(&mut self, now: Nanos, after_sample: u64, input: EngineInput) {
        let Some(state) = self.state.take() else {
            return;
        };
        let (state, effects) = engine::step(state, now, input);
        self.state = Some(state);
        for effect in effects {
            self.compare(now, after_sample, &effect);
        }
    }

    fn compare(&mut self, now: Nanos, after_sample: u64, effect: &Effect) {
        let index = self.report.decisions;
        self.report.decisions += 1;
        if !self.report.is_same_engine {
            return;
        }
        let decided = to_json(effect);
        let recorded = match self.recorded.get(index) {
            Some(entry) if entry.now == now && agree(&entry.body, &decided, TOLERANCE_DERIVED) => {
                return;
            }
            Some(entry) => entry.body.clone(),
            // The recording broke off before this decision.
            None if !self.is_finished => return,
            None => Value::Null,
        };
        let is_blessed = self.blessings.iter().any(|blessing| {
            blessing.decision == index && agree(&blessing.now, &decided, TOLERANCE_DERIVED)
        });
        if is_blessed {
            self.report.blessed += 1;
        } else {
            self.differ(now, after_sample, "decision", Some(index), recorded, decided);
        }
    }

    fn finish(&mut self) {
        let decided = self.report.decisions;
        if let (true, Some(entry)) = (self.report.is_same_engine, self.recorded.get(decided)) {
            let (now, after_sample, body) = (entry.now, entry.after_sample, entry.body.clone());
            self.differ(now, after_sample, "decision", Some(decided), body, Value::Null);
        }
    }

    fn differ(
        &mut self,
        at: Nanos,
        after_sample: u64,
        what: &str,
        decision: Option<usize>,
        recorded: Value,
        now: Value,
    ) {
        let step = self.state.as_ref().map_or(String::new(), wording::describe_step);
        self.report.first_difference.get_or_insert(ReplayDifference {
            step,
            at_s: at.seconds().0,
            after_sample,
            what: what.into(),
            decision,
            recorded,
            now,
        });
    }
}

fn is_same_fit(a: &LiveEstimate, b: &LiveEstimate) -> bool {
    let has_verdicts = !a.verdicts.is_empty();
    let (rmse, sigmas) = if has_verdicts {
        (TOLERANCE_LIVE_RMSE, TOLERANCE_LIVE_SIGMAS)
    } else {
        TOLERANCE_LIVE_OLD
    };
    let is_same_rmse =
        (a.rmse_weighted_n - b.rmse_weighted_n).abs() <= rmse * a.rmse_weighted_n.abs();
    let mut pairs = a.parameters.iter().zip(&b.parameters);
    a.samples == b.samples
        && is_same_rmse
        && (!has_verdicts || is_same_identifiability(&a.verdicts, &b.verdicts))
        && pairs.all(|(a, b)| match (a.std_error, b.std_error) {
            (Some(error), Some(again)) => {
                a.name == b.name
                    && (a.value - b.value).abs() <= sigmas * error
                    && (!has_verdicts || (error - again).abs() <= TOLERANCE_LIVE_ERROR * error)
            }
            _ => a.name == b.name,
        })
}

/// Which parameters are identified, and for which a reason is given. Its words may improve: they decide nothing.
fn is_same_identifiability(a: &[Identifiability], b: &[Identifiability]) -> bool {
    let facts =
        |one: &Identifiability| (one.parameter.clone(), one.is_identified, one.reason.is_some());
    a.iter().map(facts).eq(b.iter().map(facts))
}

/// Whether two JSON values are equal, numbers within a relative (above 1) or absolute tolerance. Sentences agree whatever
/// their words, which may improve: what was decided stands beside them in words without spaces and in numbers.
fn agree(a: &Value, b: &Value, tolerance: f64) -> bool {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => match (x.as_f64(), y.as_f64()) {
            _ if x == y => true,
            (Some(x), Some(y)) => (x - y).abs() <= tolerance * x.abs().max(y.abs()).max(1.0),
            _ => false,
        },
        (Value::Array(x), Value::Array(y)) => {
            x.len() == y.len() && x.iter().zip(y).all(|(x, y)| agree(x, y, tolerance))
        }
        (Value::Object(x), Value::Object(y)) => {
            x.len() == y.len()
                && x.iter().all(|(key, x)| y.get(key).is_some_and(|y| agree(x, y, tolerance)))
        }
        (Value::String(x), Value::String(y)) => x == y || (is_sentence(x) && is_sentence(y)),
        _ => a == b,
    }
}

fn is_sentence(text: &str) -> bool {
    text.contains(' ')
}

#[cfg(test)]
mod tests {
    use super::agree;
    use serde_json::json;

    #[test]
    fn numbers_agree_within_tolerance_words_exactly_and_sentences_whatever_they_say() {
        let check = |a, b| agree(&a, &b, 1e-9);
        assert!(check(json!({"x": 6.4, "n": [1, 2]}), json!({"x": 6.4 + 1e-12, "n": [1, 2]})));
        assert!(!check(json!({"x": 6.4}), json!({"x": 6.4 + 1e-6})));
        assert!(!check(json!({"x": 1}), json!({"y": 1})));
        assert!(!check(json!("stop"), json!("halt")));
        let trip = |interlock, reason| json!({"interlock": interlock, "reason": reason});
        assert!(check(trip("force", "the force is high"), trip("force", "too much force")));
        assert!(!check(trip("force", "the force is high"), trip("travel", "the force is high")));
        assert!(!check(json!({"reason": "stop"}), json!({"reason": "the operator stops"})));
    }
}
