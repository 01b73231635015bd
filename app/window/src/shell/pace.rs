//! How often the window is drawn: as often as an eye needs, and rarely while no key or pointer is used.

use crate::scene::detail::frame_ms;
use eframe::egui::Context;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Between two frames while something moves: 30 a second is what an eye needs on a chart.
const MOVING: Duration = Duration::from_millis(33);
/// Between two frames at rest: live values must not look frozen.
const RESTING: Duration = Duration::from_millis(250);
/// The same with no key or pointer used for [`UNUSED_S`]: what goes wrong by itself is still seen soon.
const UNUSED: Duration = Duration::from_millis(1500);
/// Frames begin at least so many times as long apart as the last one took: a key that stops the rig is read at once between
/// frames and otherwise at the end of one, so a slow renderer may have a third of the time.
const FRAMES_APART: f64 = 3.0;
/// The longest of that: however slow a renderer is, a chart that moves is seen to move.
const MOVING_SLOWLY: Duration = Duration::from_millis(200);
/// Seconds after the last key or move of the pointer until the window counts as unused.
const UNUSED_S: f64 = 5.0;

/// How often the window is drawn.
#[derive(Debug, Default)]
pub struct FramePace {
    used_at: f64,
    is_unused: Arc<AtomicBool>,
    /// Whether another thread has asked since the last frame: each time wakes the window's thread.
    is_asked: Arc<AtomicBool>,
    /// How long after the last frame the next one was wanted, while something moves.
    moving: Option<Duration>,
}

impl FramePace {
    /// Requests the next frame; `frame_s` is how long the last one took to make and paint, in s.
    pub fn next(&mut self, ctx: &Context, frame_s: Option<f32>, is_moving: bool, is_watched: bool) {
        let (now, is_used) = ctx.input(|input| (input.time, !input.events.is_empty()));
        if is_used || is_moving || is_watched {
            self.used_at = now;
        }
        let is_unused = now > self.used_at + UNUSED_S;
        self.is_unused.store(is_unused, Ordering::Relaxed);
        self.is_asked.store(false, Ordering::Relaxed);
        self.moving = is_moving.then(|| moving(frame_s));
        ctx.request_repaint_after(self.moving.unwrap_or(resting(is_unused)));
    }

    /// What the last frame took in ms, where this one follows it because something moves. `frame_s` is the work of this
    /// thread for it, in s.
    pub fn frame_ms(&self, ctx: &Context, frame_s: Option<f32>) -> Option<f64> {
        let apart_s = f64::from(ctx.input(|input| input.unstable_dt));
        let [wanted_s, work_s] = [self.moving?.as_secs_f64(), f64::from(frame_s?)];
        Some(frame_ms(1e3 * apart_s, 1e3 * wanted_s, 1e3 * work_s))
    }

    /// Requests a frame from another thread.
    pub fn waker(&self, ctx: &Context) -> impl Fn() + Send + 'static {
        let (is_unused, is_asked) = (Arc::clone(&self.is_unused), Arc::clone(&self.is_asked));
        let ctx = ctx.clone();
        move || {
            if !is_asked.swap(true, Ordering::Relaxed) {
                ctx.request_repaint_after(resting(is_unused.load(Ordering::Relaxed)));
            }
        }
    }
}

fn moving(frame_s: Option<f32>) -> Duration {
    let apart_s = FRAMES_APART * f64::from(frame_s.unwrap_or(0.0));
    Duration::try_from_secs_f64(apart_s).unwrap_or(MOVING).clamp(MOVING, MOVING_SLOWLY)
}

const fn resting(is_unused: bool) -> Duration {
    if is_unused { UNUSED } else { RESTING }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Event, Key, Modifiers, RawInput, ViewportId};

    /// When the next frame is asked for after one at a time with these events.
    fn next(
        pace: &mut FramePace,
        ctx: &Context,
        time: f64,
        events: Vec<Event>,
        ways: [bool; 2],
    ) -> Duration {
        let input = RawInput { time: Some(time), events, ..RawInput::default() };
        let [is_moving, is_watched] = ways;
        let mut output = ctx.run_ui(input, |ui| pace.next(ui.ctx(), None, is_moving, is_watched));
        output.textures_delta.clear();
        output.viewport_output[&ViewportId::ROOT].repaint_delay
    }

    #[test]
    fn an_unused_window_is_drawn_seldom_and_a_used_one_at_once_more_often() {
        let (ctx, mut pace) = (Context::default(), FramePace::default());
        // The first frames of egui ask for more themselves.
        for step in 0..4 {
            next(&mut pace, &ctx, 0.1 * f64::from(step), Vec::new(), [false; 2]);
        }
        assert!(next(&mut pace, &ctx, 1.0, Vec::new(), [false; 2]) <= RESTING);
        let unused = next(&mut pace, &ctx, 10.0, Vec::new(), [false; 2]);
        assert!(unused > RESTING && unused <= UNUSED, "{unused:?}");
        assert!(next(&mut pace, &ctx, 20.0, Vec::new(), [false, true]) <= RESTING);
        assert_eq!(pace.frame_ms(&ctx, Some(0.005)), None, "at rest frames follow from nothing");
        assert!(next(&mut pace, &ctx, 30.0, Vec::new(), [true, false]) <= MOVING);
        assert!(
            pace.frame_ms(&ctx, Some(0.005)).is_some_and(|took| took > 9e3),
            "ten seconds late"
        );
        let key = Event::Key {
            key: Key::F12,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        next(&mut pace, &ctx, 40.0, Vec::new(), [false; 2]);
        assert!(next(&mut pace, &ctx, 41.0, vec![key], [false; 2]) <= RESTING);
        assert!(next(&mut pace, &ctx, 45.0, Vec::new(), [false; 2]) <= RESTING);
    }

    #[test]
    fn slow_renderer_leaves_two_thirds_of_the_time_to_keys() {
        assert_eq!(moving(None), MOVING);
        assert_eq!(moving(Some(0.005)), MOVING);
        assert_eq!(moving(Some(0.025)).as_millis(), 75);
        assert_eq!(moving(Some(4.0)), MOVING_SLOWLY);
        assert_eq!(moving(Some(f32::NAN)), MOVING);
    }
}
