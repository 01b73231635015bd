use super::chain::Chain;
use super::contact::Poke;
use super::*;
use palpate_model::random::SplitMix;
use palpate_model::units::Seconds;

fn field(n: usize) -> HeightField {
    HeightField::flat(Grid::new(n, n, 1.0).expect("a grid"), 0.25).expect("a field")
}

fn random_poke(random: &mut SplitMix, n: usize) -> Poke {
    let [column, row] = [0, 1].map(|_| random.below(n) as u16);
    Poke {
        node: GridNode { column, row },
        z: 4.0 * random.normal(),
        side: [ContactSide::Push, ContactSide::Pull][random.below(2)],
    }
}

#[test]
fn no_node_moves_twice_in_a_pass_and_the_queue_is_in_order_of_steps() {
    let mut random = SplitMix::seeded(1);
    let mut field = field(31);
    let mut chain = Chain::new(field.grid());
    for _ in 0..200 {
        let poke = random_poke(&mut random, 31);
        let before = field.heights().to_vec();
        let counts = chain.poke(&mut field, 0.25, Cut::NONE, poke);
        let mut order: Vec<_> = chain.order().iter().map(|node| field.grid.index(*node)).collect();
        assert!(chain.order().is_sorted_by_key(|node| node.steps_to(poke.node)));
        assert_eq!(order.len(), counts.moved);
        order.sort_unstable();
        assert!(order.windows(2).all(|pair| pair[0] != pair[1]));
        let changed = (0..before.len()).filter(|&index| before[index] != field.now[index]);
        assert_eq!(order, changed.collect::<Vec<_>>());
    }
}

#[test]
fn marks_of_passes_stay_right_when_their_number_overflows() {
    let mut stamps = chain::Stamps::new(3);
    stamps.begin();
    stamps.set(1);
    assert!(stamps.has(1) && !stamps.has(0));
    stamps.at_pass(u32::MAX);
    stamps.set(2);
    stamps.begin();
    assert!((0..3).all(|index| !stamps.has(index)));
}

#[test]
fn meshes_that_cannot_be_are_refused_in_words() {
    let refused = |columns, rows, spacing| Grid::new(columns, rows, spacing).unwrap_err();
    for bad in [
        refused(1, 5, 1.0),
        refused(5, 65_536, 1.0),
        refused(5000, 5000, 1.0),
        refused(5, 5, 0.0),
        refused(5, 5, f64::NAN),
        refused(5, 5, f64::INFINITY),
    ] {
        assert!(matches!(bad, MeshError::Size { .. } | MeshError::Spacing(_)), "{bad:?}");
    }
    let grid = Grid::new(3, 2, 1.0).unwrap();
    let made = |rest: &[f64], shear| HeightField::new(grid, rest.to_vec(), shear);
    let refused = |rest: &[f64], shear| made(rest, shear).unwrap_err();
    let flat = [0.0; 6];
    let nodes = 6;
    let is_count = |refusal: MeshError, count: usize| matches!(refusal, MeshError::Count { given, nodes: all, .. } if (given, all) == (count, nodes));
    assert!(is_count(refused(&flat[1..], 1.0), 5));
    assert!(matches!(
        refused(&[0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0], 1.0),
        MeshError::Height { column: 1, row: 1, .. }
    ));
    assert!(matches!(refused(&[2e6; 6], 1.0), MeshError::Height { height: 2e6, .. }));
    for shear in [-1.0, f64::NAN] {
        assert!(matches!(refused(&flat, shear), MeshError::Shear(_)), "{shear}");
    }
    assert_eq!(
        refused(&[0.0, 0.0, 1.5, 0.0, 0.0, 1.5], 1.0),
        MeshError::Steep { column: 1, row: 0, rise: 1.5, limit: 1.0 }
    );
    // Made to the limit with roundings: possible.
    let ramp: Vec<f64> = (0..6).map(|index| 0.1 * f64::from(index % 3)).collect();
    made(&ramp, 0.1).unwrap();
}

#[test]
fn a_surface_that_came_to_rest_reaches_no_further_than_a_new_one() {
    // Bounds of heights widen with pulls; left wide they would only cost time.
    let recovery = SurfaceRecovery::new(Seconds(1e-3), Seconds(1e-3)).unwrap();
    let mut used = Surface::new(field(41), SurfaceMethod::Envelope, recovery, Cut::NONE);
    let at = |z, side| {
        SurfaceContact::at(
            &Grid::new(41, 41, 1.0).unwrap(),
            GridNode { column: 20, row: 20 },
            z,
            side,
        )
    };
    used.tick(&[at(5.0, ContactSide::Pull)]);
    while !used.tick(&[]).dirty.is_empty() {}
    let mut new = Surface::new(field(41), SurfaceMethod::Envelope, recovery, Cut::NONE);
    let poke = [at(-1.0, ContactSide::Push)];
    assert_eq!(used.tick(&poke), new.tick(&poke));
}
