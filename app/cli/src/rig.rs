//! The rig and its pace, shared by all commands that need one.

use super::calibration::source::CalibrationSource;
use super::truth::write_at_end;
use super::{Failure, new_file};
use clap::{Args, Parser};
use palpate_analysis::population::{is_member, library_member};
use palpate_drivers::Rig;
use palpate_drivers::sim::{
    SimBath, SimCell, SimClock, SimCompliance, SimInput, SimNoise, SimPreconditioning, SimProfile,
    SimRate, SimRig, SimSettings, SimSoftening, SimStiffness, SimThickness,
};
use palpate_drivers::wire::DeviceAddress;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_model::units::{Newtons, Position, Volts};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::{TimeScale, driver_clock};
use palpate_sessions::folder::{HolderLock, library_folder};
use std::path::PathBuf;

/// The bench of a simulated rig or behind an emulated device.
#[derive(Clone, Debug, Args)]
pub struct BenchArgs {
    /// Simulated rig: lab (real cell, converter, drift) or ideal (linear cell, white noise)
    #[arg(long, default_value = "lab")]
    pub profile: SimProfile,
    /// Simulated rig: its load cell, document (exactly as its calibration says) or own (drawn by the seed, with hysteresis
    /// and weights that are not exact)
    #[arg(long, default_value = "document", value_name = "CELL")]
    pub load_cell: SimCell,
    /// Simulated rig: seed of its random numbers; the same seed gives the same run
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Simulated rig: repeat of the run on the same specimen, with noise and drift of its own; 0 for the first run
    #[arg(long, default_value_t = 0, value_name = "NUMBER")]
    pub repeat: u64,
    /// Simulated rig: largest loss of elastic force after deeper loading, in percent
    #[arg(long, default_value = "0", value_name = "PERCENT")]
    pub softening: SimSoftening,
    /// Simulated rig: white noise of the ideal load cell, rms, in mN
    #[arg(long, default_value = "20", value_name = "MN")]
    pub noise: SimNoise,
    /// Simulated rig: stiffness of the tissue, in percent of the default
    #[arg(long, default_value = "100", value_name = "PERCENT")]
    pub stiffness: SimStiffness,
    /// Simulated rig: thickness of the specimen on its stiff base, in mm
    #[arg(long, default_value = "100", value_name = "MM")]
    pub thickness: SimThickness,
    /// Simulated rig: machine compliance, in um/N
    #[arg(long, default_value = "0", value_name = "UM_PER_N")]
    pub compliance: SimCompliance,
    /// Simulated rig: shift of the tissue's surface by repeated loading, in percent of the greatest depth
    #[arg(long, default_value = "0", value_name = "PERCENT")]
    pub preconditioning: SimPreconditioning,
    /// Simulated rig: temperature of its bath, heated from 21 °C, in °C; 0 for none
    #[arg(long, default_value = "0", value_name = "CELSIUS")]
    pub bath: SimBath,
    /// Simulated rig: time at which its digital input 1 goes high, in s; 0 for never
    #[arg(long, default_value = "0", value_name = "SECONDS")]
    pub input: SimInput,
    /// Tissue of a specimen of a population.
    #[arg(skip)]
    pub body: Option<ModifiedKelvin>,
}

impl BenchArgs {
    /// The settings, with the usual clock.
    pub fn settings(&self) -> SimSettings {
        SimSettings {
            profile: self.profile,
            cell: self.load_cell,
            seed: self.seed,
            repeat: self.repeat,
            softening: self.softening,
            noise: self.noise,
            stiffness: self.stiffness,
            thickness: self.thickness,
            compliance: self.compliance,
            preconditioning: self.preconditioning,
            bath: self.bath,
            input: self.input,
            body: self.body,
            ..SimSettings::default()
        }
    }
}

#[derive(Clone, Debug, Args)]
pub struct RigArgs {
    /// Rig: sim, sim:NAME for a simulated rig that only one program may hold, or a rig file, NAME.toml
    #[arg(long, default_value = "sim")]
    pub rig: String,
    #[command(flatten)]
    pub bench: BenchArgs,
    /// Simulated rig: controller clock, nominal (1000 us) or galil (976 us)
    #[arg(long, default_value = "nominal")]
    pub clock: SimClock,
    /// Simulated rig: samples a second, 1000 to 20000
    #[arg(long, default_value = "1000", value_name = "PER_SECOND")]
    pub rate: SimRate,
    /// Furthest position from home, in mm; set it a little before the base, so that no search meets it
    #[arg(long, value_name = "MM")]
    pub travel_max: Option<f64>,
    /// Read forces with this calibration: a name or id of the library, or a file; without it the one in force for the rig,
    /// or the rig's own
    #[arg(long, value_name = "NAME|FILE")]
    pub calibration: Option<String>,
    /// Simulated rig: write the true parameters, contact position and load-cell curve to this new file at the end
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Session seconds per second, or max
    #[arg(long, default_value = "1")]
    pub time_scale: TimeScale,
}

