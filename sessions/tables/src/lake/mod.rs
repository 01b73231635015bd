//! A lake: many sessions as Parquet files, which other programs query as one table, and which convert back to sessions bit
//! for bit.
//!
//! ```text
//! v1/samples/rig=R/month=YYYY-MM/ID.parquet     one row per sample
//! v1/sessions/rig=R/month=YYYY-MM/ID.parquet    one row: the session's manifest and summary
//! v1/events/rig=R/month=YYYY-MM/ID.parquet      one row per input, decision and fit
//! v1/checksums/rig=R/month=YYYY-MM/ID.json      the CRC-32 of those three files
//! v1/fits/model=M/ID.json                       one fit
//! v1/moduli/law=L/ID.json                       one modulus by a contact law
//! ```
//!
//! The session's name is a column and the name of the file, not a folder, because there are too many. Files appear complete
//! under their names and never change.

mod checksums;
mod fits;
mod layout;
mod read;
mod rows;
mod write;

pub use fits::{
    FitFile, FitState, LakeResult, StoredFitFile, StoredResult, find_fit, list_models,
    model_folder, read_fit, read_result, result_path, store_fit,
};
pub use layout::{LAKE_VERSION, Shard, ShardError, is_lake};
pub use read::{
    LakeError, LakeSession, list_sessions, read_checksums, read_manifest, read_session,
};
pub(crate) use write::kind_name;
pub use write::{LakeAddition, LakeQuality, add_session};
