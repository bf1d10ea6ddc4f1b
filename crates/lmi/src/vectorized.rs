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
            pulp::Arch::new().dispatch(Kernel { $($argument),* })
        }
    };
    (@output) => { () };
    (@output $output:ty) => { $output };
}

pub(crate) use vectorized;