impl Default for RigArgs {
    /// The values of a command line without arguments.
    fn default() -> Self {
        #[derive(Parser)]
        struct Defaults {
            #[command(flatten)]
            rig: RigArgs,
        }
        Defaults::parse_from(["palpate"]).rig
    }
}

impl RigArgs {
    /// The same with the tissue of a specimen, if that is one of a population.
    pub(super) fn with_specimen(&self, specimen: &str) -> Result<Self, Failure> {
        let mut args = self.clone();
        if !is_member(specimen) {
            return Ok(args);
        }
        if palpate_drivers::is_rig_file(&self.rig) {
            return Err(Failure::usage(format!(
                "a specimen of a population is simulated, but rig {} is not; give the name of the specimen on it",
                self.rig
            )));
        }
        if self.bench.stiffness != SimStiffness::default() {
            return Err(Failure::usage(
                "--stiffness does not apply to a specimen of a population; leave it out",
            ));
        }
        args.bench.body = Some(library_member(specimen).map_err(Failure::usage)?.body);
        Ok(args)
    }

    /// The settings of the simulated rig.
    pub fn settings(&self) -> SimSettings {
        SimSettings { clock: self.clock, rate: self.rate, ..self.bench.settings() }
    }
}

/// An open rig with the calibration of its load cell.
pub struct OpenRig {
    pub rig: Box<dyn Rig>,
    /// Volts to newtons of its load cell.
    pub calibration: Calibration,
    /// The calibration of a simulated rig, whichever is used.
    pub built_in: Option<Calibration>,
    /// Reasons to doubt that calibration, one sentence each.
    pub doubts: Vec<String>,
    /// A sentence with the calibration of the library that is used, where the command line names none.
    pub from_library: Option<String>,
    /// Interlock thresholds.
    pub limits: Limits,
    /// Lock a named rig against other programs.
    pub locks: Vec<HolderLock>,
}

/// Opens the rig; another program that holds it is named in the error.
pub fn open(args: &RigArgs) -> Result<OpenRig, Failure> {
    let settings = args.settings();
    if palpate_drivers::is_rig_file(&args.rig) {
        return open_wired(args);
    }
    let mut rig = palpate_drivers::open(&args.rig, &settings).map_err(Failure::usage)?;
    if let Some(to) = &args.truth {
        new_file::check("truth of the rig", Some(to))?;
        let file = std::fs::File::create_new(to).map_err(|err| {
            Failure::failed(format!(
                "cannot create {} ({err}); choose a folder that you may write to",
                to.display()
            ))
        })?;
        rig = Box::new(write_at_end(SimRig::named(&args.rig, settings), file));
    }
    // A plain `sim` lives and dies with its program; a named one is shared like a real rig.
    let locks = match args.rig.split_once(':') {
        Some((_, name)) => vec![rig_lock(name)?],
        None => Vec::new(),
    };
    let limits = Limits::for_travel(travel(args, rig.description().travel)?);
    // The cell of the ideal rig is straight: a curve that the library has is not of it.
    let (source, unreadable) = match (&args.calibration, settings.profile) {
        (None, SimProfile::Ideal) => (None, Vec::new()),
        (name, _) => CalibrationSource::wanted(name.as_deref(), &rig.description().name)?,
    };
    let from_library = remark(args, source.as_ref());
    let built_in = palpate_drivers::sim::calibration(settings.profile);
    let (calibration, mut doubts) = match source {
        None => (built_in.clone(), Vec::new()),
        Some(source) => {
            let doubts = source.doubts(&rig.description().name);
            (source.calibration, doubts)
        }
    };
    doubts.extend(unreadable);
    let built_in = Some(built_in);
    Ok(OpenRig { rig, calibration, built_in, doubts, from_library, limits, locks })
}

fn remark(args: &RigArgs, source: Option<&CalibrationSource>) -> Option<String> {
    let source = source.filter(|_| args.calibration.is_none())?;
    Some(format!(
        "forces are read with '{}' ({}), the calibration in force for this rig; --calibration takes another",
        source.calibration.name,
        source.id.as_deref().unwrap_or_default()
    ))
}

