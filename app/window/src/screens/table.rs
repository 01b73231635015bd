//! Every screen, in the order of a day's work: a new one is a line here and its `mod` line.

use super::screen::ScreenEntry;

/// How many of the screens are a technician's, for a day at the rig; the others are a researcher's.
pub const TECHNICIAN_SCREENS: usize = 5;

/// The screens as they stand on the rail.
pub const SCREENS: &[ScreenEntry] = &[
    super::today::SCREEN,
    super::run::SCREEN,
    super::rig::SCREEN,
    super::calibration::SCREEN,
    super::checks::SCREEN,
    super::library::SCREEN,
    super::review::SCREEN,
    super::models::SCREEN,
    super::trade::SCREEN,
    super::extremes::SCREEN,
    super::haptics::SCREEN,
    super::scene::SCREEN,
    super::start_page::SCREEN,
];
