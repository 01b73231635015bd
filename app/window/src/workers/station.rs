//! The station of the window: other programs and phones watch the rig and may stop it; runs over the network only while a
//! queue is armed here.

use super::Job;
use crate::screens::form::RunSetup;
use eframe::egui::Context;
use palpate_analysis::station_settings::{STATION_PORT, StationSettings};
use palpate_runner::Runner;
use palpate_station::Station;
use palpate_station::remote::{ArmedState, RemoteBench, RemoteDesk, RemoteQueue};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::{MutexGuard, PoisonError};
use std::time::Duration;

/// What a person at the rig does with the station.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StationCommand {
    Serve,
    EndServing,
    /// Arms the remote queue of a file for so many minutes.
    Arm(PathBuf, u64),
    Disarm,
}

/// The station, while there is one.
pub struct StationDesk {
    settings: Option<StationSettings>,
    station: Option<Station>,
    /// The file of a remote queue that is being read.
    reading: Job<Result<RemoteQueue, String>>,
    minutes: u64,
    /// Why the last command was refused.
    pub refusal: Option<String>,
}

impl StationDesk {
    /// With the settings of the command line, or for this computer alone.
    #[must_use]
    pub fn new(settings: Option<StationSettings>, library: Option<&PathBuf>) -> Self {
        let usual = |library: &PathBuf| StationSettings {
            address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), STATION_PORT),
            tls: None,
            is_plain_allowed: false,
            names: Vec::new(),
            library: library.clone(),
        };
        Self {
            settings: settings.or_else(|| library.map(usual)),
            station: None,
            reading: Job::default(),
            minutes: 0,
            refusal: None,
        }
    }

    /// The address where it serves.
    pub fn url(&self) -> Option<String> {
        self.station.as_ref().map(Station::url)
    }

    /// The address where it would.
    pub fn planned(&self) -> Option<SocketAddr> {
        self.settings.as_ref().map(|settings| settings.address)
    }

    /// Its settings, for the next rig of this window, if it serves.
    pub fn settings(&self) -> Option<StationSettings> {
        self.settings.clone().filter(|_| self.station.is_some())
    }

    pub fn armed(&self) -> Option<ArmedState> {
        self.desk()?.armed()
    }

    /// Why the last arming was taken back.
    pub fn disarmed(&self) -> Option<String> {
        self.desk()?.state(0).disarmed
    }

    fn desk(&self) -> Option<MutexGuard<'_, RemoteDesk>> {
        let desk = self.station.as_ref()?.desk();
        Some(desk.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes an arming back, if there is one.
    pub fn disarm(&self, reason: &str) {
        if let Some(mut desk) = self.desk() {
            desk.disarm(reason);
        }
    }

    /// As [`RemoteDesk::disarm_for_stop`].
    #[must_use]
    pub fn disarm_for_stop(&self, reason: &str) -> bool {
        self.desk().is_some_and(|mut desk| desk.disarm_for_stop(reason))
    }

    pub fn act(&mut self, ctx: &Context, command: &StationCommand, rig: (&Runner, RemoteBench)) {
        self.refusal = None;
        match command {
            StationCommand::Serve => self.serve(rig.0, rig.1),
            StationCommand::EndServing => self.station = None,
            StationCommand::Disarm => self.disarm("a person at the rig took it back"),
            StationCommand::Arm(file, minutes) => {
                self.minutes = *minutes;
                if let Some(station) = &self.station {
                    station.set_bench(Some(rig.1.clone()));
                }
                let (file, library) = (file.clone(), rig.1.library);
                let read =
                    move || RemoteQueue::read(&file, Some(&library)).map_err(|err| err.to_string());
                let begun = self.reading.start("remote-queue", ctx, read);
                self.refusal = begun.err().map(|err| format!("the file cannot be read: {err}"));
            }
        }
    }

    /// Begins to serve.
    pub fn serve(&mut self, runner: &Runner, bench: RemoteBench) {
        let Some(settings) = &self.settings else {
            self.refusal =
                Some("there is no library, so there are no tokens; set PALPATE_HOME".into());
            return;
        };
        match Station::start(settings, runner.handle(), Some(bench)) {
            Ok(station) => self.station = Some(station),
            Err(err) => self.refusal = Some(err.to_string()),
        }
    }

    /// Arms what was read, and says to the station whether the window needs the rig.
    pub fn poll(&mut self, busy: Option<String>) {
        if let Some(read) = self.reading.poll() {
            let time = Duration::from_secs(self.minutes.saturating_mul(60));
            let armed = read.and_then(|queue| {
                let station =
                    self.station.as_ref().ok_or("the rig is not served; serve it first")?;
                station.arm(queue, time).map_err(|err| err.to_string())
            });
            self.refusal = armed.err();
        }
        if let Some(mut desk) = self.desk() {
            desk.set_busy(busy);
        }
    }
}

/// What runs over the network are made with.
#[must_use]
pub fn remote_bench(setup: &RunSetup, is_virtual: bool, library: PathBuf) -> RemoteBench {
    RemoteBench {
        calibration: setup.calibration.clone(),
        limits: setup.limits,
        to_acknowledge: setup.all_to_acknowledge(),
        is_virtual,
        library,
    }
}
