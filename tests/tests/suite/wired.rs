//! A rig on wires: its bytes are in the session, and a computer that stands still before it ends the run.

use palpate_doubles::WiredRig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent};
use palpate_model::Nanos;
use palpate_model::rig::{RigCommand, RigDescription};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::RampHold;
use palpate_runner::TimeScale;
use palpate_runner::replay::replay;
use palpate_sessions::{LogPart, Session};
use palpate_tests::recorded_runs;
use std::path::Path;
use std::time::Duration;

/// Runs to the end of the session at `out`.
fn run(rig: Box<dyn Rig>, scale: TimeScale, out: &Path) -> Session {
    let calibration = SimRig::new(SimSettings::default()).calibration();
    let plan = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(6.0),
        hold: Seconds(2.0),
        ..RampHold::default()
    };
    recorded_runs::wait_for_end(recorded_runs::start(rig, calibration, plan.plan(), scale, out));
    Session::open(out).expect("the session")
}

fn sim() -> SimRig {
    SimRig::new(SimSettings::default())
}

#[test]
fn bytes_of_a_rig_on_wires_are_in_its_session() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    let session = run(Box::new(WiredRig::new(sim())), TimeScale::Max, &out);
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "finish", "{}", end.reason);
    let (mut cell, mut sent, mut bytes) = (Vec::new(), String::new(), 0);
    Session::scan_parts(&out, &mut |part| {
        let LogPart::Raw(block) = part else { return };
        bytes += block.len() as u64;
        for piece in block.pieces() {
            let text = String::from_utf8(piece.bytes.to_vec()).unwrap();
            match (block.device(), piece.is_sent) {
                ("cell", false) => cell.push((piece.at, text)),
                ("controller", true) => sent.push_str(&text),
                ("controller", false) => assert!(text.starts_with("Ack"), "{text}"),
                other => panic!("{other:?}"),
            }
        }
    })
    .unwrap();
    // Every reading is there as it was sent, at its time.
    let reported: Vec<(Nanos, String)> = session
        .rows
        .iter()
        .map(|row| {
            let (counts, pulses) = (row.counts.unwrap_or_default(), row.pulses.unwrap());
            (row.host, format!("{} {counts} {pulses}\r\n", row.tick))
        })
        .collect();
    assert!(cell == reported, "{} readings, {} on the wire", reported.len(), cell.len());
    assert!(sent.starts_with("EnableMotor\r"), "{sent}");
    assert_eq!(session.auxiliary.raw_bytes, bytes);
    assert_eq!(end.raw_bytes, bytes);
}

/// A rig one of whose reports makes the computer stand still.
struct Standing {
    rig: SimRig,
    is_virtual: bool,
    at: Nanos,
    pause: Option<Duration>,
}

impl Rig for Standing {
    fn description(&self) -> &RigDescription {
        self.rig.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.rig.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        if until > self.at
            && let Some(pause) = self.pause.take()
        {
            std::thread::sleep(pause);
        }
        self.rig.next_event(until)
    }

    fn is_virtual(&self) -> bool {
        self.is_virtual
    }
}

#[test]
fn a_computer_that_stands_still_before_a_rig_on_wires_ends_the_run() {
    // The time of a simulated rig waits.
    for (is_virtual, ending) in [(false, "abort"), (true, "finish")] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("session");
        let rig = Standing {
            rig: sim(),
            is_virtual,
            at: Nanos::from_millis(20_000),
            pause: Some(Duration::from_millis(700)),
        };
        let session = run(Box::new(rig), TimeScale::Factor(40.0), &out);
        let end = session.end.as_ref().unwrap();
        assert_eq!(end.outcome, ending, "{}", end.reason);
        let is_reported = end.reason.contains("was suspended");
        assert_eq!(is_reported, !is_virtual, "{}", end.reason);
        let worst = session.auxiliary.health.worst.unwrap();
        assert!(worst.lateness_s >= 0.5, "{worst:?}");
        assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
    }
}
