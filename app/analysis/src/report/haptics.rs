//! Texts on a body on a device, and on the timing of a loop.

use super::picture::{COLUMNS, LEFT, RIGHT, titled};
use super::text::{ParameterText, table};
use crate::haptics::{FeedbackCheck, HapticCheck, LoopMeasurement, SimulatedTrial};
use palpate_figures::figure::{self, AxisNames, Ink, Plot, PlotAxis, PlotSeries};
use palpate_figures::thin::thin;
use palpate_figures::tokens::LIGHT;
use palpate_figures::uncertain::plain;
use palpate_haptics::Flags;
use palpate_haptics::check::FeedbackCheckSample;
use palpate_haptics::margin::Margin;
use palpate_model::rig::Phase;
use palpate_model::units::Seconds;
use palpate_rheology::fit::FitReport;
use palpate_runner::haptics::slave::{ForceDifference, MasterLoop, SlaveReport};
use palpate_runner::haptics::timing::DurationPercentiles;

#[must_use]
pub fn check_text(checked: &HapticCheck) -> String {
    let body = &checked.body;
    let [tau_eps, mu1, mu2, mu3, tau_sig] =
        [body.tau_eps, body.mu[0], body.mu[1], body.mu[2], body.tau_sig].map(plain);
    let mut lines = vec![format!(
        "body: tau_eps {tau_eps} s, mu1 {mu1} N/mm, mu2 {mu2} N/mm^2, mu3 {mu3} N/mm^3, tau_sig {tau_sig} N*s/mm^2"
    )];
    lines.extend(checked.sentences.iter().cloned());
    lines.push(String::new());
    lines.push(
        "Simulated: a firm, lightly damped hand presses to the end of the stroke and holds there."
            .to_owned(),
    );
    for tried in &checked.trials {
        lines.push(tried_text(tried));
        lines.extend(tried.flags.iter().map(|flag| format!("  {flag}")));
    }
    lines.join("\n")
}

#[must_use]
pub fn tried_text(tried: &SimulatedTrial) -> String {
    let guards = if tried.is_guarded { "with" } else { "without" };
    let buzz = match (tried.buzz, tried.buzz_until_s) {
        (Some((frequency, amplitude)), Some(until)) => format!(
            "limit cycle in {:.0} % of the hold, until {until:.2} s after the start of the hold, amplitude up to {amplitude:.3} mm at {frequency:.0} Hz",
            100.0 * tried.buzz_share
        ),
        _ => "no limit cycle".to_owned(),
    };
    let returned = match tried.energy_min_mj < 0.0 {
        true => format!(
            "the rendered force returns {:.3} mJ more than it received",
            -tried.energy_min_mj
        ),
        false => "the rendered force returns no energy".to_owned(),
    };
    format!(
        "{guards} guards: {buzz}; the position varies by {:.3} mm in the last second, the force reaches {:.2} N, the added damping reaches {:.1} N s/m, {returned}",
        tried.swing_mm, tried.force_max_n, tried.damping_added_max
    )
}

/// Reasons why the rendered force is below that of the model, a sentence for each, the loop's own lateness last; empty if
/// nothing takes any away. `missed` counts ticks that were lately due while the loop was away.
#[must_use]
pub fn force_loss_reasons(flags: Flags, missed: u64) -> Vec<String> {
    let bounds = [Flags::FORCE_MAX, Flags::SLEW].map(|bound| bound.when(flags.has(bound)));
    let causes = std::iter::once(flags.less_force()).chain(bounds);
    let mut causes: Vec<String> =
        causes.flat_map(|flags| flags.sentences().map(str::to_owned)).collect();
    if missed > 0 {
        let ticks = if missed == 1 { "tick" } else { "ticks" };
        causes.push(format!(
            "the loop was late and missed {missed} {ticks}; the force kept its last value"
        ));
    }
    causes
}

/// The margin at the depth of the moment, in words.
#[must_use]
pub fn margin_text(margin: &Margin) -> String {
    let depth = margin.depth;
    match margin.ratio() {
        None => format!(
            "At a depth of {depth:.2} the model itself dissipates enough energy; the device needs no damping."
        ),
        Some(ratio) if margin.is_enough() => {
            format!(
                "At a depth of {depth:.2} the device has {ratio:.1} times the damping it needs."
            )
        }
        Some(ratio) => format!(
            "At a depth of {depth:.2} the device has {ratio:.2} times the damping that stability needs; the energy guard adds what is missing."
        ),
    }
}

#[must_use]
pub fn run_text(paced: &LoopMeasurement) -> String {
    let recorded = paced.recorded.map(|recorded| format!("\n{}", recorded.words()));
    bench_text(std::slice::from_ref(paced)) + &recorded.unwrap_or_default()
}

