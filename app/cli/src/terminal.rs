//! Standard input and Ctrl-C.

use super::Failure;
use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

/// Lines that may wait; a person types them.
const LINES_MAX: usize = 16;

/// Lines of standard input, read by a thread of this name.
pub(super) fn read_lines(thread: &str) -> Result<Receiver<String>, Failure> {
    let (sender, lines) = sync_channel(LINES_MAX);
    let read = move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    };
    std::thread::Builder::new().name(thread.into()).spawn(read).map_err(Failure::failed)?;
    Ok(lines)
}

/// Calls `handler` at every Ctrl-C.
pub(super) fn on_ctrl_c(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    ctrlc::set_handler(handler)
        .map_err(|err| Failure::failed(format!("the handler of Ctrl-C cannot be installed: {err}")))
}

/// A flag that Ctrl-C sets.
pub(super) fn ctrl_c_flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    on_ctrl_c(move || set.store(true, Ordering::Relaxed))?;
    Ok(flag)
}
