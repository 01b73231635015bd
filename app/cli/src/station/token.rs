//! `palpate token`: makes, lists and removes tokens of stations.

use super::super::Failure;
use super::super::output::Output;
use clap::{Args, Subcommand};
use palpate_runner::wall_now;
use palpate_sessions::journal::format_time;
use palpate_sessions::library_folder;
use palpate_station::tokens::{Scope, Tokens, TokensError};
use std::path::Path;

/// Make, list or remove tokens for stations
#[derive(Debug, Subcommand)]
pub enum TokenCommand {
    /// Make a token and print it once; only its checksum is stored
    Add(TokenAddArgs),
    /// List the tokens by name, with what they allow
    List,
    /// Remove a token; whoever uses it is cut off within a second
    Remove(TokenRemoveArgs),
}

/// Arguments of `palpate token add`.
#[derive(Debug, Args)]
pub struct TokenAddArgs {
    /// Who or what will use it, as in "office phone"
    name: String,
    /// What it allows, separated by commas: watch, stop, run; run asks for runs of a queue that a person at the rig has armed
    #[arg(long, value_name = "SCOPES", value_delimiter = ',', default_value = "watch,stop")]
    scope: Vec<Scope>,
}

/// Arguments of `palpate token remove`.
#[derive(Debug, Args)]
pub struct TokenRemoveArgs {
    name: String,
}

fn failure(err: TokensError) -> Failure {
    match err {
        TokensError::Taken(_) | TokensError::Unknown(_) | TokensError::Name(_) => {
            Failure::usage(err)
        }
        err => Failure::failed(err),
    }
}

pub(crate) fn run(command: &TokenCommand, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    match command {
        TokenCommand::Add(args) => add(args, &library, output),
        TokenCommand::List => list(&library, output),
        TokenCommand::Remove(args) => {
            Tokens::remove(&library, &args.name).map_err(failure)?;
            let object = serde_json::json!({ "removed": args.name });
            output.answer("token remove", &object, || format!("removed '{}'", args.name));
            Ok(())
        }
    }
}

fn add(args: &TokenAddArgs, library: &Path, output: &Output) -> Result<(), Failure> {
    let day = format_time(wall_now());
    let secret = Tokens::add(library, &args.name, &args.scope, day).map_err(failure)?;
    let object = serde_json::json!({ "name": args.name, "token": secret, "scopes": args.scope });
    output.answer("token add", &object, || {
        format!(
            "{secret}\nThis is shown once. On a phone open the station's address with #token={secret} behind it."
        )
    });
    Ok(())
}

fn list(library: &Path, output: &Output) -> Result<(), Failure> {
    let tokens = Tokens::read(library).map_err(failure)?;
    let listed: Vec<_> = tokens
        .all()
        .iter()
        .map(|token| {
            serde_json::json!({ "name": token.name, "scopes": token.scopes, "made_at": token.made_at })
        })
        .collect();
    output.answer("token list", &serde_json::json!({ "tokens": listed }), || {
        if tokens.all().is_empty() {
            return "no tokens; 'palpate token add NAME' makes one".into();
        }
        let lines = tokens.all().iter().map(|token| {
            let scopes: Vec<&str> = token.scopes.iter().map(|scope| scope.name()).collect();
            format!("{}  {}  made {}", token.name, scopes.join(", "), token.made_at)
        });
        lines.collect::<Vec<_>>().join("\n")
    });
    Ok(())
}
