//! A number with one lane that rounds as the SIMD types do: `mul_add` rounds once.

use super::curves::{self, Format};
use super::{Kernel, Real, Scalar, target};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A float on a CPU level with fused multiply-add. Correct on any CPU, but slow without it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Fused<F>(pub F);

macro_rules! operator {
    ($float:ty, $trait:ident, $name:ident) => {
        impl $trait for Fused<$float> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Fused(self.0.$name(other.0))
            }
        }
    };
}

macro_rules! fused {
    ($float:ty) => {
        operator!($float, Add, add);
        operator!($float, Sub, sub);
        operator!($float, Mul, mul);
        operator!($float, Div, div);

        impl Neg for Fused<$float> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Fused(-self.0)
            }
        }

        impl Real for Fused<$float> {
            type Scalar = Self;
            type Data = $float;
            type Wide = Fused<f64>;
            const LANES: usize = 1;

            #[inline(always)]
            fn of(value: f64) -> Self {
                Fused(value as $float)
            }
            #[inline(always)]
            fn splat(number: $float) -> Self {
                Fused(number)
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                Fused(self.0.mul_add(factor.0, term.0))
            }
            #[inline(always)]
            fn if_negative(self, below: Self, otherwise: Self) -> Self {
                Fused(self.0.if_negative(below.0, otherwise.0))
            }
            #[inline(always)]
            fn at_least(self, floor: Self) -> Self {
                Fused(self.0.at_least(floor.0))
            }
            #[inline(always)]
            fn at_most(self, ceiling: Self) -> Self {
                Fused(self.0.at_most(ceiling.0))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Fused(self.0.sqrt())
            }
            #[inline(always)]
            fn ln(self) -> Self {
                Fused(self.0.ln())
            }
            #[inline(always)]
            fn exp2(self) -> Self {
                curves::exp2(self)
            }
            #[inline(always)]
            fn tanh(self) -> Self {
                curves::tanh(self)
            }
            #[inline(always)]
            fn tanh_of_positive(self) -> Self {
                curves::tanh_of_positive(self)
            }
            #[inline(always)]
            fn nearest(self) -> Self {
                curves::nearest(self)
            }
            #[inline(always)]
            fn widen(self) -> Fused<f64> {
                Fused(self.0 as f64)
            }
            #[inline(always)]
            fn narrow(wide: Fused<f64>) -> Self {
                Fused(wide.0 as $float)
            }
            #[inline(never)]
            fn dispatch<F: Kernel<A>, A>(arguments: A) -> F::Output {
                target::dispatch_at_current_level::<F, A>(arguments)
            }
            #[inline(always)]
            fn lane(self, _: usize) -> Self {
                self
            }
            #[inline(always)]
            fn from_lanes(mut lane: impl FnMut(usize) -> Self) -> Self {
                lane(0)
            }
        }

        impl Scalar for Fused<$float> {
            #[inline(always)]
            fn value(self) -> f64 {
                self.0 as f64
            }
            #[inline(always)]
            fn read(data: $float) -> Self {
                Fused(data)
            }
            #[inline(always)]
            fn data(self) -> $float {
                self.0
            }
        }

        impl Format for Fused<$float> {
            const ROUNDER: f64 = <$float as Format>::ROUNDER;
            const EXPONENTS: (f64, f64) = <$float as Format>::EXPONENTS;
            const POWERS: &'static [f64] = <$float as Format>::POWERS;
            #[inline(always)]
            fn low_bits_as_power(self) -> Self {
                Fused(self.0.low_bits_as_power())
            }
        }
    };
}

fused!(f32);
fused!(f64);
