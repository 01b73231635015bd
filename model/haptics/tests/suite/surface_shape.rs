//! The shape of a poked surface against its closed form, and what must hold of it whatever touches it.

use palpate_haptics::surface::{
    ContactSide, Cut, Grid, GridNode, HeightField, Surface, SurfaceContact, SurfaceMethod,
    SurfaceRecovery,
};
use palpate_model::Seconds;
use palpate_test_support::naive_surface::{self as naive, PassOrder};
use palpate_test_support::record::Noise;

/// Exact in binary, so that sums of limits have no rounding and two orders of adding agree.
const S: f64 = 0.25;

fn grid(columns: usize, rows: usize) -> Grid {
    Grid::new(columns, rows, 0.5).expect("a grid")
}

fn node(column: usize, row: usize) -> GridNode {
    GridNode { column: column as u16, row: row as u16 }
}

fn surface(
    field: &HeightField,
    method: SurfaceMethod,
    recovery: SurfaceRecovery,
    cut: Cut,
) -> Surface {
    Surface::new(field.clone(), method, recovery, cut)
}

fn lasting(field: &HeightField, method: SurfaceMethod) -> Surface {
    surface(field, method, SurfaceRecovery::NONE, Cut::NONE)
}

fn push(grid: &Grid, column: usize, row: usize, z: f64) -> SurfaceContact {
    SurfaceContact::at(grid, node(column, row), z, ContactSide::Push)
}

/// Every height that the closed form gives.
fn closed(heights: &[f64], grid: &Grid, at: GridNode, z: f64, shear: f64) -> Vec<f64> {
    let mut expected = heights.to_vec();
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let here = node(column, row);
            let steps = f64::from(here.steps_to(at));
            let slope = if steps == 0.0 { 0.0 } else { shear * steps };
            let height = &mut expected[grid.index(here)];
            *height = height.min(z + slope);
        }
    }
    expected
}

/// A rest surface that keeps to S, its heights multiples of 1/1024.
fn hills(random: &mut Noise, grid: &Grid) -> Vec<f64> {
    let mut heights = vec![2.0; grid.nodes()];
    for _ in 0..6 {
        let (at, z) = (any_node(random, grid), binary(random, 2.0));
        heights = closed(&heights, grid, at, z, S);
    }
    heights
}

fn any_node(random: &mut Noise, grid: &Grid) -> GridNode {
    let mut below = |count: usize| (random.uniform() * count as f64) as usize % count;
    node(below(grid.columns()), below(grid.rows()))
}

/// Within `most` of zero, a multiple of 1/1024.
fn binary(random: &mut Noise, most: f64) -> f64 {
    ((2.0 * random.uniform() - 1.0) * most * 1024.0).round() / 1024.0
}

#[test]
fn a_poke_of_a_flat_surface_is_the_closed_form_with_its_count_and_volume() {
    for n in [3, 51, 201, 1001] {
        let grid = grid(n, n);
        let field = HeightField::flat(grid, S).unwrap();
        let middle = node(n / 2, n / 2);
        for ratio in [0.0, 0.5, 1.0, 1.000_000_1, 20.0, 490.0] {
            let depth = ratio * S;
            let expected = closed(field.rest(), &grid, middle, -depth, S);
            let reach = (ratio.ceil() - 1.0).max(0.0) as usize;
            let within = |end: usize| end.min(n / 2);
            let count: usize = match depth > 0.0 {
                false => 0,
                // Rows cut by the edge; whole, 2 R^2 + 2 R + 1.
                true => (0..=within(reach))
                    .map(|row| (1 + 2 * within(reach - row)) * if row == 0 { 1 } else { 2 })
                    .sum(),
            };
            if depth > 0.0 && reach <= n / 2 {
                assert_eq!(count, 2 * reach * reach + 2 * reach + 1);
            }
            for method in SurfaceMethod::ALL {
                let mut surface = lasting(&field, method);
                let report = surface.tick(&[push(&grid, n / 2, n / 2, -depth)]);
                assert_eq!(surface.heights(), expected, "{n} {ratio} {method:?}");
                assert_eq!(report.moved.moved, count, "{n} {ratio} {method:?}");
                if reach <= n / 2 {
                    let volume: f64 = -surface.heights().iter().sum::<f64>();
                    let rings: f64 = (1..=reach).map(|r| r as f64 * (depth - S * r as f64)).sum();
                    let whole = depth + 4.0 * rings;
                    assert!((volume - whole).abs() <= 1e-9 * whole, "{volume} {whole}");
                }
            }
        }
    }
}

