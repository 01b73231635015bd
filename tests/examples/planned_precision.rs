//! How often runs of a planned protocol reach the planned interval: `planned_precision RUNS [PERCENT OF TAU]`
#![expect(clippy::print_stdout, reason = "a program that prints")]
use palpate_analysis::plan::{PlanRequest, PlanningRig, plan};
use palpate_drivers::Rig;
use palpate_drivers::sim::SimRig;
use palpate_model::Seconds;
use palpate_model::rig::Limits;
use palpate_protocols::plans::RampHold;
use palpate_rheology::expected::{FreeOffsets, PrecisionTarget, ProtocolFamily};
use palpate_tests::interval_coverage::{CoverageCase, draws, plan_assumptions};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: u64 = arguments.next().map_or(60, |text| text.parse().expect("a number of runs"));
    let percent: f64 = arguments.next().map_or(0.5, |text| text.parse().expect("a percentage"));
    let case = CoverageCase::named("lab");
    let rig = SimRig::new(case.settings);
    let curve = rig.calibration().curve().expect("a curve");
    let (description, limits) =
        (rig.description().clone(), Limits::for_travel(rig.description().travel));
    let request = |percent| PlanRequest {
        targets: vec![PrecisionTarget::new("tau", percent).expect("a target")],
        unknowns: FreeOffsets::default(),
        white: None,
        memory: None,
        sample_rate_hz: 1000.0,
        depth: RampHold::default().depth,
        force_max: None,
        speed_max: None,
        duration_max: Seconds(3600.0),
        command: &|press| format!("{} {}", press.speed, press.hold),
    };
    let bench = PlanningRig { rig: &description, limits: &limits, curve: &curve };
    let assumed = plan_assumptions(&case);
    let ramp_hold = |percent: f64| {
        let report = plan(request(percent), assumed.clone(), bench).expect("a plan");
        let offer = report.proposals.into_iter().next().expect("a proposal").proposal;
        let ProtocolFamily::RampHold { speed, hold } = offer.family else { panic!("{offer:?}") };
        (speed, hold, offer.expected)
    };
    let (speed, hold, expected) = ramp_hold(percent);
    let stated = expected.parameters[0].percent.expect("an interval");
    println!(
        "planned for tau within {percent} %: {speed}, hold {hold}, {:.2} s in tissue; expected {stated:.3} %",
        expected.duration.0
    );
    let case = CoverageCase { press: Some((speed, hold)), ..case };
    let found = draws(case, 1..runs + 1, 2);
    let errors: Vec<f64> = found.iter().map(|one| 100.0 * one.signal[0].error).collect();
    let reached = errors.iter().filter(|error| error.abs() <= percent).count();
    let spread = (errors.iter().map(|error| error.powi(2)).sum::<f64>() / runs as f64).sqrt();
    println!(
        "{reached} of {runs} runs ({:.1} %) are within {percent} %; 1.96 root mean squares of the error are {:.3} %",
        100.0 * reached as f64 / runs as f64,
        1.96 * spread
    );
    // The plan that would have been enough, had it known how runs scatter.
    let (_, _, enough) = ramp_hold(percent * stated / (1.96 * spread));
    println!("{:.3} times as long as needed", expected.duration.0 / enough.duration.0);
}
