//! The serial ports of this computer, listed in the background: some drivers take seconds.

use super::Job;
use eframe::egui::Context;
use palpate_drivers::serial::{PortInfo, SerialError};

/// Lists ports: those of this computer, or in a test those that it wants.
pub type ListPorts = fn() -> Result<Vec<PortInfo>, SerialError>;

/// The serial ports found, and whether a listing is under way.
#[derive(Debug)]
pub struct Ports {
    list: ListPorts,
    job: Job<Result<Vec<PortInfo>, SerialError>>,
    found: Option<Result<Vec<PortInfo>, String>>,
}

impl Ports {
    /// None is known yet.
    #[must_use]
    pub fn new(list: ListPorts) -> Self {
        Self { list, job: Job::default(), found: None }
    }

    /// Lists the ports anew.
    pub fn refresh(&mut self, ctx: &Context) {
        let ctx = ctx.clone();
        let started = self.job.start("serial-ports", self.list, move || ctx.request_repaint());
        if let Err(err) = started {
            self.found = Some(Err(format!("the serial ports cannot be listed: {err}")));
        }
    }

    /// Takes the answer, if it is there.
    pub fn poll(&mut self) {
        if let Some(answer) = self.job.poll() {
            self.found = Some(answer.map_err(|err| err.to_string()));
        }
    }

    /// Whether a listing is under way.
    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    /// What the last listing found; `None` before the first.
    pub fn found(&self) -> Option<Result<&[PortInfo], &str>> {
        self.found.as_ref().map(|found| match found {
            Ok(ports) => Ok(ports.as_slice()),
            Err(reason) => Err(reason.as_str()),
        })
    }
}
