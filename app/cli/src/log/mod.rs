//! The program's own log, for support: transitions of runs, links and workers in `log/` beside the library's sessions.
//!
//! A caller hands over a line and goes on; a thread writes it. No decision depends on the log.

mod panic;
mod queue;

use palpate_sessions::library_folder;
use palpate_sessions::program_log::log_folder;
pub(super) use panic::stop_rigs_on_panic;
pub(super) use queue::Queue;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;

/// The filter without `RUST_LOG`: information of palpate, warnings of libraries.
fn usual() -> Targets {
    Targets::new().with_default(LevelFilter::WARN).with_target("palpate", LevelFilter::INFO)
}

/// Starts the log; `is_verbose` shows every line on standard error as well. Errors here never stop the program.
pub(super) fn begin(is_verbose: bool) -> Option<Queue> {
    let folder = library_folder().map(|library| log_folder(&library)).ok();
    let queue = Queue::start(folder, head(), is_verbose)?;
    let wanted = std::env::var("RUST_LOG").unwrap_or_default();
    let filter = match wanted.parse::<Targets>() {
        Ok(filter) if !wanted.trim().is_empty() => filter,
        Ok(_) => usual(),
        Err(err) => {
            queue.line(format!("RUST_LOG is ignored, because its filter is invalid ({err})\n"));
            usual()
        }
    };
    let lines = queue.clone();
    let layer = tracing_subscriber::fmt::layer()
        .with_ansi(false)
        .with_thread_names(true)
        .with_writer(move || lines.clone());
    let subscriber = tracing_subscriber::registry().with(filter).with(layer);
    // A second one in a process would be a test's; the first stays.
    let _ = tracing::subscriber::set_global_default(subscriber);
    Some(queue)
}

/// The first line of a file, and of a program's lines in one.
fn head() -> String {
    format!(
        "palpate {}, process {}, {} {}\n",
        env!("CARGO_PKG_VERSION"),
        std::process::id(),
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}

#[cfg(test)]
mod tests;
