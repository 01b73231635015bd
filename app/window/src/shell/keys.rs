//! Keys that work whatever has the focus. Read before any widget, so no widget can eat them.

use super::rail::Screen;
use super::run_strip::Wish;
use crate::command::{Command, Commands};
use eframe::egui::{Context, InputState, Key};

/// The keys and what they ask for. Escape stops too: it is what a startled hand finds.
pub const KEYS: [(Key, Command); 13] = [
    (Key::F1, Command::Palette),
    (Key::F12, Command::Stop),
    (Key::Escape, Command::Stop),
    (Key::F11, Command::Halt),
    (Key::F2, Command::Wish(Wish::Confirm)),
    (Key::F3, Command::NoteTyped),
    (Key::F4, Command::Wish(Wish::PauseAfter)),
    (Key::F5, Command::Start),
    (Key::F6, Command::Work),
    (Key::F7, Command::Wish(Wish::Pause)),
    (Key::F8, Command::Retract),
    (Key::F9, Command::Wish(Wish::Resume)),
    (Key::F10, Command::Wish(Wish::Finish)),
];

/// Reads the keys once per frame.
#[derive(Debug, Default)]
pub struct Keys {
    frame_read: Option<u64>,
}

impl Keys {
    /// Asks for what was pressed since the last frame.
    pub fn read(&mut self, ctx: &Context, commands: &mut Commands) {
        // While the window is hidden the input is that of the last frame shown; pressing once
        // must not act again and again.
        let frame = ctx.cumulative_frame_nr();
        if self.frame_read.replace(frame) == Some(frame) {
            return;
        }
        ctx.input(|input| {
            for (key, command) in KEYS {
                if is_pressed(input, key, false) {
                    commands.push(command);
                }
            }
            if is_pressed(input, Key::K, true) {
                commands.push(Command::Palette);
            }
            for screen in Screen::ALL {
                if is_pressed(input, screen.key(), true) {
                    commands.push(Command::Show(screen));
                }
            }
        });
    }
}

/// Whether a key went down, not counting the repeats of a key held; with Ctrl where that is asked for. The
/// modifiers are the event's own: those of the frame may have been let go already.
fn is_pressed(input: &InputState, wanted: Key, with_command: bool) -> bool {
    use eframe::egui::Event;
    input.events.iter().any(|event| {
        matches!(event, Event::Key { key, pressed: true, repeat: false, modifiers, .. }
            if *key == wanted && (modifiers.command || !with_command))
    })
}
