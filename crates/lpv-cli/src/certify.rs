//! `lpv certify`: prove, check or refute a saved design, from the plant alone.

mod polytopic;

use crate::designs;
use crate::failure::Failure;
use crate::output::print;
use crate::scenario::door::Door;
use crate::scenario::read_text;
use clap::Args;
use lpv::certificate::{Claim, ProofOptions, Record, RecordError, Verdict, Witness, check, prove_supervised};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `lpv certify`.
#[derive(Args)]
pub struct CertifyArguments {
    /// Design file, as `lpv run` and `lpv design` write it, or with K and P from elsewhere (docs/proved.md)
    design: PathBuf,
    /// Largest rate of the scheduling parameter, per second [default: the design's; of a frozen design the largest that
    /// can be proved]
    #[arg(long)]
    rate: Option<f64>,
    /// Level of the set x'P x <= REGION that is to be certified [default: the design's gamma]
    #[arg(long)]
    region: Option<f64>,
    /// Also prove the largest set x'P x <= c that is invariant for the nonlinear plant (takes longer)
    #[arg(long)]
    nonlinear: bool,
    /// Print the claims as JSON instead of text
    #[arg(long)]
    json: bool,
    /// Write what is proved, with all that another program needs to check it (docs/proved.md), to FILE
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Certificate<'a> {
    claims: Vec<ClaimLine<'a>>,
}

#[derive(Serialize)]
struct ClaimLine<'a> {
    claim: &'a str,
    verdict: Verdict,
    /// Null where there is none.
    margin: f64,
    witness: Option<&'a Witness>,
    cells: usize,
    seconds: f64,
}

impl<'a> ClaimLine<'a> {
    fn new(claim: &'a Claim) -> Self {
        let Claim { claim, verdict, margin, witness, cells, seconds, .. } = claim;
        let witness = witness.as_ref();
        Self { claim, verdict: *verdict, margin: *margin, witness, cells: *cells, seconds: *seconds }
    }
}

/// Check the design; anything worse than `numerical` is a failure.
pub fn run(arguments: &CertifyArguments) -> Result<(), Failure> {
    let positive = |key: &str, value: Option<f64>, least: f64| match value {
        Some(value) if !(value >= least && value.is_finite()) => Err(Failure::BadInput {
            file: arguments.design.clone(),
            key: key.into(),
            message: format!(
                "is {value}: it has to be a finite number, {}",
                if least > 0.0 { "above zero" } else { "zero or more" }
            ),
        }),
        _ => Ok(()),
    };
    positive("--rate", arguments.rate, 0.0)?;
    positive("--region", arguments.region, f64::MIN_POSITIVE)?;
    let text = read_text(&arguments.design)?;
    if polytopic::is_polytopic(&text) {
        let door = Door { file: &arguments.design };
        for (key, given) in [("--rate", arguments.rate.is_some()), ("--nonlinear", arguments.nonlinear)] {
            if given {
                return door.refuse(
                    key,
                    "is for the design of a plant; one over a polytope has its rate_vertices and no other model",
                );
            }
        }
        let mut record = Record::default();
        let claims = polytopic::claims(&door, &text, arguments.region, &mut record)?;
        write(arguments, &record)?;
        let name = arguments.design.file_stem().map_or("design".into(), |name| name.to_string_lossy().into_owned());
        return finish(arguments, &name, designs::worst(&claims), &claims);
    }
    let design = designs::from_json(&arguments.design, &text)?;
    let plant = design
        .plant
        .build()
        .map_err(|error| Failure::Unreadable { file: arguments.design.clone(), message: error.to_string() })?;
    let mut claims = check(&design, &*plant);
    for inner in &design.inner {
        claims.extend(designs::named_of_inner(inner, check(inner, &*plant)));
    }
    let mut verdict = designs::worst(&claims);
    let options = ProofOptions { rate: arguments.rate, level: arguments.region, nonlinear: arguments.nonlinear };
    match prove_supervised(&design, &*plant, &options) {
        Ok(proofs) => {
            if arguments.record.is_some() {
                let mut record = Record::default();
                record.add_design(&design, &*plant, &proofs).map_err(|error| unwritten(arguments, &error))?;
                write(arguments, &record)?;
            }
            // the rates found for a frozen design are a finding, not a claim that it makes
            let asked = proofs.members[0].asked;
            let counted = |claim: &&Claim| asked || claim.verdict == Verdict::Refuted;
            verdict = proofs.claims.iter().filter(counted).map(|claim| claim.verdict).fold(verdict, Verdict::min);
            claims.extend(proofs.claims);
        }
        Err(reason) if arguments.rate.is_some() || arguments.region.is_some() => {
            verdict = verdict.min(Verdict::Undecided);
            claims.push(Claim::checked("proof", Verdict::Undecided, f64::NAN, reason.to_string()));
        }
        Err(reason) => claims.push(Claim::checked("proof", Verdict::Undecided, f64::NAN, reason.to_string())),
    }
    finish(arguments, &design.name, verdict, &claims)
}

/// Write the record where it is asked for; one that would be empty is an error.
fn write(arguments: &CertifyArguments, record: &Record) -> Result<(), Failure> {
    let Some(file) = &arguments.record else { return Ok(()) };
    if record.is_empty() {
        return Err(Failure::NotCertified("nothing is proved that could be recorded".into()));
    }
    std::fs::write(file, record.text()).map_err(|error| Failure::io(file, &error))
}

fn unwritten(arguments: &CertifyArguments, error: &RecordError) -> Failure {
    Failure::Unreadable { file: arguments.design.clone(), message: error.to_string() }
}

/// Print the claims; exit as the verdict asks.
fn finish(arguments: &CertifyArguments, name: &str, verdict: Verdict, claims: &[Claim]) -> Result<(), Failure> {
    if arguments.json {
        let certificate = Certificate { claims: claims.iter().map(ClaimLine::new).collect() };
        let json = serde_json::to_string_pretty(&certificate).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        print(&designs::text(name, verdict, claims))?;
    }
    match verdict {
        Verdict::Proved | Verdict::Numerical => Ok(()),
        Verdict::Refuted | Verdict::Undecided => {
            Err(Failure::NotCertified(format!("\"{name}\" is {}", verdict.word())))
        }
    }
}
