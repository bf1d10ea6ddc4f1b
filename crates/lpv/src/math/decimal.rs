//! Decimals that err to the safe side.
//!
//! What is printed of a bound has to follow from what was proved: a proved rate, level, region or margin is rounded down, a proved
//! cost, gain, time or error up. A decimal stands for the double that it is read as, here and in every file and argument:
//! `0.1` is not less than the double `0.1`, and a printed bound that is given back to the program is the bound that was printed or
//! a safer one. The digits are those of the double's exact decimal expansion, cut or raised. Nothing that is not zero prints as zero.

/// Which way a number may err when it is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// Not above the number.
    Down,
    /// Not below the number.
    Up,
    /// To the nearest: for what claims nothing.
    Nearest,
}

/// Decimal exponents that are written out; beyond them the exponent form is shorter.
const PLAIN: std::ops::RangeInclusive<i32> = -4..=6;
/// More digits than any double has: the smallest subnormal has 751 significant ones.
const ALL_DIGITS: usize = 770;

/// `value` with at most `digits` significant digits, rounded as asked. What needs no more digits is printed as it is:
/// `2`, `0.5`, `9.807`. Infinity is `inf`, NaN is `NaN`.
pub fn decimal(value: f64, digits: usize, rounding: Rounding) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let (negative, size) = (value < 0.0, value.abs());
    let away_from_zero = match rounding {
        Rounding::Up => Some(!negative),
        Rounding::Down => Some(negative),
        Rounding::Nearest => None,
    };
    let exact = format!("{size:.ALL_DIGITS$e}");
    let (mantissa, exponent) = exact.split_once('e').unwrap_or((&exact, "0"));
    let mut exponent: i32 = exponent.parse().unwrap_or(0);
    let all: Vec<u8> = mantissa.bytes().filter(u8::is_ascii_digit).map(|digit| digit - b'0').collect();
    let digits = digits.clamp(1, ALL_DIGITS);
    let mut kept = all[..digits].to_vec();
    // a decimal stands for the double that it is read as
    let is_exact = written(false, &kept, exponent).parse() == Ok(size);
    let raise = match away_from_zero {
        Some(away) => away && !is_exact,
        None => all.get(digits).is_some_and(|&digit| digit >= 5),
    };
    let mut raised_digits = kept.clone();
    let carries = raised(&mut raised_digits);
    let raised_exponent = exponent + i32::from(carries);
    // cut away from the double, and yet raised it may be the double itself: then it is on both sides
    let is_raised_exact = written(false, &raised_digits, raised_exponent).parse() == Ok(size);
    if raise || (is_raised_exact && !is_exact) {
        (kept, exponent) = (raised_digits, raised_exponent);
    }
    while kept.len() > 1 && kept.last() == Some(&0) {
        kept.pop();
    }
    written(negative, &kept, exponent)
}

/// One more in the last place; true if that made a new leading digit.
fn raised(digits: &mut [u8]) -> bool {
    for digit in digits.iter_mut().rev() {
        if *digit < 9 {
            *digit += 1;
            return false;
        }
        *digit = 0;
    }
    digits[0] = 1;
    true
}

/// d.ddd × 10^exponent, written out where that is short.
fn written(negative: bool, digits: &[u8], exponent: i32) -> String {
    let text: String = digits.iter().map(|&digit| char::from(b'0' + digit)).collect();
    let sign = if negative { "-" } else { "" };
    if !PLAIN.contains(&exponent) {
        let (first, rest) = text.split_at(1);
        let point = if rest.is_empty() { "" } else { "." };
        return format!("{sign}{first}{point}{rest}e{exponent}");
    }
    if exponent < 0 {
        return format!("{sign}0.{}{text}", "0".repeat(-(exponent + 1) as usize));
    }
    let whole = exponent as usize + 1;
    match text.len() <= whole {
        true => format!("{sign}{text}{}", "0".repeat(whole - text.len())),
        false => format!("{sign}{}.{}", &text[..whole], &text[whole..]),
    }
}

/// Digits of a bound in a sentence or a table.
pub const DIGITS: usize = 5;

/// Of what holds up to a number: rates, levels, regions, margins. Never above it.
pub fn at_least(value: f64) -> String {
    decimal(value, DIGITS, Rounding::Down)
}

/// Of what is at most a number: costs, gains, times, errors. Never below it.
pub fn at_most(value: f64) -> String {
    decimal(value, DIGITS, Rounding::Up)
}

/// Of what claims nothing: measured, sampled, configured.
pub fn about(value: f64) -> String {
    decimal(value, DIGITS, Rounding::Nearest)
}

/// `value` with so many decimals, for columns of numbers; in the exponent form where it would read as zero and is not.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let reads_as_zero = text.bytes().all(|byte| !byte.is_ascii_digit() || byte == b'0');
    if value != 0.0 && value.is_finite() && reads_as_zero { format!("{value:.2e}") } else { text }
}

