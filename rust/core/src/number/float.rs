//! `f32` and `f64` as numbers with one lane.

use super::curves::{self, Format};
use super::{Real, Scalar};

macro_rules! float {
    ($float:ty) => {
        impl Real for $float {
            type Scalar = $float;
            type Wide = f64;
            const LANES: usize = 1;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $float
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
            fn nearest(self) -> Self {
                let rounder = <$float as Format>::ROUNDER as $float;
                (self + rounder) - rounder
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
        }
    };
}

float!(f32);
float!(f64);

// power_of_two: adding 2^(mantissa bits) + bias leaves the biased exponent in the lowest bits; the shift moves it to
// its place and everything else out.
impl Format for f32 {
    const ROUNDER: f64 = 12_582_912.0;
    const EXPONENTS: (f64, f64) = (-126.0, 127.0);
    const DEGREE: usize = 7;
    #[inline(always)]
    fn power_of_two(k: f32) -> f32 {
        f32::from_bits((k + (8_388_608.0 + 127.0)).to_bits() << 23)
    }
}

impl Format for f64 {
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    const EXPONENTS: (f64, f64) = (-1022.0, 1023.0);
    const DEGREE: usize = 13;
    #[inline(always)]
    fn power_of_two(k: f64) -> f64 {
        f64::from_bits((k + (4_503_599_627_370_496.0 + 1023.0)).to_bits() << 52)
    }
}
