//! Everything a user can ask for, one enum. Drawing code pushes; only the app acts.

/// One thing the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Start the plan in the form.
    Start,
    /// Stop motion, now.
    Stop,
    /// After a stop: leave the tissue.
    Retract,
    /// After a stop: end the session where the probe stands.
    CloseSession,
    /// List the serial ports again.
    ListPorts,
    /// Choose the folder for new sessions in a dialog of its own.
    ChooseFolder,
    /// Change between the light and the dark theme.
    SwitchTheme,
}

/// What was asked for since the app last acted.
#[derive(Debug, Default)]
pub struct Commands(Vec<Command>);

impl Commands {
    /// Asks for something.
    pub fn push(&mut self, command: Command) {
        self.0.push(command);
    }

    /// Everything asked for, a stop before all else; leaves nothing behind.
    pub fn take(&mut self) -> Vec<Command> {
        let mut commands = std::mem::take(&mut self.0);
        commands.sort_by_key(|command| *command != Command::Stop);
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_overtakes_what_was_asked_before() {
        let mut commands = Commands::default();
        for command in [Command::Start, Command::ListPorts, Command::Stop] {
            commands.push(command);
        }
        assert_eq!(
            commands.take(),
            [Command::Stop, Command::Start, Command::ListPorts]
        );
        assert!(commands.take().is_empty());
    }
}
