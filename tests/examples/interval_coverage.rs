//! How often intervals hold the truth, as tables in Markdown: `interval_coverage SEEDS [CASE]...`
use palpate_drivers::sim::{SimCell, SimProfile, SimSettings};
use palpate_tests::interval_coverage::{CoverageCase, CoverageDraws, draws, print_table};

const CASES: [&str; 6] = ["ideal", "lab", "fast", "speeds", "own", "few-weights"];

fn case(name: &str) -> CoverageCase {
    let ideal = SimSettings { profile: SimProfile::Ideal, ..SimSettings::default() };
    let own = SimSettings { cell: SimCell::Own, ..SimSettings::default() };
    let of = |settings| CoverageCase { settings, ..CoverageCase::default() };
    match name {
        "ideal" => of(ideal),
        "lab" => CoverageCase::default(),
        "fast" => {
            of(SimSettings { rate: "20000".parse().expect("a rate"), ..SimSettings::default() })
        }
        "speeds" => CoverageCase { second_speed: Some(1.5), ..CoverageCase::default() },
        "own" => of(own),
        "few-weights" => CoverageCase { is_short_of_weights: true, ..of(own) },
        other => panic!("there is no case {other}; give any of {CASES:?}"),
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().map_or(60, |text| text.parse().expect("a number of seeds"));
    let mut names: Vec<String> = arguments.collect();
    if names.is_empty() {
        names = CASES.map(str::to_owned).to_vec();
    }
    for name in names {
        let found = draws(case(&name), 1..seeds + 1);
        let signal: Vec<CoverageDraws> = found.iter().map(|one| one.signal).collect();
        let force: Vec<CoverageDraws> = found.iter().map(|one| one.force).collect();
        print_table(&format!("{name}, fitted in volts"), &signal);
        print_table(&format!("{name}, fitted in newtons"), &force);
    }
}
