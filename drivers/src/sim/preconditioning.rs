//! Tissue that loading rearranges: its surface recedes from cycle to cycle until nothing changes any more.
//!
//! Repeated loading moves the force-depth loops of soft tissue toward greater depth and lowers their peaks,
//! less with every cycle, until they repeat; after a rest part of it comes back (Fung, Biomechanics: Mechanical
//! Properties of Living Tissues, 2nd ed., 1993, section 7.3). Sverdlik & Lanir (J. Biomech. Eng. 124 (2002) 78) put
//! that into a law by letting the length at which a fibre begins to carry load grow while it is loaded, by
//! first-order kinetics, towards a limit. Here the depth at which the body begins to carry load does so:
//!
//! * under force, the set `s` follows the way the probe makes: `ds = (limit(x_max) - s) |dx| / (WAY x_max)` with
//!   `limit(x) = share x^3 / (x^2 + DEEP^2)`, so that a touch leaves the tissue as it was;
//! * free of force, it heals: `ds/dt = -s / HEALING`.
//!
//! The intrinsic time of the first law is the length of the way (as in Valanis's endochronic theory, Arch. Mech. 23
//! (1971) 517), so cycles count, not their speed. The body behind sees the
//! depth `x - s`. The set grows only where the force is positive and shrinks only where it is zero, so the power
//! `F ds/dt` that it takes is never negative: no energy comes out of it.

use super::amounts::SimPreconditioning;

/// Ways, in greatest depths, after which the set is all but a share `1/e` of its limit. With it and the usual minute
/// or minutes of rest, loops of a simulated stomach repeat within a percent after five to nine cycles.
const WAY: f64 = 1.5;

/// Depth in mm far below which hardly anything is rearranged: a search for contact presses a few millimetres, and two
/// touches of one surface have to meet it at the same place within some hundredths.
const DEEP: f64 = 10.0;

/// Time constant of healing in s: ten minutes, what Fung let pass between cycles so that they start alike.
const HEALING: f64 = 600.0;

/// Forces in N up to here are none: what rounding leaves of a body that has relaxed.
const FREE: f64 = 1e-9;

#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceRecession {
    share: f64,
    /// Greatest depth so far behind where the surface was at first, in mm.
    depth_max: f64,
    /// Depth at the newest tick, in mm.
    depth: f64,
    /// The set, in mm.
    set: f64,
}

impl SurfaceRecession {
    pub fn new(preconditioning: SimPreconditioning) -> Self {
        Self { share: preconditioning.hundredths(), depth_max: 0.0, depth: 0.0, set: 0.0 }
    }

    /// Recession of the surface, in mm.
    pub fn get(&self) -> f64 {
        self.set
    }

    /// Limit of the set, in mm.
    fn limit(&self) -> f64 {
        let x = self.depth_max;
        self.share * x * x * x / (x * x + DEEP * DEEP)
    }

    /// The probe has moved to a depth behind the first surface, and the force was so before; returns the set.
    pub fn advance(&mut self, depth: f64, force: f64, dt: f64) -> f64 {
        let depth = depth.max(0.0);
        let way = (depth - self.depth).abs();
        self.depth = depth;
        self.depth_max = self.depth_max.max(depth);
        if force > FREE {
            let missing = self.limit() - self.set;
            // Exact for a way along which the limit stays; on a first way in it grows by a ten-thousandth a tick.
            self.set -= missing * (-way / (WAY * self.depth_max)).exp_m1();
        } else {
            self.set *= (-dt / HEALING).exp();
        }
        self.set
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Random, RandomStream};
    use super::super::settings::SimSettings;
    use super::super::tissue::Tissue;
    use super::*;
    use palpate_model::{Position, Seconds};

    const DT: f64 = 1e-3;

    struct Press {
        tissue: Tissue,
        surface: Position,
    }

    #[derive(Clone, Copy, Debug)]
    struct Cycle {
        peak: f64,
        /// Depth behind the first surface at which the force reached 1 N on the way in, in mm.
        at_one_newton: f64,
        /// Energy put in, in N*mm.
        work: f64,
    }

    impl Press {
        fn new(percent: u8) -> Self {
            let settings = SimSettings {
                preconditioning: percent.to_string().parse().unwrap(),
                ..SimSettings::default()
            };
            let tissue = Tissue::new(&mut Random::new(4, RandomStream::Tissue), &settings);
            let surface = tissue.surface();
            Self { tissue, surface }
        }

        fn to(&mut self, depth: f64) -> f64 {
            let probe = self.surface.moved_by(depth);
            self.tissue.advance(probe, Seconds(DT)).0
        }

        /// In from 0.5 mm before the first surface and out again.
        fn cycle(&mut self, depth: f64, speed: f64) -> Cycle {
            let count = ((depth + 0.5) / (speed * DT)).round() as i32;
            let x = |i: i32| -0.5 + (depth + 0.5) * f64::from(i) / f64::from(count);
            let (mut peak, mut at_one_newton, mut work) = (0.0f64, f64::NAN, 0.0);
            let mut before = (x(0), self.to(x(0)));
            for i in (1..=count).chain((0..count).rev()) {
                let here = (x(i), self.to(x(i)));
                work += 0.5 * (before.1 + here.1) * (here.0 - before.0);
                peak = peak.max(here.1);
                if at_one_newton.is_nan() && here.1 >= 1.0 {
                    at_one_newton = here.0;
                }
                before = here;
            }
            Cycle { peak, at_one_newton, work }
        }

        fn rest(&mut self, seconds: f64) {
            for _ in 0..(seconds / DT).round() as u32 {
                self.to(-0.5);
            }
        }
    }

