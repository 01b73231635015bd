//! Engine tables: given a state and an input, the phase and the effects.

mod hold;

use super::*;
use crate::plans::{
    Hold, HoldUntil, Jog, LoadTo, Monitor, MonitorAction, MonitorSource, Plan, Ramp, SelfTest,
    Step, Tare, ThresholdSide,
};
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::rig::{
    Ack, AdcDescription, AxisStatus, Fault, Limits, Phase, Reading, RigCommand, RigDescription,
    RigSensors, SampleAge, SensorChannel, SensorReading,
};
use palpate_model::units::{Depth, MmPerS, MmPerS2, Newtons, Position, Seconds, Volts};
use std::sync::Arc;

/// A rig of straight lines: 0.15 V/N from 1.28 V, one sample a millisecond.
struct Bench {
    state: Option<EngineState>,
    now: Nanos,
    tick: u64,
    pulses: i64,
    status: AxisStatus,
}

const ZERO: f64 = 1.28;

fn volts(newtons: f64) -> f64 {
    ZERO + 0.15 * newtons
}

fn rig() -> RigDescription {
    RigDescription {
        name: "bench".into(),
        identity: "table".into(),
        settings: Default::default(),
        mm_per_pulse: 0.015,
        travel: Position(150.0),
        tick_nanos: 1_000_000,
        speed_quantum: MmPerS(0.03),
        speed_max: MmPerS(20.0),
        acceleration: MmPerS2(61.44),
        adc: None,
        noise_expected: Volts(0.001),
        pulse_lag: palpate_model::units::Seconds(0.0),
        cell_delay: Seconds(0.0),
        ticks_per_sample: 1.0,
        unseen_max: RigDescription::UNSEEN_USUAL,
        takes_targets: false,
        sensors: Default::default(),
    }
}

impl Bench {
    fn new(steps: Vec<Step>) -> Self {
        Self::on(rig(), steps)
    }

    fn on(rig: RigDescription, steps: Vec<Step>) -> Self {
        let calibration = Calibration::linear("line", Volts(ZERO), 0.15, Newtons(50.0));
        let config = EngineConfig {
            rig,
            limits: Limits::for_travel(Position(150.0)),
            curve: calibration.curve().unwrap(),
            plan: Plan::of("table", 1, steps),
            is_homed: true,
        };
        let state = Some(EngineState::new(Arc::new(config)));
        Self { state, now: Nanos::ZERO, tick: 0, pulses: 0, status: AxisStatus::MOTOR_ON }
    }

    /// Self-tested, tared and inside a hold of `hold` seconds.
    fn holding(hold: f64) -> Self {
        Self::holding_until(hold, None)
    }

    /// The same with a rule that may end the hold before.
    fn holding_until(hold: f64, until: Option<HoldUntil>) -> Self {
        Self::holding_on(rig(), hold, until)
    }

    fn holding_on(rig: RigDescription, hold: f64, until: Option<HoldUntil>) -> Self {
        let steps = vec![
            Step::SelfTest(SelfTest { duration: Seconds(0.1) }),
            Step::Tare(Tare { duration: Seconds(0.1) }),
            Step::Hold(Hold { duration: Seconds(hold), until, rate: None }),
        ];
        let mut bench = Self::on(rig, steps);
        bench.start();
        for _ in 0..1000 {
            if bench.state().phase() == Phase::Hold {
                return bench;
            }
            bench.sample(volts(0.0));
        }
        panic!("no hold: {:?}", bench.state());
    }

    fn state(&self) -> &EngineState {
        self.state.as_ref().unwrap()
    }

    fn give(&mut self, input: EngineInput) -> Vec<Effect> {
        let (state, effects) = step(self.state.take().unwrap(), self.now, input);
        self.state = Some(state);
        effects
    }

    /// Starts the plan and acknowledges what the self-test sends.
    fn start(&mut self) {
        self.give(EngineInput::Operator { choice: Operator::Start });
        self.sample(volts(0.0));
        for command in [RigCommand::EnableMotor, RigCommand::Stop] {
            self.give(EngineInput::Ack(Ack { command }));
        }
    }

