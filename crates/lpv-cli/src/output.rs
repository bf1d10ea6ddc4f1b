//! Results on standard output, and the arguments that say where results go.

use crate::failure::Failure;
use clap::Args;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Where results go, and in which form they are printed.
#[derive(Args)]
pub struct OutputArguments {
    /// Folder for the results (file, for a problem) [default: under out/, named after the scenario; none for a problem]
    #[arg(long, short)]
    pub out: Option<PathBuf>,
    /// Replace an earlier result
    #[arg(long)]
    pub force: bool,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Write `text` to standard output, with a line break at its end. A reader that has gone away has had enough: that is no
/// failure (`lpv certify … | head -1`).
///
/// # Errors
/// Standard output cannot be written, for example because its disk is full.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let written = out
        .write_all(text.as_bytes())
        .and_then(|()| match text.ends_with('\n') {
            true => Ok(()),
            false => out.write_all(b"\n"),
        })
        .and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::io(Path::new("standard output"), &error)),
        _ => Ok(()),
    }
}
