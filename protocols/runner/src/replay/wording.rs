//! Decisions and numbers of a replay in words.

use palpate_model::rig::{HandAction, RigCommand};
use palpate_protocols::engine::{Effect, EngineState};
use serde_json::Value;

pub(super) fn describe_step(state: &EngineState) -> String {
    let (index, _) = state.step_progress();
    let steps = &state.config().plan.steps;
    let Some(planned) = steps.get(index) else {
        return format!("after the last of {} steps", steps.len());
    };
    let place = format!("step {} of {}, {}", index + 1, steps.len(), planned.step.word());
    match state.cycle() {
        0 => place,
        cycle => format!("{place}, cycle {cycle}"),
    }
}

/// Unknown decisions stay as they are.
pub(super) fn describe_value(value: &Value) -> String {
    match value {
        Value::Null => "nothing".to_owned(),
        Value::Object(_) => match serde_json::from_value(value.clone()) {
            Ok(effect) => describe_effect(&effect),
            Err(_) => value.to_string(),
        },
        Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

fn describe_effect(effect: &Effect) -> String {
    match effect {
        Effect::Record(record) => record.to_string(),
        Effect::Finished(outcome) => format!("{}: {}", outcome.ending, outcome.reason),
        Effect::ByHand(action) => match action {
            HandAction::LoadCell { mass_g } => format!("{mass_g} g on the load cell"),
            HandAction::Mount { specimen } => format!("specimen {specimen} mounted"),
            HandAction::Unmount => "the specimen taken out".to_owned(),
        },
        Effect::Command(command) => match command {
            RigCommand::EnableMotor => "enable the motor".to_owned(),
            RigCommand::MoveTo(to) => {
                format!("move to pulse {} at {}", to.target_pulses, to.speed)
            }
            RigCommand::Track(to) => {
                format!(
                    "go to pulse {} at up to {} from wherever it is",
                    to.target_pulses, to.speed
                )
            }
            RigCommand::Oscillate(sine) => format!(
                "oscillate with an amplitude of {} pulses and a period of {} ticks, {} cycles",
                sine.amplitude_pulses, sine.period_ticks, sine.cycles
            ),
            RigCommand::Stop => "stop".to_owned(),
            RigCommand::Halt => "halt".to_owned(),
            RigCommand::DefinePosition { pulses } => {
                format!("set the position counter to {pulses} pulses")
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::describe_value;
    use serde_json::json;

    #[test]
    fn known_decisions_are_described_and_unknown_ones_stay_as_they_are() {
        let contact = json!({"effect": "record", "record": "contact_found", "position": 40.0, "std_error_mm": 0.01});
        assert!(describe_value(&contact).contains("contact"), "{}", describe_value(&contact));
        assert!(!describe_value(&contact).contains('{'));
        let stop = json!({"effect": "command", "command": "stop"});
        assert_eq!(describe_value(&stop), "stop");
        assert_eq!(describe_value(&json!(null)), "nothing");
        assert_eq!(describe_value(&json!({"effect": "dance"})), r#"{"effect":"dance"}"#);
        assert_eq!(describe_value(&json!("hold")), "hold");
    }
}