    /// The next millisecond's sample, with a little alternating noise so that the cell lives.
    fn sample(&mut self, volts: f64) -> Vec<Effect> {
        self.sample_after(1, volts)
    }

    fn sample_after(&mut self, ticks: u64, volts: f64) -> Vec<Effect> {
        self.tick += ticks;
        self.now = self.now + Nanos::from_millis(ticks);
        let noise = if self.tick.is_multiple_of(2) { 1e-4 } else { -1e-4 };
        self.give(EngineInput::Reading(Reading {
            tick: self.tick,
            counts: None,
            volts: Volts(volts + noise),
            pulses: self.pulses,
            status: self.status,
            age: None,
        }))
    }

    /// Acknowledges stops until the run holds or has ended.
    fn settle(&mut self) {
        for _ in 0..100 {
            self.give(EngineInput::Ack(Ack { command: RigCommand::Stop }));
            self.sample(volts(0.0));
            if self.state().holding().is_some() {
                return;
            }
        }
        panic!("does not settle: {:?}", self.state());
    }
}

fn tripped(effects: &[Effect]) -> Option<Interlock> {
    effects.iter().find_map(|effect| match effect {
        Effect::Record(Record::InterlockTripped { interlock, .. }) => Some(*interlock),
        _ => None,
    })
}

fn commands(effects: &[Effect]) -> Vec<RigCommand> {
    let of = |effect: &Effect| match effect {
        Effect::Command(command) => Some(*command),
        _ => None,
    };
    effects.iter().filter_map(of).collect()
}

#[test]
fn a_plan_runs_to_its_end() {
    let mut bench = Bench::holding(0.05);
    for _ in 0..49 {
        bench.sample(volts(0.0));
        assert_eq!(bench.state().phase(), Phase::Hold);
    }
    let effects = bench.sample(volts(0.0));
    let outcome = bench.state().outcome().unwrap();
    assert_eq!(outcome.ending, EndingKind::Finish);
    assert!(effects.contains(&Effect::Finished(outcome.clone())));
    assert_eq!(bench.state().power(), Power::Stopped);
}

#[test]
fn interlocks_come_before_the_plan() {
    // The sample that would complete the hold, and with it the run, is above the force limit.
    let mut bench = Bench::holding(0.05);
    (0..49).for_each(|_| drop(bench.sample(volts(0.0))));
    let effects = bench.sample(volts(9.5));
    assert_eq!(tripped(&effects), Some(Interlock::Force));
    assert_eq!(commands(&effects), [RigCommand::Stop]);
    assert_eq!(bench.state().outcome(), None, "the plan must not have seen the sample");
    bench.settle();
    assert_eq!(bench.state().holding().unwrap().ending, EndingKind::Interlock);
}

#[test]
fn the_first_interlock_in_order_is_the_reason() {
    let check = |volts: f64, status: AxisStatus, late_ms: u64, expected: Interlock| {
        let mut bench = Bench::holding(10.0);
        bench.status = AxisStatus::MOTOR_ON | status;
        bench.now = bench.now + Nanos::from_millis(late_ms);
        assert_eq!(tripped(&bench.sample(volts)), Some(expected), "{volts} {status:?} {late_ms}");
    };
    let limit = AxisStatus::FORWARD_LIMIT;
    // Everything at once, then one fault less each time.
    check(f64::NAN, limit, 500, Interlock::Signal);
    check(volts(30.0), limit, 500, Interlock::Travel);
    check(volts(30.0), AxisStatus::default(), 500, Interlock::Force);
    check(volts(8.0), AxisStatus::default(), 500, Interlock::ForceRate);
    check(volts(0.0), AxisStatus::default(), 500, Interlock::SampleAge);
    check(volts(-2.0), AxisStatus::default(), 0, Interlock::Force);
}

