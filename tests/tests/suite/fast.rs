//! Twenty times the usual rate: the same run, found and fitted better, with every sample on disk.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimClock, SimProfile, SimRig, SimSettings};
use palpate_model::rig::{Limits, Phase};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::engine::{EndingKind, Record};
use palpate_protocols::plans::RampHold;
use palpate_protocols::preview::preview;
use palpate_rheology::fit::{FitOptions, fit};
use palpate_runner::replay::replay;
use palpate_runner::{StartedRun, TimeScale};
use palpate_sessions::{EntryKind, Session};
use palpate_test_support::wait::PATIENCE;
use palpate_tests::built_in_plan;
use palpate_tests::lab::Lab;
use palpate_tests::recorded_runs;
use palpate_tests::simulated::run;

fn settings(profile: SimProfile, rate: &str, seed: u64) -> SimSettings {
    SimSettings { profile, rate: rate.parse().unwrap(), seed, ..SimSettings::default() }
}

fn short() -> RampHold {
    RampHold { speed: MmPerS(3.0), depth: Depth(15.0), hold: Seconds(4.0), ..RampHold::default() }
}

#[test]
fn a_fast_rig_finds_contact_and_body_as_well_as_its_samples_allow() {
    let known = |rate: &str, clock: SimClock, seed: u64| {
        let settings = SimSettings { clock, ..settings(SimProfile::Ideal, rate, seed) };
        let run = run(settings, short());
        let outcome = run.state.outcome().unwrap();
        assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
        let held = run.hold_ticks as f64 * run.rig.description().tick().0;
        assert!((held - 4.0).abs() < 0.002, "{settings:?}: held {held} s");
        let contact = run.state.contact().unwrap();
        let surface = run.rig.truth().surface_counted();
        let miss = surface.distance_from(contact.position);
        assert!(miss.abs() < 5.0 * contact.std_error_mm, "{settings:?}");
        assert!(run.force_peak_in_contact_search < 0.5, "{settings:?}");
        let mut options = FitOptions::default();
        options.fix("x_contact", miss).unwrap();
        let report = fit(&run.samples, &options).unwrap();
        let body = run.rig.truth().body;
        for (name, truth) in [("tau_eps", body.tau_eps), ("mu1", body.mu[0])] {
            let found = report.parameter(name).unwrap();
            let error = found.std_error.unwrap();
            // Five standard errors: once in a million and a half.
            let miss = (found.value - truth).abs();
            assert!(miss < 5.0 * error, "{settings:?} {name}: {found:?}");
        }
        let error = report.parameter("tau_eps").unwrap().std_error.unwrap();
        (contact.std_error_mm, error)
    };
    for seed in 1..4 {
        let (touch, tau) = known("1000", SimClock::Nominal, seed);
        for (rate, clock) in [("5000", SimClock::Galil), ("20000", SimClock::Nominal)] {
            let (fast_touch, fast_tau) = known(rate, clock, seed);
            let samples = 1e-3 * rate.parse::<f64>().unwrap();
            // White noise in n times the samples tells as much as a root of n less noise; the fit's own estimate of the
            // noise differs from run to run.
            for (one, other) in [(touch, fast_touch), (tau, fast_tau)] {
                let gain = one / other / samples.sqrt();
                assert!((0.7..1.4).contains(&gain), "seed {seed}, {rate}: {gain}");
            }
        }
    }
}

#[test]
fn searches_for_a_force_a_base_and_a_weight_take_as_long_as_ever() {
    for (name, values) in [
        ("stiff-surface", &[("force", "1 N"), ("repeats", "1")][..]),
        ("preconditioning-force", &[("force", "1 N"), ("cycles", "1"), ("rest", "0 s")]),
        ("creep", &[("force", "1 N"), ("duration", "10 s")]),
        ("load-cell-calibration", &[("repeats", "1")]),
    ] {
        let times = ["1000", "20000"].map(|rate| {
            let settings = SimSettings {
                compliance: "30".parse().unwrap(),
                ..settings(SimProfile::Lab, rate, 3)
            };
            let rig = SimRig::new(settings);
            let curve = rig.calibration().curve().unwrap();
            let mut lab = Lab::new(rig, curve, built_in_plan(name, values)).forgetful();
            lab.run();
            let outcome = lab.outcome.clone();
            let outcome = outcome.unwrap_or_else(|| panic!("{name} {:?}", lab.state().holding()));
            assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
            lab.now.seconds().0
        });
        // Corrections of a held force depend on the noise.
        assert!((times[1] / times[0] - 1.0).abs() < 0.02, "{name}: {times:?}");
    }
}

