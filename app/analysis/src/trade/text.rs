//! The trade as text.

use palpate_rheology::integrators::Scheme;
use palpate_rheology::trade::{Advice, MeasuredCost, Recommendation, TradeCurves};
use std::fmt::Write;

#[must_use]
pub fn text(curves: &TradeCurves, recommendation: &Recommendation) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        out,
        "measured {} by palpate {} on {}",
        curves.measured_at,
        curves.version,
        curves.machine.words()
    );
    let _ = writeln!(
        out,
        "time: the fastest round; spread: how far the median round is above the fastest; even and odd rounds differ by {} at most; *: no other row is both cheaper and more exact",
        percent(curves.worst_halves())
    );
    integrators(&mut out, curves);
    families(&mut out, curves);
    fits(&mut out, curves);
    recommended(&mut out, recommendation);
    out.truncate(out.trim_end().len());
    out
}

/// A share in percent.
pub fn percent(share: f64) -> String {
    format!("{} %", digits(100.0 * share))
}

/// As short as it can be written to six decimals.
pub fn plain(value: f64) -> String {
    format!("{}", (value * 1e6).round() / 1e6)
}

/// Two digits, in powers of ten where they are small or large.
pub fn digits(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e4).contains(&value.abs()) {
        let decimals = (1.0 - value.abs().log10().floor()).clamp(0.0, 5.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.1e}")
    }
}

/// A time in the unit that suits it.
pub fn time(ns: f64) -> String {
    match ns {
        ns if ns < 1e3 => format!("{ns:.1} ns"),
        ns if ns < 1e6 => format!("{:.2} us", ns * 1e-3),
        ns => format!("{:.2} ms", ns * 1e-6),
    }
}

fn cost(cost: &MeasuredCost) -> String {
    format!("{:>10}  {:>7}", time(cost.ns), percent(cost.spread))
}

pub fn star(front: bool) -> &'static str {
    if front { "*" } else { " " }
}

/// One line for each integrator and precision, one column for each step.
fn integrators(out: &mut String, curves: &TradeCurves) {
    let mut steps: Vec<f64> = curves.integrators.iter().map(|row| row.step_s).collect();
    steps.sort_by(f64::total_cmp);
    steps.dedup();
    let _ = write!(
        out,
        "\nintegrators of the modified Kelvin body: largest error in percent of the peak force, for each step in ms\n{:34}{:>10}  {:>7} ",
        "", "a step", "spread"
    );
    for step in &steps {
        let _ = write!(out, "{:>9}", plain(step * 1e3));
    }
    out.push('\n');
    for scheme in Scheme::ALL {
        for precision in ["f64", "f32"] {
            let rows = curves.integrators.iter();
            let rows: Vec<_> = rows
                .filter(|row| row.scheme == scheme && row.precision.name() == precision)
                .collect();
            let Some(first) = rows.first() else { continue };
            let name = format!("{}, {precision}", scheme.name());
            let _ = write!(out, "{name:34}{} ", cost(&first.cost));
            for row in &rows {
                let cell = row.error.map_or_else(
                    || "unstable".to_owned(),
                    |error| {
                        let share = digits(100.0 * error.share_of(&curves.peak));
                        format!("{share}{}", star(row.front).trim_end())
                    },
                );
                let _ = write!(out, "{cell:>9}");
            }
            out.push('\n');
        }
    }
}

fn families(out: &mut String, curves: &TradeCurves) {
    let _ = writeln!(
        out,
        "\nfamilies: time of a step, which is the same at every rate, and largest error in percent of the peak force of the approximated model\n{:34}{:>10}  {:>7} {:>10}",
        "", "a step", "spread", "error"
    );
    let mut target = "";
    for row in &curves.families {
        if row.target != target {
            target = &row.target;
            let _ = writeln!(out, "for the {target}");
        }
        let error = digits(100.0 * row.error_n / row.peak_n);
        let _ =
            writeln!(out, "  {:32}{} {error:>10} {}", row.family, cost(&row.cost), star(row.front));
    }
}

fn fits(out: &mut String, curves: &TradeCurves) {
    let [first, count] = curves.seeds;
    let _ = writeln!(
        out,
        "\nthe fit of a ramp and hold with 20 mN of noise, seeds {first} to {}: rms errors of tau and of the force\n{:34}{:>10}  {:>7} {:>10} {:>10}",
        first + count - 1,
        "",
        "a fit",
        "spread",
        "tau",
        "force"
    );
    for row in &curves.fit {
        let name = format!("{} Hz, {} samples", plain(row.rate_hz), row.samples);
        let _ = writeln!(
            out,
            "{name:34}{} {:>10} {:>10} {}",
            cost(&row.cost),
            percent(row.tau_error),
            percent(row.error_n / curves.peak.ramp_hold_n),
            star(row.front)
        );
    }
    for row in &curves.live {
        let name = format!("live, {} relaxation times, a sample", row.nodes);
        let error = row.tau_error.map_or("no answer".to_owned(), percent);
        let _ = writeln!(
            out,
            "{name:34}{} {error:>10} without noise {}",
            cost(&row.cost),
            star(row.front)
        );
    }
}

fn recommended(out: &mut String, recommendation: &Recommendation) {
    let _ = writeln!(out, "\nfor {}", terms(recommendation));
    for (name, words) in advice(recommendation) {
        let _ = writeln!(out, "  {name}: {words}");
    }
}

pub fn terms(recommendation: &Recommendation) -> String {
    format!(
        "a tolerance of {} and {} updates a second, using at most {} of each period",
        recommendation.tolerance,
        plain(recommendation.rate_hz),
        percent(recommendation.share_allowed)
    )
}

/// The purpose of each setting, and the setting or the reason there is none.
pub fn advice(recommendation: &Recommendation) -> Vec<(String, String)> {
    let words = |advice: &Advice| match advice {
        Advice::Use(choice) => {
            let share = choice
                .share_of_period
                .map_or(String::new(), |share| format!(", {} of each period", percent(share)));
            format!(
                "{}: error {} of the peak force{share}",
                choice.setting,
                percent(choice.error_of_peak)
            )
        }
        Advice::None(why) => format!("none: {why}"),
    };
    let families = recommendation.families.iter();
    let families =
        families.map(|(target, advice)| (format!("family for the {target}"), words(advice)));
    std::iter::once(("integrator".to_owned(), words(&recommendation.integrator)))
        .chain(families)
        .chain([
            ("recording to fit".to_owned(), words(&recommendation.fit)),
            ("live fit".to_owned(), words(&recommendation.live)),
        ])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits() {
        let texts = [0.0, 0.0123, 1.0, 12.3, 999.0, 1e-9].map(digits);
        assert_eq!(texts, ["0", "0.012", "1.0", "12", "999", "1.0e-9"]);
        let half = MeasuredCost { ns: 1500.0, spread: 0.5, halves: 0.0 };
        assert_eq!(cost(&half), "   1.50 us     50 %");
    }
}
