//! Curves with as many points as can be seen.

/// The points of a polyline that are needed to stay within `tolerance` of it (Ramer 1972, Douglas and Peucker 1973).
pub(super) fn simplify(points: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        let farthest = (first + 1..last)
            .map(|k| (k, distance(points[k], points[first], points[last])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, far)) = farthest.filter(|&(_, far)| far > tolerance) {
            debug_assert!(far.is_finite());
            keep[k] = true;
            open.extend([(first, k), (k, last)]);
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(point, _)| *point).collect()
}

/// Distance of `p` from the segment from `a` to `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length_squared = dx * dx + dy * dy;
    let along = if length_squared > 0.0 {
        (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - along * dx).hypot(p[1] - a[1] - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// No point of the original is farther than the tolerance from what is kept.
        #[test]
        fn simplified_curve_stays_close(heights in proptest::collection::vec(-5.0..5.0f64, 3..60)) {
            let points: Vec<[f64; 2]> = heights.iter().enumerate().map(|(k, y)| [k as f64, *y]).collect();
            let kept = simplify(&points, 0.5);
            prop_assert!(kept.len() <= points.len());
            for point in &points {
                let close = kept.windows(2).map(|pair| distance(*point, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
                prop_assert!(close <= 0.5 + 1e-12);
            }
        }
    }

    #[test]
    fn straight_line_keeps_its_ends() {
        let line: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k), 2.0 * f64::from(k)]).collect();
        assert_eq!(simplify(&line, 0.1), [[0.0, 0.0], [99.0, 198.0]]);
    }
}
