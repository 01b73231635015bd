//! A step that waits for a digital input or for the bath: on the simulated rig, when it comes and when it does not, and
//! replayed from its record.

use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::rig::{Limits, Phase};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{EndingKind, Operator, Record};
use palpate_protocols::file::Protocol;
use palpate_protocols::plans::{OnTimeout, Plan, SelfTest, WaitCondition, WaitUntil};
use palpate_protocols::preview::preview;
use palpate_runner::replay::replay;
use palpate_tests::lab::Lab;
use palpate_tests::recorded_runs;

const HIGH: WaitCondition = WaitCondition::DigitalInput { number: 1, is_high: true };

fn wait(condition: WaitCondition, secs: f64, on_timeout: OnTimeout) -> WaitUntil {
    WaitUntil { condition, timeout: Seconds(secs), on_timeout }
}

fn plan(wait: WaitUntil) -> Plan {
    let duration = Seconds(0.5);
    Plan::of("test", 1, vec![SelfTest { duration }.into(), wait.into()])
}

/// A rig whose bath is heated to 37 °C and whose switch closes after 20 s.
fn rig() -> SimRig {
    SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        bath: "37".parse().unwrap(),
        input: "20".parse().unwrap(),
        ..SimSettings::default()
    })
}

fn lab(wait: WaitUntil) -> Lab<SimRig> {
    let rig = rig();
    let curve = rig.calibration().curve().unwrap();
    Lab::new(rig, curve, plan(wait))
}

fn reported(lab: &Lab<SimRig>, name: &str) -> Vec<f64> {
    let values = lab.records.iter().filter_map(|(_, record)| match record {
        Record::StepReported { values, .. } => values.get(name).copied(),
        _ => None,
    });
    values.collect()
}

#[test]
fn run_goes_on_when_the_input_goes_high() {
    let mut lab = lab(wait(HIGH, 60.0, OnTimeout::Stop));
    lab.run();
    assert_eq!(lab.outcome.as_ref().unwrap().ending, EndingKind::Finish);
    // Half a second of self-test, a thousandth of a second each for report, command and answer.
    let waited = reported(&lab, "waited_s");
    assert!((waited[0] - 19.5).abs() < 0.02, "{waited:?}");
    // It waits at rest.
    let waits = lab.seen.iter().filter(|seen| seen.phase == Phase::Rest);
    let places: std::collections::BTreeSet<i64> = waits.map(|seen| seen.reading.pulses).collect();
    assert_eq!(places.len(), 1);
}

#[test]
fn run_goes_on_when_the_bath_is_within_its_band() {
    let band = WaitCondition::Bath { from_celsius: 30.0, to_celsius: 31.0 };
    let mut lab = lab(wait(band, 600.0, OnTimeout::Stop));
    lab.run();
    assert_eq!(lab.outcome.as_ref().unwrap().ending, EndingKind::Finish);
    // 37 - 16 exp(-t / 120 s) is 29.975 °C, which a thermometer of 0.05 °C calls 30, after 98.7 s.
    let after = 120.0 * (16.0f64 / (37.0 - 29.975)).ln();
    let waited = reported(&lab, "waited_s");
    assert!((waited[0] + 0.5 - after).abs() < 0.05, "{waited:?}");
    assert_eq!(reported(&lab, "bath_celsius"), [30.0]);
}

#[test]
fn input_that_never_comes_ends_as_the_plan_says() {
    let mut stopped = lab(wait(HIGH, 5.0, OnTimeout::Stop));
    stopped.run();
    // The run stops and holds: whether to retract is a person's choice.
    assert!(stopped.state().holding().is_some());
    stopped.operator(Operator::Close);
    assert_eq!(stopped.outcome.as_ref().unwrap().ending, EndingKind::Stop);
    let mut continued = lab(wait(HIGH, 5.0, OnTimeout::Continue));
    continued.run();
    assert_eq!(continued.outcome.as_ref().unwrap().ending, EndingKind::Finish);
    let waited = reported(&continued, "waited_s");
    assert!((waited[0] - 5.0).abs() < 0.01, "{waited:?}");
}

#[test]
fn recorded_wait_replays_to_identical_decisions() {
    let rig = rig();
    let calibration = rig.calibration();
    let session = recorded_runs::record_plan(
        Box::new(rig),
        calibration,
        plan(wait(HIGH, 60.0, OnTimeout::Stop)),
    );
    let replayed = replay(&session, &[]).unwrap();
    assert_eq!(replayed.first_difference, None);
    // Without the recorded level of the input the wait does not end where it did.
    let mut without = session.clone();
    without.entries.retain(|entry| entry.body["value"]["sensor"] != "digital_input");
    assert!(without.entries.len() < session.entries.len());
    assert!(replay(&without, &[]).unwrap().first_difference.is_some());
}

#[test]
fn pause_stops_the_clock_of_the_wait() {
    let mut lab = lab(wait(HIGH, 5.0, OnTimeout::Stop));
    lab.operator(Operator::Start);
    lab.run_until(Seconds(2.0), |_| false);
    lab.operator(Operator::Pause);
    lab.run_until(Seconds(16.0), |_| false);
    lab.operator(Operator::Resume);
    lab.run_until(Seconds(10.0), |_| false);
    assert_eq!(lab.outcome.as_ref().unwrap().ending, EndingKind::Finish);
}

#[test]
fn rig_without_the_sensor_is_refused_by_the_preview() {
    let preview_on = |rig: &SimRig| {
        let curve = rig.calibration().curve().unwrap();
        let description = rig.description();
        let limits = Limits::for_travel(description.travel);
        let plan = plan(wait(HIGH, 5.0, OnTimeout::Stop));
        preview(&plan, description, &limits, &curve, false)
    };
    assert_eq!(preview_on(&rig()).refusals.len(), 0);
    let usual = preview_on(&SimRig::new(SimSettings::default()));
    assert_eq!((usual.refusals.len(), usual.steps[1].refusals.len()), (1, 1));
}

#[test]
fn words_of_a_protocol_make_the_step() {
    let read = |keys: &str| {
        let text = format!(
            "palpate = 1\nname = \"w\"\nversion = 1\ntitle = \"Wait\"\nabout = \"Wait\"\nsource = \"none\"\n\n[procedure]\nsteps = [ {{ do = \"wait-until\", {keys} }} ]\n"
        );
        let protocol = Protocol::read(&text);
        protocol.map(|protocol| protocol.plan(&Default::default()).unwrap().steps[0].step.clone())
    };
    let expected = wait(HIGH, 600.0, OnTimeout::Stop);
    assert_eq!(read("input = 1"), Ok(expected.into()));
    let band = WaitCondition::Bath { from_celsius: 36.5, to_celsius: 37.5 };
    let expected = wait(band, 30.0, OnTimeout::Continue);
    let keys = "bath_from = \"36.5 °C\", bath_to = \"37.5 degC\", timeout = \"30 s\", on_timeout = \"continue\"";
    assert_eq!(read(keys), Ok(expected.into()));
    for wrong in [
        "",
        "input = 9",
        "bath_from = \"36 °C\"",
        "bath_from = \"38 °C\", bath_to = \"37 °C\"",
        "input = 1, bath_from = \"36 °C\", bath_to = \"37 °C\"",
        "input = 1, level = \"up\"",
    ] {
        assert_eq!(read(wrong).unwrap_err().len(), 1, "{wrong}");
    }
}