/// [`fixed`], rounded as asked: a column of bounds.
pub fn fixed_toward(value: f64, decimals: usize, rounding: Rounding) -> String {
    let nearest = format!("{value:.decimals$}");
    let read: f64 = nearest.parse().unwrap_or(f64::NAN);
    let is_safe = match rounding {
        Rounding::Nearest => true,
        Rounding::Up => read >= value,
        Rounding::Down => read <= value,
    };
    let digits: String = nearest.chars().filter(|c| *c != '.').collect();
    let (Ok(units), true) = (digits.parse::<i128>(), value.is_finite()) else {
        return decimal(value, DIGITS, rounding);
    };
    let units = match (is_safe, rounding) {
        (true, _) => units,
        (false, Rounding::Up) => units + 1,
        (false, _) => units - 1,
    };
    if units == 0 && value != 0.0 {
        return decimal(value, 3, rounding);
    }
    let text = format!("{:0>width$}", units.unsigned_abs(), width = decimals + 1);
    let (whole, rest) = text.split_at(text.len() - decimals);
    let point = if decimals == 0 { "" } else { "." };
    format!("{}{whole}{point}{rest}", if units < 0 { "-" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reads_as_an_engineer_writes() {
        assert_eq!(about(2.0), "2");
        assert_eq!(about(9.807), "9.807");
        assert_eq!(about(1e-12), "1e-12");
        assert_eq!(about(123456789.0), "1.2346e8");
        assert_eq!(about(0.00012345), "0.00012345");
        assert_eq!(about(-1234567.0), "-1234600");
        assert_eq!((about(0.0), about(-0.0), about(f64::INFINITY)), ("0".into(), "0".into(), "inf".into()));
    }

    #[test]
    fn errs_to_the_safe_side() {
        assert_eq!(at_least(5.34836), "5.3483");
        assert_eq!(at_most(5.34836), "5.3484");
        assert_eq!(at_most(-5.34836), "-5.3483");
        assert_eq!(at_most(0.99999999), "1");
        for value in [0.1, 1e-8, 0.3, 2.0, 9.807] {
            assert_eq!(at_least(value), at_most(value), "a short decimal is the double that it is read as");
        }
        assert_eq!((at_least(0.1), at_most(1e-8)), ("0.1".into(), "1e-8".into()));
        assert_eq!((at_least(0.1_f64.next_down()), at_most(0.1_f64.next_up())), ("0.099999".into(), "0.10001".into()));
        assert_eq!(at_least(f64::MAX), "1.7976e308");
        assert_ne!(at_least(f64::from_bits(1)), "0");
    }

    #[test]
    fn columns_show_what_is_not_zero() {
        assert_eq!((fixed(1.25, 6), fixed(0.0, 2), fixed(-0.0, 1)), ("1.250000".into(), "0.00".into(), "-0.0".into()));
        assert_eq!(
            (fixed(1e-9, 6), fixed(-4e-5, 2), fixed(0.004, 1)),
            ("1.00e-9".into(), "-4.00e-5".into(), "4.00e-3".into())
        );
    }

    #[test]
    fn columns_of_bounds_err_to_the_safe_side() {
        use Rounding::{Down, Nearest, Up};
        assert_eq!((fixed_toward(1.25, 1, Up), fixed_toward(1.25, 1, Down)), ("1.3".into(), "1.2".into()));
        assert_eq!((fixed_toward(-1.25, 1, Up), fixed_toward(-1.25, 1, Down)), ("-1.2".into(), "-1.3".into()));
        assert_eq!((fixed_toward(0.1, 3, Up), fixed_toward(0.1, 3, Down)), ("0.100".into(), "0.100".into()));
        assert_eq!((fixed_toward(0.99999, 2, Up), fixed_toward(9.999, 1, Down)), ("1.00".into(), "9.9".into()));
        assert_eq!((fixed_toward(1e-9, 4, Up), fixed_toward(1e-9, 4, Down)), ("0.0001".into(), "1e-9".into()));
        assert_eq!((fixed_toward(-1e-9, 4, Up), fixed_toward(0.0, 2, Down)), ("-1e-9".into(), "0.00".into()));
        assert_eq!((fixed_toward(2.5e300, 2, Up), fixed_toward(f64::NAN, 2, Up)), ("2.5e300".into(), "NaN".into()));
        assert_eq!((fixed_toward(7.0, 0, Down), fixed_toward(123.456, 2, Nearest)), ("7".into(), "123.46".into()));
    }

    proptest! {
        #[test]
        fn columns_keep_the_side(value in -1e6..1e6f64, decimals in 0..9usize) {
            let [down, up]: [f64; 2] =
                [Rounding::Down, Rounding::Up].map(|rounding| fixed_toward(value, decimals, rounding).parse().unwrap());
            prop_assert!(down <= value && value <= up, "{down} {value} {up}");
            prop_assert!(up - down <= 1.001 * 10.0_f64.powi(-(decimals as i32)) + 1e-9);
        }

        /// Printed and read back the number is on the side that was asked for, within a unit of the last digit.
        #[test]
        fn the_side_is_kept(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite() && value.abs() > 1e-290 && value.abs() < 1e290);
            let (down, up): (f64, f64) = (at_least(value).parse().unwrap(), at_most(value).parse().unwrap());
            prop_assert!(down <= value && value <= up, "{down} {value} {up}");
            prop_assert!((up - down).abs() <= 1.001e-4 * value.abs());
            prop_assert!(value == 0.0 || (down != 0.0 && up != 0.0));
        }
    }
}