#[test]
fn all_methods_agree_on_hills_with_the_closed_form_for_any_contacts() {
    let mut random = Noise::seeded(1);
    for trial in 0..60 {
        let grid = grid(3 + trial % 40, 2 + (trial * 7) % 33);
        let rest = hills(&mut random, &grid);
        let field = HeightField::new(grid, rest, S).unwrap();
        let mut surfaces = SurfaceMethod::ALL.map(|method| lasting(&field, method));
        let mut expected = field.rest().to_vec();
        let mut plain = expected.clone();
        for _ in 0..3 {
            let mut contacts = Vec::new();
            for _ in 0..11 {
                let (at, z) = (any_node(&mut random, &grid), binary(&mut random, 4.0));
                contacts.push(SurfaceContact::at(&grid, at, z, ContactSide::Push));
                expected = closed(&expected, &grid, at, z, S);
                let seed = (grid.index(at), z);
                naive::push(&mut plain, grid.columns(), |_, _| S, seed, PassOrder::First);
            }
            let report = surfaces.each_mut().map(|surface| surface.tick(&contacts));
            for surface in &surfaces {
                assert_eq!(surface.heights(), expected);
            }
            assert_eq!(plain, expected);
            assert_eq!(report[0].moved.moved, report[1].moved.moved);
        }
    }
}

#[test]
fn pulling_up_is_pushing_down_mirrored() {
    let mut random = Noise::seeded(2);
    for method in SurfaceMethod::ALL {
        let grid = grid(37, 29);
        let rest = hills(&mut random, &grid);
        let mirrored = rest.iter().map(|z| -z).collect();
        let field = |rest| HeightField::new(grid, rest, S).unwrap();
        let recovery = SurfaceRecovery::new(Seconds(0.01), Seconds(1e-3)).unwrap();
        let cut = Cut::new(Some(9), 1.0 / 64.0).unwrap();
        let mut down = surface(&field(rest), method, recovery, cut);
        let mut up = surface(&field(mirrored), method, recovery, cut);
        for _ in 0..50 {
            let push = SurfaceContact::at(
                &grid,
                any_node(&mut random, &grid),
                binary(&mut random, 4.0),
                ContactSide::Push,
            );
            let pull = SurfaceContact { z: -push.z, side: ContactSide::Pull, ..push };
            assert_eq!(down.tick(&[push]), up.tick(&[pull]));
            for (down, up) in down.heights().iter().zip(up.heights()) {
                assert_eq!(*down, -up);
            }
        }
    }
}

#[test]
fn no_link_is_ever_beyond_its_limit() {
    let mut random = Noise::seeded(3);
    for trial in 0..12 {
        let grid = grid(41, 23);
        let field = HeightField::new(grid, hills(&mut random, &grid), S).unwrap();
        let recovery = match trial % 3 {
            0 => SurfaceRecovery::NONE,
            1 => SurfaceRecovery::ELASTIC,
            _ => SurfaceRecovery::new(Seconds(0.02), Seconds(1e-3)).unwrap(),
        };
        let mut surfaces =
            SurfaceMethod::ALL.map(|method| surface(&field, method, recovery, Cut::NONE));
        for _ in 0..40 {
            let contacts: Vec<SurfaceContact> = (0..3)
                .map(|_| {
                    let side =
                        if random.uniform() < 0.7 { ContactSide::Push } else { ContactSide::Pull };
                    let z = 12.0 * (random.uniform() - 0.5);
                    SurfaceContact::at(&grid, any_node(&mut random, &grid), z, side)
                })
                .collect();
            for surface in &mut surfaces {
                surface.tick(&contacts);
                let worst = naive::worst_excess(surface.heights(), grid.columns(), |_, _| S);
                assert!(worst <= 1e-6 * S, "{worst} {recovery:?}");
            }
        }
    }
}

#[test]
fn pokes_are_idempotent_monotone_and_commute() {
    let mut random = Noise::seeded(4);
    for trial in 0..30 {
        let grid = grid(33, 21);
        let field = HeightField::new(grid, hills(&mut random, &grid), S).unwrap();
        let method = SurfaceMethod::ALL[trial % 2];
        let [a, b] = [0, 1].map(|_| {
            let z = binary(&mut random, 5.0);
            SurfaceContact::at(&grid, any_node(&mut random, &grid), z, ContactSide::Push)
        });
        let after = |contacts: &[SurfaceContact]| {
            let mut surface = lasting(&field, method);
            for contact in contacts {
                surface.tick(&[*contact]);
            }
            surface.heights().to_vec()
        };
        let once = after(&[a]);
        assert_eq!(once, after(&[a, a]));
        assert_eq!(after(&[a, b]), after(&[b, a]));
        let deeper = after(&[SurfaceContact { z: a.z - random.uniform(), ..a }]);
        assert!(once.iter().zip(&deeper).all(|(once, deeper)| deeper <= once));
    }
}

