//! How much model do records need: families compared, the cheapest one within a tolerance.
//!
//! Start at [`select()`]. Every family is fitted to all records together and judged in three ways: by
//! information criteria on the effective number of samples (`criteria`), by how it predicts what its
//! fit has not seen (`hold_out`), and by what one evaluation costs (`cost`). `verdict` makes a
//! choice of it, or says that none is deserved; `ladder` says what each extra term buys.

mod cost;
mod criteria;
mod facts;
mod hold_out;
mod ladder;
mod run;
mod verdict;

pub use cost::StepCost;
pub use criteria::criteria;
pub use facts::RecordFacts;
pub use hold_out::{HeldOutKind, HoldOut, HoldOutError, HoldOutPrediction, RecordPrediction};
pub use ladder::LadderStep;
pub use run::{
    ModelCandidate, ModelSelection, RefusedFamily, SelectError, SelectOptions, SelectProgress,
    select,
};
pub use verdict::{SelectionOutcome, SelectionVerdict};
