//! What the fits of a lake stored of the sessions of a study.

use super::curves::Workers;
use super::{PopulationError, PopulationRequest};
use crate::fit::{StoredFitError, StoredFits};
use crate::study_table::StudyTable;
use palpate_rheology::fit::LogarithmStatistics;
use palpate_tables::lake::is_lake;

/// The statistics of every row of the table, or why it has none.
pub(super) fn read_stored(
    request: &PopulationRequest<'_>,
    table: &StudyTable,
    workers: &Workers<'_>,
) -> Result<Vec<Result<LogarithmStatistics, String>>, PopulationError> {
    let lake = match request.paths {
        [lake] if is_lake(lake) => lake,
        _ => return Err(StoredFitError::NoLake.into()),
    };
    let fits = StoredFits::of(lake, request.recipe)?;
    let found = workers.all("fits", &table.rows, |row| fits.statistics(&row.session))?;
    let found = found.into_iter().map(|one| {
        let one = one?;
        Ok(one.ok_or_else(|| "the lake has no fit of it; fit the lake to see why".to_owned()))
    });
    found.collect()
}
