//! Functions compiled for several instruction sets, the best of which is chosen when the program runs.

/// Defines a function whose body is compiled once for each instruction set that `pulp` knows. Everything the body
/// calls in its inner loops is to be marked `#[inline(always)]`, or it is compiled for the lowest set only.
macro_rules! vectorized {
    (
        $(#[$meta:meta])*
        $visibility:vis fn $name:ident<$life:lifetime>($($argument:ident: $type:ty),* $(,)?) $(-> $output:ty)? $body:block
    ) => {
        $(#[$meta])*
        $visibility fn $name<$life>($($argument: $type),*) $(-> $output)? {
            struct Kernel<$life> {
                $($argument: $type,)*
            }
            impl<$life> pulp::WithSimd for Kernel<$life> {
                type Output = vectorized!(@output $($output)?);
                #[inline(always)]
                fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            $crate::vectorized::arch().dispatch(Kernel { $($argument),* })
        }
    };
    (@output) => { () };
    (@output $output:ty) => { $output };
}

pub(crate) use vectorized;

/// The best instruction set of this machine.
#[cfg(not(test))]
#[inline]
pub(crate) fn arch() -> pulp::Arch {
    pulp::Arch::new()
}

#[cfg(test)]
pub(crate) use tests::arch;

#[cfg(test)]
pub(crate) mod tests {
    use crate::{Expr, Mat, Options, Outcome, Problem};
    use std::cell::Cell;

    thread_local! {
        static FORCED: Cell<Option<pulp::Arch>> = const { Cell::new(None) };
    }

    /// The instruction set that a test asks for, otherwise the best one.
    pub fn arch() -> pulp::Arch {
        FORCED.get().unwrap_or_default()
    }

    /// Every instruction set that this machine has.
    fn all() -> Vec<pulp::Arch> {
        let mut all = vec![pulp::Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
            all.extend(pulp::x86::V4::try_new().map(pulp::Arch::V4));
        }
        all
    }

    /// Runs a test with one instruction set after the other.
    pub fn with_every_instruction_set(test: impl Fn()) {
        for set in all() {
            FORCED.set(Some(set));
            test();
        }
        FORCED.set(None);
    }

    /// Blocks of 1 to 33 rows, whole vectors or not: −AY − YAᵀ ≻ 0, Y ⪯ I for A = −I + N has the optimum tr Y = n.
    #[test]
    fn solves_with_every_instruction_set() {
        with_every_instruction_set(|| {
            for n in (1..=12).chain([17, 33]) {
                let mut problem = Problem::new();
                let y = problem.symmetric("Y", n);
                let a = Mat::from_fn(n, n, |i, j| f64::from(i8::from(j == i + 1)) - f64::from(u8::from(i == j)));
                let flow = &a * &y;
                problem.positive_definite("stability", -(&flow + flow.t()));
                problem.positive_definite("bound", Expr::identity(n) - &y);
                problem.maximize(&y.trace());
                let answer = problem.solve(&Options::default()).unwrap();
                assert!(matches!(answer.outcome, Outcome::Solved), "{n}: {:?}", answer.outcome);
                assert!((answer.objective / n as f64 - 1.0).abs() < 1e-6, "{n}: {}", answer.objective);
            }
        });
    }
}
