//! A question to a person, with an end.

use super::prelude::*;
use super::table;
use crate::engine::{EngineState, PromptAnswer};
use palpate_model::Nanos;
use palpate_model::rig::HandAction;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prompt {
    pub message: String,
    /// How long the run waits for an answer.
    pub timeout: Seconds,
    /// What follows without one.
    #[serde(default)]
    pub on_timeout: OnTimeout,
    /// What is done by hand before the answer: a simulated rig does it then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand: Option<HandAction>,
}

/// What follows where what a step waits for does not come in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnTimeout {
    #[default]
    Stop,
    Continue,
}

impl OnTimeout {
    pub(super) const WORDS: &[&str] = &["stop", "continue"];

    pub(super) fn read(args: &Args) -> Result<Self, String> {
        Ok(match args.text("on_timeout")? {
            "continue" => Self::Continue,
            _ => Self::Stop,
        })
    }
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Ask a person to do something and wait for the answer. After the answer, a simulated rig does the manual work itself.",
    keys: &[
        Key::needed("message", QuantityKind::Text, "what to do, as one sentence"),
        Key::usual("timeout", QuantityKind::Time, "10 min", "longest wait for the answer"),
        Key::usual(
            "on_timeout",
            QuantityKind::Text,
            "stop",
            "what the run does if nobody answers: `stop` or `continue`",
        )
        .one_of(OnTimeout::WORDS),
        Key::optional(
            "cell_mass",
            QuantityKind::Mass,
            "manual work: total mass to put on the load cell, `\"0 g\"` for none",
        )
        .zero_allowed(),
        Key::optional("mount", QuantityKind::Count, "manual work: number of the specimen to mount")
            .zero_allowed(),
        Key::optional(
            "unmount",
            QuantityKind::Flag,
            "manual work: `true` to take the specimen out",
        ),
    ],
    build: Some(read),
    may_touch: false,
    ..StepFacts::of("prompt", Phase::Prompt, PauseBehaviour::Wait)
};

fn read(args: &Args) -> Result<Step, String> {
    let mount = args.has("mount").then(|| args.count("mount")).transpose()?;
    let hand = match (args.maybe("cell_mass"), mount, args.is_true("unmount")) {
        (None, None, false) => None,
        (Some(mass_g), None, false) => Some(HandAction::LoadCell { mass_g }),
        (None, Some(specimen), false) => Some(HandAction::Mount { specimen: specimen.into() }),
        (None, None, true) => Some(HandAction::Unmount),
        _ => {
            let message = "a prompt can ask for one manual task only; give one of 'cell_mass', 'mount' and 'unmount'";
            return Err(message.into());
        }
    };
    Ok(Prompt {
        message: args.text("message")?.to_owned(),
        timeout: args.seconds("timeout")?,
        on_timeout: OnTimeout::read(args)?,
        hand,
    }
    .into())
}

impl StepKind for Prompt {
    fn needs(&self) -> &'static [Need] {
        match self.hand {
            Some(_) => &[Need::Outside],
            None => &[],
        }
    }

    fn pass(&self, known: &mut Preconditions) {
        // Another specimen has its surface elsewhere. Without one there is only the base to find.
        if let Some(hand @ (HandAction::Mount { .. } | HandAction::Unmount)) = self.hand {
            known.contact = false;
            known.is_bare = hand == HandAction::Unmount;
        }
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.timeout);
        if self.message.trim().is_empty() {
            walk.refuse("a prompt has no message; write what the person is to do".into());
        }
        // An operator beside the rig answers within half a minute.
        walk.unknown(self.timeout.0.min(30.0), self.timeout.0)
    }
}

/// A question that waits for its answer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PromptRun {
    plan: Prompt,
    deadline: Nanos,
}

impl Executable for Prompt {
    type Run = PromptRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<PromptRun, String> {
        cx.record(Record::Prompted { message: self.message.clone(), timeout: self.timeout });
        Ok(PromptRun { plan: self.clone(), deadline: cx.now + Nanos::from_seconds(self.timeout) })
    }
}

impl RunningStep for PromptRun {
    /// A pause stops the clock of the timeout, which starts again when the run goes on.
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        let timeout = self.plan.timeout;
        if cx.is_extended() {
            self.deadline = cx.now + Nanos::from_seconds(timeout);
        }
        if cx.now < self.deadline {
            return Ok(Progress::Continue);
        }
        cx.record(Record::Answered { answer: PromptAnswer::TimedOut });
        Ok(match self.plan.on_timeout {
            OnTimeout::Continue => Progress::Done,
            OnTimeout::Stop => {
                Progress::Stop(format!("the prompt was not answered within {timeout:.0}"))
            }
        })
    }

    fn on_event(&mut self, cx: &mut Context<'_>, event: &StepEvent) -> Option<Progress> {
        let StepEvent::Answer(answer) = *event else {
            return None;
        };
        cx.record(Record::Answered { answer });
        if answer != PromptAnswer::Confirmed {
            return Some(Progress::Stop("the operator declined the prompt".into()));
        }
        if matches!(self.plan.hand, Some(HandAction::Mount { .. })) {
            // The contact position was that of another specimen.
            cx.set_contact(None);
        }
        cx.by_hand(self.plan.hand);
        // Who answers goes on.
        cx.end_pause();
        Some(Progress::Done)
    }
}

impl EngineState {
    /// The prompt that waits for an answer, and until when.
    pub fn prompt(&self) -> Option<(&Prompt, Nanos)> {
        match self.active() {
            Some(table::ActiveStep::Prompt(asking)) => Some((&asking.plan, asking.deadline)),
            _ => None,
        }
    }
}
