//! What a frame took, and the level of detail that follows.

use palpate_tissue_view::{AdapterAbilities, DetailLevel, LEVELS, LevelChooser};

/// A frame that is later than this is late because the one before took so long: half a frame of a display at 60 Hz,
/// more than timers of systems miss by. In ms.
const LATE_MS: f64 = 8.0;

/// The time of a frame in ms. `apart_ms` has passed since the frame before, and `wanted_ms` was to pass.
///
/// The graphics processor works on while the window's thread waits, so `work_ms` of that thread is not all of it. A late
/// frame took all the time there was; of one that came when it was wanted the thread's work is all that is known.
#[must_use]
pub fn frame_ms(apart_ms: f64, wanted_ms: f64, work_ms: f64) -> f64 {
    if apart_ms > wanted_ms + LATE_MS { apart_ms } else { work_ms }
}

/// The level of detail of the picture.
#[derive(Clone, Debug, Default)]
pub struct PictureDetail {
    /// Once the adapter is known.
    chooser: Option<LevelChooser>,
}

impl PictureDetail {
    /// The level of the next picture. `frame_ms` is the time of the last frame, where frames follow each other; without
    /// it nothing changes. With full detail the time counts for nothing.
    pub fn next(
        &mut self,
        abilities: AdapterAbilities,
        frame_ms: Option<f64>,
        is_full: bool,
    ) -> DetailLevel {
        let first = abilities.first_level;
        let chooser = self.chooser.get_or_insert_with(|| LevelChooser::starting_at(first));
        if is_full {
            return abilities.possible(LEVELS[0]);
        }
        if let Some(frame_ms) = frame_ms {
            chooser.record(frame_ms);
        }
        abilities.possible(chooser.level())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_frame_took_all_the_time_and_one_in_time_what_its_thread_worked() {
        for (apart, wanted, work, took) in [
            (33.0, 33.0, 5.0, 5.0),
            (38.0, 33.0, 5.0, 5.0),
            (300.0, 33.0, 5.0, 300.0),
            (180.0, 180.0, 60.0, 60.0),
            (4.0, 33.0, 5.0, 5.0),
        ] {
            assert_eq!(frame_ms(apart, wanted, work), took, "{apart} {wanted} {work}");
        }
    }

    #[test]
    fn only_frames_that_follow_each_other_change_the_level() {
        let mut abilities = AdapterAbilities::least();
        abilities.first_level = 1;
        let mut detail = PictureDetail::default();
        let one_sample = |level: usize| DetailLevel { samples: 1, ..LEVELS[level] };
        for _ in 0..50 {
            assert_eq!(detail.next(abilities, None, false), one_sample(1));
        }
        for _ in 0..50 {
            assert_eq!(detail.next(abilities, Some(400.0), true), one_sample(0));
        }
        assert_eq!(detail.next(abilities, None, false), one_sample(1), "full detail is no measure");
        for _ in 0..50 {
            detail.next(abilities, Some(400.0), false);
        }
        assert_eq!(detail.next(abilities, None, false), one_sample(LEVELS.len() - 1));
    }
}
