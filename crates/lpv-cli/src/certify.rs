//! `lpv certify`: prove, check or refute a saved design, from the plant alone.

pub mod polytopic;

use crate::designs;
use crate::failure::Failure;
use crate::output::print;
use crate::scenario::door::Door;
use crate::scenario::read_text;
use clap::Args;
use lpv::certificate::{
    Claim, ClaimKind, Member, Of, ProofOptions, Record, RecordError, Verdict, Words, check, merged, prove_supervised,
    worst,
};
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
    verdict: Verdict,
    claims: &'a [Claim],
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
        return finish(arguments, &name, worst(&claims), &claims);
    }
    let design = designs::from_json(&arguments.design, &text)?;
    let plant = design
        .plant
        .build()
        .map_err(|error| Failure::Unreadable { file: arguments.design.clone(), message: error.to_string() })?;
    let mut checked = check(&design, &*plant);
    for (k, inner) in design.inner.iter().enumerate() {
        checked.extend(check(inner, &*plant).into_iter().map(|claim| claim.of_member(Member::Inner(k))));
    }
    let options = ProofOptions { rate: arguments.rate, level: arguments.region, nonlinear: arguments.nonlinear };
    let (claims, verdict) = match prove_supervised(&design, &*plant, &options) {
        Ok(proofs) => {
            if arguments.record.is_some() {
                let mut record = Record::default();
                record.add_design(&design, &*plant, &proofs).map_err(|error| unwritten(arguments, &error))?;
                write(arguments, &record)?;
            }
            let claims = merged(checked, proofs.claims.clone());
            // what is looked for beyond the design's own claims counts only if it is decided
            let found: Vec<Claim> =
                proofs.claims.iter().filter(|claim| !proofs.members[0].is_counted(claim)).cloned().collect();
            let is_found = |claim: &&Claim| found.iter().any(|other| other.id == claim.id);
            let counted = claims.iter().filter(|claim| !is_found(claim));
            let verdict = counted.map(|claim| claim.verdict).min().unwrap_or(Verdict::Undecided);
            (claims, verdict)
        }
        Err(reason) => {
            let asked = arguments.rate.is_some() || arguments.region.is_some();
            let verdict = if asked { Verdict::Undecided } else { worst(&checked) };
            let provable = Claim::new(ClaimKind::Provable, Of::Model, &Words::default());
            checked.push(provable.decided(Verdict::Undecided, f64::NAN, reason.to_string()));
            (checked, verdict)
        }
    };
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
        let certificate = Certificate { verdict, claims };
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
