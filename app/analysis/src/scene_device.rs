//! A real haptic device for a scene: opened, judged before play, and how it did.

use palpate_drivers::wire::DeviceAddress;
use palpate_haptic_devices::{
    DeviceMonitor, ForceLimits, HapiOptions, InverseOptions, LinkReport, open_hapi, open_inverse,
};
use palpate_haptics::HapticDevice;
use palpate_haptics::margin::{LoopDevice, MarginReport, MarginSettings};
use palpate_haptics::scene::{SceneSettings, SceneStart};
use palpate_model::units::{Depth, MmPerS};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::SeriesBody;
use palpate_runner::driver_clock;
use serde::Serialize;
use std::net::SocketAddr;
use std::str::FromStr;

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
    },
    /// A 2DIY on a hAPI board.
    Hapi(DeviceAddress),
}

/// A device as a person names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceName {
    /// With its name in the service, if there is a choice.
    Inverse(Option<String>),
    /// At a port.
    Hapi(DeviceAddress),
}

impl FromStr for DeviceName {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.split_once(':') {
            None if text == "inverse" => Ok(Self::Inverse(None)),
            Some(("inverse", name)) if !name.is_empty() => Ok(Self::Inverse(Some(name.into()))),
            Some(("hapi", port)) if !port.is_empty() => Ok(Self::Hapi(board_address(port))),
            _ => Err("give inverse, inverse:NAME or hapi:PORT, such as hapi:/dev/ttyACM0"),
        }
    }
}

/// A serial port, or an emulated one on a network. The board's USB port has no speed of its own, whatever is set.
fn board_address(port: &str) -> DeviceAddress {
    match port.parse::<SocketAddr>() {
        Ok(_) => DeviceAddress::Tcp(port.into()),
        Err(_) => DeviceAddress::Serial { port: port.into(), baud: 115_200, has_handshake: false },
    }
}

impl DeviceName {
    /// The device to open; `service` is where the service of an Inverse listens.
    #[must_use]
    pub fn at(self, service: SocketAddr) -> DeviceChoice {
        match self {
            Self::Inverse(name) => DeviceChoice::Inverse { address: service, name },
            Self::Hapi(address) => DeviceChoice::Hapi(address),
        }
    }
}

/// A device that a scene can use.
#[derive(Debug)]
pub struct OpenDevice {
    pub device: Box<dyn HapticDevice>,
    /// Damping, friction, steps and delay of the loop through it, as the margin needs them.
    pub looped: LoopDevice,
    /// A look at it while the scene's loop has it.
    pub monitor: DeviceMonitor,
}

/// A device before play.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceReport {
    /// What it is, and with what.
    pub description: String,
    /// Whether its force waits for a button. Where there is none, a person must read the report before the scene starts.
    pub has_button: bool,
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
    #[must_use]
    pub fn of(report: LinkReport) -> Self {
        let LinkReport { reports, faults, losses, stop, .. } = report;
        Self { reports, faults, losses, stop: stop.name() }
    }
}

/// What a 2DIY does not have, and what its board does not do.
const HAPI_WARNINGS: [&str; 2] = [
    "the board takes the arm's place for the home position; if the arm was elsewhere, end the scene and start again from home",
    "the board has no button and keeps its torque if this computer stops; keep the switch of the motors' power supply within reach",
];

/// A scene that can be, as a device needs to know it.
#[derive(Clone, Debug)]
pub struct SceneToTouch {
    pub settings: SceneSettings,
    /// Force models of all its materials.
    pub bodies: Vec<ModifiedKelvin>,
    pub start: SceneStart,
}

/// Opens a device for a scene; the report is to be read before the first touch.
pub fn open_device(
    choice: &DeviceChoice,
    scene: &SceneToTouch,
) -> Result<(OpenDevice, DeviceReport), String> {
    let SceneToTouch { settings, start, .. } = scene;
    if settings.controller.is_none() {
        return Err(
            "the scene has no guards and no controller, which a real device needs; switch them on (guards = true under [loop]), or use the simulated device"
                .into(),
        );
    }
    let (device, description, warnings) = match choice {
        DeviceChoice::Inverse { address, name } => {
            let options = InverseOptions {
                address: *address,
                device: name.clone(),
                ..InverseOptions::new(start.place, settings.period)
            };
            let limits = limited(options.limits, settings);
            let options = InverseOptions { limits, ..options };
            let (device, found) =
                open_inverse(&options, driver_clock()).map_err(|err| err.to_string())?;
            let description =
                format!("device {}, grip {}, service {}", found.name, found.grip, found.version);
            (device, description, Vec::new())
        }
        DeviceChoice::Hapi(address) => {
            let options = HapiOptions::new(address.clone(), start.place, settings.period);
            let limits = limited(options.limits, settings);
            let options = HapiOptions { limits, ..options };
            let device = open_hapi(&options, driver_clock()).map_err(|err| err.to_string())?;
            (device, format!("2DIY at {address}"), HAPI_WARNINGS.to_vec())
        }
    };
    let (trip, looped, monitor) = (device.round_trip(), device.loop_device(), device.monitor());
    let margin = worst_margin(settings, &scene.bodies, looped);
    let report = DeviceReport {
        description,
        has_button: matches!(choice, DeviceChoice::Inverse { .. }),
        warnings,
        round_trip_median_ms: 1e3 * trip.median.seconds().0,
        round_trip_p99_ms: 1e3 * trip.p99.seconds().0,
        delay_ticks: looped.delay_ticks,
        sentences: margin.sentences(),
        margin,
    };
    Ok((OpenDevice { device: Box::new(device), looped, monitor }, report))
}

/// No more force than the scene's file allows its device.
fn limited(limits: ForceLimits, scene: &SceneSettings) -> ForceLimits {
    ForceLimits { force_max_n: limits.force_max_n.min(scene.device.force_max_n), ..limits }
}

/// The margin of the material that needs the most damping of the device.
fn worst_margin(
    scene: &SceneSettings,
    bodies: &[ModifiedKelvin],
    device: LoopDevice,
) -> MarginReport {
    let (deepest, speed) = STROKE;
    let of = |body: ModifiedKelvin| {
        let body = SeriesBody::from(body).padded();
        MarginSettings { body, scheme: scene.scheme, period: scene.period, device }
            .assess_stroke(deepest, speed)
    };
    let ratio = |margin: &MarginReport| margin.ratio().unwrap_or(f64::INFINITY);
    bodies
        .iter()
        .map(|body| of(*body))
        .fold(of(scene.body), |worst, one| if ratio(&one) < ratio(&worst) { one } else { worst })
}