#[test]
fn moves_and_waits_take_what_the_preview_says() {
    let rig = SimRig::new(settings(SimProfile::Lab, "20000", 3));
    let (curve, plan) = (rig.calibration().curve().unwrap(), short().plan());
    let limits = Limits::for_travel(rig.description().travel);
    let expected = preview(&plan, rig.description(), &limits, &curve, false).steps;
    let mut lab = Lab::new(rig, curve, plan).forgetful();
    lab.run();
    let begun = |wanted: Phase| {
        let is_begin = |record: &Record| matches!(record, Record::PhaseStarted { phase, .. } if *phase == wanted);
        let found = lab.records.iter().find(|(_, record)| is_begin(record));
        found.unwrap().0.seconds().0
    };
    let of = |phase: Phase| expected.iter().find(|step| step.phase == phase).unwrap();
    let took = begun(Phase::Hold) - begun(Phase::Ramp) - of(Phase::Ramp).expected.0;
    // Reports take 1.0 to 1.5 ms, which counts once in the answer of the axis and once in when a phase is seen to begin.
    assert!((-1.05e-3..0.55e-3).contains(&took), "ramp: {took:e}");
    assert!(!of(Phase::Ramp).is_exact && of(Phase::Hold).is_exact);
    let took = begun(Phase::Retract) - begun(Phase::Hold) - of(Phase::Hold).expected.0;
    assert!(took.abs() < 0.55e-3, "hold: {took:e}");
}

/// Every tick of a recording is in it, and it replays.
fn is_whole(session: &Session, rate: f64) {
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "finish", "{}", end.reason);
    assert_eq!(session.rows.len() as u64, end.samples);
    let gapless = session.rows.windows(2).all(|two| two[1].tick == two[0].tick + 1);
    assert!(gapless, "samples are missing");
    // From the first sample to the last, less what reports vary by on their way.
    let [first, last] = [0, session.rows.len() - 1].map(|i| session.rows[i].host.seconds().0);
    let counted = (session.rows.len() - 1) as f64 / rate;
    assert!((last - first - counted).abs() < 1e-3);
    let report = replay(session, &[]).unwrap();
    assert_eq!(report.first_difference, None);
    assert_eq!(report.samples, end.samples);
}

#[test]
fn all_samples_are_on_disk_and_replay() {
    let rig = SimRig::new(settings(SimProfile::Ideal, "20000", 5));
    let (calibration, tau) = (rig.calibration(), rig.truth().body.tau_eps);
    let session = recorded_runs::record_ramp_hold(Box::new(rig), calibration, short());
    is_whole(&session, 20_000.0);
    assert_eq!(session.manifest.rig.as_ref().unwrap().settings["rate"], "20000");
    // Two answers of the live fit a second, the last near the truth: 0.3 % is three standard errors.
    let measured = |phase| matches!(phase, Phase::Ramp | Phase::Hold);
    let samples = session.rows.iter().filter(|row| measured(row.phase)).count();
    let mut fits = session.entries.iter().filter(|entry| entry.kind == EntryKind::Fit);
    assert!(fits.clone().count().abs_diff(samples / 10_000) <= 1);
    let last = fits.next_back().unwrap().body["parameters"].as_array().unwrap();
    let found = last.iter().find(|one| one["name"] == "tau_eps").unwrap();
    let found = found["value"].as_f64().unwrap();
    assert!((found / tau - 1.0).abs() < 3e-3, "{found} {tau}");
}

#[test]
fn a_fast_rig_loses_nothing_at_real_pace_with_the_live_fit() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    let rig = SimRig::new(settings(SimProfile::Lab, "20000", 6));
    let calibration = rig.calibration();
    // Twenty times as fast as the wall, for a run of two minutes would be a long test.
    let StartedRun { runner, woken, .. } = recorded_runs::start(
        Box::new(rig),
        calibration,
        short().plan(),
        TimeScale::Factor(20.0),
        &out,
    );
    let ended = || runner.snapshot().run.as_ref().is_some_and(|run| run.outcome.is_some());
    while !ended() {
        woken.recv_timeout(PATIENCE).unwrap();
    }
    let lateness = runner.snapshot().run.as_ref().unwrap().lateness.unwrap();
    assert!(lateness.worst.0 >= 0.0 && lateness.given_up.0 >= 0.0);
    drop(runner);
    is_whole(&Session::open(&out).unwrap(), 20_000.0);
}