#[test]
fn raw_volts_trip_whatever_the_calibration_says() {
    // A cell whose calibration claims 2.85 V is 3 N: only the raw limit sees it.
    let mut bench = Bench::holding(10.0);
    let mut config = bench.state().config().clone();
    let calibration = Calibration::linear("soft", Volts(ZERO), 0.5, Newtons(50.0));
    config.curve = calibration.curve().unwrap();
    bench.state.as_mut().unwrap().config = Arc::new(config);
    let effects = bench.sample(2.85);
    assert_eq!(tripped(&effects), Some(Interlock::Volts));
}

/// A slow cell: eighty samples a second, 12 and 13 ms apart, whose counts hide its noise.
fn slow() -> RigDescription {
    RigDescription {
        ticks_per_sample: 12.5,
        adc: Some(AdcDescription {
            counts_min: -25_000,
            counts_max: 25_000,
            volts_per_count: 0.001,
        }),
        noise_expected: Volts(1e-4),
        ..rig()
    }
}

#[test]
fn the_rate_of_a_force_is_by_time_where_samples_come_seldom() {
    // N/s at which it trips, or none in a second.
    let trips = |rate: f64| {
        let mut bench = Bench::holding_on(slow(), 60.0, None);
        (0..80).find_map(|sample| {
            let force = rate * sample as f64 * 0.0125;
            let effects = bench.sample_after(12 + sample % 2, volts(force.min(8.0)));
            tripped(&effects)
        })
    };
    // 40 N/s counted as if samples were a millisecond apart would be 500.
    assert_eq!(trips(7.0), None);
    assert_eq!(trips(40.0), None);
    assert_eq!(trips(70.0), Some(Interlock::ForceRate));
}

#[test]
fn a_cell_whose_counts_hide_its_noise_is_not_dead() {
    let stuck = |rig: RigDescription| {
        let mut bench = Bench::holding_on(rig, 60.0, None);
        (0..200).find_map(|_| {
            bench.tick += 12;
            bench.now = bench.now + Nanos::from_millis(12);
            let reading = Reading {
                tick: bench.tick,
                counts: Some(0),
                volts: Volts(ZERO),
                pulses: 0,
                status: AxisStatus::MOTOR_ON,
                age: None,
            };
            tripped(&bench.give(EngineInput::Reading(reading)))
        })
    };
    assert_eq!(stuck(slow()), None);
    let noisy = RigDescription { noise_expected: Volts(0.001), ..slow() };
    assert_eq!(stuck(noisy), Some(Interlock::Signal));
}

#[test]
fn silence_trips_by_the_speed() {
    let mut bench = Bench::holding(10.0);
    bench.now = bench.now + Nanos::from_millis(250);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), None);
    bench.now = bench.now + Nanos::from_millis(1);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), Some(Interlock::SampleAge));
    assert_eq!(
        Limits::sample_age_max(MmPerS(0.75), Position(0.1), Seconds(0.0)),
        Seconds(0.1 / 0.75)
    );
    assert_eq!(Limits::sample_age_max(MmPerS(20.0), Position(0.1), Seconds(0.0)), Seconds(0.020));
    // A rig whose file lets it go further unseen.
    assert_eq!(
        Limits::sample_age_max(MmPerS(1.5), Position(0.3), Seconds(0.0)),
        Seconds(0.3 / 1.5)
    );
    // Eighty samples a second, one in 12.5 ms.
    assert_eq!(
        Limits::sample_age_max(MmPerS(20.0), Position(0.1), Seconds(0.0125)),
        Seconds(0.0325)
    );
}

#[test]
fn the_filter_of_a_cell_is_no_lateness() {
    let filter = Nanos::from_millis(200);
    for (cell_delay, is_tripped) in [(filter, false), (Nanos::ZERO, true)] {
        let rig = RigDescription { cell_delay: cell_delay.seconds(), ..rig() };
        let mut bench = Bench::holding_on(rig, 10.0, None);
        bench.tick += 1;
        bench.now = bench.now + Nanos::from_millis(1);
        bench.give(EngineInput::Reading(Reading {
            tick: bench.tick,
            counts: None,
            volts: Volts(volts(0.0)),
            pulses: bench.pulses,
            status: bench.status,
            age: Some(SampleAge { by: filter, within: Nanos::ZERO }),
        }));
        // A quarter of a second is what a silence may last at rest.
        bench.now = bench.now + Nanos::from_millis(100);
        let trip = tripped(&bench.give(EngineInput::Tick));
        assert_eq!(trip == Some(Interlock::SampleAge), is_tripped, "{trip:?}");
    }
}

