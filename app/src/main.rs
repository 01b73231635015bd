//! The `palpate` program: arguments, then the window or one headless command.

use clap::Parser;
use palpate_app::cli::{self, Cli};
use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main(Cli::parse())
}
