//! A 95 % interval covers the truth 95 times in a hundred, also where the noise remembers.
//!
//! On the thesis protocol (0.75 mm/s to 30 mm, 50 s of hold, 1 kHz) with noise of 0.02 N. The suite
//! takes a few draws and allows for their chance; `scripts/soak noise` takes
//! `PALPATE_COVERAGE_DRAWS` of them and asks for 92 to 97 %.

use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use palpate_test_support::record::{ramp_hold, respond, with_correlated_noise};

const TRUTH: [(&str, f64); 5] =
    [("tau_eps", 1.023), ("mu1", 0.05333), ("mu2", -0.0086), ("mu3", 0.0004345), ("tau_sig", 0.06)];

/// Slow noise in N, its memory in s, white noise in N; the sum of squares is always 0.02^2.
const NOISES: [(&str, (f64, f64, f64)); 6] = [
    ("white", (0.0, 1.0, 0.02)),
    ("0.05 s", (0.02, 0.05, 0.0)),
    ("0.5 s", (0.02, 0.5, 0.0)),
    // 0.3 of the variance is white.
    ("0.05 s and white", (0.016_733_2, 0.05, 0.010_954_5)),
    ("0.5 s and white", (0.016_733_2, 0.5, 0.010_954_5)),
    // Half a percent of the variance remembers: invisible among neighbouring samples, and still half
    // of what a mean over a quarter of a second varies by.
    ("0.5 s far under white", (0.0015, 0.5, 0.019_944)),
];

fn draws() -> u64 {
    std::env::var("PALPATE_COVERAGE_DRAWS").map_or(80, |count| count.parse().unwrap())
}

/// How many of the draws each parameter's interval covers.
fn covered(clean: &[FitSample], noise: (f64, f64, f64), seeds: std::ops::Range<u64>) -> [u64; 5] {
    let mut covered = [0; 5];
    for seed in seeds {
        let record = with_correlated_noise(clean, seed, noise);
        let report = fit(&record, &FitOptions::default()).unwrap();
        for (count, (name, truth)) in covered.iter_mut().zip(TRUTH) {
            let [low, high] = report.parameter(name).unwrap().ci95.unwrap();
            *count += u64::from(low <= truth && truth <= high);
        }
    }
    covered
}

#[test]
fn intervals_cover_under_white_and_autocorrelated_noise() {
    let clean = respond(&ModifiedKelvin::THESIS, &ramp_hold(0.75, 50.0, 1e-3));
    let draws = draws();
    for (name, noise) in NOISES {
        let half = draws / 2;
        let parts = std::thread::scope(|scope| {
            let first = scope.spawn(|| covered(&clean, noise, 1000..1000 + half));
            let second = covered(&clean, noise, 1000 + half..1000 + draws);
            [first.join().unwrap(), second]
        });
        let shares: Vec<f64> =
            (0..5).map(|k| 100.0 * (parts[0][k] + parts[1][k]) as f64 / draws as f64).collect();
        let mean = shares.iter().sum::<f64>() / 5.0;
        println!("{name}: {shares:.1?} %, mean {mean:.1} % of {draws} draws");
        // Three standard deviations of a count with a chance of 0.945, the middle of 92 to 97 %.
        let chance = 300.0 * (0.945 * 0.055 / draws as f64).sqrt();
        for share in &shares {
            assert!((92.0 - chance..=97.0 + chance).contains(share), "{name}: {shares:?}");
        }
        // The five agree with each other to about 0.6, so their mean varies less; many draws leave
        // chance no say in it.
        let chance = if draws < 500 { 0.7 * chance } else { 0.0 };
        assert!((92.0 - chance..=97.0 + chance).contains(&mean), "{name}: {mean}");
    }
}
