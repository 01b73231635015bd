//! The command `palpate`, which the package brings along.

use pyo3::prelude::*;
use std::ffi::OsString;
use std::io::Write;

/// Runs a command with these arguments, the first of which is the name of the program; its exit code.
#[pyfunction]
pub fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| {
        let code = palpate_cli::run_command(&arguments, None);
        // No end of a Rust program does it here; a closed pipe is the reader's choice.
        let _ = std::io::stdout().flush();
        code
    })
}
