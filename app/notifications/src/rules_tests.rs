use super::*;
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::rig::SensorValues;
use palpate_model::signal::LiveTrace;
use palpate_model::units::Seconds;
use palpate_protocols::engine::{DerivedValues, PauseView, Power};
use palpate_runner::RigView;
use palpate_runner::base::FoundBase;
use std::sync::Arc;

const NO_REASON: &str = "it is in progress";

fn run(folder: &str, phase: Phase) -> RunView {
    RunView {
        plan_name: "ramp-hold".into(),
        plan_crc32: None,
        folder: folder.into(),
        phase,
        power: Power::Enabled,
        steps: Arc::default(),
        step_index: 0,
        now: Nanos::ZERO,
        time_left: Seconds(0.0),
        fraction: 0.0,
        derived: DerivedValues::default(),
        tare: None,
        contact: None,
        base: FoundBase::default(),
        force_peak: None,
        live: None,
        trace: Arc::new(LiveTrace::new(16)),
        phases: Arc::default(),
        samples: 0,
        saved_through: Nanos::ZERO,
        lateness: None,
        is_motion_possible: false,
        pause: PauseView::default(),
        prompt: None,
        next_checkpoint: None,
        cycle: 0,
        cycles: 0,
        cycle_starts: Arc::default(),
        planned_weights: Arc::default(),
        weight_readings: Arc::default(),
        settling: None,
        can_redo: Err(NO_REASON.into()),
        approach: Arc::new(LiveTrace::new(16)),
        contact_triggers: Arc::default(),
        holding: None,
        can_retract: Err(NO_REASON.into()),
        outcome: None,
        data_quality: None,
        log_error: None,
        data_quality_error: None,
        events: Arc::default(),
    }
}

fn outcome(ending: EndingKind, reason: &str) -> Option<RunOutcome> {
    Some(RunOutcome { ending, reason: reason.into() })
}

/// Rules with what is given to them beside a run.
#[derive(Default)]
struct Bench {
    rules: NoticeRules,
    free_bytes: Option<u64>,
    calibration: Option<CalibrationValidity>,
}

impl Bench {
    fn see(&mut self, run: Option<RunView>) -> Vec<Notice> {
        let snapshot = RunnerSnapshot {
            rig: RigView {
                description: Arc::new(SimRig::new(SimSettings::default()).description().clone()),
                reading: None,
                is_homed: false,
                link: None,
                link_error: None,
                sensors: SensorValues::default(),
            },
            run,
            refusal: None,
            sequence: 0,
        };
        self.rules.notices(Circumstances {
            now: DateTime::UNIX_EPOCH,
            snapshot: &snapshot,
            free_bytes: self.free_bytes,
            calibration: self.calibration.as_ref(),
        })
    }

    fn kinds(&mut self, run: Option<RunView>) -> Vec<NoticeKind> {
        self.see(run).iter().map(|notice| notice.kind).collect()
    }
}

#[test]
fn a_complete_run_gives_one_notice_and_the_next_run_another() {
    let mut bench = Bench::default();
    assert_eq!(bench.kinds(None), []);
    assert_eq!(bench.kinds(Some(run("s/1", Phase::Ramp))), []);
    let ended = || RunView {
        outcome: outcome(EndingKind::Finish, "the plan is complete"),
        ..run("s/1", Phase::Ended)
    };
    let notices = bench.see(Some(ended()));
    let found = notices[0].run.as_ref().unwrap();
    assert_eq!((notices.len(), notices[0].kind), (1, NoticeKind::Ended));
    // The folder above the session may have the name of a person.
    assert_eq!((found.session.as_str(), found.phase.as_str()), ("1", "ramp"));
    for _ in 0..3 {
        assert_eq!(bench.kinds(Some(ended())), []);
    }
    let next = RunView { folder: "s/2".into(), ..ended() };
    assert_eq!(bench.kinds(Some(next)), [NoticeKind::Ended]);
}

#[test]
fn an_interlock_gives_an_alarm_and_a_failure_once_also_while_the_run_waits() {
    let mut bench = Bench::default();
    assert_eq!(bench.kinds(Some(run("s/1", Phase::Hold))), []);
    let tripped = outcome(EndingKind::Interlock, "force above the ceiling");
    let holding = RunView { holding: tripped.clone(), ..run("s/1", Phase::Stopped) };
    let notices = bench.see(Some(holding.clone()));
    let kinds: Vec<NoticeKind> = notices.iter().map(|notice| notice.kind).collect();
    assert_eq!(kinds, [NoticeKind::Alarm, NoticeKind::Failed]);
    for notice in &notices {
        let run = notice.run.as_ref().unwrap();
        assert_eq!(run.phase, "hold");
        assert_eq!(run.reason.as_deref(), Some("force above the ceiling"));
    }
    assert!(notices[1].text.contains("waits"), "{}", notices[1].text);
    assert_eq!(bench.kinds(Some(holding)), []);
    let closed = RunView { outcome: tripped, ..run("s/1", Phase::Ended) };
    assert_eq!(bench.kinds(Some(closed)), []);
}

