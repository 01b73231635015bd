//! Stored curves of the measured trade: one file for each machine and kind of build, in the library.
//!
//! A file is `{"checksum": CRC-32 of the compact JSON of the curves, "curves": ...}`.

use palpate_rheology::trade::{CurveError, Machine, TRADE_FORMAT, TradeCurves};
use palpate_sessions::atomic;
use palpate_sessions::text::json_files;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum TradeFileError {
    #[error("the curves {} cannot be {what} ({source}); check the permissions and the disk", path.display())]
    Io { what: &'static str, path: PathBuf, source: io::Error },
    #[error("{} holds no curves ({reason}); measure again", path.display())]
    NotCurves { path: PathBuf, reason: String },
    #[error("the curves {} were changed after they were measured; measure again", path.display())]
    Checksum { path: PathBuf },
    #[error("a newer version of palpate wrote the curves {} (format {format}, this one writes {TRADE_FORMAT}), so they are not replaced; update palpate", path.display())]
    Newer { path: PathBuf, format: u32 },
    #[error("{}: {source}", path.display())]
    Curves { path: PathBuf, source: CurveError },
}

#[derive(Serialize, Deserialize)]
struct Stored {
    checksum: u32,
    curves: TradeCurves,
}

fn checksum(curves: &TradeCurves) -> io::Result<u32> {
    Ok(crc32fast::hash(&serde_json::to_vec(curves)?))
}

fn folder(library: &Path) -> PathBuf {
    library.join("trade")
}

/// The file of a machine's curves.
#[must_use]
pub fn trade_file(library: &Path, machine: &Machine) -> PathBuf {
    folder(library).join(format!("{}.json", machine.file_stem()))
}

/// The file of its quick curves, which never take the place of full ones.
#[must_use]
pub fn quick_trade_file(library: &Path, machine: &Machine) -> PathBuf {
    folder(library).join(format!("{}-quick.json", machine.file_stem()))
}

/// All files of curves in a library, by name; none where there is no such folder.
#[must_use]
pub fn trade_files(library: &Path) -> Vec<PathBuf> {
    json_files(&folder(library))
}

/// Stores curves in place of those of their kind, full or quick, that the machine had. The file is whole
/// whenever it is there.
pub fn write_trade(library: &Path, curves: &TradeCurves) -> Result<PathBuf, TradeFileError> {
    let path = match curves.quick {
        true => quick_trade_file(library, &curves.machine),
        false => trade_file(library, &curves.machine),
    };
    let failed = |source| TradeFileError::Io { what: "stored", path: path.clone(), source };
    if let Err(TradeFileError::Curves { source: CurveError::Format(format), path }) =
        read_trade(&path)
        && format > TRADE_FORMAT
    {
        return Err(TradeFileError::Newer { path, format });
    }
    fs::create_dir_all(folder(library)).map_err(failed)?;
    let stored = Stored { checksum: checksum(curves).map_err(failed)?, curves: curves.clone() };
    let text = serde_json::to_vec_pretty(&stored).map_err(|err| failed(err.into()))?;
    atomic::replace(&path, &text).map_err(failed)?;
    Ok(path)
}

/// Reads curves and checks that they are what was written and can have been measured.
pub fn read_trade(path: &Path) -> Result<TradeCurves, TradeFileError> {
    let failed = |source| TradeFileError::Io { what: "read", path: path.into(), source };
    let none = |err: serde_json::Error| TradeFileError::NotCurves {
        path: path.into(),
        reason: err.to_string(),
    };
    let impossible = |source| TradeFileError::Curves { path: path.into(), source };
    let text = fs::read_to_string(path).map_err(failed)?;
    // Every version of the form states its number; what follows may differ.
    let any: serde_json::Value = serde_json::from_str(&text).map_err(none)?;
    if let Some(format) = any["curves"]["format"].as_u64().and_then(|it| u32::try_from(it).ok())
        && format != TRADE_FORMAT
    {
        return Err(impossible(CurveError::Format(format)));
    }
    let stored: Stored = serde_json::from_str(&text).map_err(none)?;
    if checksum(&stored.curves).map_err(failed)? != stored.checksum {
        return Err(TradeFileError::Checksum { path: path.into() });
    }
    stored.curves.checked().map_err(impossible)
}
