//! The `palpate` program: the window or one headless command.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate_app::cli::main()
}
