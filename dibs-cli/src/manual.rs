//! `dibs completions` and `dibs man`: completion scripts and manual pages.

use crate::{Cli, output};
use anyhow::{Result, anyhow};
use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man as Page;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs completions bash > ~/.local/share/bash-completion/completions/dibs
  dibs completions zsh > ~/.zfunc/_dibs
  dibs completions fish > ~/.config/fish/completions/dibs.fish")]
pub struct Completions {
    /// The shell
    shell: Shell,
}

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs man | man -l -
  dibs man -o ~/.local/share/man/man1")]
pub struct Man {
    /// Write a page for the program and one for each of its commands into this folder
    #[arg(short, long)]
    output: Option<PathBuf>,
}

pub fn complete(args: &Completions) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "dibs", &mut script);
    output::write(&script);
    Ok(())
}

pub fn write(args: &Man) -> Result<()> {
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        Page::new(Cli::command()).render(&mut page)?;
        output::write(&page);
        return Ok(());
    };
    let name = folder.display();
    std::fs::create_dir_all(folder).map_err(|error| anyhow!("{name}: cannot be made ({error})"))?;
    clap_mangen::generate_to(Cli::command(), folder)
        .map_err(|error| anyhow!("{name}: cannot be written ({error}); check that it has room"))?;
    println!("written  {name}: dibs.1, and a page for each command");
    Ok(())
}
