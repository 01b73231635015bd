//! `palpate completions`: the completion script of a shell.

use super::output::Output;
use super::{Cli, Failure};
use clap::{Args, CommandFactory};
use clap_complete::aot::{Shell, generate};

/// Print the completion script of a shell
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Name of the shell
    #[arg(value_enum)]
    shell: Shell,
}

#[allow(clippy::unnecessary_wraps, reason = "every command may fail")]
pub(super) fn run(args: &CompletionsArgs, output: &Output) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "palpate", &mut script);
    let script = String::from_utf8_lossy(&script);
    let object = serde_json::json!({ "shell": args.shell.to_string(), "script": script });
    output.answer("completions", &object, || script.trim_end().to_owned());
    Ok(())
}