#[must_use]
pub fn slave_text(slaved: &SlaveReport) -> String {
    let less =
        |one: &ForceDifference| format!("{:.3} N rms, {:.3} N at most", one.rms_n, one.worst_n);
    let mut lines = vec![
        format!(
            "slave: greatest depth {:.3} mm; contact changed {} times",
            slaved.depth_max_mm, slaved.contact_changes
        ),
        format!(
            "greatest force: {:.3} N at the handle, {:.3} N of the model at the slave's position, {:.3} N at the load cell",
            slaved.handle_max_n, slaved.model_max_n, slaved.cell_max_n
        ),
        format!(
            "model force at the slave's position minus load-cell force: {} (the model differs from the specimen)",
            less(&slaved.model_less_cell)
        ),
        format!(
            "handle force minus load-cell force: {} (model, guard and lag)",
            less(&slaved.handle_less_cell)
        ),
    ];
    let behind = slaved.lag_mm;
    let late = slaved.lag_ms.map_or(String::new(), |lag| {
        format!("; median {:.0} ms, worst {:.0} ms", lag.median, lag.worst)
    });
    lines.push(format!(
        "lag of the slave: median {:.3} mm, worst {:.3} mm{late}",
        behind.median, behind.worst
    ));
    if let Some(through) = slaved.damping_through_slave {
        lines.push(format!(
            "damping: at the greatest depth the device has {:.1} N s/m and needs {:.1} N s/m; a force computed from the slave's position would need {through:.1} N s/m, so the handle renders the model force at the master's position",
            slaved.damping_has,
            slaved.damping_needed.max(0.0)
        ));
    }
    if let Some(MasterLoop { priority, timing }) = &slaved.master_loop {
        lines.push(format!(
            "the master's loop: {} ticks, 99.9 % of them at most {:.1} ms late, {} missed; priority {priority}",
            timing.late.count,
            1e3 * timing.late.p99_9.0,
            timing.missed
        ));
    }
    lines.join("\n")
}

/// Loops at several rates, as a table.
#[must_use]
pub fn bench_text(loops: &[LoopMeasurement]) -> String {
    let priority = loops.first().map(|first| format!("priority: {}", first.priority));
    let mut lines: Vec<String> = priority.into_iter().collect();
    lines.push(format!(
        "{:>6} {:>5}  {:<28} {:<28} {:<28} {:>8} {:>7}",
        "rate", "busy", "late (us)", "period (us)", "work (us)", "overruns", "missed"
    ));
    let heads = "p50    p99   p99.9  max";
    lines.push(format!("{:>6} {:>5}  {heads:<28} {heads:<28} {heads:<28}", "Hz", ""));
    for one in loops {
        let statistics = &one.statistics;
        lines.push(format!(
            "{:>6.0} {:>5}  {:<28} {:<28} {:<28} {:>8} {:>7}",
            one.rate_hz,
            one.busy_threads,
            spread(&statistics.late),
            spread(&statistics.period),
            spread(&statistics.work),
            statistics.overruns,
            statistics.missed
        ));
    }
    lines.join("\n")
}

fn spread(spread: &DurationPercentiles) -> String {
    let micros = |time: Seconds| format!("{:.0}", 1e6 * time.0);
    let [p50, p99, p99_9, max] = [spread.p50, spread.p99, spread.p99_9, spread.max].map(micros);
    format!("{p50:<6} {p99:<5} {p99_9:<6} {max:<8}")
}

#[must_use]
pub fn follow_text(followed: &FeedbackCheck) -> String {
    let mut lines = vec![
        format!(
            "peak       commanded {:.3} N, measured {:.3} N",
            followed.peak_commanded_n, followed.peak_measured_n
        ),
        format!(
            "while loading, the measured force minus the commanded force is {:+.3} N on average, with a scatter of {:.3} N rms",
            followed.offset_n, followed.scatter_n
        ),
    ];
    if let Some(found) = &followed.calibration {
        lines.push(format!(
            "bias       {:.4} ± {:.4} N/V at the rack; the force is linear in the bias from {:.3} to {:.3}",
            found.slope, found.slope_error, found.rising.line[0], found.rising.line[1]
        ));
    }
    lines.push(format!(
        "the difference of the forces includes {:.3} N of friction in motor and rack, and {:.3} N of drag from the drive at this speed",
        followed.friction_n, followed.drag_n
    ));
    lines.push(String::new());
    lines.push(fits_beside_the_body(followed));
    if followed.fit.is_some() {
        lines.push(difference(followed).to_owned());
    }
    lines.extend(followed.refusals.iter().cloned());
    lines.join("\n")
}

/// The cause of the difference between the fits of measured and commanded force.
fn difference(followed: &FeedbackCheck) -> &'static str {
    if followed.settings.friction_share > 0.0 {
        "the drive compensates friction only while the rack moves: the measured force jumps when the hold begins, and the fit mistakes this jump for relaxation"
    } else {
        "friction and drag add a constant force while the rack moves, and friction remains during the hold: the fit reports this force as f_offset, and the other parameters hardly change"
    }
}

