//! Reading `.dat-s`, as a stream of numbers with line counts.

use super::{BlockShape, Coefficient, Sdp};
use std::io::BufRead;

/// Why a `.dat-s` file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read further.
    #[error("line {line}: {source}")]
    Io {
        /// Line, counted from 1.
        line: usize,
        /// What the system says.
        source: std::io::Error,
    },
    /// Something else stands where a number is expected.
    #[error("line {line}: \"{found}\" where {expected} is expected")]
    NotANumber {
        /// Line, counted from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What should.
        expected: &'static str,
    },
    /// The file ends too early.
    #[error("line {line}: the file ends where {expected} is expected")]
    UnexpectedEnd {
        /// The last line.
        line: usize,
        /// What should follow.
        expected: &'static str,
    },
    /// An index or count is outside its range.
    #[error("line {line}: {what} is {found}, allowed are {least} to {most}")]
    OutOfRange {
        /// Line, counted from 1.
        line: usize,
        /// The quantity.
        what: &'static str,
        /// Its value.
        found: i64,
        /// Its least value.
        least: i64,
        /// Its greatest value.
        most: i64,
    },
    /// A diagonal block has an entry off its diagonal.
    #[error("line {line}: entry ({row}, {column}) lies off the diagonal of block {block}, which is diagonal")]
    OffDiagonal {
        /// Line, counted from 1.
        line: usize,
        /// The block, counted from 1.
        block: usize,
        /// The row, counted from 1.
        row: usize,
        /// The column, counted from 1.
        column: usize,
    },
}

/// Most rows of one block and most unknowns: far beyond what can be solved, and small enough to count with.
const MOST: i64 = 1_000_000;

/// Reads a problem in the SDPA sparse format.
///
/// # Errors
///
/// [`ReadError`] with the line where the file departs from the format.
pub fn read(input: impl BufRead) -> Result<Sdp, ReadError> {
    let mut numbers = Numbers::of(input);
    let m = numbers.leading_count("the number of unknowns")?;
    let count = numbers.leading_count("the number of blocks")?;
    let mut blocks = Vec::new();
    for _ in 0..count {
        let size = numbers.integer("a block size", -MOST, MOST)?;
        blocks.push(match usize::try_from(size.unsigned_abs()) {
            Ok(0) | Err(_) => {
                return Err(ReadError::OutOfRange {
                    line: numbers.line,
                    what: "the absolute value of a block size",
                    found: 0,
                    least: 1,
                    most: MOST,
                });
            }
            Ok(n) if size < 0 => BlockShape::Diagonal(n),
            Ok(n) => BlockShape::Symmetric(n),
        });
    }
    numbers.skip_line();
    let mut objective = Vec::new();
    for _ in 0..m {
        objective.push(numbers.real("an entry of the objective")?);
    }
    numbers.skip_line();
    let mut coefficients = Vec::new();
    while numbers.fill()? {
        let matrix = numbers.integer("the number of a coefficient matrix", 0, m as i64)? as usize;
        let block = numbers.integer("the number of a block", 1, count as i64)? as usize;
        let size = blocks[block - 1].size() as i64;
        let row = numbers.integer("a row", 1, size)? as usize;
        let column = numbers.integer("a column", 1, size)? as usize;
        let value = numbers.real("an entry of a coefficient matrix")?;
        if row != column && matches!(blocks[block - 1], BlockShape::Diagonal(_)) {
            if value == 0.0 {
                continue;
            }
            return Err(ReadError::OffDiagonal { line: numbers.line, block, row, column });
        }
        coefficients.push(Coefficient {
            unknown: matrix.checked_sub(1),
            block: block - 1,
            row: row.min(column) - 1,
            column: row.max(column) - 1,
            value,
        });
    }
    Ok(Sdp { objective, blocks, coefficients })
}

/// The numbers of a file, one line in memory at a time.
struct Numbers<R> {
    input: R,
    /// The number of the line.
    line: usize,
    bytes: Vec<u8>,
    text: String,
    /// Where in the text the next token begins.
    at: usize,
}

