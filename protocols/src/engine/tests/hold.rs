//! Tables of the rule that ends a hold early.

use super::*;
use crate::plans::{BodyParameter, HoldUntil};
use palpate_model::estimate::{FittedParameter, Identifiability, LiveEstimate};

/// An answer that knows tau to `relative`, and whether it counts as identified.
fn answer(relative: f64, is_identified: bool) -> EngineInput {
    let half = 1.02 * relative;
    EngineInput::LiveFit(LiveEstimate {
        parameters: vec![FittedParameter {
            name: "tau_eps".into(),
            value: 1.02,
            unit: "s".into(),
            std_error: Some(half / 1.96),
            ci95: Some([1.02 - half, 1.02 + half]),
            is_fixed: false,
            systematic_error: None,
            total95: None,
            budget: Vec::new(),
        }],
        rmse_weighted_n: 0.02,
        samples: 1000,
        verdicts: vec![Identifiability {
            parameter: "tau_eps".into(),
            is_identified,
            reason: (!is_identified).then(|| "hold longer".into()),
        }],
    })
}

fn rule(at_least: f64) -> HoldUntil {
    HoldUntil { parameter: BodyParameter::TauEps, relative: 0.01, at_least: Seconds(at_least) }
}

/// Whether a hold of 0.2 s with a rule ends at the sample after an answer given at 0.1 s.
fn ends_early(until: Option<HoldUntil>, input: EngineInput) -> bool {
    let mut bench = Bench::holding_until(0.2, until);
    for _ in 0..100 {
        bench.sample(volts(0.0));
    }
    let effects = bench.give(input);
    let has_reason = matches!(
        effects[..],
        [Effect::Record(Record::HoldEndedEarly { held, wanted, .. })]
            if (held.0 - 0.1).abs() < 1e-9 && (wanted - 0.01).abs() < 1e-12
    );
    assert!(has_reason || effects.is_empty(), "{effects:?}");
    bench.sample(volts(0.0));
    let has_ended = bench.state().outcome().is_some();
    assert_eq!(has_ended, has_reason);
    has_ended
}

#[test]
fn a_hold_ends_at_the_recorded_answer_that_meets_its_rule_and_at_no_other() {
    assert!(ends_early(Some(rule(0.05)), answer(0.009, true)));
    // Too wide, not identified, too soon, no rule.
    assert!(!ends_early(Some(rule(0.05)), answer(0.011, true)));
    assert!(!ends_early(Some(rule(0.05)), answer(0.009, false)));
    assert!(!ends_early(Some(rule(0.15)), answer(0.009, true)));
    assert!(!ends_early(None, answer(0.009, true)));
}

#[test]
fn the_reason_is_recorded_once_and_says_what_was_reached() {
    let mut bench = Bench::holding_until(10.0, Some(rule(0.0)));
    bench.sample(volts(0.0));
    let effects = bench.give(answer(0.008, true));
    let [Effect::Record(record)] = &effects[..] else {
        panic!("{effects:?}");
    };
    let text = record.to_string();
    for fact in ["tau_eps", "0.8 %", "1 %"] {
        assert!(text.contains(fact), "{fact}: {text}");
    }
    assert_eq!(bench.give(answer(0.007, true)), []);
}

#[test]
fn an_answer_from_before_the_hold_ends_nothing() {
    let mut bench = Bench::new(vec![
        Step::SelfTest(SelfTest { duration: Seconds(0.1) }),
        Step::Hold(Hold { duration: Seconds(0.1), until: Some(rule(0.0)), rate: None }),
    ]);
    bench.start();
    assert_eq!(bench.give(answer(0.001, true)), []);
    while bench.state().phase() != Phase::Hold {
        bench.sample(volts(0.0));
    }
    for _ in 0..99 {
        bench.sample(volts(0.0));
        assert_eq!(bench.state().outcome(), None);
    }
}

#[test]
fn a_plan_without_a_rule_is_written_and_read_as_before() {
    let text = r#"{"step":"hold","duration":2.0}"#;
    let step: Step = serde_json::from_str(text).unwrap();
    assert_eq!(step, Step::Hold(Hold { duration: Seconds(2.0), until: None, rate: None }));
    assert_eq!(serde_json::to_string(&step).unwrap(), text);
}
