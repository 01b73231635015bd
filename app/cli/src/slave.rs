//! `palpate haptics slave`: a simulated master leads the slave of a rig, through the runner like any run.

use super::haptics::body;
use super::output::Output;
use super::run::{HowArgs, Led, carry_out, labels, number};
use super::{Failure, recover, rig};
use clap::Args;
use palpate_analysis::haptics::Setting;
use palpate_analysis::report::haptics::slave_text;
use palpate_haptics::Period;
use palpate_haptics::rig::{Hand, HandPath};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::Follow;
use palpate_runner::haptics::slave::{SlaveLeader, SlaveSettings};
use palpate_sessions::library_folder;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Longest time that a slave follows, in s: an hour.
const SECONDS_MAX: f64 = 3600.0;

/// Arguments of `palpate haptics slave`.
#[derive(Debug, Args)]
pub struct SlaveArgs {
    /// A session or a table, whose fit is felt, or 'thesis' for the body of the source thesis
    #[arg(value_name = "SESSION|thesis")]
    source: PathBuf,
    /// How long the slave follows, in s
    #[arg(long, default_value_t = 30.0, value_parser = number, allow_negative_numbers = true, value_name = "S")]
    seconds: f64,
    /// How deep the hand wants to go and the slave may, in mm
    #[arg(long, default_value_t = 10.0, value_parser = number, allow_negative_numbers = true, value_name = "MM")]
    depth: f64,
    /// Fastest speed of the hand, which presses in and out, in mm/s; moves of the slave go at up to three times that
    #[arg(long, default_value_t = 2.0, value_parser = number, allow_negative_numbers = true, value_name = "MM_PER_S")]
    speed: f64,
    #[command(flatten)]
    how: HowArgs,
}

impl SlaveArgs {
    /// The hand's way: from the surface to the depth and back, again and again, at this speed half way.
    fn hand(&self) -> Hand {
        let half = 0.5 * self.depth;
        Hand::firm(HandPath::Sine {
            middle: half,
            amplitude: half,
            hz: self.speed / (std::f64::consts::TAU * half),
        })
    }

    /// Refuses what no hand and no rig can do.
    fn check(&self, speed_max: MmPerS) -> Result<(), Failure> {
        let wanted = [
            ("seconds", self.seconds, SECONDS_MAX, "s"),
            ("depth", self.depth, Setting::DEPTH_MAX, "mm"),
            ("speed", self.speed, speed_max.0, "mm/s"),
        ];
        let bad = wanted.into_iter().find(|(_, value, most, _)| !(*value > 0.0 && value <= most));
        bad.map_or(Ok(()), |(name, value, most, unit)| {
            Err(Failure::usage(format!(
                "--{name} {value} is not possible; give a number above 0 and up to {most} {unit}"
            )))
        })
    }
}

pub(super) fn run(args: &SlaveArgs, output: &Output) -> Result<(), Failure> {
    if let Ok(library) = library_folder() {
        recover::recover_unfinished(&library, output);
    }
    let bench = rig::open(&args.how.rig)?;
    let description = bench.rig.description().clone();
    args.check(description.speed_max)?;
    let depth_max = Depth(args.depth);
    let body = body(&args.source, depth_max, output)?;
    let mut master = Setting::source(Period::MILLISECOND).simulation(body, true);
    master.plant.hand = args.hand();
    let (hand, duration) = (MmPerS(args.speed), Seconds(args.seconds));
    let follow = Follow::of_hand(&description, hand, depth_max, duration);
    let leader = SlaveLeader::new(SlaveSettings {
        master,
        body,
        depth_max,
        is_virtual: bench.rig.is_virtual(),
        rig: description,
    });
    let slave = Arc::new(Mutex::new(leader.map_err(Failure::usage)?));
    let labels = labels(&args.how)?;
    let leading = Arc::clone(&slave);
    let led = Led {
        command: "haptics-slave",
        leader: slave,
        report: Box::new(move |output| {
            let leader = leading.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(reason) = leader.failure() {
                output.note(&format!("nothing led the slave: {reason}"));
            }
            let slaved = leader.slaved()?;
            Some((serde_json::to_value(&slaved).ok()?, slave_text(&slaved)))
        }),
    };
    carry_out(follow.plan(), bench, &args.how, labels, Some(led), output)
}
