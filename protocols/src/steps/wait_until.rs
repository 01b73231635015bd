//! Wait at rest for something outside the run: a digital input of the rig, or the temperature of the specimen's bath.

use super::OnTimeout;
use super::prelude::*;
use palpate_model::Nanos;
use palpate_model::rig::DIGITAL_INPUTS_MAX;
use std::collections::BTreeMap;
use std::fmt;

/// Wait at rest until a digital input or the bath is as wanted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaitUntil {
    pub condition: WaitCondition,
    /// How long, at most.
    pub timeout: Seconds,
    #[serde(default)]
    pub on_timeout: OnTimeout,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WaitCondition {
    DigitalInput {
        /// Its number, from 1.
        number: u8,
        is_high: bool,
    },
    Bath {
        /// Lower end in °C.
        from_celsius: f64,
        /// Upper end in °C.
        to_celsius: f64,
    },
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Wait at rest until a digital input of the rig has a given level, or the bath has a given temperature.",
    keys: &[
        Key::optional("input", QuantityKind::Count, "number of the digital input, from 1"),
        Key::usual(
            "level",
            QuantityKind::Text,
            "high",
            "level of the input that ends the wait: `high` or `low`",
        )
        .one_of(&["high", "low"]),
        Key::optional(
            "bath_from",
            QuantityKind::Temperature,
            "for the wait to end, the bath must be at or above this temperature; required with `bath_to`",
        ),
        Key::optional(
            "bath_to",
            QuantityKind::Temperature,
            "for the wait to end, the bath must be at or below this temperature",
        ),
        Key::usual("timeout", QuantityKind::Time, "10 min", "longest wait"),
        Key::usual(
            "on_timeout",
            QuantityKind::Text,
            "stop",
            "what follows when the longest wait is over: `stop` or `continue`",
        )
        .one_of(OnTimeout::WORDS),
    ],
    build: Some(read),
    may_touch: false,
    ..StepFacts::of("wait-until", Phase::Rest, PauseBehaviour::Wait)
};

fn read(args: &Args) -> Result<Step, String> {
    let input = args.has("input").then(|| args.count("input")).transpose()?;
    let condition = match (input, args.maybe("bath_from"), args.maybe("bath_to")) {
        (Some(number), None, None) => WaitCondition::DigitalInput {
            number: u8::try_from(number).unwrap_or(u8::MAX),
            is_high: args.text("level")? == "high",
        },
        (None, Some(from_celsius), Some(to_celsius)) => {
            WaitCondition::Bath { from_celsius, to_celsius }
        }
        _ => return Err(
            "a wait needs one condition; give either 'input', or both 'bath_from' and 'bath_to'"
                .into(),
        ),
    };
    condition.check()?;
    Ok(WaitUntil {
        condition,
        timeout: args.seconds("timeout")?,
        on_timeout: OnTimeout::read(args)?,
    }
    .into())
}

impl WaitCondition {
    fn check(&self) -> Result<(), String> {
        match *self {
            Self::DigitalInput { number, .. }
                if !(1..=DIGITAL_INPUTS_MAX).contains(&usize::from(number)) =>
            {
                Err(format!(
                    "digital input {number} does not exist; give 1 to {DIGITAL_INPUTS_MAX}"
                ))
            }
            Self::Bath { from_celsius: from, to_celsius: to }
                if from >= to || from.is_nan() || to.is_nan() =>
            {
                Err(format!(
                    "the range from {from} to {to} °C is empty; give the lower temperature as 'bath_from'"
                ))
            }
            _ => Ok(()),
        }
    }

    fn is_met(&self, cx: &Context<'_>) -> bool {
        let sensors = cx.sensors();
        match *self {
            Self::DigitalInput { number, is_high } => sensors.is_high(number) == Some(is_high),
            Self::Bath { from_celsius, to_celsius } => sensors
                .bath_celsius()
                .is_some_and(|celsius| (from_celsius..=to_celsius).contains(&celsius)),
        }
    }
}

impl fmt::Display for WaitCondition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DigitalInput { number, is_high } => {
                let level = if *is_high { "high" } else { "low" };
                write!(f, "digital input {number} is {level}")
            }
            Self::Bath { from_celsius, to_celsius } => {
                write!(f, "the bath is between {from_celsius} and {to_celsius} °C")
            }
        }
    }
}

impl StepKind for WaitUntil {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.timeout);
        walk.refusals.extend(self.condition.check().err());
        let sensors = &walk.rig.sensors;
        let is_there = match self.condition {
            WaitCondition::DigitalInput { number, .. } => number <= sensors.digital_inputs,
            WaitCondition::Bath { .. } => sensors.has_bath,
        };
        if !is_there {
            walk.refuse(format!(
                "rig {} has no sensor that shows whether {}",
                walk.rig.name, self.condition
            ));
        }
        // The time of the event is unknown; a plan that continues without it takes as long as it may.
        walk.unknown(self.timeout.0, self.timeout.0)
    }
}

impl Executable for WaitUntil {
    type Run = WaitRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<WaitRun, String> {
        Ok(WaitRun {
            plan: *self,
            begun: cx.now,
            deadline: cx.now + Nanos::from_seconds(self.timeout),
        })
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WaitRun {
    plan: WaitUntil,
    begun: Nanos,
    deadline: Nanos,
}

impl RunningStep for WaitRun {
    /// A pause stops the clock of the timeout, which starts again when the run goes on.
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        let WaitUntil { condition, timeout, on_timeout } = self.plan;
        if cx.is_extended() {
            self.deadline = cx.now + Nanos::from_seconds(timeout);
            return Ok(Progress::Continue);
        }
        if condition.is_met(cx) {
            self.report(cx, condition.to_string());
            return Ok(Progress::Done);
        }
        if cx.now < self.deadline {
            return Ok(Progress::Continue);
        }
        let missed = format!("the condition '{condition}' was not met within {timeout:.0}");
        Ok(match on_timeout {
            OnTimeout::Stop => Progress::Stop(missed),
            OnTimeout::Continue => {
                self.report(cx, missed);
                Progress::Done
            }
        })
    }
}

impl WaitRun {
    fn report(&self, cx: &mut Context<'_>, text: String) {
        let waited = cx.now.since(self.begun).seconds();
        let mut values = BTreeMap::from([("waited_s".to_owned(), waited.0)]);
        let bath = cx.sensors().bath_celsius();
        values.extend(bath.map(|celsius| ("bath_celsius".to_owned(), celsius)));
        let text = format!("{text}, after {waited:.1}");
        cx.record(Record::StepReported { text, values });
    }
}
