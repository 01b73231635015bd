//! The plan as text.

use palpate_analysis::plan::{PlanOffer, PlanReport};
use palpate_figures::uncertain::{shortest as plain, significant as digits};
use palpate_protocols::plans::RampHold;
use palpate_rheology::expected::{
    PARAMETER_NAMES, PARAMETER_UNITS, PrecisionCurve, ProtocolFamily,
};

/// Of ten points a decade, 1, 2 and 5.
const SHOWN: [usize; 3] = [0, 3, 7];
/// Numbers of cycles the table shows.
const CYCLES_SHOWN: [usize; 6] = [1, 2, 3, 5, 8, 12];

pub(super) fn text(report: &PlanReport) -> String {
    let mut lines = assumptions(report);
    lines.push(String::new());
    lines.extend(proposals(report));
    lines.push(String::new());
    lines.extend(tables(report));
    lines.join("\n")
}

fn assumptions(report: &PlanReport) -> Vec<String> {
    let body = &report.body;
    let [mu1, mu2, mu3] = body.mu;
    let values = [body.tau_eps, mu1, mu2, mu3, body.tau_sig];
    let body: Vec<String> = (0..values.len())
        .map(|k| {
            let value: f64 = format!("{:.3e}", values[k]).parse().unwrap_or(values[k]);
            format!("{} {} {}", PARAMETER_NAMES[k], plain(value), PARAMETER_UNITS[k])
        })
        .collect();
    let noise = &report.noise;
    let rate = plain(report.rig.sample_rate_hz);
    let slow = noise.memory.map_or(String::new(), |memory| {
        format!(", and {} mN that lasts {} s", plain(memory.sd.0 * 1e3), plain(memory.time.0))
    });
    let wanted: Vec<String> = report
        .targets
        .iter()
        .map(|target| format!("{} within {} %", target.parameter, plain(target.percent)))
        .collect();
    let noise = match &report.signal {
        Some(signal) => format!(
            "signal  noise {} mV in every sample, drift {} µV in one second, contact position ± {} µm; {rate} samples per second",
            digits(signal.noise_v * 1e3, 3),
            digits(signal.walk_v * 1e6, 3),
            digits(signal.contact_error_mm * 1e3, 3)
        ),
        None => format!(
            "noise   {} mN in every sample{slow}; {rate} samples per second",
            digits(noise.white.0 * 1e3, 3)
        ),
    };
    vec![
        format!("model   {}", report.body_source),
        format!("        {}", body.join(", ")),
        noise,
        format!(
            "limits  depth {} mm, force {} N, speed {} mm/s",
            plain(report.rig.depth.0),
            digits(report.rig.force_max.0, 3),
            plain(report.rig.speed_max.0)
        ),
        format!("target  {} (95 % interval)", wanted.join(", ")),
    ]
}

fn proposals(report: &PlanReport) -> Vec<String> {
    let titles: Vec<String> =
        report.proposals.iter().map(|offer| title(&offer.proposal.family)).collect();
    let width = titles.iter().map(String::len).max().unwrap_or(0);
    let names: String = PARAMETER_NAMES.iter().map(|name| format!("{name:>9}")).collect();
    let mut lines = vec![format!("   {:width$} {:>8}{names}{:>8}", "", "time", "peak")];
    for (index, (offer, title)) in report.proposals.iter().zip(&titles).enumerate() {
        let expected = &offer.proposal.expected;
        let percents: String = expected
            .parameters
            .iter()
            .map(|parameter| format!("{:>9}", percent(parameter.percent)))
            .collect();
        lines.push(format!(
            "{}  {title:width$} {:>6.1} s{percents}{:>6.2} N",
            index + 1,
            expected.duration.0,
            expected.force_max.0
        ));
    }
    for (index, offer) in report.proposals.iter().enumerate() {
        lines.push(String::new());
        lines.push(format!("{}  {}", index + 1, offer.proposal.reason));
        lines.extend(run_instructions(offer));
    }
    lines
}

