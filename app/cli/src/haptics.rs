//! `palpate haptics`: a fitted model on a master-slave device.

use super::Failure;
use super::arguments::{above_zero, parse_number};
use super::new_file;
use super::output::Output;
use super::scene::{RecordingReplayArgs, report_replay};
use super::slave::{self, SlaveArgs};
use clap::{Args, Subcommand, ValueEnum};
use palpate_analysis::feedback_session::store_feedback_check;
use palpate_analysis::haptics::{HapticSettings, check, check_feedback, fit_haptic_body, pace};
use palpate_analysis::haptics_tape::{recorder, replay};
use palpate_analysis::progress::Progress;
use palpate_analysis::report::haptics::{
    bench_text, check_text, follow_plot, follow_table, follow_text, run_text,
};
use palpate_haptics::check::FeedbackCheckSettings;
use palpate_haptics::{DriveKind, Period};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::path::{Path, PathBuf};

/// Feel a fitted model through a master-slave device: check it, run it, time its loop
#[derive(Debug, Subcommand)]
pub enum HapticsCommand {
    /// Report where a model can return energy, which damping it needs and what the guard does
    Check(HapticsCheckArgs),
    /// Run the loop in real time on the simulated device and report its timing
    Run(HapticsRunArgs),
    /// Compute every tick of a recorded run again and compare bit for bit
    Replay(RecordingReplayArgs),
    /// Push the master's rack with a simulated slider and compare the force commanded with the force measured
    Follow(HapticsFollowArgs),
    /// Lead the slave of a rig with a simulated master, and compare the force at its handle with the force on the slave's load cell
    Slave(Box<SlaveArgs>),
    /// Time the loop on this computer at several rates, idle and with busy threads
    Bench(HapticsBenchArgs),
}

/// The motor's drive.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum DriveArg {
    /// By voltage, as the source thesis did; the motor's back-EMF damps
    Voltage,
    /// By current; the motor damps nothing
    Current,
}

/// The device, the loop and the hand.
#[derive(Debug, Args)]
struct DeviceArgs {
    /// Loop rate in Hz, 250 to 10000
    #[arg(long, default_value_t = 1000.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "HZ")]
    rate: f64,
    /// How the motor is driven
    #[arg(long, value_enum, default_value = "voltage")]
    drive: DriveArg,
    /// Damping of the device without its motor, in N s/m
    #[arg(long, default_value_t = 0.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "NS_PER_M")]
    damping: f64,
    /// Coulomb friction of the device in N; without it that of the motor in the source thesis
    #[arg(long, value_parser = parse_number, allow_negative_numbers = true, value_name = "N")]
    friction: Option<f64>,
    /// Delay from an encoder count to its force, in ticks
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=i64::from(HapticSettings::DELAY_MAX)), value_name = "TICKS")]
    delay: u8,
    /// End of the stroke in mm
    #[arg(long, default_value_t = 30.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM")]
    depth: f64,
    /// Speed of the hand in mm/s
    #[arg(long, default_value_t = 50.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM_PER_S")]
    speed: f64,
}

impl DeviceArgs {
    fn setting(&self) -> Result<HapticSettings, Failure> {
        let not_negative = |name: &str, value: f64| {
            (value >= 0.0).then_some(value).ok_or_else(|| {
                Failure::usage(format!("--{name} {value} is out of range; give 0 or more"))
            })
        };
        let friction = self.friction.map(|friction| not_negative("friction", friction));
        let period = Period::of_rate(self.rate).map_err(Failure::usage)?;
        let usual = HapticSettings::source(period);
        Ok(HapticSettings {
            period,
            drive: match self.drive {
                DriveArg::Voltage => usual.drive,
                DriveArg::Current => DriveKind::Current { amps_per_volt: 1.0 },
            },
            // N s/m as catalogues have it, N s/mm inside.
            damping: 1e-3 * not_negative("damping", self.damping)?,
            friction: friction.transpose()?.map(Newtons),
            delay: usize::from(self.delay),
            deepest: Depth(above_zero("depth", self.depth, HapticSettings::DEPTH_MAX, "mm")?),
            speed: MmPerS(above_zero("speed", self.speed, HapticSettings::SPEED_MAX, "mm/s")?),
        })
    }
}

/// Arguments of `palpate haptics check`.
#[derive(Debug, Args)]
pub struct HapticsCheckArgs {
    /// A session or table to fit, 'thesis' for the model of the source thesis, or a specimen of a population,
    /// population:NAME#NUMBER
    #[arg(value_name = "SESSION|thesis|SPECIMEN")]
    source: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Arguments of `palpate haptics run`.
#[derive(Debug, Args)]
pub struct HapticsRunArgs {
    /// A session or table to fit, 'thesis' for the model of the source thesis, or a specimen of a population,
    /// population:NAME#NUMBER
    #[arg(value_name = "SESSION|thesis|SPECIMEN")]
    source: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
    /// Duration in s
    #[arg(long, default_value_t = 10.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "S")]
    seconds: f64,
    /// Record every tick in this new folder, which 'palpate haptics replay' computes again
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// Arguments of `palpate haptics follow`.
#[derive(Debug, Args)]
pub struct HapticsFollowArgs {
    /// A session or table to fit, 'thesis' for the model of the source thesis, or a specimen of a population,
    /// population:NAME#NUMBER
    #[arg(value_name = "SESSION|thesis|SPECIMEN")]
    source: PathBuf,
    /// Speed of the slider in mm/s
    #[arg(long, default_value_t = 0.75, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM_PER_S")]
    speed: f64,
    /// Travel in mm
    #[arg(long, default_value_t = 30.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "MM")]
    depth: f64,
    /// Hold in s
    #[arg(long, default_value_t = 50.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "S")]
    hold: f64,
    /// Share of the motor's friction that the drive compensates, in percent
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=100), value_name = "PERCENT")]
    help_friction: u8,
    /// Draw both forces and the torque as a new SVG file
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write the samples as a new table, which 'palpate fit' and 'palpate import' read
    #[arg(long, value_name = "FILE.csv")]
    table: Option<PathBuf>,
    /// Make a session of the samples in a new folder, as 'palpate import' would of the table
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// Arguments of `palpate haptics bench`.
#[derive(Debug, Args)]
pub struct HapticsBenchArgs {
    /// Seconds for each rate and load
    #[arg(long, default_value_t = 10.0, value_parser = parse_number, allow_negative_numbers = true, value_name = "S")]
    seconds: f64,
    /// Rates in Hz
    #[arg(long, value_delimiter = ',', default_values_t = [500.0, 1000.0, 2000.0, 5000.0], value_parser = parse_number, allow_negative_numbers = true, value_name = "HZ,...")]
    rates: Vec<f64>,
    /// Busy threads in the second half of the table
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=64), value_name = "THREADS")]
    busy: u8,
}

