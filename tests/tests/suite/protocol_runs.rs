//! Whole protocols: the pure engine against the simulated rig, without disk or threads.

use palpate_drivers::Rig;
use palpate_drivers::sim::{SimClock, SimProfile, SimSettings};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_protocols::engine::{EndingKind, Record};
use palpate_protocols::plans::RampHold;
use palpate_tests::simulated::run;

fn short() -> RampHold {
    RampHold { speed: MmPerS(3.0), depth: Depth(12.0), hold: Seconds(2.0), ..RampHold::default() }
}

#[test]
fn ramp_and_hold_finishes_on_every_kind_of_simulated_rig() {
    for profile in [SimProfile::Lab, SimProfile::Ideal] {
        for clock in [SimClock::Nominal, SimClock::Galil] {
            for seed in 0..5 {
                let settings = SimSettings { profile, seed, clock, ..SimSettings::default() };
                let run = run(settings, short());
                let outcome = run
                    .state
                    .outcome()
                    .unwrap_or_else(|| panic!("{settings:?}: {:?}", run.state.holding()));
                assert_eq!(outcome.ending, EndingKind::Finish, "{settings:?}: {}", outcome.reason);
                // Two seconds of hold in true time, whatever the clock counts.
                let held = run.hold_ticks as f64 * run.rig.description().tick().0;
                assert!((held - 2.0).abs() < 0.002, "{settings:?}: held {held} s");
            }
        }
    }
}

#[test]
fn contact_is_found_where_the_tissue_is_and_hardly_pressed() {
    for (profile, std_error_max) in [(SimProfile::Lab, 0.02), (SimProfile::Ideal, 0.06)] {
        let mut squares = 0.0;
        for seed in 0..20 {
            let run = run(
                SimSettings { profile, seed, clock: SimClock::Nominal, ..SimSettings::default() },
                short(),
            );
            let contact = run.state.contact().expect("contact");
            let error = contact.position.distance_from(run.rig.truth().surface_counted());
            assert!(contact.std_error_mm < std_error_max, "{profile:?} {seed}: {contact:?}");
            assert!(
                error.abs() < 5.0 * contact.std_error_mm,
                "{profile:?} {seed}: off by {error:.4} mm, {contact:?}"
            );
            assert!(
                run.force_peak_in_contact_search < 0.5,
                "{profile:?} {seed}: {} N",
                run.force_peak_in_contact_search
            );
            squares += (error / contact.std_error_mm).powi(2);
        }
        println!(
            "{profile:?}: mean square of contact error over standard error {:.2}",
            squares / 20.0
        );
    }
}

#[test]
fn the_probe_ends_clear_of_the_tissue() {
    let run = run(SimSettings::default(), short());
    let truth = run.rig.truth();
    assert!(truth.position.0 < truth.surface.0 - 9.0);
    assert!(run.records.iter().any(|record| matches!(record, Record::Homed { .. })));
}

#[test]
fn too_deep_for_the_travel_is_refused_when_contact_is_known() {
    let params = RampHold { depth: Depth(120.0), ..short() };
    let run = run(SimSettings::default(), params);
    let ending = run.state.holding().expect("aborted");
    assert_eq!(ending.ending, EndingKind::Abort);
    assert!(ending.reason.contains("beyond the travel"), "{}", ending.reason);
    assert!(run.rig.truth().force < Newtons(0.5));
}
