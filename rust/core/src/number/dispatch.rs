//! [`Data`] for f32 and f64: which number types each CPU level computes with. SIMD types are reachable only through
//! here.

use super::simd_level::Level;
use super::{Data, Fused, Work};

impl Data for f32 {
    const EPSILON: f64 = f32::EPSILON as f64;
    #[inline(always)]
    fn pick<'a>(single: &'a [f32], _: &'a [f64]) -> &'a [f32] {
        single
    }

    fn widths(level: Level) -> &'static [usize] {
        match level {
            Level::Scalar => &[1],
            Level::Neon => &[4, 1],
            Level::Avx2 => &[8, 1],
            Level::Avx512 => &[16, 8, 1],
        }
    }

    fn run_on_lanes<W: Work<f32>>(level: Level, width: usize, work: W) -> W::Output {
        level.expect_here();
        assert!(Self::widths(level).contains(&width), "{} has no {width} lanes", level.name());
        match (level, width) {
            #[cfg(target_arch = "x86_64")]
            (_, 16) => work.run::<super::simd::F32x16>(),
            #[cfg(target_arch = "x86_64")]
            (_, 8) => work.run::<super::simd::F32x8>(),
            #[cfg(target_arch = "aarch64")]
            (_, 4) => work.run::<super::neon::F32x4>(),
            (Level::Scalar, _) => work.run::<f32>(),
            _ => work.run::<Fused<f32>>(),
        }
    }

    fn run_on_registers<W: Work<f32>>(level: Level, work: W) -> W::Output {
        Self::run_on_lanes(level, Self::widths(level)[0], work)
    }
}

/// Double precision is for accuracy, not speed: one body at a time.
impl Data for f64 {
    const EPSILON: f64 = f64::EPSILON;
    #[inline(always)]
    fn pick<'a>(_: &'a [f32], double: &'a [f64]) -> &'a [f64] {
        double
    }

    fn widths(_: Level) -> &'static [usize] {
        &[1]
    }

    fn run_on_lanes<W: Work<f64>>(level: Level, _: usize, work: W) -> W::Output {
        level.expect_here();
        match level {
            Level::Scalar => work.run::<f64>(),
            _ => work.run::<Fused<f64>>(),
        }
    }

    fn run_on_registers<W: Work<f64>>(level: Level, work: W) -> W::Output {
        level.expect_here();
        match level {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => work.run::<super::simd::F64x16>(),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => work.run::<super::simd::F64x8>(),
            #[cfg(target_arch = "aarch64")]
            Level::Neon => work.run::<super::neon::F64x4>(),
            _ => work.run::<f64>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Real;
    use std::panic::catch_unwind;

    struct Nothing;

    impl<D> Work<D> for Nothing {
        type Output = usize;
        fn run<R: Real<Data = D>>(self) -> usize {
            R::LANES
        }
    }

    #[test]
    fn no_gate_opens_to_lanes_that_are_not_here() {
        for (level, _) in Level::ALL {
            let widths = if level.is_here() { f32::widths(level) } else { &[] };
            for width in [0, 1, 2, 4, 8, 16, 32] {
                let entered = catch_unwind(|| f32::run_on_lanes(level, width, Nothing)).ok();
                assert_eq!(entered, widths.contains(&width).then_some(width), "{level:?}, {width} lanes");
            }
            assert_eq!(catch_unwind(|| f32::run_on_registers(level, Nothing)).is_ok(), level.is_here());
            assert_eq!(catch_unwind(|| f64::run_on_registers(level, Nothing)).is_ok(), level.is_here());
            assert_eq!(catch_unwind(|| f64::run_on_lanes(level, 1, Nothing)).is_ok(), level.is_here());
        }
    }
}