#[test]
fn every_ending_stops_the_axis_and_says_why() {
    for (choice, ending, command) in [
        (Operator::Stop, EndingKind::Stop, RigCommand::Stop),
        (Operator::Abort, EndingKind::Abort, RigCommand::Stop),
        (Operator::Halt, EndingKind::Halt, RigCommand::Halt),
    ] {
        let mut bench = Bench::holding(10.0);
        let effects = bench.give(EngineInput::Operator { choice });
        assert_eq!(commands(&effects), [command]);
        bench.give(EngineInput::Ack(Ack { command }));
        bench.sample(volts(0.0));
        assert_eq!(bench.state().holding().unwrap().ending, ending);
        assert_eq!(bench.state().is_homed(), choice != Operator::Halt, "a halt may lose steps");
        let effects = bench.give(EngineInput::Operator { choice: Operator::Close });
        assert!(
            matches!(&effects[..], [.., Effect::Finished(outcome)] if outcome.ending == ending)
        );
    }
}

#[test]
fn faults_end_the_run_and_unhome_where_position_is_lost() {
    for (fault, ending, is_homed) in [
        (Fault::LinkLost { detail: "gone".into() }, EndingKind::Interlock, false),
        (Fault::ControllerReset, EndingKind::Interlock, false),
        (Fault::CommandRefused { detail: "no".into() }, EndingKind::Abort, true),
        (Fault::LogFailed { detail: "full".into() }, EndingKind::Abort, true),
        (Fault::LogAtRisk { detail: "slow".into() }, EndingKind::Abort, true),
    ] {
        let mut bench = Bench::holding(10.0);
        let effects = bench.give(EngineInput::Fault(fault.clone()));
        assert_eq!(commands(&effects), [RigCommand::Stop], "{fault:?}");
        bench.now = bench.now + Nanos::from_millis(2_001);
        bench.give(EngineInput::Tick);
        assert_eq!(bench.state().holding().unwrap().ending, ending, "{fault:?}");
        assert_eq!(bench.state().is_homed(), is_homed, "{fault:?}");
    }
}

#[test]
fn a_clock_that_runs_back_is_a_reset_controller() {
    let mut bench = Bench::holding(10.0);
    bench.tick = 0;
    assert_eq!(tripped(&bench.sample(volts(0.0))), Some(Interlock::Link));
    assert!(!bench.state().is_homed());
}

#[test]
fn a_command_without_acknowledgement_is_a_lost_link() {
    let mut bench = Bench::new(vec![Step::SelfTest(SelfTest { duration: Seconds(0.1) })]);
    bench.give(EngineInput::Operator { choice: Operator::Start });
    let trip = (0..1100).find_map(|_| tripped(&bench.sample(volts(0.0))));
    assert_eq!(trip, Some(Interlock::Link));
}

#[test]
fn a_move_needs_a_homed_axis_and_a_jog_does_not() {
    let unhomed = |step: Step| {
        let mut bench = Bench::new(vec![Step::SelfTest(SelfTest { duration: Seconds(0.1) }), step]);
        let mut config = bench.state().config().clone();
        config.is_homed = false;
        bench.state = Some(EngineState::new(Arc::new(config)));
        bench.start();
        let sent: Vec<_> = (0..150).flat_map(|_| commands(&bench.sample(volts(0.0)))).collect();
        sent
    };
    let ramp = Step::Ramp(Ramp { speed: MmPerS(0.75), depth: palpate_model::Depth(1.0) });
    assert_eq!(unhomed(ramp), [RigCommand::Stop]);
    let jog = Step::Jog(Jog { distance_mm: 1.5, speed: MmPerS(0.75) });
    assert!(
        matches!(unhomed(jog)[..], [RigCommand::MoveTo(command)] if command.target_pulses == 100)
    );
}

