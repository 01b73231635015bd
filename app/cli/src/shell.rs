//! `palpate completions` and `palpate man`: the whole command as shells and `man` know it.

use super::output::Output;
use super::{Cli, Failure};
use clap::{Args, CommandFactory};
use clap_complete::aot::{Shell, generate};
use clap_mangen::Man;
use std::io;
use std::path::PathBuf;

/// Arguments of `palpate completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `palpate man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Write a page for every command to this folder, and not that of palpate alone to the terminal
    #[arg(long, value_name = "DIR")]
    to: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn completions(args: &CompletionsArgs, output: &Output) {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "palpate", &mut script);
    let script = String::from_utf8_lossy(&script);
    let object = serde_json::json!({
        "command": "completions", "shell": args.shell.to_string(), "script": script,
    });
    output.result(&object, || script.trim_end().to_owned());
}

pub(super) fn man(args: &ManArgs, output: &Output) -> Result<(), Failure> {
    let mut command = Cli::command();
    let Some(folder) = &args.to else {
        let mut page = Vec::new();
        Man::new(command)
            .render(&mut page)
            .map_err(Failure::failed)?;
        let page = String::from_utf8_lossy(&page);
        let object = serde_json::json!({ "command": "man", "page": page });
        output.result(&object, || page.trim_end().to_owned());
        return Ok(());
    };
    let failed = |err: io::Error| {
        Failure::failed(format!(
            "cannot write pages to {} ({err}); choose a folder that exists and may be written",
            folder.display()
        ))
    };
    command.build();
    let mut pages = Vec::new();
    write_pages(Man::new(command.clone()), &command, folder, &mut pages).map_err(failed)?;
    let object = serde_json::json!({ "command": "man", "pages": pages });
    output.result(&object, || {
        format!("{} pages written to {}", pages.len(), folder.display())
    });
    Ok(())
}

/// The page of a command and those of the ones below it.
fn write_pages(
    page: Man,
    command: &clap::Command,
    folder: &std::path::Path,
    pages: &mut Vec<PathBuf>,
) -> io::Result<()> {
    let path = folder.join(page.get_filename());
    let mut text = Vec::new();
    page.render(&mut text)?;
    palpate_sessions::atomic::replace(&path, &text)?;
    pages.push(path);
    for below in command
        .get_subcommands()
        .filter(|one| one.get_name() != "help")
    {
        write_pages(Man::new(below.clone()), below, folder, pages)?;
    }
    Ok(())
}