/// What stands between two separators.
#[derive(Clone, Copy)]
struct Token<'a> {
    text: &'a str,
    line: usize,
    expected: &'static str,
}

/// Of a byte of a text whose white space is that of ASCII.
fn separates(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t'..=b'\r' | b',' | b'(' | b')' | b'{' | b'}')
}

impl<R: BufRead> Numbers<R> {
    fn of(input: R) -> Self {
        Self { input, line: 0, bytes: Vec::new(), text: String::new(), at: 0 }
    }

    /// Reads on until there is a token; false at the end of the file.
    fn fill(&mut self) -> Result<bool, ReadError> {
        loop {
            if let Some(gap) = self.text.as_bytes()[self.at..].iter().position(|byte| !separates(byte)) {
                self.at += gap;
                return Ok(true);
            }
            self.bytes.clear();
            let read = self.input.read_until(b'\n', &mut self.bytes);
            let read = read.map_err(|source| ReadError::Io { line: self.line + 1, source })?;
            self.skip_line();
            if read == 0 {
                return Ok(false);
            }
            self.line += 1;
            let text = String::from_utf8_lossy(&self.bytes);
            let text = text.trim_start_matches('\u{feff}').trim_start();
            if text.starts_with(['"', '*']) {
                continue;
            }
            if text.is_ascii() {
                self.text.push_str(text);
            } else {
                self.text.extend(text.chars().map(|c| if c.is_whitespace() { ' ' } else { c }));
            }
        }
    }

    fn skip_line(&mut self) {
        self.text.clear();
        self.at = 0;
    }

    fn next(&mut self, expected: &'static str) -> Result<Token<'_>, ReadError> {
        if !self.fill()? {
            return Err(ReadError::UnexpectedEnd { line: self.line, expected });
        }
        let rest = &self.text[self.at..];
        let text = &rest[..rest.bytes().position(|byte| separates(&byte)).unwrap_or(rest.len())];
        self.at += text.len();
        Ok(Token { text, line: self.line, expected })
    }

    /// A count at the start of a line; what follows on the line is a remark.
    fn leading_count(&mut self, what: &'static str) -> Result<usize, ReadError> {
        let count = self.next(what)?.without_remark().integer(1, MOST)?;
        self.skip_line();
        Ok(count as usize)
    }

    fn integer(&mut self, what: &'static str, least: i64, most: i64) -> Result<i64, ReadError> {
        self.next(what)?.integer(least, most)
    }

    fn real(&mut self, what: &'static str) -> Result<f64, ReadError> {
        self.next(what)?.real()
    }
}

impl Token<'_> {
    /// Some files glue the remark to the number, as in "13=mDIM".
    fn without_remark(mut self) -> Self {
        let digits = self.text.find(|c: char| !(c.is_ascii_digit() || c == '+' || c == '-'));
        self.text = &self.text[..digits.filter(|digits| *digits > 0).unwrap_or(self.text.len())];
        self
    }

    fn not_a_number(self) -> ReadError {
        ReadError::NotANumber { line: self.line, found: self.text.to_owned(), expected: self.expected }
    }

    fn integer(self, least: i64, most: i64) -> Result<i64, ReadError> {
        // Some files write counts as reals, as in "3.0".
        let parsed = self.text.parse::<i64>().ok().or_else(|| {
            let value = self.text.parse::<f64>().ok()?;
            (value.fract() == 0.0 && value.abs() < 1e15).then_some(value as i64)
        });
        let found = parsed.ok_or_else(|| self.not_a_number())?;
        if found < least || found > most {
            return Err(ReadError::OutOfRange { line: self.line, what: self.expected, found, least, most });
        }
        Ok(found)
    }

    fn real(self) -> Result<f64, ReadError> {
        // Fortran writes exponents with D.
        let parsed = self.text.parse::<f64>().or_else(|_| self.text.replace(['D', 'd'], "e").parse::<f64>());
        match parsed {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.not_a_number()),
        }
    }
}
