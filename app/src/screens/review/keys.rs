//! Keys of the review screen, read while nobody types and no control has the focus.

use super::{ReviewScreen, View};
use crate::plots::navigate::{PAN_STEP, ZOOM_STEP};
use eframe::egui::{Context, Key};

/// Cursor A at the left third and B at the right one, where no pointer says where.
const CURSOR_SHARES: [f64; 2] = [1.0 / 3.0, 2.0 / 3.0];
/// Share of what is shown by which a key moves a cursor.
const CURSOR_STEP: f64 = 1.0 / 400.0;

/// What can be asked of the plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// See less, larger.
    ZoomIn,
    /// See more.
    ZoomOut,
    /// Earlier.
    Back,
    /// Later.
    On,
    /// Everything.
    All,
    /// Set a cursor, A or B.
    Cursor(usize),
    /// Take both away.
    NoCursors,
}

impl ReviewScreen {
    /// Does what a button or a key asks for.
    pub(super) fn go(&mut self, to: Move) {
        let spans = match self.view {
            View::OverDepth => vec![&mut self.depth, &mut self.force],
            _ => vec![&mut self.time],
        };
        match to {
            Move::ZoomIn | Move::ZoomOut => {
                let factor = match to {
                    Move::ZoomIn => ZOOM_STEP,
                    _ => 1.0 / ZOOM_STEP,
                };
                for span in spans {
                    span.zoom(factor, span.at(0.5));
                }
            }
            Move::Back | Move::On => {
                let share = if to == Move::On { PAN_STEP } else { -PAN_STEP };
                spans.into_iter().take(1).for_each(|span| span.pan(share));
            }
            Move::All => spans.into_iter().for_each(|span| span.show_all()),
            Move::Cursor(number) => {
                self.cursors[number] = Some(self.time.at(CURSOR_SHARES[number]));
            }
            Move::NoCursors => self.cursors = [None; 2],
        }
    }

    /// Reads the keys.
    pub(super) fn read_keys(&mut self, ctx: &Context) {
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let (mut moves, mut steps) = (Vec::new(), Vec::new());
        ctx.input(|input| {
            let (is_a, is_b) = (input.modifiers.alt, input.modifiers.shift);
            // Ctrl with a sign makes the text larger.
            if input.modifiers.command {
                return;
            }
            for (key, way) in [(Key::ArrowLeft, -1.0), (Key::ArrowRight, 1.0)] {
                if !input.key_pressed(key) {
                    continue;
                }
                match (is_a, is_b) {
                    (true, _) => steps.push((0, way)),
                    (_, true) => steps.push((1, way)),
                    _ if way < 0.0 => moves.push(Move::Back),
                    _ => moves.push(Move::On),
                }
            }
            for (keys, to) in [
                (&[Key::Plus, Key::Equals][..], Move::ZoomIn),
                (&[Key::Minus], Move::ZoomOut),
                (&[Key::Home], Move::All),
                (&[Key::A], Move::Cursor(0)),
                (&[Key::B], Move::Cursor(1)),
                (&[Key::Delete], Move::NoCursors),
            ] {
                if keys.iter().any(|key| input.key_pressed(*key)) {
                    moves.push(to);
                }
            }
        });
        moves.into_iter().for_each(|to| self.go(to));
        let [low, high] = self.time.shown();
        for (number, way) in steps {
            let from = self.cursors[number].unwrap_or(self.time.at(CURSOR_SHARES[number]));
            self.cursors[number] = Some(from + way * CURSOR_STEP * (high - low));
        }
    }
}