    #[test]
    fn peaks_fall_and_loops_shift_to_greater_depth_until_steady() {
        for (speed, rest) in [(5.0, 0.0), (0.75, 0.0), (3.0, 180.0)] {
            let mut press = Press::new(10);
            let cycles: Vec<Cycle> = (0..10)
                .map(|_| {
                    let cycle = press.cycle(30.0, speed);
                    press.rest(rest);
                    cycle
                })
                .collect();
            println!("{speed} mm/s, rest {rest} s: {cycles:.3?}");
            let shifts: Vec<f64> = cycles
                .windows(2)
                .map(|pair| pair[1].at_one_newton - pair[0].at_one_newton)
                .collect();
            assert!(cycles.windows(2).all(|pair| pair[1].peak < pair[0].peak));
            // A tick's way, by which a depth is known, is 5 um at most.
            assert!(shifts.iter().all(|shift| *shift > -1e-9), "{shifts:?}");
            assert!(shifts[..5].is_sorted_by(|one, next| one > next), "{shifts:?}");
            // What the thesis saw: repeats 1 and 9 differ clearly, 5 and 9 barely.
            let change = |a: usize, b: usize| 1.0 - cycles[b - 1].peak / cycles[a - 1].peak;
            assert!(change(1, 9) > 0.08 && change(5, 9) < 0.01, "{cycles:?}");
            assert!(press.tissue.surface().distance_from(press.surface) < 3.0);
        }
    }

    #[test]
    fn rest_restores_part_of_the_recession() {
        let mut press = Press::new(10);
        let fresh = press.cycle(30.0, 5.0);
        for _ in 0..8 {
            press.cycle(30.0, 5.0);
        }
        let set = press.tissue.surface().distance_from(press.surface);
        press.rest(600.0);
        let healed = press.tissue.surface().distance_from(press.surface);
        // Ten minutes are one time constant.
        let share = healed / set;
        assert!((share - (-1.0f64).exp()).abs() < 1e-9, "{share}");
        let rested = press.cycle(30.0, 5.0);
        let again = press.cycle(30.0, 5.0);
        assert!(again.peak < rested.peak && rested.peak < fresh.peak);
        assert!(rested.at_one_newton > fresh.at_one_newton + 0.3);
    }

    #[test]
    fn the_set_follows_its_law_at_any_speed() {
        for (depth, speed) in [(20.0, 20.0), (20.0, 0.5), (3.0, 0.5), (30.0, 3.0)] {
            let mut press = Press::new(20);
            let count = (depth / (speed * DT)).round() as i32;
            for i in 0..=count {
                press.to(depth * f64::from(i) / f64::from(count));
            }
            let set = press.tissue.surface().distance_from(press.surface);
            // On the first way in x = x_max, and s = x^-q int q L(x) x^(q - 1) dx with q = 1 / WAY; midpoints.
            let q = 1.0 / WAY;
            let step = depth / 1e5;
            let terms = (0..100_000).map(|i| {
                let x = (f64::from(i) + 0.5) * step;
                q * 0.2 * x.powi(3) / (x * x + DEEP * DEEP) * x.powf(q - 1.0) * step
            });
            let law = terms.sum::<f64>() * depth.powf(-q);
            // The force is above zero from the surface on: what differs is the way of a tick, up to 0.02 mm.
            assert!((set / law - 1.0).abs() < 3e-3, "{depth} {speed}: {set} {law}");
        }
    }

    #[test]
    fn a_touch_leaves_the_tissue_as_it_was() {
        let mut press = Press::new(10);
        press.cycle(3.0, 1.0);
        let set = press.tissue.surface().distance_from(press.surface);
        assert!(set > 0.0 && set < 0.03, "{set}");
    }

    #[test]
    fn no_closed_loop_gives_energy_back() {
        for (depth, speed) in [(20.0, 0.5), (30.0, 5.0), (10.0, 5.0), (30.0, 20.0)] {
            let [hard, soft] = [0, 30].map(|percent| {
                let mut press = Press::new(percent);
                (0..4).map(|_| press.cycle(depth, speed).work).collect::<Vec<f64>>()
            });
            assert!(hard.iter().chain(&soft).all(|work| *work > 0.0), "{hard:?} {soft:?}");
            // The first loop pays for what is rearranged in it.
            assert!(soft[0] > soft[3], "{soft:?}");
        }
        // Nor does a small loop on top of a large one.
        let mut press = Press::new(30);
        press.cycle(30.0, 2.0);
        let mut work = 0.0;
        let mut before = (-0.5, 0.0);
        for i in 0..60_000_u32 {
            let phase = f64::from(i) * DT * std::f64::consts::TAU / 20.0;
            // From 25 mm, 2 mm up and down, after the way there.
            let x = if i < 20_000 {
                -0.5 + 25.5 * f64::from(i) / 20_000.0
            } else {
                25.0 + 2.0 * phase.sin()
            };
            let here = (x, press.to(x));
            if i > 40_000 {
                work += 0.5 * (before.1 + here.1) * (here.0 - before.0);
            }
            before = here;
        }
        assert!(work > 0.0, "{work}");
    }

    #[test]
    fn without_preconditioning_forces_stay_the_same_to_the_last_bit() {
        let mut with = Press::new(0);
        let plain = Tissue::new(&mut Random::new(4, RandomStream::Tissue), &SimSettings::default());
        let mut without = Press { surface: plain.surface(), tissue: plain };
        for i in 0..20_000 {
            let x = 15.0 - 16.0 * (f64::from(i) * 1e-3).cos();
            assert_eq!(with.to(x), without.to(x));
        }
    }
}
