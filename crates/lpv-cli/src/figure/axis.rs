//! Axes: ranges, round ticks, numbers.

use lpv::math::decimal::about;

/// An axis with its label, unit included.
#[derive(Clone, Debug)]
pub struct Axis {
    /// For example `x_1 / rad`; `_1` is set as an index.
    pub label: String,
    /// Ends; found from the data where not given.
    pub range: Option<[f64; 2]>,
    /// Ticks with their words, where they are not round values of the axis itself; none: those.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis that spans its data.
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, ticks: Vec::new() }
    }

    /// An axis from `low` to `high`.
    pub fn over(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..Self::new(label) }
    }

    /// An axis for the decimal logarithms of `values`, which are positive: powers of ten, and round values between them where there are few.
    pub fn logarithmic(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = span(values.filter(|value| *value > 0.0).map(f64::log10));
        // not less than a factor of two is worth a scale
        let room = (0.5 * (0.5 - (high - low))).max(0.0);
        let (low, high) = (low - room, high + room);
        let powers: Vec<i32> = (low.ceil() as i32..=high.floor() as i32).collect();
        let step = powers.len().div_ceil(MOST_POWERS).max(1);
        let mut ticks: Vec<(f64, String)> =
            powers.iter().step_by(step).map(|&power| (f64::from(power), power_of_ten(power))).collect();
        if ticks.len() < 3 {
            let round = |digits: &[f64]| -> Vec<(f64, String)> {
                let powers = (low.floor() as i32..=high.floor() as i32).map(|power| 10f64.powi(power));
                let values = powers.flat_map(|power| digits.iter().map(move |digit| digit * power));
                let inside = values.filter(|value| (low..=high).contains(&value.log10()));
                inside.map(|value| (value.log10(), about(value))).collect()
            };
            ticks = round(&[1.0, 2.0, 5.0]);
            if ticks.len() < 3 {
                ticks = round(&[1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0]);
            }
        }
        Self { label: label.into(), range: Some([low, high]), ticks }
    }

    /// Where the ticks stand in `range`, about `count` of them, and their words.
    pub(super) fn ticks(&self, range: [f64; 2], count: usize) -> Vec<(f64, String)> {
        if !self.ticks.is_empty() {
            return self.ticks.clone();
        }
        let values = ticks(range, count);
        let labels = tick_labels(&values);
        values.into_iter().zip(labels).collect()
    }
}

/// Powers of ten with words, at most.
const MOST_POWERS: usize = 7;

/// 10⁴
fn power_of_ten(power: i32) -> String {
    let digits = power.to_string();
    let raised = |c: char| match c {
        '-' => '⁻',
        digit => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit as usize - '0' as usize).unwrap_or(digit),
    };
    format!("10{}", digits.chars().map(raised).collect::<String>())
}

/// Round values in `range`, about `count` of them and two at least: multiples of 1, 2 or 5 times a power of ten.
pub(super) fn ticks(range: [f64; 2], count: usize) -> Vec<f64> {
    let found = round_values(range, count);
    if found.len() > 1 { found } else { round_values(range, count + 2) }
}

fn round_values([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let rough = (high - low) / count.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|step| *step >= rough * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The numbers of `ticks`, all with the decimals that their distance asks for.
pub(super) fn tick_labels(ticks: &[f64]) -> Vec<String> {
    let step = if ticks.len() > 1 { ticks[1] - ticks[0] } else { 1.0 };
    let largest = ticks.iter().fold(0.0f64, |largest, tick| largest.max(tick.abs()));
    if largest >= 1e5 || (step < 1e-4 && step > 0.0) {
        return ticks.iter().map(|tick| if *tick == 0.0 { "0".into() } else { format!("{tick:.1e}") }).collect();
    }
    let decimals = (-step.log10() - 1e-9).ceil().max(0.0) as usize;
    let typographic = |number: String| number.replace('-', "−");
    ticks.iter().map(|tick| typographic(format!("{:.decimals$}", tick + 0.0))).collect()
}

/// The range of `values` with room at both ends.
pub(super) fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return [0.0, 1.0];
    }
    let room = if high > low { 0.06 * (high - low) } else { 0.5 * low.abs().max(1.0) };
    [low - room, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([-0.2, 1.05], 5), [0.0, 0.5, 1.0]);
        assert_eq!(tick_labels(&ticks([-0.2, 1.05], 5)), ["0.0", "0.5", "1.0"]);
        assert_eq!(tick_labels(&ticks([-3.0, 3.0], 4)), ["−2", "0", "2"]);
        assert_eq!(
            tick_labels(&ticks([-0.047, 0.047], 3)),
            ["−0.04", "−0.02", "0.00", "0.02", "0.04"],
            "not zero alone"
        );
        assert_eq!(ticks([0.0, 60.0], 6), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
    }

    #[test]
    fn logarithmic_axes_have_powers_of_ten() {
        let words = |values: [f64; 2]| -> Vec<String> {
            let axis = Axis::logarithmic("", values.into_iter());
            axis.ticks([0.0, 1.0], 5).into_iter().map(|(_, label)| label).collect()
        };
        assert_eq!(words([0.05, 1.5e4]), ["10⁻¹", "10⁰", "10¹", "10²", "10³", "10⁴"]);
        assert_eq!(words([3.0, 1e12]).len(), 7);
        assert_eq!(words([2.0, 11.0]), ["2", "5", "10"]);
        assert_eq!(words([5.0, 5.0]), ["2", "5", "10"], "room around a constant");
    }

    #[test]
    fn constant_data_has_a_range() {
        assert_eq!(span([2.0, 2.0].into_iter()), [1.0, 3.0]);
        assert_eq!(span(std::iter::empty()), [0.0, 1.0]);
    }
}