#[test]
fn self_test_refuses_a_dead_a_noisy_and_a_loaded_cell() {
    let reason = |signal: fn(u64) -> f64| {
        let mut bench = Bench::new(vec![Step::SelfTest(SelfTest { duration: Seconds(0.1) })]);
        bench.start();
        for _ in 0..120 {
            bench.tick += 1;
            bench.now = bench.now + Nanos::from_millis(1);
            let (tick, volts) = (bench.tick, Volts(signal(bench.tick)));
            let status = AxisStatus::MOTOR_ON;
            let reading = Reading { tick, counts: None, volts, pulses: 0, status, age: None };
            let effects = bench.give(EngineInput::Reading(reading));
            if let Some(Effect::Record(Record::EndingStarted { reason, .. })) = effects.first() {
                return reason.clone();
            }
        }
        String::new()
    };
    assert!(reason(|_| ZERO).contains("does not change"));
    assert!(reason(|tick| ZERO + if tick % 2 == 0 { 0.01 } else { -0.01 }).contains("noise"));
    assert!(
        reason(|tick| volts(2.0) + (tick % 2) as f64 * 1e-3).contains("before anything touches")
    );
}

#[test]
fn same_state_and_input_give_the_same_result() {
    let mut bench = Bench::holding(10.0);
    let state = bench.state().clone();
    let reading = Reading {
        tick: bench.tick + 1,
        counts: None,
        volts: Volts(volts(1.0)),
        pulses: 0,
        status: AxisStatus::MOTOR_ON,
        age: None,
    };
    let (a, b) = (
        step(state.clone(), bench.now, EngineInput::Reading(reading)),
        step(state, bench.now, EngineInput::Reading(reading)),
    );
    assert_eq!(a, b);
    bench.sample(volts(0.0));
}

/// Self-tested and jogging 15 mm at 9 mm/s; the command was sent with the last sample.
#[test]
fn a_monitor_watches_a_sensor_by_its_name() {
    let channel = |name: &str| SensorChannel { name: name.into(), unit: "°C".into() };
    let channels = vec![channel("bench.temperature"), channel("room.temperature")];
    let rig = RigDescription { sensors: RigSensors { channels, ..RigSensors::default() }, ..rig() };
    let mut bench = Bench::holding_on(rig, 10.0, None);
    let mut config = bench.state().config().clone();
    config.plan.monitors = vec![Monitor {
        source: MonitorSource::Channel("room.temperature".into()),
        side: ThresholdSide::Above,
        threshold: 25.0,
        resume: 25.0,
        settle: Seconds(1.0),
        action: MonitorAction::Stop,
        message: "the room is too warm".into(),
    }];
    bench.state = Some(EngineState::new(Arc::new(config)));
    bench.start();
    while bench.state().phase() != Phase::Hold {
        bench.sample(volts(0.0));
    }
    let value = |number, value| EngineInput::Sensor {
        value: SensorReading::Channel { number, value, age: Nanos::ZERO },
    };
    bench.give(value(1, 99.0));
    bench.give(value(2, 24.9));
    assert_eq!(commands(&bench.sample(volts(0.0))), []);
    bench.give(value(2, 25.0));
    assert_eq!(commands(&bench.sample(volts(0.0))), [RigCommand::Stop]);
}

fn jogging() -> Bench {
    let mut bench = Bench::new(vec![
        Step::SelfTest(SelfTest { duration: Seconds(0.1) }),
        Step::Jog(Jog { distance_mm: 15.0, speed: MmPerS(9.0) }),
    ]);
    bench.start();
    for _ in 0..200 {
        let sent = commands(&bench.sample(volts(0.0)));
        if let [command @ RigCommand::MoveTo(_)] = sent[..] {
            bench.give(EngineInput::Ack(Ack { command }));
            return bench;
        }
    }
    panic!("no jog: {:?}", bench.state());
}

