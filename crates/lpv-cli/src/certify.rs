//! `lpv certify`: check a saved design again, from the plant alone.

use crate::designs;
use crate::failure::Failure;
use crate::output::print;
use crate::scenario::read_text;
use clap::Args;
use lpv::certificate::{BlockMargin, Claim, Verdict, block_margins, check};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `lpv certify`.
#[derive(Args)]
pub struct CertifyArguments {
    /// Design file, as `lpv run` and `lpv design` write it
    design: PathBuf,
    /// Print the claims as JSON instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Certificate<'a> {
    design: &'a str,
    verdict: Verdict,
    claims: &'a [Claim],
    /// λ_min of every block of every inequality.
    blocks: Vec<BlockMargin>,
}

/// Check the design; anything worse than `numerical` is a failure.
pub fn run(arguments: &CertifyArguments) -> Result<(), Failure> {
    let design = designs::from_json(&arguments.design, &read_text(&arguments.design)?)?;
    let plant = design
        .plant
        .build()
        .map_err(|error| Failure::Unreadable { file: arguments.design.clone(), message: error.to_string() })?;
    let claims = check(&design, &*plant);
    let verdict = designs::worst(&claims);
    if arguments.json {
        let blocks = block_margins(&design, &*plant);
        let certificate = Certificate { design: &design.name, verdict, claims: &claims, blocks };
        let json = serde_json::to_string_pretty(&certificate).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        print(&designs::text(&design.name, &claims))?;
    }
    match verdict {
        Verdict::Proved | Verdict::Numerical => Ok(()),
        Verdict::Refuted | Verdict::Undecided => {
            Err(Failure::NotCertified(format!("\"{}\" is {}", design.name, verdict.word())))
        }
    }
}
