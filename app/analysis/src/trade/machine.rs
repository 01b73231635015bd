//! The machine at hand.

use chrono::{DateTime, Utc};
use palpate_rheology::trade::{Machine, TradeCurves};
use palpate_runner::wall_now;

/// Version of this program.
#[must_use]
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// What is known of the machine this program runs on.
#[must_use]
pub fn this_machine() -> Machine {
    let described = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    Machine {
        cpu: cpu_name(&described).unwrap_or(std::env::consts::ARCH).into(),
        os: std::env::consts::OS.into(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        profile: if cfg!(debug_assertions) { "debug".into() } else { "release".into() },
    }
}

/// The processor's name as Linux tells it; elsewhere there is no such text.
fn cpu_name(described: &str) -> Option<&str> {
    let line = described.lines().find(|line| line.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then_some(name)
}

/// Days since curves were measured; endless if their date cannot be read.
#[must_use]
pub fn age_days(curves: &TradeCurves) -> f64 {
    let now: DateTime<Utc> = wall_now().into();
    DateTime::parse_from_rfc3339(&curves.measured_at).map_or(f64::INFINITY, |then| {
        (now - then.with_timezone(&Utc)).num_seconds() as f64 / 86_400.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_processor_is_found_where_there_is_one() {
        let text = "processor\t: 0\nmodel name\t: Example(R) CPU\nflags\t: fpu\n";
        assert_eq!(cpu_name(text), Some("Example(R) CPU"));
        assert_eq!(cpu_name("processor\t: 0\n"), None);
        assert_eq!(cpu_name(""), None);
        assert!(this_machine().cores >= 1);
    }
}
