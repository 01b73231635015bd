//! A study as a research object: sessions, settings, numbers and figures in one folder or zip file, from which anybody
//! computes them again.
//!
//! Start reading at [`make_crate`] and [`reproduce`]. The layout of a crate is in `docs/format.md`.

mod archive;
mod changes;
mod compare;
mod completeness;
mod computer;
mod contents;
mod entities;
mod error;
mod files;
mod licences;
mod make;
mod metadata;
mod page;
mod people;
mod reproduce;
mod run_steps;
mod steps;
mod study_file;
pub mod terms;

pub use changes::{ChangelogEntry, changes_since};
pub use compare::{FileResult, RELATIVE_BOUND, Tolerance, compare};
pub use completeness::{Finding, Recommendation};
pub use computer::ComputerClass;
pub use error::CrateError;
pub use files::{FileFault, SUMS_FILE};
pub use licences::Licence;
pub use make::{CrateRequest, MadeCrate, make_crate};
pub use metadata::{CrateOrigin, METADATA_FILE, PAGE_FILE};
pub use people::CratePerson;
pub use reproduce::{
    ComparedFile, ProgramAge, ReproduceRequest, Reproduction, StepComparison, reproduce,
};
pub use steps::{CrateStep, StepOutput, StepPlace, StepRefusal, StepRunner, check_words};
pub use study_file::{CrateStudy, STUDY_FILE};
