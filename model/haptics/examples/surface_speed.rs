//! What a tick of the deformable surface takes: recovery and poke of whatever is displaced, by the two
//! methods and by a naive chain, in one run.
//!
//! `cargo run --release -p palpate-haptics --example surface_speed -- [TICKS [fast]]`; `fast`: the closed form alone
//!
//! Three cases each. `lasting`: a tool that stays at a depth whose reach is half the mesh along each axis,
//! so that every tick recovers and pushes back the diamond between the middles of the edges, half of
//! all nodes. `whole`: twice that depth, which moves every node, the worst there is. `moving`: the tool
//! circles at a tenth of the first depth and what it leaves behind recovers.
//! The longest ticks are mostly the machine's: the first line says what it does to work that is always
//! the same.
//!
//! A naive tick recovers the whole grid and pushes with a queue and a set that allocate.

#![expect(clippy::print_stdout, reason = "an example that prints figures")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

mod timing;

use palpate_haptics::surface::{
    ContactSide, Cut, Grid, GridNode, HeightField, Surface, SurfaceContact, SurfaceMethod,
    SurfaceRecovery,
};
use palpate_model::Seconds;
use palpate_test_support::naive_surface as naive;
use std::hint::black_box;
use std::time::Instant;
use timing::{measure_machine, percentiles};

/// A tick at 1 kHz.
const TICK: f64 = 1e-3;
/// Relaxation time of the thesis body in s.
const TAU: f64 = 1.023;
/// Of neighbours, in mm.
const SHEAR: f64 = 0.05;
/// Naive ticks: a hundredth of the others, since each takes up to a second.
const NAIVE_SHARE: usize = 100;

#[derive(Clone, Copy)]
enum Case {
    Lasting,
    Whole,
    Moving,
}

impl Case {
    fn name(self) -> &'static str {
        match self {
            Self::Lasting => "lasting",
            Self::Whole => "whole",
            Self::Moving => "moving",
        }
    }

    /// Where the tool is at a tick.
    fn tool(self, n: usize, tick: usize) -> (GridNode, f64) {
        let middle = (n / 2) as f64;
        let depth = SHEAR * middle;
        let node = |column: f64, row: f64| GridNode { column: column as u16, row: row as u16 };
        match self {
            Self::Lasting => (node(middle, middle), -depth),
            Self::Whole => (node(middle, middle), -2.0 * depth),
            Self::Moving => {
                let (sin, cos) = (TAU * tick as f64 * TICK * 2.0).sin_cos();
                let radius = 0.5 * middle;
                (node(middle + radius * cos, middle + radius * sin), -0.1 * depth)
            }
        }
    }
}

fn line(name: &str, times: &mut [f64], nodes_per_tick: f64) -> f64 {
    let total: f64 = times.iter().sum();
    let rate = nodes_per_tick * times.len() as f64 / total * 1e3;
    let [p50, p99, p999, max] = percentiles(times);
    println!(
        "  {name:<24}{p50:>10.1}{p99:>10.1}{p999:>10.1}{max:>11.1}{nodes_per_tick:>12.0}{rate:>12.0}"
    );
    rate
}

fn measure(n: usize, case: Case, method: SurfaceMethod, ticks: usize) -> f64 {
    let grid = Grid::new(n, n, 0.5).expect("a grid");
    let field = HeightField::flat(grid, SHEAR).expect("a field");
    let recovery = SurfaceRecovery::new(Seconds(TAU), Seconds(TICK)).expect("a recovery");
    let mut surface = Surface::new(field, method, recovery, Cut::NONE);
    let mut times = Vec::with_capacity(ticks);
    let mut moved = 0;
    // The first tenth is not counted: memory comes to the cache, and the trail of the tool appears.
    for tick in 0..ticks + ticks / 10 {
        let (node, z) = case.tool(n, tick);
        let contact = [SurfaceContact::at(&grid, node, z, ContactSide::Push)];
        let start = Instant::now();
        let report = black_box(surface.tick(black_box(&contact)));
        let taken = start.elapsed().as_secs_f64();
        if tick >= ticks / 10 {
            times.push(taken * 1e6);
            moved += report.moved.moved;
        }
    }
    line(method.name(), &mut times, moved as f64 / ticks as f64)
}

/// Nodes per ms of the naive tick.
fn measure_naive(n: usize, case: Case, ticks: usize) -> f64 {
    let (rest, mut now) = (vec![0.0; n * n], vec![0.0; n * n]);
    let keep = (-TICK / TAU).exp();
    let (mut chain, mut moved) = (Vec::new(), 0);
    for tick in 0..ticks {
        let (node, z) = case.tool(n, tick);
        let seed = usize::from(node.row) * n + usize::from(node.column);
        let start = Instant::now();
        for (now, rest) in now.iter_mut().zip(&rest) {
            *now = rest + (*now - rest) * keep;
        }
        moved += naive::push(&mut now, n, |_, _| SHEAR, (seed, z), naive::PassOrder::First);
        chain.push(start.elapsed().as_secs_f64() * 1e6);
    }
    black_box(&now);
    line("naive", &mut chain, moved as f64 / ticks as f64)
}

fn main() {
    let ticks = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let ticks: usize = ticks.unwrap_or(10_000);
    let is_fast = std::env::args().nth(2).is_some_and(|word| word == "fast");
    println!("us per tick; {ticks} ticks, chains at 1001 nodes a tenth of that");
    measure_machine(ticks);
    for n in [201, 1001] {
        for case in [Case::Lasting, Case::Whole, Case::Moving] {
            println!(
                "{n} x {n}, {:<16}{:>10}{:>10}{:>10}{:>11}{:>12}{:>12}",
                case.name(),
                "p50",
                "p99",
                "p99.9",
                "max",
                "nodes/tick",
                "nodes/ms"
            );
            let few = if n > 500 { ticks / 10 } else { ticks };
            if is_fast {
                measure(n, case, SurfaceMethod::Envelope, ticks);
                continue;
            }
            let naive = measure_naive(n, case, (few / NAIVE_SHARE).max(5));
            for method in SurfaceMethod::ALL {
                let ticks = if method == SurfaceMethod::Envelope { ticks } else { few };
                let rate = measure(n, case, method, ticks.max(10));
                println!("    {:.0} times naive", rate / naive);
            }
        }
    }
}
