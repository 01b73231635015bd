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
    ExpectedAnswer, ExtremesRow, ExtremesSubject, ExtremesVerdict, Oracle, PathCase, SubjectAnswer,
    TOLERANCE, judge,
};
pub use members::make_member;
pub use subjects::{FamilyBody, SchemeBody};

use crate::families::{Family, UnknownFamily, all_families, find_family};
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtremesExtent {
    /// Seconds: corners and middles of every table.
    Quick,
    /// Minutes: every power of ten; the longest records for the cheap families.
    Whole,
    /// The longest records for every family too.
    Soak,
}

/// Rows of one group for one subject.
pub struct ExtremesPart {
    pub group: &'static str,
    pub subject: String,
    run: Box<Rows>,
}

/// Makes rows and reports the share done, 0 to 1.
type Rows = dyn Fn(&mut dyn FnMut(f64)) -> Vec<ExtremesRow> + Send + Sync;

/// The same of a family.
type FamilyRows = fn(ExtremesExtent, &Arc<dyn Family>, &mut dyn FnMut(f64)) -> Vec<ExtremesRow>;

/// The groups that every family runs: name, words before the key of the family, rows.
const FAMILY_GROUPS: [(&str, &str, FamilyRows); 6] = [
    (tau_step::GROUP, "", tau_step::rows),
    (path::GROUP, "", path::rows),
    (scale::GROUP, "", scale::rows),
    (input::GROUP, "", input::rows),
    (records::GROUP, "fit of ", records::rows),
    (long::GROUP, "", long::rows),
];

impl ExtremesPart {
    fn new(
        group: &'static str,
        subject: String,
        run: impl Fn(&mut dyn FnMut(f64)) -> Vec<ExtremesRow> + Send + Sync + 'static,
    ) -> Self {
        Self { group, subject, run: Box::new(run) }
    }

    /// Runs its cases; `progress` gets the share done, 0 to 1.
    pub fn rows(&self, mut progress: impl FnMut(f64)) -> Vec<ExtremesRow> {
        (self.run)(&mut progress)
    }
}

/// Everything there is to run, or what concerns one family.
pub fn list_extremes(
    extent: ExtremesExtent,
    family: Option<&str>,
) -> Result<Vec<ExtremesPart>, UnknownFamily> {
    let families: Vec<Arc<dyn Family>> = match family {
        Some(key) => vec![find_family(key)?],
        None => all_families(),
    };
    let mut parts = Vec::new();
    for (group, prefix, rows) in FAMILY_GROUPS {
        parts.extend(families.iter().cloned().map(|family| {
            let subject = format!("{prefix}{}", family.key());
            ExtremesPart::new(group, subject, move |progress| rows(extent, &family, progress))
        }));
    }
    // Groups that concern no family are left out where one is given.
    if family.is_none() {
        parts.extend(integrators::parts(extent));
        parts.push(long::scheme_part(extent));
        parts.push(input::thesis_part());
        parts.push(records::thesis_part(extent));
    }
    Ok(parts)
}

/// One row after the other; `progress` gets the share done after each.
fn rows_of<T>(
    cases: Vec<T>,
    progress: &mut dyn FnMut(f64),
    mut row: impl FnMut(T) -> ExtremesRow,
) -> Vec<ExtremesRow> {
    let count = cases.len() as f64;
    let rows = cases.into_iter().enumerate().map(|(index, case)| {
        let row = row(case);
        progress((index + 1) as f64 / count);
        row
    });
    rows.collect()
}
