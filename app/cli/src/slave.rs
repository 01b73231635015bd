//! `palpate haptics slave`: a simulated master leads the slave of a rig, through the runner like any run.

use super::arguments::{above_zero, parse_number};
use super::haptics::body;
use super::output::Output;
use super::protocol::ValueArgs;
use super::rig::OpenRig;
use super::run::{RunCompanions, RunLeader, SessionArgs, labels, read, run_plan};
use super::{Failure, recover, rig};
use clap::Args;
use palpate_analysis::haptics::HapticSettings;
use palpate_analysis::report::haptics::slave_text;
use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_model::metadata::SessionLabels;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::{Follow, Plan};
use palpate_runner::haptics::slave::{SlaveLeader, SlaveSettings};
use palpate_sessions::library_folder;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Longest time that a slave follows, in s: an hour.
const SECONDS_MAX: f64 = 3600.0;

/// Arguments of `palpate haptics slave`.
#[derive(Debug, Args)]
pub struct SlaveArgs {
    /// A session or table to fit, 'thesis' for the model of the source thesis, or a specimen of a population,
    /// population:NAME#NUMBER
    #[arg(value_name = "SESSION|thesis|SPECIMEN")]
    source: PathBuf,
    /// Duration in s
    #[arg(long, default_value_t = 30.0, conflicts_with = "protocol", value_parser = parse_number, allow_negative_numbers = true, value_name = "S")]
    seconds: f64,
    /// Target depth of the hand, in mm; without --protocol also the limit of the slave
    #[arg(long, default_value_t = 10.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM")]
    depth: f64,
    /// Fastest speed of the hand, which presses in and out, in mm/s; moves of the slave go at up to three times that
    #[arg(long, default_value_t = 2.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM_PER_S")]
    speed: f64,
    /// Protocol file with a step 'follow', instead of the built-in plan
    #[arg(long, value_name = "FILE")]
    protocol: Option<String>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    session: SessionArgs,
}

impl SlaveArgs {
    /// Path of the hand: from the surface to the depth and back, repeated; `speed` is reached half way.
    fn hand(&self) -> SimulatedHand {
        let half = 0.5 * self.depth;
        SimulatedHand::firm(HandPath::Sine {
            middle: half,
            amplitude: half,
            hz: self.speed / (std::f64::consts::TAU * half),
        })
    }

    fn check(&self, speed_max: MmPerS) -> Result<(), Failure> {
        above_zero("seconds", self.seconds, SECONDS_MAX, "s")?;
        above_zero("depth", self.depth, HapticSettings::DEPTH_MAX, "mm")?;
        above_zero("speed", self.speed, speed_max.0, "mm/s")?;
        Ok(())
    }
}

/// The plan to run, the rig for it, and the labels of its session.
fn prepare(args: &SlaveArgs, output: &Output) -> Result<(Plan, OpenRig, SessionLabels), Failure> {
    let values = args.values.values();
    if let Some(name) = &args.protocol {
        let (plan, bench, labels) = read(name, &values, &args.session, output)?;
        if !plan.needs_lead() {
            return Err(Failure::usage(format!(
                "the protocol {name} has no step 'follow'; add one, or run the protocol with 'palpate run'"
            )));
        }
        args.check(bench.rig.description().speed_max)?;
        return Ok((plan, bench, labels));
    }
    if !values.is_empty() {
        return Err(Failure::usage("--set sets a parameter of a protocol; add --protocol FILE"));
    }
    if let Ok(library) = library_folder() {
        recover::recover_unfinished(&library, output);
    }
    let bench = rig::open(&args.session.rig.with_specimen(&args.session.specimen)?)?;
    let description = bench.rig.description();
    args.check(description.speed_max)?;
    let (hand, duration) = (MmPerS(args.speed), Seconds(args.seconds));
    let plan = Follow::of_hand(description, hand, Depth(args.depth), duration).plan();
    Ok((plan, bench, labels(&args.session)?))
}

pub(super) fn run(args: &SlaveArgs, output: &Output) -> Result<(), Failure> {
    let (plan, bench, labels) = prepare(args, output)?;
    let depths = plan.follow_depths().map(|depth| depth.0);
    let depth_max = Depth(depths.fold(0.0, f64::max));
    let body = body(&args.source, Depth(args.depth), output)?;
    let mut master = HapticSettings::source(Period::MILLISECOND).simulation(body, true);
    master.plant.hand = args.hand();
    let leader = SlaveLeader::new(SlaveSettings {
        master,
        body,
        depth_max,
        is_virtual: bench.rig.is_virtual(),
        rig: bench.rig.description().clone(),
    });
    let slave = Arc::new(Mutex::new(leader.map_err(Failure::usage)?));
    let leading = Arc::clone(&slave);
    let run_leader = RunLeader {
        command: "haptics-slave",
        leader: slave,
        report: Box::new(move |output| {
            let leader = leading.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(reason) = leader.failure() {
                output.note(&format!("the master did not lead the slave: {reason}"));
            }
            let slaved = leader.report()?;
            Some((serde_json::to_value(&slaved).ok()?, slave_text(&slaved)))
        }),
    };
    let companions = RunCompanions { leader: Some(run_leader), ..RunCompanions::default() };
    run_plan(plan, bench, &args.session, labels, companions, output)
}