#[test]
fn pokes_follow_shifts_and_quarter_turns() {
    let n = 45;
    let grid = grid(n, n);
    let field = HeightField::flat(grid, 0.1).unwrap();
    let shape = |method, column, row| {
        let mut surface = lasting(&field, method);
        surface.tick(&[push(&grid, column, row, -0.83)]);
        surface.heights().to_vec()
    };
    for method in SurfaceMethod::ALL {
        let [one, shifted, turned] =
            [(20, 18), (25, 21), (18, n - 1 - 20)].map(|(c, r)| shape(method, c, r));
        let at = |heights: &[f64], column: usize, row: usize| heights[row * n + column];
        for row in 0..n - 3 {
            for column in 0..n - 5 {
                assert_eq!(at(&one, column, row), at(&shifted, column + 5, row + 3));
            }
        }
        for row in 0..n {
            for column in 0..n {
                assert_eq!(at(&one, column, row), at(&turned, row, n - 1 - column));
            }
        }
    }
}

#[test]
fn last_moved_first_breaks_the_limits_of_a_surface_but_not_of_a_line() {
    // The mutant this proves the tests to see: same rules, other order.
    for ratio in [5.0, 8.0, 20.0] {
        let n = 51;
        let seed = (n * (n / 2) + n / 2, -ratio * S);
        let mut z = vec![0.0; n * n];
        naive::push(&mut z, n, |_, _| S, seed, PassOrder::Last);
        assert!(naive::worst_excess(&z, n, |_, _| S) > 0.5 * S, "{ratio}");
        let grid = grid(n, n);
        let expected = closed(&vec![0.0; n * n], &grid, node(n / 2, n / 2), seed.1, S);
        assert_ne!(z, expected);
        // A line: one dimension hides the mistake.
        let mut line = vec![0.0; n];
        naive::push(&mut line, n, |_, _| S, (n / 2, seed.1), PassOrder::Last);
        assert!(naive::worst_excess(&line, n, |_, _| S) <= 0.0);
    }
}

#[test]
fn a_threshold_leaves_out_no_more_than_itself() {
    let mut random = Noise::seeded(6);
    for _ in 0..20 {
        let grid = grid(39, 31);
        let field = HeightField::new(grid, hills(&mut random, &grid), S).unwrap();
        let contact = SurfaceContact::at(
            &grid,
            any_node(&mut random, &grid),
            binary(&mut random, 5.0),
            ContactSide::Push,
        );
        for method in SurfaceMethod::ALL {
            let mut whole = lasting(&field, method);
            let mut last = whole.tick(&[contact]).moved.moved;
            for threshold in [1.0 / 64.0, 1.0 / 16.0, 0.1875, 0.5, 1.0] {
                let cut = Cut::new(None, threshold).unwrap();
                let mut cut = surface(&field, method, SurfaceRecovery::NONE, cut);
                let moved = cut.tick(&[contact]).moved.moved;
                assert!(moved <= last);
                last = moved;
                for (cut, whole) in cut.heights().iter().zip(whole.heights()) {
                    assert!((0.0..=threshold).contains(&(cut - whole)));
                }
                assert!(naive::worst_excess(cut.heights(), grid.columns(), |_, _| S) <= threshold);
            }
        }
    }
    // From flat, the reach is that of a poke shallower by the threshold.
    let grid = grid(101, 101);
    let field = HeightField::flat(grid, S).unwrap();
    for (depth, threshold) in [(5.0, 0.125), (3.3, 0.25), (2.0, 1.9), (0.5, 0.125)] {
        let reach = ((depth - threshold) / S).ceil() as usize - 1;
        for method in SurfaceMethod::ALL {
            let cut = Cut::new(None, threshold).unwrap();
            let report = surface(&field, method, SurfaceRecovery::NONE, cut)
                .tick(&[push(&grid, 50, 50, -depth)]);
            assert_eq!(report.moved.moved, 2 * reach * reach + 2 * reach + 1);
        }
    }
    assert!(Cut::new(None, f64::NAN).is_err() && Cut::new(None, -1.0).is_err());
}

#[test]
fn a_range_ends_the_chain() {
    let mut random = Noise::seeded(7);
    let grid = grid(39, 31);
    let field = HeightField::new(grid, hills(&mut random, &grid), S).unwrap();
    let at = node(11, 17);
    let expected = closed(field.rest(), &grid, at, -9.0, S);
    for range in [0, 1, 5, 12] {
        for method in SurfaceMethod::ALL {
            let cut = Cut::new(Some(range), 0.0).unwrap();
            let mut surface = surface(&field, method, SurfaceRecovery::NONE, cut);
            surface.tick(&[SurfaceContact::at(&grid, at, -9.0, ContactSide::Push)]);
            for row in 0..grid.rows() {
                for column in 0..grid.columns() {
                    let here = node(column, row);
                    let index = grid.index(here);
                    let z = match here.steps_to(at) <= range {
                        true => expected[index],
                        false => field.rest()[index],
                    };
                    assert_eq!(surface.heights()[index], z, "{range} {method:?}");
                }
            }
        }
    }
}