/// A day, in s.
const SECONDS_MAX: f64 = 86_400.0;

pub(super) fn run(command: &HapticsCommand, output: &Output) -> Result<(), Failure> {
    match command {
        HapticsCommand::Check(args) => run_check(args, output),
        HapticsCommand::Run(args) => run_loop(args, output),
        HapticsCommand::Replay(args) => report_replay("haptics-replay", args, replay, output),
        HapticsCommand::Follow(args) => run_follow(args, output),
        HapticsCommand::Slave(args) => slave::run(args, output),
        HapticsCommand::Bench(args) => run_bench(args, output),
    }
}

/// The model of a source; remarks on it become notes.
pub(super) fn body(
    source: &Path,
    deepest: Depth,
    output: &Output,
) -> Result<ModifiedKelvin, Failure> {
    let found = fit_haptic_body(source).map_err(Failure::usage)?;
    let notes = found.notes.iter().cloned();
    notes.chain(found.extrapolation_warning(deepest)).for_each(|note| output.note(&note));
    Ok(found.body)
}

fn run_check(args: &HapticsCheckArgs, output: &Output) -> Result<(), Failure> {
    let setting = args.device.setting()?;
    let body = body(&args.source, setting.deepest, output)?;
    let checked = output
        .with_share_bar(|bar| check(body, &setting, &mut |share| bar.share(share, "")))
        .map_err(Failure::usage)?;
    output.answer("haptics-check", &checked, || check_text(&checked));
    Ok(())
}

fn run_follow(args: &HapticsFollowArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("picture", args.plot.as_deref())?;
    new_file::check("table", args.table.as_deref())?;
    new_file::check("session", args.out.as_deref())?;
    let body = body(&args.source, Depth(args.depth), output)?;
    let settings = FeedbackCheckSettings {
        speed: MmPerS(args.speed),
        depth: Depth(args.depth),
        hold: Seconds(args.hold),
        friction_share: f64::from(args.help_friction) / 100.0,
        ..FeedbackCheckSettings::source(body)
    };
    let followed = output
        .with_share_bar(|bar| {
            check_feedback(&settings, &mut |share| {
                bar.share(share, "");
            })
        })
        .map_err(Failure::usage)?;
    output.answer("haptics-follow", &followed, || follow_text(&followed));
    let source = args.source.display().to_string();
    new_file::write("picture", args.plot.as_deref(), || follow_plot(&source, &followed))?;
    new_file::write("table", args.table.as_deref(), || follow_table(&followed))?;
    match &args.out {
        Some(folder) => store_feedback_check(&followed, &source, folder).map_err(Failure::failed),
        None => Ok(()),
    }
}

fn run_loop(args: &HapticsRunArgs, output: &Output) -> Result<(), Failure> {
    let setting = args.device.setting()?;
    let seconds = above_zero("seconds", args.seconds, SECONDS_MAX, "s")?;
    new_file::check("recording", args.record.as_deref())?;
    let body = body(&args.source, setting.deepest, output)?;
    let recorder = args.record.as_deref().map(|to| recorder(to, body, &setting));
    let recorder = recorder.transpose().map_err(Failure::failed)?;
    let settings = setting.simulation(body, true);
    let paced = output
        .with_share_bar(|bar| {
            pace(&settings, seconds, 0, recorder, &mut |share| bar.share(share, ""))
        })
        .map_err(Failure::failed)?;
    output.answer("haptics-run", &paced, || run_text(&paced));
    Ok(())
}

fn run_bench(args: &HapticsBenchArgs, output: &Output) -> Result<(), Failure> {
    let seconds = above_zero("seconds", args.seconds, SECONDS_MAX, "s")?;
    let periods = args.rates.iter().map(|rate| Period::of_rate(*rate));
    let periods: Vec<Period> = periods.collect::<Result<_, _>>().map_err(Failure::usage)?;
    let loads = match args.busy {
        0 => vec![0],
        busy => vec![0, usize::from(busy)],
    };
    let bar = output.share_bar();
    let count = (periods.len() * loads.len()).max(1) as f64;
    let mut loops = Vec::new();
    for &busy in &loads {
        for &period in &periods {
            let setting = HapticSettings::source(period);
            let done = loops.len() as f64;
            let settings = setting.simulation(ModifiedKelvin::THESIS, true);
            let paced = pace(&settings, seconds, busy, None, &mut |share| {
                bar.share((done + share) / count, "")
            });
            loops.push(paced.map_err(Failure::failed)?);
        }
    }
    drop(bar);
    let found = serde_json::json!({ "seconds": seconds, "loops": loops });
    output.answer("haptics-bench", &found, || bench_text(&loops));
    Ok(())
}
