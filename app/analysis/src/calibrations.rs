//! Reading, assessing and storing the library's calibrations, away from the window's thread.

use crate::report::calibration::{Entry, Told};
use crate::report::calibration_plot::plots;
use palpate_figures::figure::Plot;
use palpate_model::calibration::{Bench, Calibration};
use palpate_runner::programme::calibration_of;
use palpate_runner::wall_now;
use palpate_sessions::{Session, Shelf, age_days, save, supersede};
use std::path::Path;

/// Calibrations of the library with their assessment, and the one just stored.
pub struct Shelved {
    /// The rig's own first, then those of the library by identifier.
    pub shown: Vec<Shown>,
    /// Reasons for each calibration that cannot be read.
    pub unreadable: Vec<String>,
    /// Identifier of the one just stored, or the reason it was not.
    pub kept: Option<Result<String, String>>,
}

/// One calibration with its details.
pub struct Shown {
    pub entry: Entry,
    pub calibration: Calibration,
    /// Details and plots, or the reason there are none.
    pub told: Result<(Told, [Plot; 4]), String>,
    /// Reasons against using it on its rig.
    pub doubts: Vec<String>,
}

impl Shown {
    fn of(entry: Entry, calibration: Calibration, rig: &str) -> Self {
        let details = Told::of(&calibration).and_then(|details| {
            let plots = plots(&calibration, &details)?;
            Ok((details, plots))
        });
        Self {
            told: details.map_err(|err| err.to_string()),
            doubts: calibration.doubts(&Bench {
                rig,
                age_days: entry.age_days,
                ..Bench::default()
            }),
            entry,
            calibration,
        }
    }
}

/// Reads the library. `own` is the rig's own calibration.
pub fn read(
    library: &Path,
    own: (Calibration, String),
    kept: Option<Result<String, String>>,
) -> Shelved {
    let (own, rig) = own;
    let now = wall_now();
    let shelf = Shelf::open(library);
    let entry = Entry::built_in(&own);
    let mut shown = vec![Shown {
        // The calibration that comes with the rig needs no date.
        doubts: Vec::new(),
        ..Shown::of(entry, own, &rig)
    }];
    shown.extend(shelf.kept.iter().map(|stored| {
        let age = age_days(&stored.document, now.into());
        Shown::of(Entry::of(&shelf, stored, age), stored.document.clone(), &rig)
    }));
    Shelved { shown, unreadable: shelf.unreadable.iter().map(ToString::to_string).collect(), kept }
}

/// Stores the calibration a session measured, in the place of the one in force for its rig; tells its id.
pub fn keep(library: &Path, session: &Path, name: &str) -> Result<String, String> {
    let session = Session::open(session).map_err(|err| err.to_string())?;
    let calibration = calibration_of(&session, name).map_err(|err| err.to_string())?;
    let shelf = Shelf::open(library);
    let stored = match shelf.in_force(&calibration.rig) {
        Some(old) => supersede(library, &old.id, &calibration),
        None => save(library, &calibration),
    };
    stored.map(|stored| stored.id).map_err(|err| err.to_string())
}
