//! When and for how long a flight was beyond what a bound is for.

use serde::Serialize;

/// When a flight was beyond what a bound is for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Excursion {
    /// First time beyond.
    pub from_s: f64,
    /// Last time beyond.
    pub to_s: f64,
    /// Time beyond in between, altogether.
    pub total_s: f64,
}

/// The excursion over samples at `times`, each of which stands for the time up to the next; `None` if none `is_beyond`.
pub fn excursion(times: &[f64], is_beyond: impl Fn(usize) -> bool) -> Option<Excursion> {
    let mut found: Option<Excursion> = None;
    for k in (0..times.len()).filter(|&k| is_beyond(k)) {
        let until = times.get(k + 1).copied().unwrap_or(times[k]);
        let so_far = found.get_or_insert(Excursion { from_s: times[k], to_s: until, total_s: 0.0 });
        so_far.to_s = until;
        so_far.total_s += until - times[k];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excursions_say_when_and_for_how_long() {
        let times = [0.0, 0.5, 1.0, 1.5, 2.0];
        assert_eq!(excursion(&times, |_| false), None);
        let beyond = excursion(&times, |k| k == 1 || k == 3).unwrap();
        assert_eq!(beyond, Excursion { from_s: 0.5, to_s: 2.0, total_s: 1.0 });
    }
}
