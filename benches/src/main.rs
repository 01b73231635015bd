//! palpate's fit beside its peers, on the same record in the same run.
//!
//! `fit-peers [--python PYTHON] [--json FILE] [--largest POWER] [--skip-intervals]`; see the README.

mod ours;
mod peers;
mod record;
mod result;
mod table;
mod varpro_peer;

use peers::Peers;
use record::Records;
use result::Fit;
use serde::Serialize;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// Intervals of the thesis record: 1 kHz.
const INTERVALS: u32 = 90_000;
/// Relaxation time in s from which the peers start, a tenth of the hold; the truth is 1.023 s. What
/// else they start from is computed from the record. palpate is given nothing.
const TAU_START: f64 = 5.0;
/// Repeats of our own fit; peers repeat three times.
const REPEATS: usize = 15;

struct Arguments {
    python: PathBuf,
    json: Option<PathBuf>,
    largest: u32,
    with_intervals: bool,
}

/// Everything measured.
#[derive(Serialize)]
struct Report {
    samples: usize,
    is_pinned: bool,
    palpate: [Fit; 2],
    varpro: [Result<Fit, String>; 2],
    peers: Result<Peers, String>,
    profile: Result<(f64, [[f64; 2]; 5]), String>,
    live: ours::Live,
    scaling: ours::Scaling,
}

fn main() -> ExitCode {
    let arguments = match arguments() {
        Ok(arguments) => arguments,
        Err(text) => {
            eprintln!("{text}");
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        // The table says which participant is wrong or missing.
        Ok(false) => ExitCode::FAILURE,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::FAILURE
        }
    }
}

fn arguments() -> Result<Arguments, String> {
    let mut found = Arguments {
        python: PathBuf::from("python3"),
        json: None,
        largest: 7,
        with_intervals: true,
    };
    let mut given = std::env::args().skip(1);
    while let Some(argument) = given.next() {
        let mut value = || given.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--python" => found.python = PathBuf::from(value()?),
            "--json" => found.json = Some(PathBuf::from(value()?)),
            "--largest" => {
                let text = value()?;
                found.largest = text
                    .parse()
                    .ok()
                    .filter(|power| (3..=8).contains(power))
                    .ok_or(format!("--largest is a power of ten, 3 to 8, not '{text}'"))?;
            }
            "--skip-intervals" => found.with_intervals = false,
            other => {
                return Err(format!(
                    "unknown argument '{other}'; there are --python, --json, --largest, --skip-intervals"
                ));
            }
        }
    }
    Ok(found)
}

/// Whether every peer ran and agrees.
fn run(arguments: &Arguments) -> Result<bool, String> {
    let is_pinned = pin_to_one_core();
    let records = Records::new(INTERVALS);
    let both = [&records.noiseless, &records.noisy];
    // What runs now goes to stderr, the tables to stdout.
    eprintln!("palpate ...");
    let [noiseless, noisy] = both.map(|samples| ours::cold_fit(samples, REPEATS));
    let palpate = [noiseless?, noisy?];
    let live = ours::live(&records, [&palpate[0], &palpate[1]])?;
    let profile = ours::profile_intervals(&records.noisy);
    eprintln!("varpro ...");
    let varpro = both.map(|samples| varpro_peer::fit(samples, TAU_START, 3));
    eprintln!("scipy and lmfit ...");
    let python = &arguments.python;
    let peers = peers::run(python, &records, TAU_START, arguments.with_intervals);
    eprintln!("series of sample counts ...");
    let report = Report {
        samples: records.noiseless.len(),
        is_pinned,
        palpate,
        varpro,
        peers,
        profile,
        live,
        scaling: ours::scaling(arguments.largest)?,
    };
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&report).map_err(|err| err.to_string())?;
        std::fs::write(path, text)
            .map_err(|err| format!("cannot write {}: {err}", path.display()))?;
    }
    Ok(table::print(&report))
}

/// Keeps this process, and with it every peer it starts, on the first core.
fn pin_to_one_core() -> bool {
    Command::new("taskset")
        .args(["-cp", "0", &std::process::id().to_string()])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
