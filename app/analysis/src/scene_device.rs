//! A real haptic device for a scene: opened, judged before play, and how it did.

use palpate_haptic_devices::inverse::{DeadMan, LinkReport};
use palpate_haptic_devices::{InverseDevice, InverseOptions};
use palpate_haptics::margin::{LoopDevice, MarginReport, MarginSettings};
use palpate_haptics::scene::{SceneSettings, SceneStart};
use palpate_model::units::{Depth, MmPerS};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::SeriesBody;
use palpate_runner::driver_clock;
use serde::Serialize;
use std::net::SocketAddr;

/// The stroke that is judged before play: as deep and as fast as a finger presses.
const STROKE: (Depth, MmPerS) = (Depth(10.0), MmPerS(50.0));

/// Which device.
#[derive(Clone, Debug)]
pub struct DeviceChoice {
    /// Where its service listens.
    pub address: SocketAddr,
    /// Its name in the service; the only one where there is none.
    pub name: Option<String>,
    pub dead_man: DeadMan,
}

/// A device before play.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceReport {
    pub name: String,
    pub grip: Option<String>,
    /// Version of its service.
    pub service: String,
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
) -> Result<(InverseDevice, DeviceReport), String> {
    let SceneToTouch { settings, bodies, start } = scene;
    let options = InverseOptions {
        address: choice.address,
        device: choice.name.clone(),
        dead_man: choice.dead_man,
        ..InverseOptions::new(start.place, settings.period)
    };
    let device = InverseDevice::open(&options, driver_clock()).map_err(|err| err.to_string())?;
    let (found, trip, looped) = (device.found(), device.round_trip(), device.loop_device());
    let margin = worst_margin(settings, bodies, looped);
    let report = DeviceReport {
        name: found.name.clone(),
        grip: found.grip.clone(),
        service: found.version.clone(),
        round_trip_median_ms: 1e3 * trip.median.seconds().0,
        round_trip_p99_ms: 1e3 * trip.p99.seconds().0,
        delay_ticks: looped.delay_ticks,
        sentences: margin.sentences(),
        margin,
    };
    Ok((device, report))
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
