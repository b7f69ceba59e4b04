//! 2^x and tanh from additions and multiplications only: the same bits on every machine of a CPU level, and no library
//! calls.

use super::Real;

/// Constants of a floating-point format.
pub(super) trait Format: Real {
    /// 1.5 · 2^(mantissa bits) + the exponents' bias: adding it to x leaves the nearest integer k, biased, in the lowest
    /// bits of the mantissa.
    const ROUNDER: f64;
    /// Exponents of the smallest and largest normal power of two.
    const EXPONENTS: (f64, f64);
    /// The polynomial for (2^f − 1) / f on |f| ≤ 1/2, to the format's rounding.
    const POWERS: &'static [f64];
    /// 2^k from x + ROUNDER: the shift moves the biased exponent to its place and everything else out.
    fn low_bits_as_power(self) -> Self;
}

/// Nearly minimax in relative error, 1.2e-8: interpolation at Chebyshev's nodes.
pub(super) const SINGLE_POWERS: [f64; 6] = [
    0.6931471880262288,
    0.24022650760568126,
    0.05550357114219078,
    0.009618082557277852,
    0.0013390863364671234,
    0.0001545316294512069,
];

/// Taylor's series, ln(2)^k / k!.
pub(super) const DOUBLE_POWERS: [f64; 13] = {
    let mut table = [0.0; 13];
    let mut term = 1.0;
    let mut k = 0;
    while k < 13 {
        term *= std::f64::consts::LN_2 / (k + 1) as f64;
        table[k] = term;
        k += 1;
    }
    table
};

/// Splits x = k + f with k integral and |f| ≤ 1/2, and returns (2^k, 2^f − 1).
#[inline(always)]
fn split<T: Format>(x: T) -> (T, T) {
    let rounded = x + T::of(T::ROUNDER);
    let f = x - (rounded - T::of(T::ROUNDER));
    let mut series = T::of(T::POWERS[T::POWERS.len() - 1]);
    for &power in T::POWERS[..T::POWERS.len() - 1].iter().rev() {
        series = series.mul_add(f, T::of(power));
    }
    (rounded.low_bits_as_power(), series * f)
}

/// The nearest integer, halves to even.
#[inline(always)]
pub(super) fn nearest<T: Format>(x: T) -> T {
    (x + T::of(T::ROUNDER)) - T::of(T::ROUNDER)
}

#[inline(always)]
pub(super) fn exp2<T: Format>(x: T) -> T {
    let (power, fraction) = split(x.at_least(T::of(T::EXPONENTS.0)).at_most(T::of(T::EXPONENTS.1)));
    power.mul_add(fraction, power)
}

/// tanh x = −m / (2 + m) with m = e^(−2x) − 1 for x ≥ 0, which keeps its relative accuracy down to x = 0.
#[inline(always)]
pub(super) fn tanh_of_positive<T: Format>(x: T) -> T {
    let exponent = x * T::of(-2.0 * std::f64::consts::LOG2_E);
    let (power, fraction) = split(exponent.at_least(T::of(T::EXPONENTS.0)));
    let m = power.mul_add(fraction, power - T::of(1.0));
    // Not −m: for one lane aarch64 compiles −(a·b + c) to (−a)·b − c, whose zero has the opposite sign to the SIMD
    // lanes'.
    m / (T::of(-2.0) - m)
}

#[inline(always)]
pub(super) fn tanh<T: Format>(x: T) -> T {
    let t = tanh_of_positive(x.abs());
    x.if_negative(-t, t)
}

#[cfg(test)]
mod tests {
    use crate::number::{Fused, Real};

    #[test]
    fn exp2_is_within_two_ulp_of_the_platform() {
        for i in -4000..4000 {
            let x = i as f64 * 0.0371;
            let want = f64::exp2(x);
            assert!((Real::exp2(x) / want - 1.0).abs() < 5e-16, "{x}");
            assert!((Fused(x).exp2().0 / want - 1.0).abs() < 5e-16, "{x}");
            let x = x as f32;
            let want = f64::exp2(x as f64);
            assert!((Real::exp2(x) as f64 / want - 1.0).abs() < 2.5e-7 || x.abs() > 125.0, "{x}");
            assert!((Fused(x).exp2().0 as f64 / want - 1.0).abs() < 2.5e-7 || x.abs() > 125.0, "{x}");
        }
        assert!(Real::exp2(-1e30_f32) > 0.0 && Real::exp2(1e30_f64).is_finite());
    }

    #[test]
    fn tanh_keeps_its_relative_accuracy_near_zero() {
        for i in 1..2000 {
            let x = 1.0123_f64.powi(i - 1900);
            assert!((Real::tanh(x) / f64::tanh(x) - 1.0).abs() < 1e-15, "{x}");
            assert_eq!(Real::tanh(-x), -Real::tanh(x));
            let narrow = x as f32;
            if narrow > 1e-30 {
                assert!((Real::tanh(narrow) as f64 / f64::tanh(narrow as f64) - 1.0).abs() < 4e-7, "{x}");
                assert!((Fused(narrow).tanh().0 as f64 / f64::tanh(narrow as f64) - 1.0).abs() < 4e-7, "{x}");
            }
        }
        assert_eq!(Real::tanh(0.0_f64), 0.0);
    }
}
