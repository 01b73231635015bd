//! Keys that work whatever has the focus. Read before any widget, so no widget can eat them.

use super::run_strip::RunControl;
use super::top_bar::push_stop_buttons;
use crate::command::{Commands, UiCommand};
use crate::screens::table::screens;
use eframe::egui::{Context, Event, Key};

/// The keys and their commands. Escape stops too: a startled hand finds it.
pub const KEYS: [(Key, UiCommand); 13] = [
    (Key::F1, UiCommand::Palette),
    (Key::F12, UiCommand::Stop),
    (Key::Escape, UiCommand::Stop),
    (Key::F11, UiCommand::Halt),
    (Key::F2, UiCommand::RunControl(RunControl::Confirm)),
    (Key::F3, UiCommand::NoteTyped),
    (Key::F4, UiCommand::RunControl(RunControl::PauseAfter)),
    (Key::F5, UiCommand::Start),
    (Key::F6, UiCommand::Work),
    (Key::F7, UiCommand::RunControl(RunControl::Pause)),
    (Key::F8, UiCommand::Retract),
    (Key::F9, UiCommand::RunControl(RunControl::Resume)),
    (Key::F10, UiCommand::RunControl(RunControl::Finish)),
];

/// Reads the keys once per frame, those that stop before all others.
#[derive(Debug, Default)]
pub struct KeyReader {
    frame_read: Option<u64>,
    /// The frame whose events were looked at before it began, and how many of them.
    looked_at: Option<(u64, usize)>,
    frame_stopped: Option<u64>,
}

impl KeyReader {
    /// Pushes the stops among the events of a frame that is about to begin, as early as possible.
    pub fn read_early(&mut self, ctx: &Context, events: &[Event], commands: &mut Commands) {
        let frame = ctx.cumulative_frame_nr();
        // Events that wait while the window is hidden come again, before those that are new.
        let known = match self.looked_at {
            Some((of, count)) if of == frame => count.min(events.len()),
            _ => 0,
        };
        self.looked_at = Some((frame, events.len()));
        // Repeats are not marked yet: a key that is held went down before.
        let is_new = |event: &&Event| match event {
            Event::Key { key, .. } => !ctx.input(|input| input.key_down(*key)),
            _ => false,
        };
        let new: Vec<Event> = events[known..].iter().filter(is_new).cloned().collect();
        push_keys(&new, true, commands);
    }

    /// Pushes the stops of this frame, before anything is drawn: keys that [`Self::read_early`] has not read, and the
    /// buttons of the top bar.
    pub fn read_stops(&mut self, ctx: &Context, commands: &mut Commands) {
        // A frame may have several passes, and while the window is hidden its input is that of the last frame
        // shown: pressing once must not act again and again.
        let frame = ctx.cumulative_frame_nr();
        if self.frame_stopped.replace(frame) == Some(frame) {
            return;
        }
        if self.looked_at.is_none_or(|(of, _)| of != frame) {
            ctx.input(|input| push_keys(&input.events, true, commands));
        }
        push_stop_buttons(ctx, commands);
    }

    /// Pushes the commands of other keys; true if this frame is read for the first time. Those that take what is typed
    /// are to be done after the frame's letters have reached their fields.
    pub fn read(
        &mut self,
        ctx: &Context,
        commands: &mut Commands,
        after_letters: &mut Commands,
    ) -> bool {
        let frame = ctx.cumulative_frame_nr();
        if self.frame_read.replace(frame) == Some(frame) {
            return false;
        }
        ctx.input(|input| {
            let mut pressed = Commands::default();
            push_keys(&input.events, false, &mut pressed);
            for (key, command) in [(Key::K, UiCommand::Palette), (Key::Enter, UiCommand::AcceptRun)]
            {
                if is_pressed(&input.events, key, true) {
                    pressed.push(command);
                }
            }
            for command in pressed.take() {
                let to = if takes_what_is_typed(&command) {
                    &mut *after_letters
                } else {
                    &mut *commands
                };
                to.push(command);
            }
            for screen in screens() {
                if screen.key.is_some_and(|key| is_pressed(&input.events, key, true)) {
                    commands.push(UiCommand::Show(screen.name));
                }
            }
        });
        true
    }
}

/// Whether a command reads the fields of the window.
const fn takes_what_is_typed(command: &UiCommand) -> bool {
    use UiCommand::{AcceptRun, NoteTyped, Start, Work};
    matches!(command, NoteTyped | Start | Work | AcceptRun)
}

/// Pushes the commands of [`KEYS`] among events: the stops, or the others.
fn push_keys(events: &[Event], are_stops: bool, commands: &mut Commands) {
    for (key, command) in KEYS {
        if command.is_stop() == are_stops && is_pressed(events, key, false) {
            commands.push(command);
        }
    }
}

/// Whether a key went down, not counting the repeats of a key held; with Ctrl where that is asked for. The
/// modifiers are the event's own: those of the frame may have been let go already.
fn is_pressed(events: &[Event], wanted: Key, with_command: bool) -> bool {
    events.iter().any(|event| {
        matches!(event, Event::Key { key, pressed: true, repeat: false, modifiers, .. }
            if *key == wanted && (modifiers.command || !with_command))
    })
}