#[test]
fn silence_counts_at_the_commanded_speed_before_any_sample_shows_it() {
    let mut bench = jogging();
    assert_eq!(bench.state().derived().velocity, MmPerS(0.0));
    // 0.1 mm at 9 mm/s is 11 ms; the floor is 20 ms.
    bench.now = bench.now + Nanos::from_millis(21);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), Some(Interlock::SampleAge));
}

#[test]
fn a_lost_stop_is_followed_by_a_halt() {
    let mut bench = jogging();
    bench.status = AxisStatus::MOTOR_ON | AxisStatus::MOVING;
    bench.sample(volts(0.0));
    let detail = "unplugged".to_owned();
    let effects = bench.give(EngineInput::Fault(Fault::LinkLost { detail }));
    assert_eq!(commands(&effects), [RigCommand::Stop]);
    bench.now = bench.now + Nanos::from_millis(2_001);
    assert_eq!(commands(&bench.give(EngineInput::Tick)), [RigCommand::Halt]);
    assert_eq!(bench.state().holding(), None);
    bench.now = bench.now + Nanos::from_millis(2_001);
    bench.give(EngineInput::Tick);
    assert_eq!(bench.state().holding().unwrap().ending, EndingKind::Interlock);
}

#[test]
fn an_axis_that_moves_after_a_stop_is_cut() {
    let mut bench = Bench::holding(10.0);
    let choice = Operator::Stop;
    bench.give(EngineInput::Operator { choice });
    bench.settle();
    bench.status = AxisStatus::MOTOR_ON | AxisStatus::MOVING;
    let effects = bench.sample(volts(0.0));
    assert_eq!(tripped(&effects), Some(Interlock::Path));
    assert_eq!(commands(&effects), [RigCommand::Halt]);
    assert!(!bench.state().is_homed());
}

/// Loading to 1 N, which the first sample of the load has already: the move and the stop behind it are sent. With a brake
/// the approach begins fast and goes on slower.
fn reached_at_once(brake: Option<Newtons>) -> Bench {
    let hold = |secs: f64| Step::Hold(Hold { duration: Seconds(secs), until: None, rate: None });
    let load = LoadTo { force: Newtons(1.0), speed: MmPerS(0.75), depth_max: Depth(35.0), brake };
    let (check, tare) = (Seconds(0.1), Seconds(0.1));
    let mut bench = Bench::new(vec![
        Step::SelfTest(SelfTest { duration: check }),
        Step::Tare(Tare { duration: tare }),
        hold(0.1),
        Step::LoadTo(load),
        hold(10.0),
    ]);
    bench.start();
    let (mut sent, mut force) = (Vec::new(), 0.0_f64);
    for _ in 0..1000 {
        if bench.state().phase() == Phase::Hold {
            bench.state.as_mut().unwrap().contact =
                Some(ContactPosition { position: Position(0.0), std_error_mm: 0.01 });
            // 20 N/s, as no interlock minds.
            force = (force + 0.02).min(1.1);
        }
        sent.extend(commands(&bench.sample(volts(force))));
        if sent.last() == Some(&RigCommand::Stop) {
            assert!(sent[0].is_motion(), "{sent:?}");
            return bench;
        }
    }
    panic!("no load: {:?}", bench.state());
}

#[test]
fn a_stop_of_the_plan_may_come_before_the_move_that_it_ends() {
    // A driver drops the move, which waits in its queue, and says so; or the move is over between two samples.
    let dropped = EngineInput::Fault(Fault::CommandRefused { detail: "a stop came first".into() });
    let (_, command) = reached_at_once(None).state().unacknowledged[0];
    for answer in [dropped, EngineInput::Ack(Ack { command })] {
        let mut bench = reached_at_once(None);
        bench.give(answer.clone());
        let command = RigCommand::Stop;
        bench.give(EngineInput::Ack(Ack { command }));
        let effects = bench.sample(volts(1.1));
        let is_reached =
            |effect: &Effect| matches!(effect, Effect::Record(Record::ForceReached { .. }));
        assert!(effects.iter().any(is_reached), "{answer:?} {effects:?}");
        bench.sample(volts(1.1));
        assert_eq!(bench.state().phase(), Phase::Hold, "{answer:?}");
        assert_eq!(bench.state().holding(), None);
        assert!(bench.state().unacknowledged.is_empty());
    }
}

