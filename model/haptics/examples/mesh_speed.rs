//! What a tick of touch on a mesh takes: contact point, force of two materials, and dent, on a stomach of 50 240 triangles.
//!
//! `cargo run --release -p palpate-haptics --example mesh_speed -- [TICKS]`
//!
//! `slide`: the device circles the body of the stomach at 3 mm of depth and 100 mm/s. `deep`: the same at 10 mm. `wide`: it stays at
//! 30 mm, and the dent is as wide as it may be. `air`: it moves up to 20 mm above the surface. `fast`: each tick it is somewhere else, inside or outside.
//! The longest ticks are mostly the machine's: the first line says what it does to work that is always the same. The hash is of the forces
//! of all ticks and the dent of every hundredth: it is the same where no number has changed.

#![expect(clippy::print_stdout, reason = "an example that prints figures")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

mod timing;

use palpate_haptics::surface::SurfaceRecovery;
use palpate_haptics::triangles::shapes::stomach;
use palpate_haptics::triangles::{
    DentSettings, MaterialMap, MeshTouchLoop, MeshTouchSettings, Shading, TriangleMesh,
};
use palpate_haptics::{LawSettings, Period};
use palpate_model::Seconds;
use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::ModifiedKelvin;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;
use timing::{measure_machine, percentiles};
/// Way of the device in a tick in mm: 100 mm/s.
const STEP_MM: f64 = 0.1;
/// From one look at the whole dent to the next, in ticks.
const HASHED: usize = 100;
/// Where the hash FNV-1a begins, 64 bit.
const FNV: u64 = 0xcbf2_9ce4_8422_2325;

fn add(hash: u64, numbers: impl IntoIterator<Item = f64>) -> u64 {
    let bytes = numbers.into_iter().flat_map(|number| number.to_bits().to_le_bytes());
    bytes.fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[derive(Clone, Copy)]
enum Case {
    Slide,
    Deep,
    Wide,
    Trail,
    Air,
    Fast,
}

impl Case {
    const ALL: [Self; 6] =
        [Self::Slide, Self::Deep, Self::Wide, Self::Trail, Self::Air, Self::Fast];

    fn name(self) -> &'static str {
        match self {
            Self::Slide => "slide, 3 mm deep",
            Self::Deep => "slide, 10 mm deep",
            Self::Wide => "still, 30 mm deep",
            Self::Trail => "slide, slow recovery",
            Self::Air => "0 to 20 mm above",
            Self::Fast => "anywhere each tick",
        }
    }

    fn device(self, mesh: &TriangleMesh, tick: usize, random: &mut SplitMix) -> [f64; 3] {
        let way = STEP_MM * tick as f64;
        match self {
            Self::Slide | Self::Trail => around(mesh, way, 3.0),
            Self::Deep => around(mesh, way, 10.0),
            Self::Wide => around(mesh, 0.0, (0.1 * tick as f64 - 1.0).min(30.0)),
            Self::Air => around(mesh, way, -10.0 - 10.0 * (0.001 * tick as f64).sin()),
            Self::Fast => {
                let [low, high] = mesh.bounds();
                [0, 1, 2].map(|axis| {
                    low[axis] + (high[axis] - low[axis]) * random.below(1_000_000) as f64 / 1e6
                })
            }
        }
    }
}

/// Around a ring in the middle of the stomach, `depth` below it.
fn around(mesh: &TriangleMesh, way: f64, depth: f64) -> [f64; 3] {
    let first = 1 + 160 * 78;
    let length = 1.3;
    let at = |index: usize| {
        (mesh.points()[first + index % 160], mesh.vertex_normals()[first + index % 160])
    };
    let share = (way / length).fract();
    let index = (way / length) as usize;
    let [(p, m), (q, n)] = [at(index), at(index + 1)];
    [0, 1, 2].map(|axis| {
        p[axis] + share * (q[axis] - p[axis]) - depth * (m[axis] + share * (n[axis] - m[axis]))
    })
}

fn measure(mesh: &Arc<TriangleMesh>, case: Case, ticks: usize) {
    let recovery = match case {
        Case::Trail => SurfaceRecovery::new(Seconds(1.0), Seconds(1e-3)).expect("a recovery"),
        _ => SurfaceRecovery::ELASTIC,
    };
    let law = LawSettings::of(ModifiedKelvin::THESIS, Period::MILLISECOND);
    let settings = MeshTouchSettings {
        laws: vec![law; 2],
        friction: 0.2,
        shading: Shading::Smooth,
        dent: DentSettings { recovery, ..DentSettings::default() },
    };
    let mut touched =
        MeshTouchLoop::new(mesh.clone(), MaterialMap::one(mesh), &settings).expect("a touch");
    let mut random = SplitMix::seeded(1);
    let mut times = Vec::with_capacity(ticks);
    let (mut moved, mut contacts, mut hash) = (0, 0, FNV);
    touched.tick(around(mesh, 0.0, -5.0));
    // The first tenth is not counted: memory comes to the cache.
    for tick in 0..ticks + ticks / 10 {
        let device = case.device(mesh, tick, &mut random);
        let start = Instant::now();
        let report = black_box(touched.tick(black_box(device)));
        let taken = start.elapsed().as_secs_f64();
        if tick >= ticks / 10 {
            times.push(taken * 1e6);
            moved += report.dent.moved;
            contacts += usize::from(report.contact.touch.is_contact());
            hash = add(hash, report.force);
            if tick % HASHED == 0 {
                hash = add(hash, touched.touched().dent().sunk().iter().copied());
            }
        }
    }
    let [p50, p99, p999, max] = percentiles(&mut times);
    let (moved, contacts) = (moved / ticks, 100 * contacts / ticks);
    println!(
        "{:<24}{p50:>10.1}{p99:>10.1}{p999:>10.1}{max:>11.1}{moved:>10}{contacts:>10}  {hash:016x}",
        case.name()
    );
}

fn main() {
    let ticks = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(20_000);
    let start = Instant::now();
    let mesh = Arc::new(TriangleMesh::new(stomach()).expect("a mesh"));
    let made = start.elapsed().as_secs_f64() * 1e3;
    println!("{} triangles, made in {made:.0} ms; us per tick, {ticks} ticks", mesh.faces().len());
    measure_machine(ticks);
    println!(
        "{:<24}{:>10}{:>10}{:>10}{:>11}{:>10}{:>10}  hash",
        "", "p50", "p99", "p99.9", "max", "moved", "contact %"
    );
    Case::ALL.into_iter().for_each(|case| measure(&mesh, case, ticks));
}
