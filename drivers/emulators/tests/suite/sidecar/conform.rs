//! The conformance suite on an emulated sidecar, in simulated time: an honest one passes, and each lie fails a check.

use super::bench::Shared;
use palpate_drivers::sidecar::conform::{
    ConformBench, ConformOptions, ConformReport, Verdict, run, speed_for_overtravel,
};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::sidecar::{EmulatedSidecarSettings as Emulated, SidecarLie};
use palpate_model::Nanos;
use palpate_model::units::MmPerS2;

fn conform(wire: &Shared, range_mm: Option<f64>) -> ConformReport {
    let options = ConformOptions { range_mm, ..ConformOptions::default() };
    let mut open = || {
        // A plug that is pulled and put back: what was on its way is gone.
        let mut unplugged = wire.lock();
        unplugged.emulator.transmit(0);
        drop(unplugged);
        Ok(Box::new(wire.clone()) as Box<dyn palpate_drivers::wire::Link>)
    };
    let wait = |time: Nanos| wire.pass(time.seconds().0);
    let mut bench =
        ConformBench { open: &mut open, clock: wire.clock(), wait: &wait, progress: &mut |_| {} };
    run(&mut bench, &options).expect("the link holds")
}

fn failed(report: &ConformReport) -> Vec<&'static str> {
    let failed = report.checks.iter().filter(|check| check.verdict == Verdict::Fail);
    failed.map(|check| check.name).collect()
}

#[test]
fn an_honest_sidecar_passes_in_every_way_of_writing_and_may_be_trusted() {
    for (has_checksum, has_frames) in [(false, false), (true, false), (false, true), (true, true)] {
        let settings =
            Emulated { has_checksum, has_frames, clock_ppm: 300.0, ..Emulated::default() };
        let wire = Shared::new(settings.clone());
        let report = conform(&wire, Some(6.0));
        assert_eq!(failed(&report), [""; 0], "{report:#?}");
        let trust = report.trust.expect("it was moved");
        // The parts by hand: 2 ms between samples; 0.7 ms for a byte and its answer after 0.3 ms and a step of 0.2 ms
        // or two; a look each half millisecond.
        assert!((trust.sample_period_s - 0.002).abs() < 1e-9);
        assert!((0.001..0.003).contains(&trust.answer_s), "{trust:?}");
        let by_formula = speed_for_overtravel(0.5, trust.reaction_s, MmPerS2(50.0)).0;
        assert_eq!(trust.speed_max_mm_s, by_formula.min(10.0));
        assert!(trust.speed_max_mm_s > 6.0, "{trust:?}");
        let drift = report.checks.iter().find(|check| check.name == "clock-drift").unwrap();
        assert!((drift.measured.unwrap() - 300.0).abs() < 20.0, "{drift:?}");
        // It kept to its range, and stands where the link was cut in the last motion.
        let end = wire.lock().emulator.position_mm();
        assert!((0.0..=6.0).contains(&end), "{end}");
    }
}

#[test]
fn without_permission_nothing_moves() {
    let wire = Shared::new(Emulated::default());
    let report = conform(&wire, None);
    assert_eq!(failed(&report), [""; 0], "{report:#?}");
    assert!(report.trust.is_none() && report.checks.iter().any(|c| c.verdict == Verdict::Skipped));
    assert_eq!(wire.lock().emulator.position_mm(), 0.0);
    assert!(!String::from_utf8_lossy(&wire.lock().sent).contains("move"));
}

#[test]
fn each_lie_fails_its_check_and_takes_the_trust_away() {
    for (lie, check) in [
        (SidecarLie::WithoutWatchdog, "silence"),
        (SidecarLie::DeafToStops, "stop"),
        (SidecarLie::Lazy, "path"),
        (SidecarLie::WrongUnits(3), "path"),
        (SidecarLie::Jump(i64::MAX), "start"),
        (SidecarLie::ClockStuck, "rate"),
    ] {
        let wire = Shared::new(Emulated::default());
        wire.lock().emulator.set_lie(Some(lie));
        let report = conform(&wire, Some(6.0));
        assert!(failed(&report).contains(&check), "{lie:?}: {:?}", failed(&report));
        assert!(report.is_unsafe(), "{lie:?}");
        assert!(report.trust.is_none_or(|trust| trust.speed_max_mm_s == 0.0), "{lie:?}");
    }
}

#[test]
fn a_slow_sidecar_may_be_trusted_with_less() {
    let speed = |reaction, rate| {
        let wire = Shared::new(Emulated { reaction, rate, ..Emulated::default() });
        let report = conform(&wire, Some(-6.0));
        assert_eq!(failed(&report), [""; 0], "{report:#?}");
        report.trust.expect("it was moved").speed_max_mm_s
    };
    let (quick, slow) = (speed(Nanos(300_000), 500.0), speed(Nanos::from_millis(60), 20.0));
    assert!(slow < quick / 2.0 && slow > 0.5, "{slow} {quick}");
    let late = Shared::new(Emulated { reaction: Nanos::from_millis(150), ..Emulated::default() });
    assert!(failed(&conform(&late, None)).contains(&"answer"));
}
