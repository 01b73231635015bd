use super::*;
use crate::shape::IndenterShape;
use crate::viscoelastic::lee_radok_force;

fn body() -> RelaxationModulus {
    let term = |(modulus_mpa, time_secs)| RelaxationMode { modulus_mpa, time_secs };
    let terms = [(0.03, 0.1), (0.02, 1.0), (0.015, 10.0)].map(term).to_vec();
    RelaxationModulus { equilibrium_mpa: 0.01, terms, exponent: 1.0 }
}

/// Numbers of about a normal distribution.
fn normals(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        // Knuth's generator for MMIX.
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// A test: ramp time and hold time in s, noise over the largest force.
#[derive(Clone, Copy)]
pub(super) struct Test {
    pub shape: IndenterShape,
    pub ramp: f64,
    pub hold: f64,
    pub noise: f64,
    pub seed: u64,
}

pub(super) const TEST: Test = Test { shape: SPHERE, ramp: 0.1, hold: 60.0, noise: 1e-3, seed: 1 };
const ONE_TERM: RelaxationFamily = RelaxationFamily::Prony { terms: 1 };
const THREE_TERMS: RelaxationFamily = RelaxationFamily::Prony { terms: 3 };
pub(super) const SPHERE: IndenterShape = IndenterShape::Sphere { radius_mm: 5.0 };
pub(super) const PUNCH: IndenterShape = IndenterShape::FlatPunch { radius_mm: 2.0 };
pub(super) const CONE: IndenterShape = IndenterShape::Cone { half_angle_rad: 1.2 };

impl Test {
    /// Samples every 10 ms, and at the corner.
    pub fn record(self, body: &RelaxationModulus) -> (PowerLaw, DepthHistory, Vec<f64>) {
        let corner = self.ramp;
        let count = ((corner + self.hold) / 0.01) as i32;
        let mut times: Vec<f64> = (0..count).map(|k| 0.01 * f64::from(k)).collect();
        times.push(corner);
        times.sort_by(f64::total_cmp);
        let depths: Vec<f64> = times.iter().map(|t| 0.3 * (t / corner).min(1.0)).collect();
        let history = DepthHistory::new(&times, &depths).unwrap();
        let law = PowerLaw::new(self.shape, 0.5).unwrap();
        let exact = lee_radok_force(law, body, &history).unwrap();
        let largest = exact.iter().copied().fold(0.0, f64::max);
        let mut normal = normals(self.seed);
        let forces = exact.iter().map(|force| force + self.noise * largest * normal()).collect();
        (law, history, forces)
    }

    fn fit(
        self,
        body: &RelaxationModulus,
        terms: usize,
    ) -> Result<RelaxationFit, RelaxationFitError> {
        self.fit_family(body, RelaxationFamily::Prony { terms })
    }

    pub fn fit_family(
        self,
        body: &RelaxationModulus,
        family: RelaxationFamily,
    ) -> Result<RelaxationFit, RelaxationFitError> {
        let (law, history, forces) = self.record(body);
        fit_relaxation(law, &history, &forces, family)
    }
}

/// The largest share by which a fit is off the body's modulus, from a hundredth of the shortest time to 60 s.
fn off(fit: &RelaxationFit) -> f64 {
    let times = (0..80).map(|k| 1e-3 * 10f64.powf(0.06 * f64::from(k)));
    times.map(|t| (fit.modulus.modulus(t) / body().modulus(t) - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn three_terms_are_found_from_ramps_short_and_long_against_the_shortest_time() {
    let mut worst: f64 = 0.0;
    for shape in [PUNCH, SPHERE, CONE] {
        for ramp_over_time in [0.01, 0.03, 0.1, 0.3, 1.0, 3.0] {
            let test = Test { shape, ramp: 0.1 * ramp_over_time, noise: 1e-2, ..TEST };
            let fit = test.fit(&body(), 3).unwrap();
            worst = worst.max(off(&fit));
            for (number, term) in fit.modulus.terms.iter().enumerate() {
                let (exact, error) = (body().terms[number], fit.standard_errors.terms[number]);
                let time = (term.time_secs - exact.time_secs).abs();
                let modulus = (term.modulus_mpa - exact.modulus_mpa).abs();
                assert!(time < 4.5 * error.time_secs, "{ramp_over_time} {term:?} {error:?}");
                assert!(modulus < 4.5 * error.modulus_mpa, "{ramp_over_time} {term:?} {error:?}");
            }
        }
    }
    println!("off: {worst:e}");
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn record_without_noise_gives_the_body_back() {
    let fit = Test { noise: 0.0, ramp: 0.3, ..TEST }.fit(&body(), 3).unwrap();
    assert!(off(&fit) < 1e-10, "{}", off(&fit));
}

#[test]
fn what_is_not_identifiable_is_refused_in_one_sentence() {
    let refusal = |test: Test, body: &RelaxationModulus, count: usize| {
        test.fit(body, count).unwrap_err().to_string()
    };
    let slow = refusal(Test { ramp: 3.0, ..TEST }, &body(), 3);
    assert!(slow.contains("is not identifiable behind a ramp of 2.94"), "{slow}");
    assert!(slow.contains("less than 10 times the shortest time"), "{slow}");
    // The standard errors reach a tenth between these.
    assert!(Test { noise: 0.02, ..TEST }.fit(&body(), 3).is_ok());
    let noisy = refusal(Test { noise: 0.08, ..TEST }, &body(), 3);
    assert!(noisy.contains("is not identifiable in this record"), "{noisy}");
    let short = refusal(Test { hold: 3.0, ..TEST }, &body(), 3);
    assert!(short.contains("is not identifiable in this record"), "{short}");
    // A term that is not there.
    let two = RelaxationModulus { terms: body().terms[1..].to_vec(), ..body() };
    for seed in 1..4 {
        let refused = Test { seed, ..TEST }.fit(&two, 3);
        assert!(refused.is_err(), "{seed}: {refused:?}");
        assert!(Test { seed, ..TEST }.fit(&two, 2).is_ok());
    }
}

/// Over many records the squares of the errors over their standard errors are one on average.
#[test]
fn standard_errors_are_the_spread_of_the_fits() {
    let draws = 60;
    let mut squares = [0.0; 4];
    for seed in 1..=draws {
        let fit = Test { seed, hold: 20.0, noise: 2e-3, ..TEST }.fit(&body(), 3).unwrap();
        let (found, exact, error) = (&fit.modulus, body(), &fit.standard_errors);
        // Of the moduli, the equilibrium and the logarithms of the times.
        let age = |term: &RelaxationMode| 0.3 / term.time_secs;
        let of_moduli = found.terms.iter().map(|term| (-age(term)).exp());
        let of_times =
            found.terms.iter().map(|term| term.modulus_mpa * age(term) * (-age(term)).exp());
        let gradient: Vec<f64> = of_moduli.chain([1.0]).chain(of_times).collect();
        for (sum, (found, exact, error)) in squares.iter_mut().zip([
            (found.terms[0].time_secs, exact.terms[0].time_secs, error.terms[0].time_secs),
            (found.terms[2].modulus_mpa, exact.terms[2].modulus_mpa, error.terms[2].modulus_mpa),
            (found.equilibrium_mpa, exact.equilibrium_mpa, error.equilibrium_mpa),
            (found.modulus(0.3), exact.modulus(0.3), fit.standard_error_along(&gradient)),
        ]) {
            *sum += ((found - exact) / error).powi(2) / draws as f64;
        }
    }
    // Of 60 squares the mean has the standard deviation 0.18.
    println!("squares: {squares:?}");
    assert!(squares.iter().all(|mean| (0.45..1.55).contains(mean)), "{squares:?}");
}

#[test]
fn bad_records_are_refused_in_words() {
    let (law, history, forces) = Test { hold: 1.0, ..TEST }.record(&body());
    let message = |forces: &[f64], terms: usize| {
        let family = RelaxationFamily::Prony { terms };
        fit_relaxation(law, &history, forces, family).unwrap_err().to_string()
    };
    assert_eq!(message(&forces, 0), "the number of terms is 0; give 1 to 5");
    assert_eq!(message(&forces, 6), "the number of terms is 6; give 1 to 5");
    assert!(message(&forces[1..], 1).contains("give one for each"));
    let mut holes = forces.clone();
    holes[7] = f64::NAN;
    assert!(message(&holes, 1).starts_with("the force of sample 7 is NaN"));
    assert!(message(&vec![0.0; forces.len()], 1).contains("take fewer terms"));
    let still = DepthHistory::new(&[0.0, 1.0, 2.0, 3.0], &[0.0; 4]).unwrap();
    assert!(fit_relaxation(law, &still, &[0.1; 4], ONE_TERM).is_err());
    let once = DepthHistory::new(&[1.0; 9], &[0.1; 9]).unwrap();
    let few = fit_relaxation(law, &once, &[0.1; 9], ONE_TERM).unwrap_err().to_string();
    assert!(few.starts_with("the record has 1 samples at different times"), "{few}");
}

/// A fit again of forces with an error says what the error does.
#[test]
fn small_errors_of_force_move_the_fit_by_as_much_as_a_fit_of_them() {
    let test = Test { noise: 1e-3, ramp: 0.3, hold: 20.0, ..TEST };
    let (law, history, forces) = test.record(&body());
    let fit = fit_relaxation(law, &history, &forces, THREE_TERMS).unwrap();
    let largest = forces.iter().copied().fold(0.0, f64::max);
    let error = |force: &f64| 2e-3 * force * (force / largest - 0.3);
    let errors: Vec<f64> = forces.iter().map(error).collect();
    let moved: Vec<f64> = forces.iter().zip(&errors).map(|(force, error)| force + error).collect();
    let again = fit_relaxation(law, &history, &moved, THREE_TERMS).unwrap();
    let shifts = fit.shift_by(&errors);
    for number in 0..3 {
        let (before, after) = (fit.modulus.terms[number], again.modulus.terms[number]);
        let of_modulus = after.modulus_mpa - before.modulus_mpa;
        let of_time = (after.time_secs / before.time_secs).ln();
        assert!((shifts[number] / of_modulus - 1.0).abs() < 0.02, "{number}: {of_modulus:e}");
        assert!((shifts[4 + number] / of_time - 1.0).abs() < 0.02, "{number}: {of_time:e}");
    }
    let of_equilibrium = again.modulus.equilibrium_mpa - fit.modulus.equilibrium_mpa;
    assert!((shifts[3] / of_equilibrium - 1.0).abs() < 0.02, "{of_equilibrium:e}");
}
