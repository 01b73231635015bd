//! Every screen, in the order of a day's work: a new one is a line here and its `mod` line.

use super::screen::ScreenEntry;

/// A part of the rail.
pub struct ScreenGroup {
    pub name: &'static str,
    pub screens: &'static [ScreenEntry],
}

/// The screens as they stand on the rail: what a day of measuring needs, what prepares it, what is done with the data.
pub const GROUPS: [ScreenGroup; 3] = [
    ScreenGroup {
        name: "Measure",
        screens: &[super::today::SCREEN, super::run::SCREEN, super::result::SCREEN],
    },
    ScreenGroup {
        name: "Prepare",
        screens: &[super::rig::SCREEN, super::calibration::SCREEN, super::checks::SCREEN],
    },
    ScreenGroup {
        name: "Research",
        screens: &[
            super::library::SCREEN,
            super::review::SCREEN,
            super::models::SCREEN,
            super::material::SCREEN,
            super::groups::SCREEN,
            super::trade::SCREEN,
            super::extremes::SCREEN,
            super::haptics::SCREEN,
            super::scene::SCREEN,
        ],
    },
];

/// All screens, those on the rail first.
pub fn screens() -> impl Iterator<Item = &'static ScreenEntry> {
    const START_PAGE: &ScreenEntry = &super::start_page::SCREEN;
    GROUPS.iter().flat_map(|group| group.screens).chain([START_PAGE])
}
