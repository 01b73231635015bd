//! Reports and figures of sessions as new files.

use super::{Done, step};
use crate::progress::Progress;
use crate::report::dossier::{self, Ending, Figure, Wanted};
use crate::report::figures::{Align, Window};
use palpate_runner::wall_now;
use std::path::Path;

/// What is written.
#[derive(Clone, Debug, PartialEq)]
pub enum Paper {
    /// A page on these sessions.
    Page(Vec<Wanted>),
    /// One figure of a session.
    Figure(Wanted, Figure, Window),
}

/// Writes it as a new file, or says why not.
pub fn paper(paper: &Paper, to: &Path, progress: &dyn Progress) -> Result<Done, String> {
    if to.exists() {
        return Err(format!("{} exists already; choose another name", to.display()));
    }
    let bytes = match paper {
        Paper::Page(wanted) => {
            let made = dossier::made(wall_now().into());
            let page = dossier::write(wanted, Align::default(), &made, progress);
            page.map_err(|err| err.to_string())?.into_bytes()
        }
        Paper::Figure(wanted, figure, window) => {
            let ending = Ending::of(to)?;
            step(progress, 0, 1, "drawing")?;
            let drawing = dossier::figure(wanted, *figure, *window);
            let drawing = drawing.map_err(|err| err.to_string())?;
            ending.bytes(&drawing?)?
        }
    };
    write_new(to, &bytes)?;
    Ok(Done::told(format!("written: {}", to.display())))
}

/// Writes a file that was not there.
fn write_new(to: &Path, bytes: &[u8]) -> Result<(), String> {
    palpate_sessions::atomic::create(to, bytes).map_err(|err| {
        format!("cannot write {} ({err}); choose a folder that may be written", to.display())
    })
}
