//! Files that are dropped on the window, passed to the screen that they are for.

use crate::command::{Commands, UiCommand};
use crate::screens::{models, run, scene};
use crate::workers::PathPurpose;
use palpate_analysis::haptics_tape::is_tape;
use palpate_sessions::ticks::TICKS_FILE;
use std::path::{Path, PathBuf};

/// Pushes a command for each dropped file or folder; `shown` is the screen in front.
pub fn push_dropped(paths: Vec<PathBuf>, shown: &str, commands: &mut Commands) {
    let (protocols, others): (Vec<_>, Vec<_>) =
        paths.into_iter().partition(|path| ends(path, "toml"));
    let (tables, folders): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|path| path.is_file() && !ends(path, "mcap"));
    let (recordings, sessions): (Vec<_>, Vec<_>) =
        folders.into_iter().partition(|path| path.join(TICKS_FILE).is_file());
    match protocols.into_iter().next() {
        Some(path) if shown == scene::SCREEN.name => {
            commands.push(UiCommand::Chosen(PathPurpose::Scene, path));
        }
        Some(path) => {
            commands.push(UiCommand::Show(run::SCREEN.name));
            commands.push(UiCommand::Chosen(PathPurpose::Protocol, path));
        }
        None => {}
    }
    if shown == models::SCREEN.name {
        let chosen = tables.into_iter();
        chosen.for_each(|path| commands.push(UiCommand::Chosen(PathPurpose::Table, path)));
    } else if !tables.is_empty() {
        commands.push(UiCommand::Import(tables));
    }
    if let Some(folder) = recordings.into_iter().next() {
        // A recording of neither loop is refused with a reason on the screen of scenes.
        commands.push(match is_tape(&folder).unwrap_or(false) {
            true => UiCommand::ReplayLoop(folder),
            false => UiCommand::ReplayScene(folder),
        });
    }
    if !sessions.is_empty() {
        commands.push(UiCommand::Review(sessions.into_iter().map(session_of).collect()));
    }
}

fn ends(path: &Path, wanted: &str) -> bool {
    let ending = path.extension().and_then(|one| one.to_str());
    ending.is_some_and(|one| one.eq_ignore_ascii_case(wanted))
}

/// A log that was dropped stands for its session.
fn session_of(path: PathBuf) -> PathBuf {
    match (path.is_file(), path.parent()) {
        (true, Some(folder)) => folder.to_owned(),
        _ => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dropped(paths: &[&Path], shown: &str) -> Vec<UiCommand> {
        let mut commands = Commands::default();
        let paths = paths.iter().map(|path| path.to_path_buf()).collect();
        push_dropped(paths, shown, &mut commands);
        commands.take()
    }

    #[test]
    fn each_kind_goes_to_its_screen_and_some_to_the_one_that_is_shown() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let [protocol, table, session] = [at("own.TOML"), at("table.csv"), at("session")];
        std::fs::write(&protocol, "").unwrap();
        std::fs::write(&table, "").unwrap();
        std::fs::create_dir(&session).unwrap();
        let log = session.join("log.mcap");
        std::fs::write(&log, "").unwrap();
        let all: [&Path; 3] = [&protocol, &table, &log];
        let review = UiCommand::Review(vec![session.clone()]);
        assert_eq!(
            dropped(&all, "Rig"),
            [
                UiCommand::Show("Run"),
                UiCommand::Chosen(PathPurpose::Protocol, protocol.clone()),
                UiCommand::Import(vec![table.clone()]),
                review.clone(),
            ]
        );
        assert_eq!(
            dropped(&all, "Models")[2..],
            [UiCommand::Chosen(PathPurpose::Table, table), review]
        );
        assert_eq!(
            dropped(&[&protocol], "Scene"),
            [UiCommand::Chosen(PathPurpose::Scene, protocol)]
        );
        // Ticks of no known loop are refused on the screen of scenes.
        let ticks = at("ticks");
        std::fs::create_dir(&ticks).unwrap();
        std::fs::write(ticks.join(TICKS_FILE), "").unwrap();
        assert_eq!(dropped(&[&ticks], "Run"), [UiCommand::ReplayScene(ticks)]);
    }
}