/// Parameters of the fits of both forces, beside those of the rendered body.
fn fits_beside_the_body(followed: &FeedbackCheck) -> String {
    let body = &followed.body;
    let [mu1, mu2, mu3] = body.mu;
    let cell = |report: &Option<FitReport>, name: &str| {
        let found = report.as_ref().and_then(|report| report.parameter(name));
        found.map_or("none".to_owned(), |one| ParameterText::of(one).value)
    };
    let row = |name: &str, value: f64, unit: &str| {
        let measured = cell(&followed.fit, name);
        let commanded = cell(&followed.fit_commanded, name);
        [name, &plain(value), &commanded, &measured, unit].map(str::to_owned).to_vec()
    };
    let rows = [
        row("tau_eps", body.tau_eps, "s"),
        row("mu1", mu1, "N/mm"),
        row("mu2", mu2, "N/mm²"),
        row("mu3", mu3, "N/mm³"),
        row("tau_sig", body.tau_sig, "N·s/mm²"),
        row("f_offset", 0.0, "N"),
    ];
    table(" | model | fit of the commanded force | fit of the measured force | ", rows)
}

/// A check of the feedback as a picture: forces over time, and one over the other.
#[must_use]
pub fn follow_plot(source: &str, followed: &FeedbackCheck) -> String {
    let series =
        |of: fn(&FeedbackCheckSample) -> [f64; 2]| thin(followed.samples.iter().map(of), COLUMNS);
    let commanded = series(|one| [one.t.0, one.commanded.0]);
    let measured = series(|one| [one.t.0, one.measured.0]);
    let torque = series(|one| [one.t.0, one.torque]);
    let last = followed.samples.last().map_or(1.0, |one| one.t.0);
    let line = format!(
        "a slider pushes the rack and a load cell measures the force; peak commanded {:.3} N, measured {:.3} N",
        followed.peak_commanded_n, followed.peak_measured_n
    );
    let mut svg = titled(source, &line);
    let time = || PlotAxis::linear("time (s)").with_range([0.0, last]);
    let force = Plot::new("", time(), PlotAxis::linear("force (N)")).with([
        // Wide under narrow, so that both are seen where they agree.
        PlotSeries::line("measured", Ink::Series, 2.6, measured),
        PlotSeries::line("commanded", Ink::Limit, 1.4, commanded),
    ]);
    figure::legend(&mut svg, [RIGHT, 46.0], &force);
    force.draw(&mut svg, [LEFT, 66.0, RIGHT, 360.0], AxisNames::Upright);
    let torque = PlotSeries::line("torque", Ink::Limit, 1.4, torque);
    let torque = Plot::new("", time(), PlotAxis::linear("torque (N mm)")).with([torque]);
    torque.draw(&mut svg, [LEFT, 396.0, RIGHT, 510.0], AxisNames::Both);
    svg.finish(556.0, LIGHT.canvas, &format!("Feedback of {source}"))
}

/// The check as a table that palpate fits and imports.
#[must_use]
pub fn follow_table(followed: &FeedbackCheck) -> String {
    let mut table = "time_s,depth_mm,force_n,commanded_n,torque_nmm,bias_v,phase\n".to_owned();
    let ramp = followed.settings.ramp_end();
    for one in &followed.samples {
        let numbers =
            [one.t.0, one.depth.0, one.measured.0, one.commanded.0, one.torque, one.bias.0];
        let phase = if one.t <= ramp { Phase::Ramp } else { Phase::Hold };
        table.push_str(&numbers.map(|value| value.to_string()).join(","));
        table.push_str(&format!(",{}\n", phase.name()));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_haptics::margin::MarginCause;
    use palpate_model::units::{Depth, Newtons};

    #[test]
    fn only_flags_that_take_force_away_are_listed() {
        assert!(force_loss_reasons(Flags::NONE, 0).is_empty());
        // These appear elsewhere: they take no force.
        assert!(force_loss_reasons(Flags::BUZZ | Flags::MARGIN | Flags::PASSIVITY, 0).is_empty());
        let all = force_loss_reasons(Flags::NO_CONTACT | Flags::SOFT_START | Flags::FORCE_MAX, 1);
        assert_eq!(all.len(), 4);
        for words in ["no contact", "after the start", "at its limit", "missed 1 tick"] {
            assert!(all.iter().any(|one| one.contains(words)), "{words}: {all:?}");
        }
    }

    #[test]
    fn a_margin_in_words_says_which_side_of_enough_it_is_on() {
        let margin = |needed, has| Margin {
            depth: Depth(10.0),
            needed,
            has,
            cause: MarginCause::Tick,
            friction_needed: Newtons(0.0),
            friction: Newtons(0.0),
        };
        assert!(margin_text(&margin(-0.1, 0.0)).contains("needs no damping"));
        assert!(margin_text(&margin(0.002, 0.008)).contains("4.0 times"));
        assert!(margin_text(&margin(0.002, 0.001)).contains("0.50 times"));
    }
}
