//! The Python peers, run as one process on the same record.

use crate::record::Records;
use crate::result::Fit;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What `peers.py` prints.
#[derive(Debug, Serialize, Deserialize)]
pub struct Peers {
    /// Version of Python.
    pub python: String,
    /// Version of numpy.
    pub numpy: String,
    /// Version of scipy.
    pub scipy: String,
    /// Version of lmfit.
    pub lmfit: String,
    /// Fits, each peer on each record.
    pub fits: Vec<PeerFit>,
    /// lmfit's `conf_interval`, unless skipped.
    pub intervals: Option<Intervals>,
}

/// A peer's fit of a record.
#[derive(Debug, Serialize, Deserialize)]
pub struct PeerFit {
    /// Who.
    pub name: String,
    /// `noiseless` or `noisy`.
    pub record: String,
    /// What it found.
    #[serde(flatten)]
    pub fit: Fit,
}

/// Five 95 % intervals.
#[derive(Debug, Serialize, Deserialize)]
pub struct Intervals {
    /// Wall time of all five.
    pub seconds: f64,
    /// Low and high of each.
    pub bounds: [[f64; 2]; 5],
}

/// Runs `peers.py` with `python`, every numerical library held to one thread.
pub fn run(
    python: &Path,
    records: &Records,
    tau_start: f64,
    with_intervals: bool,
) -> Result<Peers, String> {
    let path = std::env::temp_dir().join(format!("palpate-record-{}.f64", std::process::id()));
    records
        .write(&path)
        .map_err(|err| format!("cannot write the record to {}: {err}", path.display()))?;
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("peers.py");
    let mut command = Command::new(python);
    command.arg(script).arg(&path).arg(tau_start.to_string());
    if !with_intervals {
        command.arg("--skip-intervals");
    }
    for name in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"] {
        command.env(name, "1");
    }
    let output = command.stderr(Stdio::inherit()).output();
    // The record is scratch; failing to remove it must not hide the result.
    let _ = std::fs::remove_file(&path);
    let output = output.map_err(|err| format!("cannot run {}: {err}", python.display()))?;
    if !output.status.success() {
        return Err(format!(
            "peers.py failed; install benches/requirements.txt for {}",
            python.display()
        ));
    }
    serde_json::from_slice(&output.stdout)
        .map_err(|err| format!("peers.py printed no result: {err}"))
}