/// Opens the rig that a file describes.
fn open_wired(args: &RigArgs) -> Result<OpenRig, Failure> {
    if args.truth.is_some() {
        return Err(Failure::usage("--truth applies only to simulated rigs; leave out --truth"));
    }
    if args.time_scale != TimeScale::Factor(1.0) {
        return Err(Failure::usage(
            "--time-scale applies only to simulated rigs; leave out --time-scale",
        ));
    }
    // A wrong name is refused before anything is opened.
    if let Some(name) = &args.calibration {
        CalibrationSource::find(name)?;
    }
    let (rig, locks) = open_rig_file(&args.rig)?;
    // A load cell that is calibrated itself needs no other calibration, but may have one.
    let (source, unreadable) = match (&args.calibration, rig.newtons_per_volt()) {
        (None, Some(_)) => (None, Vec::new()),
        (name, _) => CalibrationSource::wanted(name.as_deref(), &rig.description().name)?,
    };
    let mut bench = calibrated(args, rig, locks, source).map_err(|failure| match failure {
        // One that cannot be read may be the one that is missing.
        Failure::Usage(reason) if !unreadable.is_empty() => {
            Failure::Usage(format!("{reason} ({})", unreadable.join("; ")))
        }
        other => other,
    })?;
    bench.doubts.extend(unreadable);
    Ok(bench)
}

/// Opens a rig by the name that was chosen in a window.
pub(super) fn open_in_window(name: &str) -> Result<OpenRig, Failure> {
    open(&RigArgs { rig: name.to_owned(), ..RigArgs::default() })
}

/// Gives an open rig the calibration of this source, or that of its own load cell.
fn calibrated(
    args: &RigArgs,
    rig: Box<dyn Rig>,
    locks: Vec<HolderLock>,
    source: Option<CalibrationSource>,
) -> Result<OpenRig, Failure> {
    let description = rig.description();
    let mut limits = Limits::for_travel(travel(args, description.travel)?);
    let from_library = remark(args, source.as_ref());
    let full_scale = description.adc.map(|adc| f64::from(adc.counts_max) * adc.volts_per_count);
    let (calibration, doubts) = match (source, rig.newtons_per_volt(), full_scale) {
        (Some(source), ..) => {
            let doubts = source.doubts(&description.name);
            (source.calibration, doubts)
        }
        (None, Some(newtons), Some(full_scale)) => {
            // Its own calibration holds over its own range, and the end of that stands for all that is beyond.
            let step = description.adc.map_or(0.0, |adc| adc.volts_per_count);
            limits.volts_max = Volts(full_scale - step);
            let own = Calibration::linear(
                &description.name,
                Volts(0.0),
                1.0 / newtons,
                Newtons(full_scale * newtons),
            );
            (own, Vec::new())
        }
        (None, ..) => {
            let name = &args.rig;
            return Err(Failure::Usage(format!(
                "the library has no calibration of rig {name}; give --calibration NAME or FILE, or start 'palpate window --rig {name} --calibration thesis' and measure one with weights"
            )));
        }
    };
    Ok(OpenRig { rig, calibration, built_in: None, doubts, from_library, limits, locks })
}

/// Opens the rig of a file and locks it against other programs.
pub(super) fn open_rig_file(file_name: &str) -> Result<(Box<dyn Rig>, Vec<HolderLock>), Failure> {
    let file = palpate_drivers::read_rig_file(file_name).map_err(Failure::usage)?;
    let locks = lock_places(file.places())?;
    let rig = palpate_drivers::open_wired(file_name, &driver_clock())
        .map_err(|err| Failure::Failed(err.to_string()))?;
    Ok((rig, locks))
}

/// Locks devices against other programs. Two programs may be connected to one controller on a network; only one may drive
/// it.
pub(super) fn lock_places(places: &[DeviceAddress]) -> Result<Vec<HolderLock>, Failure> {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let names = places.iter().map(|place| place.to_string().chars().map(plain).collect::<String>());
    names.map(|name| rig_lock(&name)).collect()
}

/// The end of the travel: the rig's, or one before it.
fn travel(args: &RigArgs, rigs: Position) -> Result<Position, Failure> {
    match args.travel_max {
        None => Ok(rigs),
        Some(end) if end > 0.0 && end <= rigs.0 => Ok(Position(end)),
        Some(end) => Err(Failure::usage(format!(
            "--travel-max {end} is outside the rig's travel; give a number above 0 and up to {} mm",
            rigs.0
        ))),
    }
}

fn rig_lock(name: &str) -> Result<HolderLock, Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    HolderLock::acquire(&library.join("rigs").join(format!("{name}.lock")))
        .map_err(|err| Failure::usage(format!("rig {name}: {err}")))
}
