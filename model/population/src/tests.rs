use crate::likelihood::{Evaluation, SpreadFactor};
use crate::search::Coordinates;
use crate::study::NestedStudy;
use crate::{Evidence, PopulationOptions, Study, StudyError, StudySession, fit_population};
use nalgebra::{Cholesky, DMatrix, DVector};
use palpate_model::random::SplitMix;

/// An unbalanced study of two parameters with an effect.
fn study(random: &mut SplitMix) -> Study {
    let mut sessions = Vec::new();
    for animal in 0..4 {
        let outer = random.normal();
        for site in 0..1 + animal % 3 {
            let inner = outer + 0.5 * random.normal();
            for repeat in 0..1 + (animal + site) % 3 {
                let shear = random.normal();
                let information = DMatrix::from_row_slice(2, 2, &[40.0, 9.0, 9.0, 30.0 + shear]);
                sessions.push(StudySession {
                    groups: vec![format!("a{animal}"), format!("s{site}")],
                    design: vec![1.0, f64::from(repeat)],
                    values: vec![
                        inner + 0.2 * random.normal(),
                        1.0 - inner + 0.3 * random.normal(),
                    ],
                    evidence: Evidence::Information(information),
                });
            }
        }
    }
    Study {
        parameters: ["stiffness", "time"].map(String::from).to_vec(),
        effects: ["mean", "order"].map(String::from).to_vec(),
        levels: ["animal", "site", "repeat"].map(String::from).to_vec(),
        sessions,
    }
}

fn factors() -> Vec<SpreadFactor> {
    [[0.9, 0.0, -0.4, 0.5], [0.4, 0.0, 0.1, 0.0], [0.2, 0.0, 0.05, 0.12]]
        .map(|entries| SpreadFactor::of(DMatrix::from_row_slice(2, 2, &entries)))
        .to_vec()
}

/// The same by the covariance of all values at once.
fn dense(study: &NestedStudy, factors: &[SpreadFactor]) -> Evaluation {
    let (count, sessions) = (study.parameters, &study.sessions);
    let size = count * sessions.len();
    let [outer, inner, own] = [0, 1, 2].map(|level: usize| factors[level].covariance());
    let mut covariance = DMatrix::zeros(size, size);
    let mut design = DMatrix::zeros(size, count * study.effects);
    let mut values = DVector::zeros(size);
    let mut of_errors = 0.0;
    for (i, session) in sessions.iter().enumerate() {
        for (j, other) in sessions.iter().enumerate() {
            let mut block = covariance.view_mut((i * count, j * count), (count, count));
            if session.groups[0] == other.groups[0] {
                block += &outer;
                if session.groups[1] == other.groups[1] {
                    block += &inner;
                }
            }
            if i == j {
                block += &own;
                if let Evidence::Information(information) = &session.evidence {
                    let factor = Cholesky::new(information.clone()).unwrap();
                    block += factor.inverse();
                    of_errors -= factor.determinant().ln();
                }
            }
        }
        for (k, factor) in session.design.iter().enumerate() {
            let one = DMatrix::identity(count, count) * *factor;
            design.view_mut((i * count, k * count), (count, count)).copy_from(&one);
        }
        values.rows_mut(i * count, count).copy_from(&session.vector());
    }
    let whole = Cholesky::new(covariance).unwrap();
    let precision = Cholesky::new(design.tr_mul(&whole.solve(&design))).unwrap();
    let effects = precision.solve(&design.tr_mul(&whole.solve(&values)));
    let residual = &values - &design * &effects;
    let square = residual.dot(&whole.solve(&residual));
    Evaluation {
        criterion: whole.ln_determinant() - of_errors + precision.ln_determinant() + square,
        covariance: precision.inverse(),
        effects,
    }
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{found} {expected}");
}

