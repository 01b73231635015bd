//! The force that falls while the depth is held.

use super::Estimate;
use super::local::{bins, last_rise, line, mean};
use palpate_model::units::{Newtons, Seconds};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StressRelaxation {
    /// From the first to the last sample of the hold.
    pub duration: Seconds,
    /// Force at the end: a line through the last tenth of the hold, read at its end.
    pub force_end: Estimate<Newtons>,
    /// Fall of the force by then, in percent of the peak (percent relaxation).
    pub percent: Estimate<f64>,
    /// Time from the start of the hold until half of what will have gone at its end has gone.
    pub half_time: Option<Seconds>,
    /// Slope of that line in N/s: what a longer hold would still change.
    pub rate_end: Estimate<f64>,
    /// Where the force is heading. Settled within its noise: the mean of the last sixth. Else extrapolated from the last
    /// half as one exponential (Aitken, Proc. R. Soc. Edinb. 46 (1926) 289, of the means of its three thirds).
    /// `None` where it still falls so evenly that it could end anywhere.
    pub equilibrium: Option<Estimate<Newtons>>,
}

/// Last part of a hold from which its end is read.
const TAIL: f64 = 0.1;

/// A difference of so many standard errors is no noise.
const SIGNIFICANT: f64 = 3.0;

/// Largest ratio of two falls in a row from which an end can be extrapolated: at 0.9 the end is nine falls away.
const RATIO_MAX: f64 = 0.9;

/// Measures a hold from its points (time in s, force in N) and the force at its start; `None` for fewer than twenty.
#[must_use]
pub fn relaxation(hold: &[[f64; 2]], peak: Estimate<Newtons>) -> Option<StressRelaxation> {
    let (first, last) = (hold.first()?[0], hold.last()?[0]);
    let duration = last - first;
    if hold.len() < 20 || duration <= 0.0 || peak.value.0 == 0.0 {
        return None;
    }
    let tail = after(hold, last - TAIL * duration);
    let end = line(tail, last)?;
    let (remaining, top) = (end.value[0] / peak.value.0, peak.value.0);
    let percent_error = 100.0 * ((end.value[1] / top).hypot(remaining * peak.std_error.0 / top));
    Some(StressRelaxation {
        duration: Seconds(duration),
        force_end: Estimate::of(Newtons, end.value),
        percent: Estimate { value: 100.0 * (1.0 - remaining), std_error: percent_error },
        half_time: half_time(hold, 0.5 * (top + end.value[0])),
        rate_end: Estimate::of(|rate| rate, end.slope),
        equilibrium: equilibrium(hold, last - 0.5 * duration, 0.5 * duration),
    })
}

fn after(points: &[[f64; 2]], t: f64) -> &[[f64; 2]] {
    &points[points.partition_point(|point| point[0] < t)..]
}

/// When the force first is below a level: the hold up to twice that time is looked at more closely.
fn half_time(hold: &[[f64; 2]], level: f64) -> Option<Seconds> {
    let first = hold.first()?[0];
    let crossing = |points: &[[f64; 2]]| {
        let upside_down: Vec<[f64; 2]> = points.iter().map(|point| [point[0], -point[1]]).collect();
        last_rise(&bins(&upside_down), -level)
    };
    let [coarse, _] = crossing(hold)?;
    let until = first + 2.0 * (coarse - first);
    let near = &hold[..hold.partition_point(|point| point[0] <= until)];
    let [fine, _] = crossing(near).unwrap_or([coarse, 0.0]);
    Some(Seconds(fine - first))
}

