//! Curves of properties against the closed forms that made the records.

use super::*;
use crate::compliance::ComplianceCorrections;
use crate::material::{ErrorSource, MaterialRequest};
use crate::property::{Property, PropertyRequest, find_property};
use crate::report::property::property_text;
use palpate_indentation::{Base, ContactLaw, Indenter, PoissonBasis, Quantity, RelaxationFamily};
use std::fmt::Write;

const EQUILIBRIUM_MPA: f64 = 0.004;
const RELAXING_MPA: f64 = 0.008;
const TIME_S: f64 = 2.0;
const RAMP_S: f64 = 0.5;
/// A flat punch of 3 mm takes `4 R / (1 - nu) G d`.
const N_PER_MM_MPA: f64 = 4.0 * 3.0 / 0.55;

fn exact(value: f64) -> Quantity {
    Quantity { value, standard_uncertainty: 0.0 }
}

/// The property of a table of times, depths and forces.
fn found(
    indenter: Indenter,
    property: Property,
    rows: impl Iterator<Item = [f64; 3]>,
) -> PropertyReport {
    let at = tempfile::tempdir().unwrap();
    let source = at.path().join("press.csv");
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for (index, [t, depth, force]) in rows.enumerate() {
        // A square has no period that a term could describe.
        let noise = 1e-6 * (12.9898 * (index * index) as f64).sin();
        writeln!(text, "{t},{depth},{}", force + noise).unwrap();
    }
    std::fs::write(&source, text).unwrap();
    let press = MaterialRequest {
        source,
        columns: None,
        analysis: None,
        is_rejected_included: false,
        corrections: ComplianceCorrections::none(None),
        law: ContactLaw::Sneddon,
        indenter,
        thickness_mm: Some(exact(800.0)),
        base: Base::Bonded,
        poisson_ratio: exact(0.45),
        poisson_basis: PoissonBasis::Assumed,
        depth_max_mm: None,
        contact: ErrorSource::Stated(0.0),
        force_zero: ErrorSource::Recorded,
    };
    find_property(&PropertyRequest { press, property }).unwrap()
}

fn series<'a>(plot: &'a Plot, name: &str) -> &'a [[f64; 2]] {
    &plot.series.iter().find(|one| one.name == name).unwrap().points
}

#[test]
fn relaxation_and_creep_are_drawn_as_the_solid_that_made_the_record() {
    let row = |index: i32| {
        let t = 0.01 * f64::from(index);
        let (pressed, speed) = (t.min(RAMP_S), 0.6);
        let left = TIME_S * ((-(t - pressed) / TIME_S).exp() - (-t / TIME_S).exp());
        let force = speed * (EQUILIBRIUM_MPA * pressed + RELAXING_MPA * left);
        [t, speed * pressed, N_PER_MM_MPA * force]
    };
    let punch = Indenter::FlatPunch { radius_mm: exact(3.0) };
    let property = Property::Relaxation { family: Some(RelaxationFamily::Prony { terms: 1 }) };
    let report = found(punch, property, (0..=4000).map(row));
    let PropertyReport::Relaxation(relaxation) = &report else { panic!("{report:?}") };
    let [modulus, creep] = property_plots(&report);
    let first = EQUILIBRIUM_MPA + RELAXING_MPA;
    let [start, end] = [1.0 / first, 1.0 / EQUILIBRIUM_MPA];
    let retardation_s = TIME_S * first / EQUILIBRIUM_MPA;
    let expected: [&dyn Fn(f64) -> f64; 2] =
        [&|t| 1e3 * (EQUILIBRIUM_MPA + RELAXING_MPA * (-t / TIME_S).exp()), &|t| {
            1e-3 * (end - (end - start) * (-t / retardation_s).exp())
        }];
    for ((plot, name), exact) in
        [(&modulus, "relaxation modulus"), (&creep, "creep compliance")].into_iter().zip(expected)
    {
        let points = series(plot, name);
        let [low, high] = &plot.bands[0].edges;
        for (point, (low, high)) in points.iter().zip(low.iter().zip(high)) {
            let [t, value] = *point;
            assert!((value / exact(t) - 1.0).abs() < 2e-3, "{name} at {t}: {value} {}", exact(t));
            assert!(low[1] < value && value < high[1] && low[0] == t && high[0] == t);
        }
        // Nothing is drawn of what was not seen, and the end of the ramp is in sight.
        assert!((points[0][0] / relaxation.seen_from_s - 1.0).abs() < 1e-12);
        assert!((points[points.len() - 1][0] / 40.0 - 1.0).abs() < 1e-12);
        assert!((plot.stretches[0].ends[1] / (0.99 * RAMP_S) - 1.0).abs() < 0.02, "{plot:?}");
    }
}

#[test]
fn the_fitted_part_of_an_unloading_lies_on_its_power_within_all_of_it() {
    let row = |index: i32| {
        let depth = 0.001 * f64::from(200 - (index - 200).abs());
        [0.01 * f64::from(index), depth, 2.0 * depth * depth]
    };
    let cone = Indenter::Cone { half_angle_degrees: exact(75.0) };
    let report = found(cone, Property::Unloading, (0..=400).map(row));
    let [force, _] = property_plots(&report);
    // The top at 0.2 mm is 80 mN.
    assert_eq!(force.y.name, "force (mN)");
    let [first, .., last] = series(&force, "fitted part") else { panic!("{force:?}") };
    assert!((first[1] / 80.0 - 0.4).abs() < 0.01 && (last[1] / 80.0 - 0.98).abs() < 0.01);
    for [depth, newtons] in series(&force, "power of the depth") {
        assert!((newtons - 2e3 * depth * depth).abs() < 0.01, "{depth} {newtons}");
    }
    assert_eq!(series(&force, "rest").len(), 201);
}

#[test]
fn moduli_of_a_sine_stand_within_their_intervals() {
    let row = |index: i32| {
        let t = 0.01 * f64::from(index);
        let (sin, cos) = (std::f64::consts::PI * t).sin_cos();
        let force = EQUILIBRIUM_MPA * 0.3 + 0.01 * (0.009 * sin + 0.003 * cos);
        [t, 0.3 + 0.01 * sin, N_PER_MM_MPA * force]
    };
    let punch = Indenter::FlatPunch { radius_mm: exact(3.0) };
    let property = Property::Dynamic { frequency_hz: Some(0.5), moving_mass_g: None };
    let report = found(punch, property, (0..=2000).map(row));
    let [shear, ratio] = property_plots(&report);
    for (plot, name, exact) in
        [(&shear, "G'", 9.0), (&shear, "G''", 3.0), (&ratio, "tan delta", 1.0 / 3.0)]
    {
        let [[frequency, value]] = *series(plot, name) else { panic!("{plot:?}") };
        assert!(frequency == 0.5 && (value / exact - 1.0).abs() < 1e-3, "{name}: {value}");
        let holds = |one: &PlotSeries| match *one.points {
            [[_, low], [_, high]] => low < value && value < high,
            _ => false,
        };
        assert_eq!(plot.series.iter().filter(|one| holds(one)).count(), 1, "{name}");
    }
    // The record has no hold before the sine that could predict it.
    assert!(property_text(&report).contains("not predicted    from the relaxation before"));
    assert!(!shear.series.iter().any(|one| one.name.contains("predicted")));
}
