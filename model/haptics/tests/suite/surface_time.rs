//! Recovery of a poked surface, what a tick says has changed, and that it repeats to the bit.

use palpate_haptics::surface::{
    ContactSide, Cut, Grid, GridNode, HeightField, SETTLED_MM, Surface, SurfaceContact,
    SurfaceMethod, SurfaceRecovery,
};
use palpate_model::Seconds;
use palpate_test_support::naive_surface as naive;
use palpate_test_support::record::Noise;

const S: f64 = 0.25;

fn surface(n: usize, method: SurfaceMethod, recovery: SurfaceRecovery) -> Surface {
    let field = HeightField::flat(Grid::new(n, n, 0.5).expect("a grid"), S).expect("a field");
    Surface::new(field, method, recovery, Cut::NONE)
}

fn at(surface: &Surface, column: u16, row: u16, z: f64, side: ContactSide) -> SurfaceContact {
    SurfaceContact::at(surface.field().grid(), GridNode { column, row }, z, side)
}

#[test]
fn recovery_is_the_exponential_and_ends() {
    let (tau, tick) = (0.05, 1e-3);
    for method in SurfaceMethod::ALL {
        for side in [ContactSide::Push, ContactSide::Pull] {
            let recovery = SurfaceRecovery::new(Seconds(tau), Seconds(tick)).unwrap();
            let mut surface = surface(41, method, recovery);
            let z = if side == ContactSide::Push { -3.0 } else { 3.0 };
            surface.tick(&[at(&surface, 20, 20, z, side)]);
            let start = surface.heights().to_vec();
            let mut ticks = 0;
            while !surface.tick(&[]).dirty.is_empty() {
                ticks += 1;
                let share = (-f64::from(ticks) * tick / tau).exp();
                // Behind the exponential by at most what the target is beyond rest.
                for (now, start) in surface.heights().iter().zip(&start) {
                    let behind = (start * share - now) * z.signum();
                    assert!((-1e-12..=SETTLED_MM).contains(&behind), "{behind}");
                }
                assert!(naive::worst_excess(surface.heights(), 41, |_, _| S) <= 1e-12);
            }
            // ln(3 mm / 1 nm) time constants.
            let expected = (3.0 / SETTLED_MM).ln_1p() * tau / tick;
            assert!((f64::from(ticks) - expected).abs() <= 2.0, "{ticks} {expected}");
            assert!(surface.heights().iter().all(|z| *z == 0.0));
        }
    }
}

#[test]
fn elastic_shapes_depend_on_this_ticks_contacts_alone() {
    let mut random = Noise::seeded(1);
    for method in SurfaceMethod::ALL {
        let mut used = surface(31, method, SurfaceRecovery::ELASTIC);
        for _ in 0..50 {
            let side = if random.uniform() < 0.5 { ContactSide::Push } else { ContactSide::Pull };
            let [column, row] = [0, 1].map(|_| (31.0 * random.uniform()) as u16);
            let contacts = [at(&used, column, row, 4.0 * random.normal(), side)];
            let mut new = surface(31, method, SurfaceRecovery::ELASTIC);
            new.tick(&contacts);
            used.tick(&contacts);
            assert_eq!(new.heights(), used.heights());
        }
    }
}

#[test]
fn no_time_constant_is_elastic_and_an_infinite_one_never_recovers() {
    let of = |tau| SurfaceRecovery::new(Seconds(tau), Seconds(1e-3));
    assert_eq!(of(0.0).unwrap(), SurfaceRecovery::ELASTIC);
    assert_eq!(of(f64::INFINITY).unwrap(), SurfaceRecovery::NONE);
    for bad in [-1.0, f64::NAN, f64::NEG_INFINITY] {
        assert!(of(bad).is_err());
        assert!(SurfaceRecovery::new(Seconds(1.0), Seconds(bad)).is_err());
    }
    assert!(SurfaceRecovery::new(Seconds(1.0), Seconds(0.0)).is_err());
}

#[test]
fn everything_that_changed_is_in_the_dirty_rectangle() {
    let mut random = Noise::seeded(2);
    for method in SurfaceMethod::ALL {
        let recovery = SurfaceRecovery::new(Seconds(2e-3), Seconds(1e-3)).unwrap();
        let mut surface = surface(51, method, recovery);
        let mut before = surface.heights().to_vec();
        let mut quiet = 0;
        for tick in 0..400 {
            let mut contacts = Vec::new();
            // Bursts with rests between, in which everything comes to rest.
            if tick % 50 < 10 {
                let [column, row] = [0, 1].map(|_| (51.0 * random.uniform()) as u16);
                contacts.push(at(
                    &surface,
                    column,
                    row,
                    -2.0 * random.uniform(),
                    ContactSide::Push,
                ));
            }
            let report = surface.tick(&contacts);
            for (index, (now, was)) in surface.heights().iter().zip(&before).enumerate() {
                let [column, row] = [index % 51, index / 51].map(|i| i as u32);
                let inside = (report.dirty.columns[0]..report.dirty.columns[1]).contains(&column)
                    && (report.dirty.rows[0]..report.dirty.rows[1]).contains(&row);
                assert!(inside || now == was, "{method:?} {tick}");
            }
            quiet += usize::from(report.dirty.is_empty());
            before.copy_from_slice(surface.heights());
        }
        assert!(quiet > 50, "{quiet}");
    }
}

#[test]
fn methods_agree_over_time_and_replays_are_equal_to_the_bit() {
    let run = |method: SurfaceMethod| {
        let mut random = Noise::seeded(3);
        let recovery = SurfaceRecovery::new(Seconds(0.03), Seconds(1e-3)).unwrap();
        let mut surface = surface(61, method, recovery);
        for tick in 0..500 {
            let (column, row) = (30 + (tick / 40) as u16, 25);
            let z = -4.0 * (f64::from(tick) * 0.02).sin() + 0.01 * random.normal();
            let tool = at(&surface, column, row, z, ContactSide::Push);
            let other = at(&surface, 5, 50, 1.0 - z, ContactSide::Pull);
            surface.tick(&[tool, other]);
        }
        surface.heights().to_vec()
    };
    let shapes = SurfaceMethod::ALL.map(run);
    for (method, shape) in SurfaceMethod::ALL.into_iter().zip(&shapes) {
        let bits = |heights: &[f64]| heights.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(shape), bits(&run(method)));
        for (a, b) in shape.iter().zip(&shapes[0]) {
            assert!((a - b).abs() < 1e-10, "{method:?} {a} {b}");
        }
    }
}
