//! The damping that a body needs over the depths of a stroke, in its parts.

use palpate_haptics::margin::{LinearisedBody, LoopDevice, MarginSettings};
use palpate_model::units::{Depth, MmPerS};

/// Number of depths: as many as a plot is wide.
const DEPTHS: u32 = 600;

/// Damping needed at a depth, in N s/m; each part stands on the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginPoint {
    /// In mm.
    pub depth: f64,
    /// For the body's own lag.
    pub lag: f64,
    /// With what the tick adds.
    pub tick: f64,
    /// With what the delay adds: all that is needed.
    pub delay: f64,
}

/// Over a stroke entered at a speed, with the criterion that the check has.
#[must_use]
pub fn margin_curve(watch: &MarginSettings, deepest: Depth, speed: MmPerS) -> Vec<MarginPoint> {
    let prompt =
        MarginSettings { device: LoopDevice { delay_ticks: 0.0, ..watch.device }, ..*watch };
    let point = |i: u32| {
        // Closer together near the surface, where most changes.
        let share = f64::from(i) / f64::from(DEPTHS);
        let depth = Depth(deepest.0 * share * share);
        // A body that brings its own damping needs none.
        let lag = LinearisedBody::of(&watch.body, depth).lag().max(0.0);
        let tick = prompt.exact_margin_at(depth, speed).needed.max(lag);
        let delay = watch.exact_margin_at(depth, speed).needed.max(tick);
        // N s/m, as catalogues have it.
        MarginPoint { depth: depth.0, lag: 1e3 * lag, tick: 1e3 * tick, delay: 1e3 * delay }
    };
    (0..=DEPTHS).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::haptics::HapticSettings;
    use palpate_haptics::Period;
    use palpate_model::viscoelastic::ModifiedKelvin;

    fn curve(rate: f64, delay: usize) -> (Vec<MarginPoint>, f64) {
        let setting =
            HapticSettings { delay, ..HapticSettings::source(Period::of_rate(rate).unwrap()) };
        let watch = setting.simulation(ModifiedKelvin::THESIS, true).system.watch();
        let verdict = watch.assess_stroke(setting.deepest, setting.speed);
        let curve = margin_curve(&watch, setting.deepest, setting.speed);
        (curve, 1e3 * verdict.worst.needed)
    }

    #[test]
    fn the_top_of_the_curve_is_the_damping_that_the_check_names() {
        for (rate, delay) in [(1000.0, 0), (500.0, 2), (5000.0, 4)] {
            let (curve, worst) = curve(rate, delay);
            let top = curve.iter().map(|one| one.delay).fold(0.0, f64::max);
            // The check looks at other depths.
            assert!((top - worst).abs() < 0.01 * worst, "{rate} {delay}: {top} {worst}");
            for one in &curve {
                assert!(one.lag <= one.tick && one.tick <= one.delay, "{one:?}");
            }
        }
    }

    #[test]
    fn a_faster_loop_takes_from_the_tick_and_leaves_the_lag() {
        let ([slow, fast], depth) = ([curve(500.0, 0).0, curve(5000.0, 0).0], 300);
        assert_eq!(slow[depth].lag, fast[depth].lag);
        let of_tick = |one: &MarginPoint| one.tick - one.lag;
        // Half a tick of stiffness: a tenth at ten times the rate.
        let ratio = of_tick(&slow[depth]) / of_tick(&fast[depth]);
        assert!((ratio - 10.0).abs() < 0.5, "{ratio}");
        // Without a delay nothing stands on the tick's part.
        assert!(slow.iter().all(|one| one.delay == one.tick));
    }
}
