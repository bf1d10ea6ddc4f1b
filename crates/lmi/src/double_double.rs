//! Numbers of twice the precision of `f64`: unevaluated sums h + l with |l| ≤ ulp(h)/2.
//!
//! Every operation below has a relative error of at most [`UNIT`] = 2⁻¹⁰⁰ as long as nothing over- or underflows; the algorithms and
//! their true bounds, 2u² to 16u² with u = 2⁻⁵³, are those of Joldes, Muller and Popescu (ACM Trans. Math. Softw. 44, 2017).

/// Bound on the relative error of one operation, with room to spare.
pub(crate) const UNIT: f64 = 1.0 / (1_u128 << 100) as f64;

/// h + l.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Double {
    pub h: f64,
    pub l: f64,
}

/// a + b exactly, for |a| ≥ |b| or a = 0.
#[inline(always)]
pub(crate) fn fast_two_sum(a: f64, b: f64) -> Double {
    let h = a + b;
    Double { h, l: b - (h - a) }
}

/// a + b exactly.
#[inline(always)]
pub(crate) fn two_sum(a: f64, b: f64) -> Double {
    let h = a + b;
    let t = h - a;
    Double { h, l: (a - (h - t)) + (b - t) }
}

/// a·b exactly.
#[inline(always)]
pub(crate) fn two_product(a: f64, b: f64) -> Double {
    let h = a * b;
    Double { h, l: a.mul_add(b, -h) }
}

#[inline(always)]
pub(crate) fn add(a: Double, b: Double) -> Double {
    let (s, t) = (two_sum(a.h, b.h), two_sum(a.l, b.l));
    let v = fast_two_sum(s.h, s.l + t.h);
    fast_two_sum(v.h, t.l + v.l)
}

/// a + b with an error of a few `UNIT`(|a| + |b|), in two thirds of the time: where a and b cancel, relative accuracy goes.
#[inline(always)]
pub(crate) fn accumulate(a: Double, b: Double) -> Double {
    let s = two_sum(a.h, b.h);
    fast_two_sum(s.h, s.l + (a.l + b.l))
}

#[inline(always)]
pub(crate) fn multiply(a: Double, b: Double) -> Double {
    let p = two_product(a.h, b.h);
    fast_two_sum(p.h, p.l + a.l.mul_add(b.h, a.h * b.l))
}

#[inline(always)]
pub(crate) fn multiply_by(a: Double, b: f64) -> Double {
    let p = two_product(a.h, b);
    fast_two_sum(p.h, a.l.mul_add(b, p.l))
}

/// 1/a for a > 0.
#[inline(always)]
pub(crate) fn reciprocal(a: Double) -> Double {
    let q = 1.0 / a.h;
    // 1 − q a: the first part is exact.
    let rest = (-q).mul_add(a.h, 1.0) - q * a.l;
    fast_two_sum(q, q * rest)
}

/// √a for a > 0.
#[inline(always)]
pub(crate) fn square_root(a: Double) -> Double {
    let h = a.h.sqrt();
    let p = two_product(h, h);
    let rest = ((a.h - p.h) - p.l) + a.l;
    fast_two_sum(h, rest / (2.0 * h))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The relative difference of two numbers that should be equal, in double-double arithmetic itself.
    fn difference(a: Double, b: Double) -> f64 {
        let d = add(a, Double { h: -b.h, l: -b.l });
        ((d.h + d.l) / b.h).abs()
    }

    #[test]
    fn inverse_operations_cancel() {
        let mut seed = 1_u64;
        for _ in 0..1000 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let h = 0.5 + (seed >> 11) as f64 / (1_u64 << 53) as f64;
            let a = fast_two_sum(h, h * 3e-17);
            let root = square_root(a);
            assert!(difference(multiply(root, root), a) < 4.0 * UNIT);
            let one = multiply(a, reciprocal(a));
            assert!(difference(one, Double { h: 1.0, l: 0.0 }) < 4.0 * UNIT);
            let tripled = add(a, add(a, a));
            assert!(difference(tripled, multiply_by(a, 3.0)) < 4.0 * UNIT);
        }
    }
}
