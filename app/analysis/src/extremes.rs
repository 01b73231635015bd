//! Every case at the extremes, as the command line and the window both run them.

use crate::progress::Progress;
use palpate_rheology::extremes::{ExtremesExtent, ExtremesRow, list_extremes};
use palpate_rheology::families::UnknownFamily;

/// Runs everything, or what concerns one family. `progress` hears how many thousandths are done and what is
/// under way, and may end the whole between two parts: then there is no answer.
pub fn survey(
    extent: ExtremesExtent,
    family: Option<&str>,
    progress: &dyn Progress,
) -> Result<Option<Vec<ExtremesRow>>, UnknownFamily> {
    let parts = list_extremes(extent, family)?;
    let of = 1000 * parts.len();
    let mut rows = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        let what = format!("{}: {}", part.group, part.subject);
        let tell =
            |share: f64| progress.report(1000 * index + (1000.0 * share) as usize, of, &what);
        if tell(0.0).is_break() {
            return Ok(None);
        }
        rows.extend(part.rows(|share| {
            // Within a part only the next one can be left out.
            let _ = tell(share);
        }));
    }
    Ok(Some(rows))
}
