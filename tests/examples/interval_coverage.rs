//! `cargo run -p palpate-tests --example interval_coverage [PROFILE] [SEEDS]`
use palpate_drivers::sim::SimSettings;
use palpate_tests::interval_coverage::{draws, print_table};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let profile = arguments.next().unwrap_or_else(|| "lab".into());
    let seeds = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(20);
    let profile = profile.parse().expect("lab or ideal");
    let found = draws(SimSettings { profile, ..SimSettings::default() }, 1..seeds + 1);
    if std::env::args().nth(3).is_some() {
        for one in &found.signal {
            println!("Z {}", one.map(|k| format!("{:.3}", k.error / k.std_error)).join(" "));
        }
    }
    print_table("in volts", &found.signal);
    print_table("in newtons", &found.force);
}
