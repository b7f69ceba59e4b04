//! `f32` and `f64` as numbers with one lane, on any CPU.

use super::curves::{self, DOUBLE_POWERS, Format, SINGLE_POWERS};
use super::{Real, Scalar};

macro_rules! float {
    ($float:ty) => {
        impl Real for $float {
            type Scalar = $float;
            type Data = $float;
            type Wide = f64;
            const LANES: usize = 1;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $float
            }
            #[inline(always)]
            fn splat(number: $float) -> Self {
                number
            }
            #[inline(always)]
            fn if_negative(self, below: Self, otherwise: Self) -> Self {
                if self < 0.0 { below } else { otherwise }
            }
            #[inline(always)]
            fn at_least(self, floor: Self) -> Self {
                if self < floor { floor } else { self }
            }
            #[inline(always)]
            fn at_most(self, ceiling: Self) -> Self {
                if self > ceiling { ceiling } else { self }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$float>::sqrt(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                <$float>::ln(self)
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
            fn widen(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn narrow(wide: f64) -> Self {
                wide as $float
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

        impl Scalar for $float {
            #[inline(always)]
            fn value(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn read(data: $float) -> Self {
                data
            }
            #[inline(always)]
            fn data(self) -> $float {
                self
            }
        }
    };
}

float!(f32);
float!(f64);

impl Format for f32 {
    const ROUNDER: f64 = 12_582_912.0 + 127.0;
    const EXPONENTS: (f64, f64) = (-126.0, 127.0);
    const POWERS: &'static [f64] = &SINGLE_POWERS;
    #[inline(always)]
    fn low_bits_as_power(self) -> f32 {
        f32::from_bits(self.to_bits() << 23)
    }
}

impl Format for f64 {
    const ROUNDER: f64 = 6_755_399_441_055_744.0 + 1023.0;
    const EXPONENTS: (f64, f64) = (-1022.0, 1023.0);
    const POWERS: &'static [f64] = &DOUBLE_POWERS;
    #[inline(always)]
    fn low_bits_as_power(self) -> f64 {
        f64::from_bits(self.to_bits() << 52)
    }
}
