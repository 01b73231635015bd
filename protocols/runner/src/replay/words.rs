//! Differences in the words of the protocol and its records.

use palpate_model::rig::{HandAction, RigCommand};
use palpate_protocols::engine::{Effect, State};
use serde_json::Value;

/// Where in the plan a run is.
pub(super) fn of_step(state: &State) -> String {
    let (index, _) = state.step_progress();
    let steps = &state.config().plan.steps;
    let Some(planned) = steps.get(index) else {
        return format!("behind the last of {} steps", steps.len());
    };
    let place = format!("step {} of {}, {}", index + 1, steps.len(), planned.step.word());
    match state.cycle() {
        0 => place,
        cycle => format!("{place}, cycle {cycle}"),
    }
}

/// A decision or a number in words; what is none of ours as it stands.
pub(super) fn of(value: &Value) -> String {
    match value {
        Value::Null => "nothing".to_owned(),
        Value::Object(_) => match serde_json::from_value(value.clone()) {
            Ok(effect) => of_effect(&effect),
            Err(_) => value.to_string(),
        },
        Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

fn of_effect(effect: &Effect) -> String {
    match effect {
        Effect::Record(record) => record.to_string(),
        Effect::Finished(outcome) => format!("{}: {}", outcome.ending, outcome.reason),
        Effect::ByHand(action) => match action {
            HandAction::LoadCell { mass_g } => format!("{mass_g} g on the load cell"),
            HandAction::Mount { specimen } => format!("specimen {specimen} clipped in"),
            HandAction::Unmount => "the specimen taken out".to_owned(),
        },
        Effect::Command(command) => match command {
            RigCommand::EnableMotor => "enable the motor".to_owned(),
            RigCommand::MoveTo(to) => {
                format!("move to pulse {} at {}", to.target_pulses, to.speed)
            }
            RigCommand::Oscillate(sine) => format!(
                "swing by {} pulses, {} ticks a period, {} times",
                sine.amplitude_pulses, sine.period_ticks, sine.cycles
            ),
            RigCommand::Stop => "stop".to_owned(),
            RigCommand::Halt => "halt".to_owned(),
            RigCommand::DefinePosition { pulses } => format!("call this place pulse {pulses}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::of;
    use serde_json::json;

    #[test]
    fn decisions_are_told_as_their_records_are_and_the_unknown_as_it_stands() {
        let contact = json!({"effect": "record", "record": "contact_found", "position": 40.0, "std_error_mm": 0.01});
        assert!(of(&contact).contains("contact"), "{}", of(&contact));
        assert!(!of(&contact).contains('{'));
        let stop = json!({"effect": "command", "command": "stop"});
        assert_eq!(of(&stop), "stop");
        assert_eq!(of(&json!(null)), "nothing");
        assert_eq!(of(&json!({"effect": "dance"})), r#"{"effect":"dance"}"#);
        assert_eq!(of(&json!("hold")), "hold");
    }
}
