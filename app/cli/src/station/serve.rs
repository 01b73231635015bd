//! `palpate serve`: a rig as a station, without a window. The person at the rig types at its terminal.

use super::super::Failure;
use super::super::notices::Notices;
use super::super::output::Output;
use super::super::rig::{RigArgs, open};
use super::super::terminal::{ctrl_c_flag, read_lines};
use super::{StationArgs, parse_address, remote_bench, start, usual_address};
use clap::Args;
use palpate_protocols::engine::Operator;
use palpate_runner::{Runner, RunnerRequest};
use palpate_station::Station;
use palpate_station::remote::{RemoteQueue, RemoteRunState};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{TryRecvError, sync_channel};
use std::time::Duration;

/// Serve a rig over HTTP: watch and stop it from a browser, and run what a person at the rig has armed
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// Where to listen: an address, a port, or both; without it this computer alone, at 127.0.0.1:7480
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address)]
    address: Option<SocketAddr>,
    #[command(flatten)]
    station: StationArgs,
    /// Arm this remote queue from the start; you stand at the rig
    #[arg(long, value_name = "FILE")]
    arm: Option<PathBuf>,
    /// For so many minutes
    #[arg(long, value_name = "MINUTES", default_value = "60", requires = "arm")]
    arm_for: u64,
    #[command(flatten)]
    rig: RigArgs,
}

/// How often the terminal and the desk are looked at, where the rig says nothing.
const LOOK_EVERY: Duration = Duration::from_millis(200);

const WORDS: &str = "type stop, arm FILE MINUTES, disarm, or quit";

pub(crate) fn run(args: &ServeArgs, output: &Output) -> Result<(), Failure> {
    let settings = args.station.settings(args.address.unwrap_or_else(usual_address))?;
    let queue = args.arm.as_ref().map(|file| RemoteQueue::read(file, Some(&settings.library)));
    let queue = queue.transpose().map_err(Failure::usage)?;
    let bench = open(&args.rig)?;
    bench.from_library.iter().chain(&bench.doubts).for_each(|words| output.note(words));
    let remote = remote_bench(&bench, settings.library.clone());
    let notices = Notices::open(&bench.calibration, output);
    let (wake, woken) = sync_channel(1);
    let woken_by = move || {
        // A full channel holds a wake-up already.
        let _ = wake.try_send(());
    };
    let runner = Runner::start(bench.rig, args.rig.time_scale, None, woken_by).map_err(|err| {
        Failure::failed(format!("the thread that runs protocols cannot be started: {err}"))
    })?;
    let station = start(&settings, runner.handle(), Some(remote))?;
    let is_ending = ctrl_c_flag()?;
    if let Some(queue) = queue {
        arm(&station, queue, args.arm_for)?;
    }
    let url = station.url();
    let object = serde_json::json!({ "url": url, "address": station.address() });
    output.answer("serve", &object, || format!("the rig is served at {url}/; {WORDS}"));
    let lines = read_lines("terminal")?;
    let mut desk = DeskNews::default();
    while !is_ending.load(Ordering::Relaxed) && runner.is_alive() {
        let _ = woken.recv_timeout(LOOK_EVERY);
        notices.see(&runner.snapshot());
        desk.tell(&station, output);
        match lines.try_recv() {
            Ok(line) if line.trim() == "quit" => break,
            Ok(line) => obey(line.trim(), &station, &runner, &settings.library, output),
            // A service has no terminal; a signal ends it.
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
        }
    }
    // The station first, so that nothing is started any more; then the rig stops.
    drop(station);
    notices.see(&runner.snapshot());
    notices.finish(output);
    match runner.is_alive() {
        true => Ok(()),
        false => Err(Failure::failed(
            "the thread that controls the rig ended unexpectedly; check the rig and start again",
        )),
    }
}

fn arm(station: &Station, queue: RemoteQueue, minutes: u64) -> Result<(), Failure> {
    station.arm(queue, Duration::from_secs(minutes.saturating_mul(60))).map_err(Failure::usage)
}

/// Does what a person at the rig has typed. A stop comes before everything else.
fn obey(line: &str, station: &Station, runner: &Runner, library: &Path, output: &Output) {
    let desk = || station.desk().lock().unwrap_or_else(PoisonError::into_inner);
    let mut words = line.split_whitespace();
    match (words.next(), words.next(), words.next(), words.next()) {
        (Some("stop"), None, ..) => {
            let stop = || runner.request(RunnerRequest::Operator(Operator::Stop));
            let mut passed = stop();
            if desk().disarm_for_stop("a person at the rig stopped it") {
                passed = stop();
            }
            if let Err(reason) = passed {
                output.note(&reason);
            }
        }
        (Some("disarm"), None, ..) => desk().disarm("a person at the rig took it back"),
        (Some("arm"), Some(file), Some(minutes), None) => {
            let armed = minutes
                .parse::<u64>()
                .map_err(|_| format!("'{minutes}' is no number of minutes; {WORDS}"))
                .and_then(|minutes| {
                    let queue = RemoteQueue::read(Path::new(file), Some(library));
                    Ok((queue.map_err(|err| err.to_string())?, minutes))
                })
                .and_then(|(queue, minutes)| {
                    arm(station, queue, minutes).map_err(|failure| failure.sentence().to_owned())
                });
            if let Err(reason) = armed {
                output.note(&reason);
            }
        }
        (None, ..) => {}
        _ => output.note(WORDS),
    }
}

/// Says what has changed at the desk since it was looked at last.
#[derive(Default)]
struct DeskNews {
    armed: Option<String>,
    runs: BTreeMap<u64, RemoteRunState>,
}

impl DeskNews {
    fn tell(&mut self, station: &Station, output: &Output) {
        let state = station.desk().lock().unwrap_or_else(PoisonError::into_inner).state(50);
        let armed = state.armed.map(|one| format!("'{}' until {}", one.queue, one.until));
        if armed != self.armed {
            match (&armed, state.disarmed) {
                (Some(words), _) => output.note(&format!("armed: the queue {words}")),
                (None, Some(reason)) => {
                    output.note(&format!("no queue is armed any more: {reason}"))
                }
                (None, None) => {}
            }
            self.armed = armed;
        }
        for run in state.runs {
            if self.runs.insert(run.id, run.state) != Some(run.state) {
                let reason = run.reason.map_or_else(String::new, |reason| format!(": {reason}"));
                output.note(&format!(
                    "run {} of '{}' for '{}' {}{reason}",
                    run.id,
                    run.queue,
                    run.token,
                    run.state.words()
                ));
            }
        }
    }
}
