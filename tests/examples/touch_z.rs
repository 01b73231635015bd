use palpate_drivers::sim::*;
use palpate_tests::interval_coverage::touch;
fn main() {
    let n: u64 = std::env::args().nth(1).unwrap().parse().unwrap();
    for seed in 1..=n {
        let (e, s) = touch(SimSettings { seed, ..SimSettings::default() });
        println!("{seed} {:.3} {:.3} {:.2}", 1e3 * e, 1e3 * s, e / s);
    }
}