#[test]
fn the_tree_is_the_covariance_of_all_values_at_once() {
    let nested = study(&mut SplitMix::seeded(3)).nested().unwrap();
    // A variance below zero, too, as long as the whole is a covariance.
    for sign in [1.0, -1.0] {
        let mut factors = factors();
        factors[1].root[(0, 0)] = 0.1;
        factors[1].signs[0] = sign;
        let (found, expected) = (nested.evaluate(&factors).unwrap(), dense(&nested, &factors));
        close(found.criterion, expected.criterion);
        found.effects.iter().zip(&expected.effects).for_each(|(a, b)| close(*a, *b));
        found.covariance.iter().zip(&expected.covariance).for_each(|(a, b)| close(*a, *b));
    }
}

/// Differences over 1e-6 are good to about 1e-8 of a criterion of some tens.
#[test]
fn the_gradient_is_that_of_differences() {
    for exact in [false, true] {
        let mut study = study(&mut SplitMix::seeded(4));
        if exact {
            study.sessions.iter_mut().for_each(|one| one.evidence = Evidence::Exact);
        }
        let nested = study.nested().unwrap();
        let mut factors = factors();
        // Exact values need a whole covariance of their own.
        factors[2].signs[1] = if exact { 1.0 } else { -1.0 };
        let (_, gradient) = nested.evaluate_with_gradient(&factors).unwrap();
        for level in 0..3 {
            for (row, column) in [(0, 0), (1, 0), (1, 1)] {
                let shifted = |by: f64| {
                    let mut other = factors.clone();
                    other[level].root[(row, column)] += by;
                    nested.evaluate(&other).unwrap().criterion
                };
                let slope = (shifted(1e-6) - shifted(-1e-6)) / 2e-6;
                let found = gradient[level][(row, column)];
                assert!((found - slope).abs() < 1e-6 * slope.abs().max(1.0), "{found} {slope}");
            }
        }
    }
}

/// The most probable shifts are those of the whole covariance: of a session, what its values and those of its relatives say.
#[test]
fn shifts_are_those_of_the_covariance_of_all() {
    let nested = study(&mut SplitMix::seeded(5)).nested().unwrap();
    let factors = factors();
    let effects = nested.evaluate(&factors).unwrap().effects;
    let shifts = nested.shifts(&factors, &effects).unwrap();
    // All shifts at once: the least squares of values and shifts, each over its spread.
    let counts: Vec<usize> = shifts.iter().map(Vec::len).collect();
    let starts = [0, counts[0], counts[0] + counts[1]];
    let total = 2 * counts.iter().sum::<usize>();
    let (mut matrix, mut right) = (DMatrix::zeros(total, total), DVector::zeros(total));
    for level in 0..3 {
        let precision = factors[level].covariance().pseudo_inverse(1e-12).unwrap();
        for k in 0..counts[level] {
            let at = 2 * (starts[level] + k);
            let mut block = matrix.view_mut((at, at), (2, 2));
            block += &precision;
        }
    }
    for (index, session) in nested.sessions.iter().enumerate() {
        let Evidence::Information(information) = &session.evidence else { unreachable!() };
        let site = nested.owner[index];
        let own = [nested.parents[1][site], starts[1] + site, starts[2] + index];
        let residual = session.vector() - nested.session_mean(index, &effects);
        for a in own {
            for b in own {
                let mut block = matrix.view_mut((2 * a, 2 * b), (2, 2));
                block += information;
            }
            let mut block = right.rows_mut(2 * a, 2);
            block += information * &residual;
        }
    }
    // The spread of sites has one direction only; the other has no shift.
    let along = DVector::from_vec(vec![0.4, 0.1]).normalize();
    let mut keep = DMatrix::identity(total, total);
    for site in 0..counts[1] {
        let at = 2 * (starts[1] + site);
        keep.view_mut((at, at), (2, 2)).copy_from(&(&along * along.transpose()));
    }
    let covariance = (&keep * matrix * &keep).pseudo_inverse(1e-10).unwrap();
    let solution = &covariance * (&keep * right);
    for (index, one) in shifts[2].iter().enumerate() {
        let shift = &one.shift;
        let site = nested.owner[index];
        let own = [nested.parents[1][site], starts[1] + site, starts[2] + index];
        for k in 0..2 {
            let expected: f64 = own.iter().map(|one| solution[2 * one + k]).sum();
            assert!((shift[k] - expected).abs() < 1e-8, "{} {expected}", shift[k]);
            let pairs = own.iter().flat_map(|a| own.iter().map(move |b| (2 * a + k, 2 * b + k)));
            let variance: f64 = pairs.map(|pair| covariance[pair]).sum();
            assert!((one.covariance[(k, k)] / variance - 1.0).abs() < 1e-6, "{variance}");
        }
    }
}

