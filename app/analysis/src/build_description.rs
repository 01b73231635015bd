//! What this program was built from and for, as `--version --verbose` and a bundle for support tell it.

use palpate_protocols::engine::ENGINE_VERSION;
use palpate_sessions::RECORD_VERSION;
use serde::Serialize;
use std::fmt;

/// What a program was built from and for.
#[derive(Clone, Debug, Serialize)]
pub struct BuildDescription {
    pub version: &'static str,
    /// State of the source, from PALPATE_COMMIT in the environment of the build.
    pub commit: Option<&'static str>,
    pub engine_version: u32,
    pub record_version: u32,
    pub target: String,
    /// Optional parts of this build.
    pub features: Vec<&'static str>,
    pub is_release: bool,
}

impl BuildDescription {
    #[must_use]
    pub fn of(features: Vec<&'static str>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("PALPATE_COMMIT"),
            engine_version: ENGINE_VERSION,
            record_version: RECORD_VERSION,
            target: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
            features,
            is_release: !cfg!(debug_assertions),
        }
    }
}

impl fmt::Display for BuildDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let features = match self.features.is_empty() {
            true => "none".to_owned(),
            false => self.features.join(", "),
        };
        writeln!(f, "palpate {}", self.version)?;
        writeln!(f, "commit {}", self.commit.unwrap_or("not stated"))?;
        writeln!(f, "engine {}", self.engine_version)?;
        writeln!(f, "record {}", self.record_version)?;
        writeln!(f, "target {}", self.target)?;
        writeln!(f, "features {features}")?;
        write!(f, "built for {}", if self.is_release { "release" } else { "debugging" })
    }
}