#[test]
fn an_interlock_during_the_retract_after_a_stop_still_alarms() {
    let mut bench = Bench::default();
    let holding = RunView {
        holding: outcome(EndingKind::Stop, "by the operator"),
        ..run("s/1", Phase::Stopped)
    };
    assert_eq!(bench.kinds(Some(holding)), [NoticeKind::Failed]);
    let ended = RunView {
        outcome: outcome(EndingKind::Interlock, "the link was lost"),
        ..run("s/1", Phase::Ended)
    };
    assert_eq!(bench.kinds(Some(ended)), [NoticeKind::Alarm]);
}

#[test]
fn what_ends_early_or_with_another_log_has_failed() {
    for (index, ending) in
        [EndingKind::Stop, EndingKind::Abort, EndingKind::Halt].into_iter().enumerate()
    {
        let ended = RunView {
            outcome: outcome(ending, "a reason"),
            ..run(&format!("s/{index}"), Phase::Ended)
        };
        assert_eq!(Bench::default().kinds(Some(ended)), [NoticeKind::Failed], "{ending}");
    }
    let lost = RunView {
        outcome: outcome(EndingKind::Finish, "the plan is complete"),
        log_error: Some("the disk is full".into()),
        ..run("s/9", Phase::Ended)
    };
    assert_eq!(Bench::default().kinds(Some(lost)), [NoticeKind::Failed]);
}

#[test]
fn a_move_by_hand_gives_an_alarm_and_nothing_else() {
    let mut bench = Bench::default();
    let moved = |ending| RunView {
        plan_name: MOVES_BY_HAND[0].into(),
        outcome: outcome(ending, "a reason"),
        ..run("s/1", Phase::Ended)
    };
    assert_eq!(bench.kinds(Some(moved(EndingKind::Finish))), []);
    assert_eq!(bench.kinds(Some(moved(EndingKind::Interlock))), [NoticeKind::Alarm]);
}

#[test]
fn a_low_disk_is_announced_once_until_it_was_ample() {
    let mut bench = Bench { free_bytes: Some(DISK_LOW_BYTES), ..Bench::default() };
    let hold = || Some(run("s/1", Phase::Hold));
    assert_eq!(bench.kinds(hold()), []);
    for (free, expected) in [
        (DISK_LOW_BYTES - 1, vec![NoticeKind::Disk]),
        (0, vec![]),
        (DISK_LOW_BYTES, vec![]),
        (DISK_LOW_BYTES - 1, vec![]),
        (DISK_AMPLE_BYTES, vec![]),
        (DISK_LOW_BYTES - 1, vec![NoticeKind::Disk]),
    ] {
        bench.free_bytes = Some(free);
        assert_eq!(bench.kinds(hold()), expected, "{free}");
    }
    // Where nothing is recorded nothing needs space.
    let mut idle = Bench { free_bytes: Some(0), ..Bench::default() };
    assert_eq!(idle.kinds(None), []);
}

#[test]
fn a_calibration_is_announced_before_and_after_its_end_once_each() {
    let mut bench = Bench::default();
    let with_days = |days_left| {
        Some(CalibrationValidity { name: "cell 7".into(), taken: "2026-03-01".into(), days_left })
    };
    let mut found = Vec::new();
    for days_left in (-3..=31).rev() {
        bench.calibration = with_days(days_left);
        found.extend(bench.see(None).into_iter().map(|notice| (days_left, notice.kind)));
    }
    // The window and the command line warn on the same day.
    assert_eq!(found, [(29, NoticeKind::Calibration), (-1, NoticeKind::Calibration)]);
    // Another program that knows what was announced says nothing, and a newer calibration is another one.
    let mut next = Bench {
        rules: NoticeRules::new(bench.rules.announced_calibrations().clone()),
        calibration: with_days(-3),
        ..Bench::default()
    };
    assert_eq!(next.kinds(None), []);
    next.calibration = with_days(3).map(|one| CalibrationValidity { taken: "2027".into(), ..one });
    assert_eq!(next.kinds(None), [NoticeKind::Calibration]);
}