/// A curve that does not tell a parameter adds nothing to what the others say of it.
#[test]
fn a_parameter_that_a_session_does_not_tell_is_left_to_the_others() {
    let mut random = SplitMix::seeded(6);
    let mut study = study(&mut random);
    let open = DMatrix::from_row_slice(2, 2, &[40.0, 0.0, 0.0, 0.0]);
    study.sessions[0].evidence = Evidence::Information(open);
    study.sessions[0].values[1] = 1e6;
    let far = study.nested().unwrap().evaluate(&factors()).unwrap();
    study.sessions[0].values[1] = 0.0;
    let near = study.nested().unwrap().evaluate(&factors()).unwrap();
    close(far.criterion, near.criterion);
    close(far.effects[1], near.effects[1]);
}

#[test]
fn a_spread_that_is_not_there_is_zero_and_its_interval_starts_there() {
    let mut random = SplitMix::seeded(8);
    let mut study = study(&mut random);
    for (index, session) in study.sessions.iter_mut().enumerate() {
        // Each site has the same mean of its animal: the sites scatter less than their repeats let expect.
        session.values = vec![if index % 2 == 0 { 1.0 } else { -1.0 }, random.normal()];
    }
    let options = PopulationOptions { has_spread_intervals: true, ..Default::default() };
    let fit = fit_population(&study, options).unwrap();
    let animals = &fit.spreads[0];
    assert!(animals.is_zero && animals.value == 0.0, "{animals:?}");
    assert_eq!(animals.interval[0], Some(0.0));
    assert!(animals.interval[1].unwrap() > 0.0);
}

#[test]
fn studies_that_say_nothing_are_refused() {
    let whole = study(&mut SplitMix::seeded(9));
    let refusal = |change: &dyn Fn(&mut Study)| {
        let mut other = whole.clone();
        change(&mut other);
        fit_population(&other, PopulationOptions::default()).unwrap_err()
    };
    let one_animal = refusal(&|study| study.sessions.retain(|one| one.groups[0] == "a2"));
    assert_eq!(one_animal, StudyError::OneGroup { level: "animal".into() });
    let same = refusal(&|study| study.sessions.iter_mut().for_each(|one| one.groups[1].clear()));
    assert!(matches!(same, StudyError::SameGroups { .. }), "{same}");
    let few = refusal(&|study| study.sessions.truncate(4));
    assert!(matches!(few, StudyError::Sessions { .. }), "{few}");
    let double = refusal(&|study| study.sessions.iter_mut().for_each(|one| one.design[1] = 2.0));
    assert!(matches!(double, StudyError::Effects { .. }), "{double}");
    let open = refusal(&|study| study.sessions[2].values[0] = f64::NAN);
    assert_eq!(open, StudyError::NotFinite { session: 2, what: "value" });
}

#[test]
fn scales_are_the_scatter_of_the_values() {
    let nested = study(&mut SplitMix::seeded(1)).nested().unwrap();
    let coordinates = Coordinates::of(&nested, true);
    assert_eq!(coordinates.all.len(), 9);
    assert!(coordinates.scales.iter().all(|scale| *scale > 0.0));
}