/// The command of one press.
pub(super) fn command(press: &RampHold) -> String {
    format!(
        "palpate run ramp-hold --speed {} --depth {} --hold {}",
        plain(press.speed.0),
        plain(press.depth.0),
        plain(press.hold.0)
    )
}

fn run_instructions(offer: &PlanOffer) -> Vec<String> {
    let Some(secs) = offer.run_s else {
        return vec!["   palpate has no command for this protocol yet".into()];
    };
    let mut lines: Vec<String> =
        offer.commands.iter().map(|command| format!("   {command}")).collect();
    let acknowledgements = offer.acknowledgements.iter();
    lines.extend(acknowledgements.map(|reason| format!("   with --acknowledge, because {reason}")));
    lines.push(format!("   about {secs:.0} s in all, including homing and the contact search"));
    lines
}

fn title(family: &ProtocolFamily) -> String {
    match family {
        ProtocolFamily::RampHold { speed, hold } => {
            format!("ramp and hold: {} mm/s, {} s", plain(speed.0), plain(hold.0))
        }
        ProtocolFamily::TwoSpeeds { speeds, hold, .. } => format!(
            "two speeds: {} and {} mm/s, {} s each",
            plain(speeds[0].0),
            plain(speeds[1].0),
            plain(hold.0)
        ),
        ProtocolFamily::Cycles { speed, between, count } => format!(
            "{count} cycle{}: {} mm/s, {} to {} mm",
            if *count == 1 { "" } else { "s" },
            plain(speed.0),
            plain(between[0].0),
            plain(between[1].0)
        ),
    }
}

fn tables(report: &PlanReport) -> Vec<String> {
    let wanted = report.targets[0].parameter;
    let k = PARAMETER_NAMES.iter().position(|name| *name == wanted).unwrap_or(0);
    let curves = &report.curves;
    let easy = |curve: &PrecisionCurve| -> Vec<usize> {
        let all = 0..curve.x.len();
        all.filter(|i| SHOWN.contains(&(i % 10))).collect()
    };
    let counts = |_: &PrecisionCurve| CYCLES_SHOWN.map(|count| count - 1).to_vec();
    let mut lines = vec![format!("95 % interval of {wanted} in %, ramp and hold, by hold time")];
    lines.extend(table("hold s", &curves.hold, k, easy));
    let [top, bottom] = curves.between;
    lines.push(format!(
        "95 % interval of {wanted} in %, cycles from {} to {} mm, by number of cycles",
        plain(top.0),
        plain(bottom.0)
    ));
    lines.extend(table("cycles", &curves.cycles, k, counts));
    lines.push(format!(
        "95 % interval of {wanted} in %, ramp and hold of {} s, by samples per second",
        plain(curves.rate_hold.0)
    ));
    let rate = std::slice::from_ref(&curves.rate);
    lines.extend(table("per second", rate, k, easy));
    lines
}

fn table(
    head: &str,
    curves: &[PrecisionCurve],
    parameter: usize,
    shown: impl Fn(&PrecisionCurve) -> Vec<usize>,
) -> Vec<String> {
    let Some(first) = curves.first() else {
        return Vec::new();
    };
    let cells = |label: String, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>9}")).collect();
        format!("  {label:<12}{cells}")
    };
    let shown = shown(first);
    let heads = shown.iter().map(|&i| plain(first.x[i])).collect();
    let mut lines = vec![cells(head.to_owned(), heads)];
    for curve in curves {
        let values = shown.iter().map(|&i| percent(curve.percent[i][parameter])).collect();
        lines.push(cells(format!("{} mm/s", plain(curve.speed.0)), values));
    }
    lines
}

/// Three digits; above 1000 % nothing is known.
fn percent(value: Option<f64>) -> String {
    match value {
        Some(value) if value < 1000.0 => digits(value, 3),
        _ => "-".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_values_are_a_dash() {
        assert_eq!(percent(Some(0.324_98)), "0.325");
        assert_eq!((percent(None), percent(Some(2e4))), ("-".into(), "-".into()));
    }
}
