//! A library in an object store: rigs push finished sessions, everyone reads one table of them, and no server of ours runs.
//!
//! ```text
//! objects/ab/cdef...                       pieces of files, lists of files and results, each named by the SHA-256 of its bytes
//! sessions/_delta_log/00000000000000000000.json   one change of the table of sessions
//! sessions/part-....parquet                rows: one of every version of every session
//! fits/, moduli/, populations/             tables of results: a row for each number
//! ```
//!
//! An object never changes and is never deleted. A version of a session is in the table only once all of its objects are
//! stored, so that there is never half a session. The table is a Delta table, whose changes are written under a name that
//! must not exist yet: of two writers one finds the name taken, reads what the other wrote, and tries the next.
//!
//! Start reading at [`Store`], then [`Store::push`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod checkpoint;
mod compact;
mod delta;
mod error;
mod files;
mod location;
mod mirror;
mod part;
mod probe;
mod pull;
mod push;
mod results;
mod rows;
mod table;
#[cfg(test)]
mod tests;
mod verify;

pub use compact::Compaction;
pub use error::StoreError;
pub use location::{Store, StoreUrl, is_store_url};
pub use mirror::Mirror;
pub use pull::Pulled;
pub use push::{PushOutcome, PushRefusal, PushRequest};
pub use results::{ResultNumber, ResultTable, ResultsOutcome, StudyResult};
pub use rows::STORE_VERSION;
pub use verify::{StoreFault, StoreVerification};
