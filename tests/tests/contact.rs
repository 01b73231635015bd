//! Where the tissue begins, against the truth of the simulated rig.
#![expect(
    clippy::print_stdout,
    reason = "the table of the search is printed here"
)]

use palpate_drivers::sim::{SimProfile, SimSettings};
use palpate_model::units::Newtons;
use palpate_protocols::plans::FindContact;
use palpate_tests::searching::{bound_mm, search};

#[test]
fn probe() {
    for noise in ["5", "20", "50"] {
        for stiffness in ["50", "100", "200"] {
            for seed in 0..4 {
                let settings = SimSettings {
                    profile: SimProfile::Ideal,
                    seed,
                    noise: noise.parse().unwrap(),
                    stiffness: stiffness.parse().unwrap(),
                    ..SimSettings::default()
                };
                let plan = FindContact::default();
                let start = std::time::Instant::now();
                let found = search(settings, plan, None);
                let bound = bound_mm(
                    &found.body,
                    found.pass,
                    plan.pass_speed,
                    Newtons(noise.parse::<f64>().unwrap() * 1e-3),
                );
                println!(
                    "{noise} {stiffness} {seed} {} err {:?} se {:?} bound {bound:.4} pass {:?} fmax {:.3} {:.3} took {} wall {:?}",
                    found.outcome.reason,
                    found.contact.map(|c| c.position.0 - found.surface_mm),
                    found.contact.map(|c| c.std_error_mm),
                    found.pass,
                    found.force_true_max,
                    found.force_filtered_max,
                    found.duration,
                    start.elapsed()
                );
            }
        }
    }
}
