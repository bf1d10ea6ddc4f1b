//! Writing `.dat-s`.

use super::{BlockShape, Sdp};
use std::io::{self, Write};

/// Writes a problem in the SDPA sparse format; reading it back gives the same numbers to the last bit.
///
/// # Errors
///
/// Those of the output.
pub fn write(problem: &Sdp, mut output: impl Write) -> io::Result<()> {
    writeln!(output, "{} = unknowns", problem.objective.len())?;
    writeln!(output, "{} = blocks", problem.blocks.len())?;
    let sizes = problem.blocks.iter().map(|block| match block {
        BlockShape::Symmetric(n) => format!("{n}"),
        BlockShape::Diagonal(n) => format!("-{n}"),
    });
    writeln!(output, "{}", sizes.collect::<Vec<_>>().join(" "))?;
    let objective = problem.objective.iter().map(|c| format!("{c:e}"));
    writeln!(output, "{}", objective.collect::<Vec<_>>().join(" "))?;
    let mut coefficients: Vec<_> = problem.coefficients.iter().collect();
    coefficients.sort_by_key(|c| (c.unknown.map_or(0, |unknown| unknown + 1), c.block, c.row, c.column));
    for c in coefficients {
        let matrix = c.unknown.map_or(0, |unknown| unknown + 1);
        writeln!(output, "{matrix} {} {} {} {:e}", c.block + 1, c.row + 1, c.column + 1, c.value)?;
    }
    Ok(())
}
