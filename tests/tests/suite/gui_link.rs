//! A link that is lost between runs, in the window: what it says, and how it is made again.

use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigError, RigEvent, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RigCommand, RigDescription};
use palpate_runner::TimeScale;
use palpate_tests::flow::WindowFlow;
use palpate_window::window::WindowOptions;

/// A rig whose plug is pulled after a second, and put back after the first try to connect again.
struct Unplugged {
    rig: SimRig,
    tries: u32,
    is_reported: bool,
}

impl Unplugged {
    fn is_out(&self, until: Nanos) -> bool {
        self.tries < 2 && until >= Nanos::from_millis(1_000)
    }
}

impl Rig for Unplugged {
    fn description(&self) -> &RigDescription {
        self.rig.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.rig.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        if !self.is_out(until) {
            return self.rig.next_event(until);
        }
        if std::mem::replace(&mut self.is_reported, true) {
            return None;
        }
        let fault = Fault::LinkLost { detail: "the device has disconnected".into() };
        Some(RigEvent::new(until, RigEventBody::Fault(fault)))
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        self.tries += 1;
        if self.tries < 2 {
            return Err(RigError::CannotReconnect);
        }
        Ok(())
    }

    fn is_virtual(&self) -> bool {
        self.rig.is_virtual()
    }
}

#[test]
fn a_lost_link_is_reported_and_reconnected_by_a_button() {
    let scale = TimeScale::Factor(1.0);
    let mut options = WindowOptions::open("sim", &SimSettings::default(), scale).unwrap();
    options.request.rig = Box::new(Unplugged {
        rig: SimRig::new(SimSettings::default()),
        tries: 0,
        is_reported: false,
    });
    let mut flow = WindowFlow::open_on(options, tempfile::tempdir().unwrap());
    flow.wait("the loss", |window| window.state().snapshot().rig.link_error.is_some());
    flow.window.step();
    assert!(flow.says("State: LINK LOST"));
    assert!(flow.says("the device has disconnected"));
    assert!(!flow.is_enabled("Start  F5"));
    // The first try fails, and says so.
    flow.click("Connect again");
    flow.wait("the refusal", |window| {
        let error = &window.state().snapshot().rig.link_error;
        error.as_ref().is_some_and(|error| error.contains("connected again"))
    });
    flow.window.step();
    flow.click("Connect again");
    flow.wait("samples", |window| {
        let rig = &window.state().snapshot().rig;
        rig.link_error.is_none() && rig.reading.is_some()
    });
    flow.window.step();
    assert!(flow.is_enabled("Start  F5"));
    assert!(!flow.says("Connect again"));
}