#[test]
fn edges_and_numbers_that_are_none() {
    let grid = grid(9, 5);
    let flat = |shear| HeightField::flat(grid, shear).unwrap();
    for method in SurfaceMethod::ALL {
        // Corner and edge: the closed form.
        for (column, row) in [(0, 0), (8, 0), (0, 4), (8, 4), (4, 0), (0, 2)] {
            let mut surface = lasting(&flat(S), method);
            surface.tick(&[push(&grid, column, row, -1.7)]);
            let expected = closed(surface.field().rest(), &grid, node(column, row), -1.7, S);
            for (z, expected) in surface.heights().iter().zip(expected) {
                assert!((z - expected).abs() < 1e-12);
            }
        }
        let mut surface = lasting(&flat(S), method);
        let none = |x, y, z| SurfaceContact { x, y, z, side: ContactSide::Push };
        let [nan, inf] = [f64::NAN, f64::INFINITY];
        let nothing = [
            none(-0.3, 0.0, -1.0),
            none(4.3, 0.0, -1.0),
            none(0.0, 1e300, -1.0),
            none(nan, 0.0, -1.0),
            none(0.0, inf, -1.0),
            none(0.0, 0.0, nan),
        ];
        let report = surface.tick(&nothing);
        assert_eq!((report.ignored, report.moved.moved), (6, 0));
        // Above the surface: no touch, however far.
        let report = surface.tick(&[none(1.0, 1.0, 2.0), none(1.0, 1.0, inf)]);
        assert_eq!((report.ignored, report.clamped, report.moved.moved), (0, 1, 0));
        assert_eq!(surface.heights(), surface.field().rest());
        // Downward without end.
        for z in [-inf, f64::MIN] {
            let report = surface.tick(&[none(1.0, 1.0, z)]);
            assert_eq!(report.clamped, 1);
            assert!(surface.heights().iter().all(|z| z.is_finite()));
            assert_eq!(surface.heights()[grid.index(node(2, 2))], -1e6);
        }
        // No shear: everything is level. Any shear: one node.
        for (shear, count) in [(0.0, 45), (inf, 1), (f64::MAX, 1), (5e-324, 45)] {
            let mut surface = lasting(&flat(shear), method);
            let report = surface.tick(&[push(&grid, 4, 2, -1.0)]);
            assert_eq!(report.moved.moved, count, "{shear} {method:?}");
            let low = surface.heights().iter().filter(|z| **z == -1.0).count();
            assert_eq!(low, count);
        }
    }
}

#[test]
fn whatever_comes_in_heights_stay_numbers_within_a_kilometre() {
    let mut random = Noise::seeded(9);
    let odd = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN,
        5e-324,
        -5e-324,
        0.0,
        1e6,
        -1e6,
        2.0,
        -3.5,
    ];
    let mut any = |mostly: f64| {
        let pick = (random.uniform() * 2.0 * odd.len() as f64) as usize;
        odd.get(pick).copied().unwrap_or(mostly * (2.0 * random.uniform() - 1.0))
    };
    let grid = grid(13, 11);
    let taus = [0.0, 5e-324, 1e-3, 1e300, f64::INFINITY];
    for (trial, shear) in [0.0, 5e-324, 0.1, 1e300, f64::INFINITY].into_iter().enumerate() {
        for method in SurfaceMethod::ALL {
            let field = HeightField::new(grid, vec![1.5; grid.nodes()], shear).unwrap();
            let recovery = SurfaceRecovery::new(Seconds(taus[trial]), Seconds(1e-3)).unwrap();
            let cut = Cut::new(None, [0.0, 1e300][trial % 2]).unwrap();
            let mut surface = surface(&field, method, recovery, cut);
            for tick in 0..300 {
                let contacts = [0; 3].map(|_| SurfaceContact {
                    x: any(8.0),
                    y: any(6.0),
                    z: any(4.0),
                    side: if tick % 2 == 0 { ContactSide::Push } else { ContactSide::Pull },
                });
                let report = surface.tick(&contacts);
                let is_none = |contact: &&SurfaceContact| {
                    contact.z.is_nan() || grid.nearest(contact.x, contact.y).is_none()
                };
                assert_eq!(report.ignored, contacts.iter().filter(is_none).count());
                assert!(surface.heights().iter().all(|z| z.abs() <= 1e6));
            }
        }
    }
}
