//! Numerical stability at the extremes: cases, the exact answer to each, and the verdict.
//!
//! Every family of force models, every integrator and every fit runs the same cases. Each must
//! give the right number to a stated tolerance or refuse in words that name the reason. Anything else,
//! a number that is off, NaN, infinity, a refusal of what can be answered, is wrong. Truth is the
//! [reference](crate::reference) in many digits, or for a fit the parameters that made the record.
//!
//! Start at [`parts`]; [`judge`] holds what right means, and one file each the groups of cases.

mod fits;
mod input;
mod integrators;
mod judge;
mod long;
mod members;
mod path;
mod records;
mod scale;
mod subjects;
mod tau_step;

pub use judge::{
    ExpectedAnswer, ExtremesSubject, Oracle, PathCase, Row, SubjectAnswer, TOLERANCE, Verdict,
    judge,
};
pub use members::make_member;
pub use subjects::{FamilyBody, SchemeBody};

use crate::families::{Family, UnknownFamily, all, by_key};
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Seconds: corners and middles of every table.
    Quick,
    /// Minutes: every power of ten; the longest records for the cheap families.
    Whole,
    /// The longest records for every family too.
    Soak,
}

/// Rows of one group for one subject.
pub struct Part {
    pub group: &'static str,
    pub subject: String,
    run: Box<Rows>,
}

/// Makes rows and tells the share done, 0 to 1.
type Rows = dyn Fn(&mut dyn FnMut(f64)) -> Vec<Row>;

impl Part {
    fn new(
        group: &'static str,
        subject: String,
        run: impl Fn(&mut dyn FnMut(f64)) -> Vec<Row> + 'static,
    ) -> Self {
        Self { group, subject, run: Box::new(run) }
    }

    /// Its rows; `progress` hears the share done, 0 to 1.
    pub fn rows(&self, mut progress: impl FnMut(f64)) -> Vec<Row> {
        (self.run)(&mut progress)
    }
}

/// Everything there is to run, or what concerns one family.
pub fn parts(extent: Extent, family: Option<&str>) -> Result<Vec<Part>, UnknownFamily> {
    let families: Vec<Arc<dyn Family>> = match family {
        Some(key) => vec![by_key(key)?],
        None => all(),
    };
    let mut parts = Vec::new();
    for group in
        [tau_step::parts, path::parts, scale::parts, input::parts, records::parts, long::parts]
    {
        parts.extend(families.iter().flat_map(|family| group(extent, &family.key())));
    }
    // What is of no family is left out where one was asked for.
    if family.is_none() {
        parts.extend(integrators::parts(extent));
        parts.extend(long::scheme_parts(extent));
        parts.extend(input::thesis_parts());
        parts.extend(records::thesis_parts(extent));
    }
    Ok(parts)
}
