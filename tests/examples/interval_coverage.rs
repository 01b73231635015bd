//! How often intervals hold the truth, as tables in Markdown: `interval_coverage SEEDS [CASE]...`
#![expect(clippy::print_stdout, reason = "a program that prints")]
use palpate_tests::interval_coverage::{
    CoverageCase, CoverageDraws, HELD_OUT_SPEED, HELD_OUT_TIMES, draws, table,
};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().map_or(60, |text| text.parse().expect("a number of seeds"));
    let mut names: Vec<String> = arguments.collect();
    if names.is_empty() {
        names = CoverageCase::NAMES.map(str::to_owned).to_vec();
    }
    for name in names {
        let found = draws(CoverageCase::named(&name), 1..seeds + 1, 2);
        let signal: Vec<CoverageDraws> = found.iter().map(|one| one.signal).collect();
        let force: Vec<CoverageDraws> = found.iter().map(|one| one.force).collect();
        println!("{}", table(&format!("{name}, fitted in volts"), &signal));
        println!("{}", table(&format!("{name}, fitted in newtons"), &force));
        let live: Vec<CoverageDraws> = found.iter().map(|one| one.live).collect();
        println!("{}", table(&format!("{name}, live fit at the end of the run"), &live));
        let held = HELD_OUT_TIMES.iter().enumerate().map(|(k, t)| {
            let count = found.iter().filter(|one| one.held_out[k]).count();
            format!("{:.1} % at {t} s", 100.0 * count as f64 / found.len() as f64)
        });
        let held: Vec<String> = held.collect();
        println!(
            "95 % band of the force at {HELD_OUT_SPEED} mm/s, from the fit at half that speed, holds {}\n",
            held.join(", ")
        );
    }
}
