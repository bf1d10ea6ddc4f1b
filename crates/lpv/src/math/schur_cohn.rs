//! Are all eigenvalues of a matrix inside the unit circle, or is one outside? Decided in balls of any precision.
//!
//! The characteristic polynomial p comes from the method of Faddeev and Le Verrier (products and traces alone, no pivot that could
//! vanish): N₁ = I, c = −tr(M Nₖ)/k, Nₖ₊₁ = M Nₖ + cI. Then the recursion of Schur and Cohn: of a monic p of degree d with p*(z) = zᵈp(1/z)
//! and κ = p(0), the polynomial (p − κp*)/z has, where |κ| < 1, one zero fewer inside the circle and as many on and outside (Rouché's
//! theorem, as |κp*| < |p| on the circle; zeros on it are common to both). A product of zeros |κ| > 1 shows one outside. If |κ| < 1
//! down to degree 0, all are inside. (Jury, Theory and Application of the z-Transform Method, 1964.)
//!
//! Nothing in it minds eigenvalues that are multiple, defective or close to the circle: they ask for more bits.

use super::ball::{Ball, BallMatrix};

/// Where the eigenvalues are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spectrum {
    /// All are inside the unit circle; 1 − |κ| is at least this in every step.
    Inside {
        /// min 1 − |κ|
        margin: f64,
    },
    /// At least one is outside the closed unit disc; the step that shows it has |κ| − 1 at least this.
    Outside {
        /// |κ| − 1
        excess: f64,
    },
    /// |κ| is too near 1 to be told; with more bits it may be unless it is known to 2⁻¹²⁸ already.
    Unknown {
        /// More bits may tell.
        is_open: bool,
    },
}

/// Bits to which |κ| = 1 is taken for a tie.
const TIE_BITS: u64 = 128;

/// Coefficients c₀ … cₙ₋₁ of det(zI − M) = zⁿ + cₙ₋₁zⁿ⁻¹ + … + c₀.
pub fn characteristic_polynomial(m: &BallMatrix) -> Vec<Ball> {
    let n = m.size();
    let mut coefficients = Vec::with_capacity(n);
    let mut auxiliary = BallMatrix::identity(n, m.bits());
    for k in 1..=n {
        let product = m.times(&auxiliary);
        let coefficient = product.trace().negated_over(k);
        auxiliary = product.plus_diagonal(&coefficient);
        coefficients.push(coefficient);
    }
    coefficients.reverse();
    coefficients
}

/// Where the zeros of zⁿ + cₙ₋₁zⁿ⁻¹ + … + c₀ are.
pub fn zeros(mut coefficients: Vec<Ball>, bits: u64) -> Spectrum {
    let one = Ball::new(1.0, bits);
    let mut margin = f64::INFINITY;
    while let Some(kappa) = coefficients.first().cloned() {
        if let Some(excess) = kappa.above_one() {
            return Spectrum::Outside { excess };
        }
        let Some(found) = kappa.below_one() else {
            return Spectrum::Unknown { is_open: !kappa.is_within(TIE_BITS) };
        };
        margin = margin.min(found);
        let d = coefficients.len();
        let leading = one.minus(&kappa.times(&kappa));
        // b_j = (a_{j+1} − κ a_{d−1−j})/(1 − κ²)
        let next = |j: usize| coefficients[j + 1].minus(&kappa.times(&coefficients[d - 1 - j])).over(&leading);
        match (0..d - 1).map(next).collect() {
            Some(next) => coefficients = next,
            None => return Spectrum::Unknown { is_open: true },
        }
    }
    Spectrum::Inside { margin }
}

/// The polynomial whose zeros are q times those of the given one.
pub fn scaled(coefficients: &[Ball], q: f64, bits: u64) -> Vec<Ball> {
    let (q, mut power) = (Ball::new(q, bits), Ball::new(1.0, bits));
    let mut scaled: Vec<Ball> = (coefficients.iter().rev())
        .map(|coefficient| {
            power = power.times(&q);
            coefficient.times(&power)
        })
        .collect();
    scaled.reverse();
    scaled
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Mat;
    use crate::math::interval::Interval;
    use crate::math::matrix::from_rows;

    fn of(matrix: &Mat<f64>, bits: u64) -> Spectrum {
        let entry = |i: usize, j: usize| Interval::point(matrix[(i, j)]);
        let ball = BallMatrix::new(matrix.nrows(), matrix.ncols(), bits, entry, |_, _| 0).unwrap();
        zeros(characteristic_polynomial(&ball), bits)
    }

    fn is_inside(spectrum: Spectrum) -> bool {
        matches!(spectrum, Spectrum::Inside { .. })
    }

    fn is_outside(spectrum: Spectrum) -> bool {
        matches!(spectrum, Spectrum::Outside { .. })
    }

    /// λ on the diagonal, `c` above it: one defective eigenvalue.
    fn jordan(n: usize, eigenvalue: f64, c: f64) -> Mat<f64> {
        Mat::from_fn(n, n, |i, j| if i == j { eigenvalue } else { f64::from(u8::from(j == i + 1)) * c })
    }

    #[test]
    fn one_unit_from_the_circle() {
        for (eigenvalue, inside) in [(1.0_f64.next_down(), true), (1.0_f64.next_up(), false)] {
            for sign in [-1.0, 1.0] {
                for n in [1, 2, 5] {
                    let found = of(&jordan(n, sign * eigenvalue, 3.0), 1500);
                    assert!(
                        if inside { is_inside(found) } else { is_outside(found) },
                        "{n} {sign} {eigenvalue} {found:?}"
                    );
                }
            }
        }
        assert_eq!(of(&jordan(3, 1.0, 1.0), 400), Spectrum::Unknown { is_open: false });
    }

    #[test]
    fn large_defective_matrices() {
        assert!(is_inside(of(&jordan(24, 1.0 - 1e-6, 1.0), 1200)));
        assert!(is_outside(of(&jordan(24, -1.0 - 1e-6, 1.0), 1200)));
        assert_eq!(of(&jordan(24, 1.0 - 1e-6, 1.0), 100), Spectrum::Unknown { is_open: true });
    }

    /// The product of the eigenvalues 2 and 1/2 is 1, which says nothing; scaled a little it does.
    #[test]
    fn a_product_of_one_is_told_after_scaling() {
        let matrix = from_rows(&[vec![2.0, 1.0], vec![0.0, 0.5]]);
        assert_eq!(of(&matrix, 300), Spectrum::Unknown { is_open: false });
        let entry = |i: usize, j: usize| Interval::point(matrix[(i, j)]);
        let ball = BallMatrix::new(2, 2, 300, entry, |_, _| 0).unwrap();
        assert!(is_outside(zeros(scaled(&characteristic_polynomial(&ball), 0.75, 300), 300)));
    }

    #[test]
    fn no_states_and_zeros() {
        assert!(is_inside(zeros(Vec::new(), 64)));
        assert!(is_inside(of(&Mat::zeros(5, 5), 64)));
    }
}
