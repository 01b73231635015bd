//! A real haptic device for a scene: opened, judged before play, and how it did.

use palpate_drivers::wire::DeviceAddress;
use palpate_haptic_devices::inverse::DeadMan;
use palpate_haptic_devices::{
    DeviceMonitor, HapiDevice, HapiOptions, InverseDevice, InverseOptions, LinkReport, RoundTrip,
};
use palpate_haptics::HapticDevice;
use palpate_haptics::margin::{LoopDevice, MarginReport, MarginSettings};
use palpate_haptics::scene::SceneSettings;
use palpate_model::units::{Depth, MmPerS};
use palpate_rheology::integrators::SeriesBody;
use palpate_runner::driver_clock;
use serde::Serialize;
use std::net::SocketAddr;

/// The stroke that is judged before play: as deep and as fast as a finger presses.
const STROKE: (Depth, MmPerS) = (Depth(10.0), MmPerS(50.0));

/// Which device.
#[derive(Clone, Debug)]
pub enum DeviceChoice {
    /// An Inverse3 of Haply's Inverse service.
    Inverse {
        /// Where its service listens.
        address: SocketAddr,
        /// Its name in the service; the only one where there is none.
        name: Option<String>,
        dead_man: DeadMan,
    },
    /// A 2DIY on a hAPI board.
    Hapi(DeviceAddress),
}

/// A device that a scene can use.
#[derive(Debug)]
pub struct OpenDevice {
    pub device: Box<dyn HapticDevice>,
    /// A look at it while the scene's loop has it.
    pub monitor: DeviceMonitor,
}

/// A device before play.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceReport {
    /// What it is, and with what.
    pub description: String,
    /// What a person has to know before the first touch.
    pub warnings: Vec<&'static str>,
    /// Round trips of messages with zero force.
    pub round_trip_median_ms: f64,
    pub round_trip_p99_ms: f64,
    /// Delay of the whole loop in ticks.
    pub delay_ticks: f64,
    /// The stability margin with the device's own delay, damping and steps.
    pub margin: MarginReport,
    /// The margin in words, the most important first.
    pub sentences: Vec<String>,
}

/// How the connection was.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeviceUse {
    pub reports: u64,
    /// Reports that could not be.
    pub faults: u64,
    /// Times that the connection was lost.
    pub losses: u64,
    /// Why there was no force at the end.
    pub stop: &'static str,
}

impl DeviceUse {
    pub(crate) fn of(report: LinkReport) -> Self {
        let LinkReport { reports, faults, losses, stop, .. } = report;
        Self { reports, faults, losses, stop: stop.name() }
    }
}

/// What a 2DIY does not have, and what its board does not do.
const HAPI_WARNINGS: [&str; 2] = [
    "the board takes the arm's place for the home position; if the arm was elsewhere, end the scene and start again from home",
    "the board has no button and keeps its torque if this computer stops; keep the switch of the motors' power supply within reach",
];

/// Opens a device for a scene; the report is to be read before the first touch.
pub fn open_device(
    choice: &DeviceChoice,
    scene: &SceneSettings,
) -> Result<(OpenDevice, DeviceReport), String> {
    match choice {
        DeviceChoice::Inverse { address, name, dead_man } => {
            let options = InverseOptions {
                address: *address,
                device: name.clone(),
                dead_man: *dead_man,
                ..InverseOptions::new(scene.middle(), scene.period)
            };
            open_inverse(&options, scene)
        }
        DeviceChoice::Hapi(address) => {
            let options = HapiOptions::new(address.clone(), scene.middle(), scene.period);
            open_hapi(&options, scene)
        }
    }
}

fn open_inverse(
    options: &InverseOptions,
    scene: &SceneSettings,
) -> Result<(OpenDevice, DeviceReport), String> {
    let device = InverseDevice::open(options, driver_clock()).map_err(|err| err.to_string())?;
    let found = device.found();
    let grip = found.grip.as_ref().map_or("no grip".to_owned(), |grip| format!("grip {grip}"));
    let description = format!("device {}, {grip}, service {}", found.name, found.version);
    let report = judge(description, &device.round_trip(), device.loop_device(), scene);
    let monitor = device.monitor();
    Ok((OpenDevice { device: Box::new(device), monitor }, report))
}

fn open_hapi(
    options: &HapiOptions,
    scene: &SceneSettings,
) -> Result<(OpenDevice, DeviceReport), String> {
    let device = HapiDevice::open(options, driver_clock()).map_err(|err| err.to_string())?;
    let description = format!("2DIY at {}", device.port());
    let report = judge(description, &device.round_trip(), device.loop_device(), scene);
    let report = DeviceReport { warnings: HAPI_WARNINGS.to_vec(), ..report };
    let monitor = device.monitor();
    Ok((OpenDevice { device: Box::new(device), monitor }, report))
}

/// The margin of a scene on a device.
fn judge(
    description: String,
    trip: &RoundTrip,
    looped: LoopDevice,
    scene: &SceneSettings,
) -> DeviceReport {
    let margin = MarginSettings {
        body: SeriesBody::from(scene.body).padded(),
        scheme: scene.scheme,
        period: scene.period,
        device: looped,
    };
    let (deepest, speed) = STROKE;
    let margin = margin.assess_stroke(deepest, speed);
    DeviceReport {
        description,
        warnings: Vec::new(),
        round_trip_median_ms: 1e3 * trip.median.seconds().0,
        round_trip_p99_ms: 1e3 * trip.p99.seconds().0,
        delay_ticks: looped.delay_ticks,
        sentences: margin.sentences(),
        margin,
    }
}
