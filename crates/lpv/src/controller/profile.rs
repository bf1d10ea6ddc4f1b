//! Rest-to-rest profiles s(t) from 0 to 1 with bounded derivatives: what a governed reference moves along.
//!
//! A unit step averaged over N boxes of lengths T₁ ≥ … ≥ T_N is a piecewise polynomial of order N that rests before 0 and
//! after ΣTⱼ:
//!
//! ```text
//! s⁽ᵏ⁾(t) = Σ_S (−1)^|S| (t − Σ_{j∈S} Tⱼ)₊^(N−k) / ((N − k)! T₁…T_N),   S over all subsets of {1, …, N}.
//! ```
//!
//! Every average leaves bounds as they are, and the derivative of an average over T is a difference over T. So
//! |s⁽ᵏ⁾| ≤ pₖ = 1/(T₁…Tₖ), provided that what is subtracted has the other sign nowhere within T: Tⱼ ≥ Tⱼ₊₁ + … + T_N.
//! This is the S-curve that a point-to-point motion with bounded speed, acceleration, jerk and snap has.

/// Derivatives that can be bounded, at most.
pub const MOST_ORDER: usize = 4;
/// What is smaller than this, against its peak, is rounding.
const ROUNDING: f64 = 1e-12;
/// No box is shorter than this where nothing bounds it.
const SHORTEST_S: f64 = 1e-9;
/// Halvings of a bracket when a box length is sought.
const HALVINGS: usize = 50;

/// A profile as its box lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// T₁ … T_N, and zeros.
    boxes: [f64; MOST_ORDER],
    /// N
    order: usize,
}

impl Profile {
    /// The fastest profile with |s⁽ᵏ⁾| ≤ `bounds[k − 1]`; infinite is no bound. Without any bound it is a step.
    ///
    /// The lengths are found from the first to the last: T₁ is the least that satisfies T₁ ≥ 1/b₁ and T₁ ≥ T₂ + … + T_N for
    /// the fastest T₂ … T_N that lead to p₁ = 1/T₁, and so on. These rests fall in T₁, more slowly than T₁ grows, so that
    /// the least T₁ is the best one.
    pub fn fastest(bounds: [f64; MOST_ORDER]) -> Self {
        let order = bounds.iter().rposition(|bound| bound.is_finite()).map_or(0, |last| last + 1);
        let mut boxes = [0.0; MOST_ORDER];
        fastest_boxes(1.0, &bounds[..order], &mut boxes[..order]);
        Self { boxes, order }
    }

    /// The same, `factor` ≥ 1 times as slow: s⁽ᵏ⁾ falls by its k-th power.
    pub fn slower(self, factor: f64) -> Self {
        Self { boxes: self.boxes.map(|length| factor * length), ..self }
    }

    /// pₖ, the bounds of the derivatives k = 1 … 4; zero beyond the order, where nothing asks for them.
    pub fn peaks(&self) -> [f64; MOST_ORDER] {
        let mut peak = 1.0;
        let mut peaks = [0.0; MOST_ORDER];
        for (k, value) in peaks.iter_mut().enumerate().take(self.order) {
            peak /= self.boxes[k];
            *value = peak;
        }
        peaks
    }

    /// When it rests again.
    pub fn duration(&self) -> f64 {
        self.boxes.iter().sum()
    }

    /// [s, s′, s″, s‴, s⁗] at time `t` after its start.
    ///
    /// s⁽ᴺ⁾ is constant between the 2ᴺ times Σ_{j∈S} Tⱼ; from one to the next the derivatives are carried by Taylor's formula. The
    /// sum of truncated powers is the same polynomial, but loses all digits where one box is much longer than the others.
    pub fn at(&self, t: f64) -> [f64; MOST_ORDER + 1] {
        let mut values = [0.0; MOST_ORDER + 1];
        if t >= self.duration() {
            values[0] = 1.0;
            return values;
        }
        let boxes = &self.boxes[..self.order];
        let mut jumps = [(f64::INFINITY, 0.0); 1 << MOST_ORDER];
        for (subset, jump) in jumps.iter_mut().enumerate().take(1 << self.order) {
            let area: f64 = boxes.iter().product();
            *jump = (0.0, 1.0 / area);
            for (j, length) in boxes.iter().enumerate() {
                if subset >> j & 1 == 1 {
                    *jump = (jump.0 + length, -jump.1);
                }
            }
        }
        jumps.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let peaks = self.peaks();
        let mut now = 0.0;
        for (time, jump) in jumps.into_iter().take_while(|&(time, _)| time <= t) {
            self.advance(&mut values, time - now);
            // a rounding error where a derivative should be zero would be carried along for the whole cruise
            for (value, peak) in values[1..].iter_mut().zip(&peaks) {
                *value = if value.abs() < ROUNDING * peak { 0.0 } else { *value };
            }
            values[self.order] += jump;
            now = time;
        }
        if t > now {
            self.advance(&mut values, t - now);
        }
        values
    }

