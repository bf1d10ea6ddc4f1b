//! The reader and writer of `.dat-s`.

use lmi::sdpa::{BlockShape, Coefficient, ReadError, Sdp, read, write};
use proptest::prelude::*;

const PLAIN: &str = "2\n2\n2 -3\n1.0 -2.5\n0 1 1 2 1.5\n1 2 3 3 1\n2 1 2 2 -4e-1\n";

#[test]
fn punctuation_comments_and_remarks_do_not_matter() {
    let plain = read(PLAIN.as_bytes()).unwrap();
    assert_eq!(plain.blocks, [BlockShape::Symmetric(2), BlockShape::Diagonal(3)]);
    assert_eq!(plain.objective, [1.0, -2.5]);
    assert_eq!(plain.coefficients[0], Coefficient { unknown: None, block: 0, row: 0, column: 1, value: 1.5 });
    assert_eq!(plain.coefficients.len(), 3);
    let odd = "\"a title\n* a remark\n 2 =mDIM\n2=nBLOCK\n {2,\n -3} = bLOCKsTRUCT\n{1.0D0, -25.0d-1}\r\n\n0 1 2 1 +1.5\n\
               {1, 2, 3, 3} 1\n2 1\n2 2 -.4\n";
    assert_eq!(read(odd.as_bytes()).unwrap(), plain);
    // A byte order mark, white space of other scripts, a form feed.
    let foreign = PLAIN.replace("1 2 3 3 1", "1\u{a0}2\u{2003}3\x0c3\t\u{3000}1");
    assert_eq!(read(format!("\u{feff}{foreign}").as_bytes()).unwrap(), plain);
    assert_ne!(foreign, PLAIN);
}

/// The error of a file, and the line it names.
fn error(text: &str) -> (ReadError, usize) {
    let error = read(text.as_bytes()).unwrap_err();
    let line = match &error {
        ReadError::Io { line, .. }
        | ReadError::NotANumber { line, .. }
        | ReadError::UnexpectedEnd { line, .. }
        | ReadError::OutOfRange { line, .. }
        | ReadError::OffDiagonal { line, .. } => *line,
    };
    assert!(error.to_string().starts_with(&format!("line {line}: ")), "{error}");
    (error, line)
}

#[test]
fn errors_name_the_line() {
    for (text, line) in [
        ("", 0),
        ("* only a remark\n", 1),
        ("two\n", 1),
        ("0\n1\n1\n\n", 1),
        ("-3\n", 1),
        ("1\n1\n", 2),
        ("1\n1\n0\n1\n", 3),
        ("1\n1\n2.5\n1\n", 3),
        ("1\n1\nx\n1\n", 3),
        ("2\n1\n2\n1\n", 4),
        ("2\n1\n2\n1 nan\n", 4),
        ("1\n1\n2\n1\n2 1 1 1 1\n", 5),
        ("1\n1\n2\n1\n1 2 1 1 1\n", 5),
        ("1\n1\n2\n1\n\n1 1 3 1 1\n", 6),
        ("1\n1\n2\n1\n1 1 0 1 1\n", 5),
        ("1\n1\n2\n1\n1 1 1 1\n", 5),
        ("1\n1\n2\n1\n1 1 1 1 inf\n", 5),
        ("1\n1\n2\n1\n1 1 1 1 1e999\n", 5),
        ("1\n1\n2\n1\n1 1 1 1 1\nend\n", 6),
        ("1\n1\n-2\n1\n1 1 1 2 1\n", 5),
        ("99999999999999999999\n", 1),
    ] {
        assert_eq!(error(text).1, line, "{text:?}");
    }
    let (error, _) = error("1\n1\n2\n1\n1 1 3 1 1\n");
    assert_eq!(error.to_string(), "line 5: a row is 3, allowed are 1 to 2");
}

#[test]
fn off_diagonal_zeros_of_diagonal_blocks_are_let_pass() {
    assert!(read("1\n1\n-2\n1\n1 1 1 2 0.0\n1 1 1 1 1\n".as_bytes()).unwrap().coefficients.len() == 1);
}

proptest! {
    /// Written and read again, a problem is the same to the last bit.
    #[test]
    fn write_and_read(
        objective in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 1..6),
        sizes in prop::collection::vec((1_usize..6, any::<bool>()), 1..4),
        entries in prop::collection::vec((0_usize..6, 0_usize..4, 0_usize..6, 0_usize..6, prop::num::f64::NORMAL), 0..20),
    ) {
        let blocks: Vec<BlockShape> = sizes
            .iter()
            .map(|&(n, diagonal)| if diagonal { BlockShape::Diagonal(n) } else { BlockShape::Symmetric(n) })
            .collect();
        let mut coefficients: Vec<Coefficient> = entries
            .iter()
            .map(|&(unknown, block, row, column, value)| {
                let block = block % blocks.len();
                let n = blocks[block].size();
                let (row, column) = (row % n, column % n);
                let column = if matches!(blocks[block], BlockShape::Diagonal(_)) { row } else { column };
                let unknown = (unknown % (objective.len() + 1)).checked_sub(1);
                Coefficient { unknown, block, row: row.min(column), column: row.max(column), value }
            })
            .collect();
        coefficients.sort_by_key(|c| (c.unknown.map_or(0, |unknown| unknown + 1), c.block, c.row, c.column));
        let problem = Sdp { objective, blocks, coefficients };
        let mut text = Vec::new();
        write(&problem, &mut text).unwrap();
        prop_assert_eq!(read(&text[..]).unwrap(), problem);
    }

    /// No text makes the reader panic.
    #[test]
    fn any_text(text in "[-0-9a-z .,{}()\"*\n]{0,80}") {
        let _ = read(text.as_bytes());
    }

    /// Nor do any bytes.
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
        let _ = read(&bytes[..]);
    }
}