fn equilibrium(hold: &[[f64; 2]], from: f64, span: f64) -> Option<Estimate<Newtons>> {
    let part = |k: usize| {
        let start = after(hold, from + span * k as f64 / 3.0);
        let end = from + span * (k + 1) as f64 / 3.0;
        let count = match k {
            2 => start.len(),
            _ => start.partition_point(|point| point[0] < end),
        };
        mean(start[..count].iter().map(|point| point[1]))
    };
    let [[f1, e1], [f2, e2], [f3, e3]] = [part(0)?, part(1)?, part(2)?];
    // The spread within a part holds its fall as well: an error a little too large.
    let noise = e1.hypot(e3);
    if (f1 - f3).abs() <= SIGNIFICANT * noise {
        return Some(Estimate::of(Newtons, [f3, e3]));
    }
    let (one, two) = (f2 - f1, f3 - f2);
    let ratio = two / one;
    if !(0.0..RATIO_MAX).contains(&ratio) {
        return None;
    }
    // f3 + r / (1 - r) (f3 - f2), with its derivatives by the three means.
    let rest = two * ratio / (1.0 - ratio);
    let by_ratio = two / (1.0 - ratio).powi(2);
    let gain = ratio / (1.0 - ratio);
    let d1 = by_ratio * two / (one * one);
    let d2 = -gain - by_ratio * (1.0 / one + two / (one * one));
    let d3 = 1.0 + gain + by_ratio / one;
    let error = (d1 * e1).hypot(d2 * e2).hypot(d3 * e3);
    Some(Estimate::of(Newtons, [f3 + rest, error]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// 5 + 2 exp(-t / tau) N at 1 kHz.
    fn hold(tau: f64, seconds: f64, noise: f64, seed: u64) -> Vec<[f64; 2]> {
        let mut random = SplitMix::seeded(seed);
        (0..=(seconds * 1e3) as u32)
            .map(|i| f64::from(i) * 1e-3)
            .map(|t| [100.0 + t, 5.0 + 2.0 * (-t / tau).exp() + noise * random.normal()])
            .collect()
    }

    const PEAK: Estimate<Newtons> = Estimate { value: Newtons(7.0), std_error: Newtons(0.01) };

    #[test]
    fn an_exponential_has_the_numbers_of_its_formula() {
        let found = relaxation(&hold(1.0, 20.0, 0.0, 1), PEAK).unwrap();
        assert!((found.force_end.value.0 - 5.0).abs() < 1e-8);
        assert!((found.percent.value - 200.0 / 7.0).abs() < 1e-6);
        // d(F / P) = F dP / P^2.
        assert!((found.percent.std_error - 100.0 * 5.0 * 0.01 / 49.0).abs() < 1e-6);
        // ln 2, seen through bins of 7 ms.
        assert!((found.half_time.unwrap().0 - 2f64.ln()).abs() < 2e-4);
        assert!((found.equilibrium.unwrap().value.0 - 5.0).abs() < 1e-4);
    }

    #[test]
    fn a_short_hold_is_extrapolated() {
        // Two time constants: the force ends 0.27 N above where it is heading.
        let found = relaxation(&hold(10.0, 20.0, 0.0, 1), PEAK).unwrap();
        assert!((found.force_end.value.0 - 5.0 - 2.0 * (-2.0f64).exp()).abs() < 1e-3);
        assert!((found.equilibrium.unwrap().value.0 - 5.0).abs() < 1e-3);
        let slope = found.rate_end.value;
        assert!((slope / (-0.2 * (-2.0f64).exp()) - 1.0).abs() < 0.12, "{slope}");
        // A hundredth of a time constant: no telling.
        let found = relaxation(&hold(2000.0, 20.0, 0.0, 1), PEAK).unwrap();
        assert_eq!(found.equilibrium, None);
    }

    #[test]
    fn errors_are_those_of_the_noise() {
        let (mut ends, mut heads) = (Vec::new(), Vec::new());
        for seed in 0..100 {
            let found = relaxation(&hold(3.0, 6.0, 0.02, seed), PEAK).unwrap();
            let truth = 5.0 + 2.0 * (-2.0f64).exp();
            ends.push((found.force_end.value.0 - truth) / found.force_end.std_error.0);
            let head = found.equilibrium.unwrap();
            heads.push((head.value.0 - 5.0) / head.std_error.0);
        }
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / 100.0).sqrt();
        println!("end {:.2}, equilibrium {:.2} standard errors", rms(&ends), rms(&heads));
        // The curvature of the tail adds a little to the one, the fall within a part makes the other too careful.
        assert!((0.8..1.6).contains(&rms(&ends)), "{}", rms(&ends));
        assert!((0.1..1.2).contains(&rms(&heads)), "{}", rms(&heads));
    }
}