#[test]
fn a_stop_that_is_accepted_late_does_not_end_the_next_move() {
    let mut bench = reached_at_once(Some(Newtons(0.5)));
    let detail = "a stop came first".into();
    bench.give(EngineInput::Fault(Fault::CommandRefused { detail }));
    // At rest the slower approach begins, before the stop of the first one is accepted.
    let sent = commands(&bench.sample(volts(0.6)));
    assert!(sent[0].is_motion(), "{sent:?}");
    let command = RigCommand::Stop;
    bench.give(EngineInput::Ack(Ack { command }));
    bench.sample(volts(0.6));
    assert!(!bench.state().is_at_rest(), "the move is still to come");
}

#[test]
fn a_move_that_is_refused_without_a_stop_ends_the_run() {
    let mut bench = jogging();
    let detail = "speed".into();
    let effects = bench.give(EngineInput::Fault(Fault::CommandRefused { detail }));
    assert_eq!(commands(&effects), [RigCommand::Stop]);
}

#[test]
fn a_motor_without_current_trips() {
    let mut bench = Bench::holding(10.0);
    bench.status = AxisStatus::default();
    assert_eq!(tripped(&bench.sample(volts(0.0))), Some(Interlock::Motor));
    assert!(!bench.state().is_homed());
}

#[test]
fn a_probe_on_the_far_switch_may_leave_it_but_not_press_on() {
    let mut bench = jogging();
    bench.status = AxisStatus::MOTOR_ON | AxisStatus::MOVING | AxisStatus::FORWARD_LIMIT;
    assert_eq!(tripped(&bench.sample(volts(0.0))), Some(Interlock::Travel));

    let mut bench = Bench::holding(10.0);
    let state = bench.state.as_mut().unwrap();
    state.contact = Some(ContactPosition { position: Position(0.0), std_error_mm: 0.01 });
    bench.pulses = 8000;
    bench.status = AxisStatus::MOTOR_ON | AxisStatus::FORWARD_LIMIT;
    bench.state.as_mut().unwrap().path.on_define(8000);
    assert_eq!(tripped(&bench.sample(volts(0.0))), Some(Interlock::Travel));
    bench.give(EngineInput::Ack(Ack { command: RigCommand::Stop }));
    bench.sample(volts(0.0));
    let choice = Operator::Retract;
    bench.give(EngineInput::Operator { choice });
    assert_eq!(tripped(&bench.sample(volts(0.0))), None);
    let command = RigCommand::EnableMotor;
    let sent = commands(&bench.give(EngineInput::Ack(Ack { command })));
    assert!(matches!(sent[..], [RigCommand::MoveTo(command)] if command.target_pulses == 0));
    assert_eq!(tripped(&bench.sample(volts(0.0))), None);
}

#[test]
fn a_pause_of_the_computer_is_no_silence_of_the_rig() {
    let late = |ms| EngineInput::HostLate { late: Nanos::from_millis(ms) };
    let wait = |bench: &mut Bench, ms| bench.now = bench.now + Nanos::from_millis(ms);
    // 0.1 mm at 9 mm/s is 11 ms; the floor is 20 ms. Sixty of 75 were the computer's.
    let mut bench = jogging();
    bench.give(late(60));
    wait(&mut bench, 75);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), None);
    // What is silent then is silent.
    wait(&mut bench, 6);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), Some(Interlock::SampleAge));
    // A computer that stood still for longer than a rig may keep silent at rest has no excuse.
    let mut bench = jogging();
    bench.give(late(251));
    wait(&mut bench, 21);
    assert_eq!(tripped(&bench.give(EngineInput::Tick)), Some(Interlock::SampleAge));
}
