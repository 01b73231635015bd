//! A rig that gives way: how much, found on a stiff surface, and what a fit makes of depths with and without it.
use palpate_analysis::compliance::{
    ComplianceCorrections, ComplianceMeasurementError, compliance_from_session,
};
use palpate_analysis::source::{FitSource, RecordStretch, fit_samples};
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::units::Seconds;
use palpate_protocols::file::built_in;
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{FitOptions, FitReport, fit};
use palpate_sessions::Session;
use palpate_sessions::document_store::save_document;
use palpate_tests::interval_coverage::{CoverageCase, recorded};
use palpate_tests::recorded_runs;
use std::collections::BTreeMap;

/// The base the simulated rig presses gives way by this much itself, in mm/N.
const BASE: f64 = 1e-3;

fn rig(um_per_n: &str) -> SimRig {
    SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        seed: 11,
        compliance: um_per_n.parse().unwrap(),
        ..SimSettings::default()
    })
}

fn stiff_surface(um_per_n: &str) -> Session {
    let protocol = built_in("stiff-surface").unwrap().unwrap();
    let plan = protocol.plan(&BTreeMap::new()).unwrap();
    let rig = rig(um_per_n);
    let calibration = rig.calibration();
    recorded_runs::record_plan(Box::new(rig), calibration, plan)
}

/// The five parameters of the body, true and fitted with their standard errors.
fn body(rig: &SimRig, report: &FitReport) -> [(f64, f64, f64); 5] {
    let truth = rig.truth().body;
    let truth = [
        ("tau_eps", truth.tau_eps),
        ("mu1", truth.mu[0]),
        ("mu2", truth.mu[1]),
        ("mu3", truth.mu[2]),
        ("tau_sig", truth.tau_sig),
    ];
    truth.map(|(name, truth)| {
        let found = report.parameter(name).unwrap();
        (truth, found.value, found.std_error.unwrap())
    })
}

#[test]
fn depths_less_what_the_rig_gives_way_bring_the_parameters_back() {
    let library = tempfile::tempdir().unwrap();
    let options = FitOptions::default();
    let stiff = fit(&source(&recorded_on("0")).samples, &options).unwrap();
    let stiff = body(&rig("0"), &stiff);
    for um_per_n in ["20", "60", "100"] {
        let wanted = um_per_n.parse::<f64>().unwrap() * 1e-3 + BASE;
        let found = compliance_from_session(&stiff_surface(um_per_n), None).unwrap();
        println!("{um_per_n} um/N: {:.5} ± {:.5} mm/N", found.mm_per_n, found.std_error_mm_per_n);
        assert_eq!(found.presses.len(), 3);
        let error = found.mm_per_n - wanted;
        // Four standard errors; of three presses the scatter itself is known to a half.
        assert!(error.abs() < 4.0 * found.std_error_mm_per_n + 1e-4 * wanted, "{error} {found:?}");
        let folder = library.path().join(um_per_n);
        save_document(&folder, &found).unwrap();

        let truth = rig(um_per_n);
        let session = recorded_on(um_per_n);
        let raw = source(&session);
        let mut corrected = raw.clone();
        let corrections = ComplianceCorrections::named("last", Some(&folder)).unwrap();
        let correction = corrections.apply(&mut corrected).unwrap().unwrap();
        println!("  {}", correction.sentence());
        assert!(
            correction.is_applied
                && (correction.at_peak_um - 1e3 * wanted * correction.force_peak_n).abs() < 5.0
        );
        let before = body(&truth, &fit(&raw.samples, &options).unwrap());
        let after = body(&truth, &fit(&corrected.samples, &options).unwrap());
        for ((raw, corrected), stiff) in before.iter().zip(&after).zip(&stiff) {
            let off = |one: &(f64, f64, f64)| (one.1 - one.0) / one.2;
            println!(
                "  true {:.5}: raw {:.5} ({:+.1} sigma), corrected {:.5} ({:+.1} sigma), stiff rig {:.5}",
                raw.0,
                raw.1,
                off(raw),
                corrected.1,
                off(corrected),
                stiff.1
            );
            // The contact's own error is left, which no compliance makes or mends: the rig that does not give way
            // has it too. Three standard errors of the difference of two fits.
            let left = (corrected.1 - stiff.1).abs();
            assert!(left < 3.0 * corrected.2.hypot(stiff.2), "{corrected:?} {stiff:?}");
            assert!((raw.1 - stiff.1).abs() > 3.0 * left, "{raw:?} {stiff:?}");
        }
    }
}

