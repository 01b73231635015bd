//! `palpate man`: the whole command as manual pages.

use super::output::Output;
use super::{Cli, Failure};
use clap::{Args, CommandFactory};
use clap_mangen::Man;
use std::io;
use std::path::PathBuf;

/// Print the manual page, or write one for every command
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Write a page for every command to this folder, instead of printing the main page
    #[arg(long, value_name = "DIR")]
    to: Option<PathBuf>,
}

pub(super) fn run(args: &ManArgs, output: &Output) -> Result<(), Failure> {
    let mut command = Cli::command();
    let Some(folder) = &args.to else {
        let mut page = Vec::new();
        Man::new(command).render(&mut page).map_err(Failure::failed)?;
        let page = String::from_utf8_lossy(&page);
        let object = serde_json::json!({ "page": page });
        output.answer("man", &object, || page.trim_end().to_owned());
        return Ok(());
    };
    let failed = |err: io::Error| {
        Failure::failed(format!(
            "the manual pages cannot be written to {} ({err}); choose an existing folder that you may write to",
            folder.display()
        ))
    };
    command.build();
    let mut pages = Vec::new();
    write_pages(Man::new(command.clone()), &command, folder, &mut pages).map_err(failed)?;
    let object = serde_json::json!({ "pages": pages });
    output.answer("man", &object, || {
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
    for below in command.get_subcommands().filter(|one| one.get_name() != "help") {
        write_pages(Man::new(below.clone()), below, folder, pages)?;
    }
    Ok(())
}
