//! A question to a person, with an end.

use super::context::{Context, Progress};
use super::input::{Answer, Effect, EndingKind, Record};
use super::state::{Active, Activity, Pause};
use super::{pause, step, stop};
use crate::plans::{OnTimeout, Prompt, Step};
use palpate_model::Nanos;
use palpate_model::rig::HandAction;

pub(super) fn begin(cx: &mut Context<'_>, prompt: &Prompt) -> Active {
    cx.record(Record::Prompted {
        message: prompt.message.clone(),
        timeout: prompt.timeout,
    });
    Active::Prompt {
        deadline: cx.now + Nanos::from_seconds(prompt.timeout),
    }
}

/// Time passes without an answer. A pause stops this clock; it begins anew when the run goes on.
pub(super) fn on_time(cx: &mut Context<'_>, deadline: &mut Nanos) -> Progress {
    let Some(Step::Prompt(prompt)) = cx.state.current_step() else {
        return Progress::Continue;
    };
    let (timeout, on_timeout) = (prompt.timeout, prompt.on_timeout);
    if cx.state.pause == Some(Pause::Extended) {
        *deadline = cx.now + Nanos::from_seconds(timeout);
    }
    if cx.now < *deadline {
        return Progress::Continue;
    }
    let answer = Answer::TimedOut;
    cx.record(Record::Answered { answer });
    match on_timeout {
        OnTimeout::Continue => Progress::Done,
        OnTimeout::Stop => Progress::Stop(format!("nobody answered within {timeout:.0}")),
    }
}

/// The operator answered.
pub(super) fn answer(cx: &mut Context<'_>, answer: Answer) {
    if !matches!(cx.state.activity, Activity::Step(Active::Prompt { .. })) {
        let reason = "there is no question to answer".to_owned();
        return cx.record(Record::Refused { reason });
    }
    cx.record(Record::Answered { answer });
    match answer {
        Answer::Confirmed => {
            let hand = match cx.state.current_step() {
                Some(Step::Prompt(prompt)) => prompt.hand,
                _ => None,
            };
            if matches!(hand, Some(HandAction::Mount { .. })) {
                // What was known of the tissue was known of another specimen.
                cx.state.contact = None;
            }
            cx.effects.extend(hand.map(Effect::ByHand));
            // Who answers goes on.
            if cx.state.pause == Some(Pause::Extended) {
                pause::resume(cx);
            }
            step::next(cx);
        }
        _ => stop::begin(
            cx,
            EndingKind::Stop,
            "the operator declined what the plan asked for".into(),
        ),
    }
}