#[test]
fn a_drifting_zero_and_a_curved_cell_leave_the_compliance_exact() {
    let mut squares = 0.0;
    let seeds = 0..6;
    let count = seeds.end as f64;
    for seed in seeds {
        let compliance = "60".parse().unwrap();
        let settings = SimSettings { seed, compliance, ..SimSettings::default() };
        let plan = built_in("stiff-surface").unwrap().unwrap().plan(&BTreeMap::new()).unwrap();
        let rig = SimRig::new(settings);
        let calibration = rig.calibration();
        let session = recorded_runs::record_plan(Box::new(rig), calibration, plan);
        let found = compliance_from_session(&session, None).unwrap();
        let error = found.mm_per_n - 0.06 - BASE;
        println!("{seed}: {:.2} ± {:.2} um/N", 1e3 * error, 1e3 * found.std_error_mm_per_n);
        assert!(error.abs() < 4.0 * found.std_error_mm_per_n, "{error} {found:?}");
        squares += error * error;
    }
    // The root mean square of 60 seeds is 0.022 um/N, and of lines through forces above the tare 0.3.
    assert!((squares / count).sqrt() < 6e-5, "{squares}");
}

/// The search takes every depth for the probe's own and meets a surface that the rig gives way from too early.
#[test]
fn contact_of_a_rig_that_gives_way_moves_to_the_surface() {
    let case = CoverageCase::named("soft");
    let (mut found, mut corrected) = (0.0f64, 0.0f64);
    for seed in 1..=4 {
        let settings = SimSettings { seed, ..case.settings };
        let case = CoverageCase { settings, ..case };
        let calibration = SimRig::new(settings).calibration();
        let (recording, truth) = recorded(&case, &calibration, None);
        let signal = recording.signal.unwrap();
        let [.., surface] = truth;
        println!("{seed}: surface {surface:.5} mm, contact {:.5} mm", signal.contact_shift_mm);
        let left = surface - signal.contact_shift_mm;
        assert!(left.abs() < 3.5 * signal.contact_error_mm, "seed {seed}: {left}");
        (found, corrected) = (found + surface.powi(2), corrected + left.powi(2));
    }
    // 60 um/N times a tenth of a newton is 6 um; touches are good to 1.5 um.
    assert!(corrected < 0.2 * found, "{corrected} {found}");
}

/// A ramp and hold on such a rig.
fn recorded_on(um_per_n: &str) -> Session {
    let rig = rig(um_per_n);
    let calibration = rig.calibration();
    recorded_runs::record_ramp_hold(Box::new(rig), calibration, RampHold::default())
}

fn source(session: &Session) -> FitSource {
    FitSource {
        samples: fit_samples(session, RecordStretch::RampHold).unwrap(),
        signal: None,
        start: Seconds(0.0),
        offset: Seconds(0.0),
        notes: Vec::new(),
        specimen: None,
        rig: session.manifest.rig.as_ref().map(|rig| rig.name.clone()),
        calibration: None,
        raw: None,
        touches: Vec::new(),
        thickness_mm: None,
    }
}

#[test]
fn a_session_that_touched_no_base_tells_no_compliance() {
    let refused = compliance_from_session(&recorded_on("60"), None);
    assert!(matches!(refused, Err(ComplianceMeasurementError::NoSurface)), "{refused:?}");
}
