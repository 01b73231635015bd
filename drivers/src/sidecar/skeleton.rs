//! A working sidecar to begin with, in some languages: a folder with its program, its rig file and what to do next.

use super::description::is_name;
use std::fmt;

/// The name in the skeletons, which the new one replaces.
const PLACEHOLDER: &str = "my-sidecar";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkeletonLanguage {
    Python,
    Arduino,
    Rust,
}

impl SkeletonLanguage {
    pub const ALL: [Self; 3] = [Self::Python, Self::Arduino, Self::Rust];

    /// Its word on a command line.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Python => "python",
            Self::Arduino => "arduino",
            Self::Rust => "rust",
        }
    }
}

impl fmt::Display for SkeletonLanguage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A file of a skeleton.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkeletonFile {
    /// Within the folder; parts are separated by slashes.
    pub path: String,
    pub text: String,
}

/// Whether a sidecar, its folder and its files can be called so.
#[must_use]
pub fn is_skeleton_name(name: &str) -> bool {
    is_name(name) && name.starts_with(|c: char| c.is_ascii_alphabetic()) && !name.contains('.')
}

/// The files of a sidecar of this name.
#[must_use]
pub fn skeleton(name: &str, language: SkeletonLanguage) -> Vec<SkeletonFile> {
    let module = name.replace('-', "_").to_lowercase();
    let own = |text: &str| text.replace(PLACEHOLDER, name);
    let file = |path: String, text: String| SkeletonFile { path, text };
    let (place, program, mut files) = match language {
        SkeletonLanguage::Python => (
            format!("program = [\"python3\", \"{module}.py\"]"),
            format!("{module}.py"),
            vec![
                file(format!("{module}.py"), own(include_str!("../../sidecar/python/skeleton.py"))),
                file(
                    "palpate_sidecar.py".into(),
                    include_str!("../../sidecar/python/palpate_sidecar.py").into(),
                ),
            ],
        ),
        SkeletonLanguage::Arduino => (
            "port = \"/dev/ttyUSB0\"\nbaud = 115200".into(),
            format!("{name}.ino"),
            vec![file(
                format!("{name}.ino"),
                own(include_str!("../../sidecar/arduino/skeleton.ino")),
            )],
        ),
        SkeletonLanguage::Rust => (
            format!("program = [\"./target/release/{name}\"]"),
            "src/main.rs".into(),
            vec![
                file("src/main.rs".into(), own(include_str!("../../sidecar/rust/skeleton.rs"))),
                file("Cargo.toml".into(), manifest(name)),
            ],
        ),
    };
    files.push(file(format!("{name}.toml"), rig_file(name, &place)));
    let first_run = include_str!("../../sidecar/first-run.toml");
    files.push(file("first-run.toml".into(), first_run.into()));
    files.push(file("README.md".into(), readme(name, &program, language)));
    files
}

fn manifest(name: &str) -> String {
    format!(
        "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\nserde_json = \"1\"\n\n# A package of its own, also within another.\n[workspace]\n"
    )
}

fn rig_file(name: &str, place: &str) -> String {
    format!(
        "# The rig {name}. The sidecar reports its travel, its acceleration and its load cell by itself.\n\
         device = \"sidecar\"\n{place}\n\
         # Largest speed; `palpate rig conform {name}.toml --move 4` measures what the rig may be trusted with.\n\
         speed_max_mm_s = 1\n\
         # How far the probe may go while no sample comes, 0.02 to 0.5: shorter pauses of this computer end no run.\n\
         unseen_mm = 0.1\n"
    )
}

fn readme(name: &str, program: &str, language: SkeletonLanguage) -> String {
    let first = match language {
        SkeletonLanguage::Python => "Nothing is to be installed beside Python 3.9.",
        SkeletonLanguage::Arduino => {
            "Open the sketch in the Arduino IDE, choose the board, and upload it. Correct `port` in the rig file:\n`palpate rig detect --ask` lists the ports."
        }
        SkeletonLanguage::Rust => "Build it with `cargo build --release`.",
    };
    format!(
        "# {name}\n\nA sidecar for palpate: `{program}` speaks the sidecar protocol, `{name}.toml` is its rig file.\n\
         As it is, stage and load cell are simulated. Replace the lines marked `REPLACE`.\n\n{first}\n\n\
         ```\npalpate rig check {name}.toml\npalpate rig monitor {name}.toml\npalpate rig conform {name}.toml --move 4\n```\n\n\
         `conform` moves the axis by up to 4 mm from where it stands and prints what the rig may be trusted with. Write that\n\
         speed into the rig file. `first-run.toml` is a protocol for the first run,\nwith slow motions. A rig needs an emergency stop of its own: palpate's stop keys are software.\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig_file::RigFile;

    #[test]
    fn every_skeleton_has_a_rig_file_that_is_read_and_no_placeholder() {
        for language in SkeletonLanguage::ALL {
            let files = skeleton("Stage-2", language);
            assert!(files.iter().all(|file| !file.text.contains(PLACEHOLDER)), "{language}");
            let rig = files.iter().find(|file| file.path == "Stage-2.toml").unwrap();
            RigFile::parse(&rig.path, &rig.text).unwrap();
            assert!(files.iter().any(|file| file.path == "README.md"));
        }
        for name in ["", "-a", "7up", "a b", "a.b", "../a"] {
            assert!(!is_skeleton_name(name), "{name}");
        }
    }

    #[test]
    fn the_python_skeleton_is_as_short_as_it_claims() {
        let lines = |text: &str| text.lines().count();
        assert!(lines(include_str!("../../sidecar/python/skeleton.py")) < 60);
        assert!(lines(include_str!("../../sidecar/python/palpate_sidecar.py")) < 300);
    }
}