    /// s⁽ᵏ⁾(t + h) = Σ_j s⁽ᵏ⁺ʲ⁾(t) hʲ/j!, where s⁽ᴺ⁾ is constant.
    fn advance(&self, values: &mut [f64; MOST_ORDER + 1], h: f64) {
        for k in 0..self.order {
            let (mut sum, mut factor) = (0.0, 1.0);
            for (j, value) in values[k..=self.order].iter().enumerate() {
                sum += factor * value;
                factor *= h / (j + 1) as f64;
            }
            values[k] = sum;
        }
    }
}

/// The least T with `peak`/T ≤ `bounds[0]` and T ≥ the sum of what follows, and what follows, into `boxes`; their sum.
fn fastest_boxes(peak: f64, bounds: &[f64], boxes: &mut [f64]) -> f64 {
    let ([bound, following @ ..], [length, rest @ ..]) = (bounds, boxes) else { return 0.0 };
    let least = peak / bound;
    match following {
        [] => {
            *length = least;
            return least;
        }
        // T and T′ = peak/(b′T) ≤ T
        [next] => {
            *length = least.max((peak / next).sqrt());
            rest[0] = peak / (next * *length);
            return *length + rest[0];
        }
        _ => {}
    }
    let mut after = |length: f64| fastest_boxes(peak / length, following, rest);
    // below the bracket the rests are longer than T, above it they are not
    let mut high = least.max(SHORTEST_S);
    if after(high) > high {
        while after(high) > high {
            high *= 4.0;
        }
        let mut low = 0.25 * high;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if after(middle) > middle { low = middle } else { high = middle }
        }
    }
    *length = high;
    high + after(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASES: [[f64; MOST_ORDER]; 6] = [
        [0.1, 0.05, 0.2, 1.0],
        [f64::INFINITY, 0.05, 0.2, 1.0],
        [f64::INFINITY, f64::INFINITY, f64::INFINITY, 3.0],
        [f64::INFINITY, 2.0, f64::INFINITY, f64::INFINITY],
        [0.02, f64::INFINITY, f64::INFINITY, 0.4],
        [0.5, f64::INFINITY, f64::INFINITY, f64::INFINITY],
    ];

    #[test]
    fn bounds_are_kept_and_one_of_them_is_reached() {
        for bounds in CASES {
            let profile = Profile::fastest(bounds);
            let mut most = [0.0f64; MOST_ORDER];
            for i in 0..=20_000 {
                let values = profile.at(profile.duration() * f64::from(i) / 20_000.0);
                for (most, value) in most.iter_mut().zip(&values[1..]) {
                    *most = most.max(value.abs());
                }
            }
            let peaks = profile.peaks();
            for k in 0..MOST_ORDER {
                assert!(peaks[k] <= bounds[k] * (1.0 + 1e-9), "{bounds:?}: {peaks:?}");
                assert!(most[k] <= peaks[k] * (1.0 + 1e-9), "{bounds:?}: derivative {} reaches {}", k + 1, most[k]);
            }
            assert!((0..MOST_ORDER).any(|k| most[k] > 0.999 * bounds[k]), "{bounds:?}: {most:?}");
        }
    }

    #[test]
    fn each_derivative_is_that_of_the_one_before() {
        let profile = Profile::fastest([0.3, 0.3, 0.9, 4.0]);
        let h = 1e-4;
        for i in 1..100 {
            let t = profile.duration() * f64::from(i) / 100.0;
            let (before, at, after) = (profile.at(t - h), profile.at(t), profile.at(t + h));
            for k in 0..MOST_ORDER - 1 {
                let slope = (after[k] - before[k]) / (2.0 * h);
                assert!((slope - at[k + 1]).abs() < 1e-3, "derivative {} at {t}: {slope} {}", k + 1, at[k + 1]);
            }
        }
        assert_eq!(profile.at(-1.0), [0.0; 5]);
        assert_eq!(profile.at(profile.duration()), [1.0, 0.0, 0.0, 0.0, 0.0]);
    }

    /// Long cruises lose no digits: at a speed of 10⁻⁴ the middle is the middle, and the end is met.
    #[test]
    fn slow_profiles_are_exact() {
        let profile = Profile::fastest([1e-4, f64::INFINITY, f64::INFINITY, 100.0]);
        let duration = profile.duration();
        assert!(duration > 1e4);
        let middle = profile.at(0.5 * duration);
        assert!((middle[0] - 0.5).abs() < 1e-13 && (middle[1] - 1e-4).abs() < 1e-17, "{middle:?}");
        let end = profile.at(duration * (1.0 - 1e-12));
        assert!((end[0] - 1.0).abs() < 1e-12, "{end:?}");
    }

    /// Minimum times in closed form: 2/√b₂ for bounded acceleration, and (32/b₃)^⅓ for bounded jerk.
    #[test]
    fn times_are_the_least_ones() {
        let none = f64::INFINITY;
        let acceleration = Profile::fastest([none, 2.0, none, none]).duration();
        assert!((acceleration - 2.0 / 2f64.sqrt()).abs() < 1e-12);
        let jerk = Profile::fastest([none, none, 2.0, none]).duration();
        assert!((jerk - (32.0 / 2.0f64).cbrt()).abs() < 1e-12);
        let snap = Profile::fastest([none, none, none, 2.0]).duration();
        assert!((snap - 8.0 * (1.0 / 16.0f64).powf(0.25)).abs() < 1e-12);
    }
}
