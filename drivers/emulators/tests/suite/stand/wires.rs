//! The stand over a pseudo-terminal, in real time. Waits are generous: nothing here is about speed.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use super::bench::{to, usual};
use palpate_drivers::mark10::{StandDevice, StandRig};
use palpate_drivers::wire::{DeviceAddress, HostClock};
use palpate_drivers::{Rig, RigEventBody};
use palpate_emulators::mark10::{EmulatedStand, EmulatedStandSettings};
use palpate_emulators::serve::{EmulatorAddress as At, ServeEvent, ServeOptions, serve};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Reading, RigCommand};
use palpate_test_support::skip;
use palpate_test_support::wait::PATIENCE;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Instant;

/// Takes reports until one is as wanted.
fn until(rig: &mut StandRig, start: Instant, is_so: impl Fn(&RigEventBody) -> bool) -> usize {
    let begin = Instant::now();
    let mut readings = 0;
    while begin.elapsed() < PATIENCE {
        let until = Nanos(start.elapsed().as_nanos() as u64) + Nanos::from_millis(20);
        let Some(event) = rig.next_event(until) else {
            continue;
        };
        readings += usize::from(matches!(event.body, RigEventBody::Reading(_)));
        if is_so(&event.body) {
            return readings;
        }
    }
    panic!("it never came");
}

fn rests_at(pulses: i64) -> impl Fn(&RigEventBody) -> bool {
    move |body| {
        let is_there =
            |reading: &Reading| reading.pulses == pulses && !reading.status.has(AxisStatus::MOVING);
        matches!(body, RigEventBody::Reading(reading) if is_there(reading))
    }
}

#[test]
fn a_stand_on_a_pseudo_terminal_moves_and_is_connected_anew() {
    if skip::lacks_terminals() {
        return;
    }
    let (_orders, received) = sync_channel(16);
    let (sender, printed) = sync_channel(64);
    let stop = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&stop);
    let work = move || {
        let mut device = EmulatedStand::new(EmulatedStandSettings::default());
        let options = ServeOptions {
            address: At::Pty(None),
            baud: None,
            latency: Nanos::ZERO,
            faults: Vec::new(),
            seed: 1,
        };
        // Only where it is matters here.
        let mut tell = |printed| drop(sender.try_send(printed));
        serve(&mut device, &options, &received, &is_over, &mut tell).is_ok()
    };
    let thread = std::thread::Builder::new().name("stand".into()).spawn(work).expect("a thread");
    let Ok(ServeEvent::Ready(port)) = printed.recv_timeout(PATIENCE) else {
        panic!("it did not start");
    };
    let place = DeviceAddress::Serial { port, baud: 115_200, has_handshake: false };
    let start = Instant::now();
    let clock: HostClock = Arc::new(move || Nanos(start.elapsed().as_nanos() as u64));
    let open = || {
        let (place, settings) = (place.clone(), usual());
        StandRig::open(StandDevice { place, settings }, Arc::clone(&clock))
    };
    let mut rig = open().expect("a stand");
    let second = open().err();
    let second = second.expect("two on one port").to_string();
    assert!(second.contains("another program"), "{second}");

    rig.send(to(100, 1.0));
    let readings = until(&mut rig, start, rests_at(100));
    println!("{readings} samples in a move; {:?}", rig.links());
    rig.reconnect().expect("the same stand");
    // It is where it was, by its own travel.
    until(&mut rig, start, rests_at(100));
    rig.send(to(50, 1.0));
    until(&mut rig, start, rests_at(50));
    rig.send(RigCommand::Stop);
    let is_stopped = |body: &RigEventBody| matches!(body, RigEventBody::Ack(ack) if ack.command == RigCommand::Stop);
    until(&mut rig, start, is_stopped);
    assert!(rig.take_raw().iter().any(|piece| piece.is_sent));
    drop(rig);
    stop.store(true, Ordering::SeqCst);
    assert!(thread.join().expect("the emulator"));
}
