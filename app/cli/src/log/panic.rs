//! A panic stops every open rig before it is logged or printed.

use super::Queue;
use palpate_drivers::wire::run_after_link_stop;
use palpate_model::panics::is_panic_caught;
use palpate_runner::panic_stop::halt_open_rigs;
use std::backtrace::Backtrace;
use std::panic::{set_hook, take_hook};

/// From now on a panic of any thread, unless it is contained, first stops the rigs, then is logged with where it
/// happened, then is printed as before.
pub fn stop_rigs_on_panic(log: Option<Queue>) {
    let before = take_hook();
    set_hook(Box::new(move |panic| {
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name").to_owned();
        if is_panic_caught() {
            tracing::warn!("contained: thread {name} {panic}");
            return;
        }
        halt_open_rigs();
        let trace = Backtrace::force_capture();
        let report = format!("thread {name} {panic}\n{trace}");
        let log = log.clone();
        run_after_link_stop(move || {
            tracing::error!("{report}");
            if let Some(log) = log {
                log.flush();
            }
        });
        before(panic);
    }));
}
