//! The gates to the CPU's levels: work that is generic over its number enters with the widest number that pays.
//!
//! The CPU's instructions may be used only in functions that are compiled for them. Everything between such a function
//! ([`Real::apart`]) and an operation of a lane type must be inlined into it: rooms mark their loops' helpers as
//! `#[inline(always)]`. Glue between rooms runs anywhere; a single operation there is slow but right.

use super::{Fused, Real, Room};
use crate::error::{Error, Result};
use std::sync::OnceLock;

/// What a CPU offers, least first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Scalar,
    Avx2,
    Avx512,
    Neon,
}

/// Something to compute with any number that reads and writes arrays of `D`.
pub trait Work<D> {
    type Output;
    fn run<R: Real<Data = D>>(self) -> Self::Output;
}

/// The numbers of a format.
pub trait Gates: Sized {
    /// The lanes of its numbers at a level, most first.
    fn widths(level: Level) -> &'static [usize];
    /// Runs `work` on the number with `width` lanes, one of [`Gates::widths`] of the level. Panics unless it is, and the CPU
    /// has the level: this is the only way to the lane types, whose operations rely on its instructions.
    fn enter<W: Work<Self>>(level: Level, width: usize, work: W) -> W::Output;
    /// Runs `work` on the number with the most lanes that the level has in this format, for work on many numbers of one
    /// body. Panics unless the CPU has the level.
    fn enter_registers<W: Work<Self>>(level: Level, work: W) -> W::Output;
}

impl Level {
    const ALL: [(Level, &'static str); 4] =
        [(Level::Avx512, "avx512"), (Level::Avx2, "avx2"), (Level::Neon, "neon"), (Level::Scalar, "scalar")];

    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(level, _)| *level == self).expect("all are listed").1
    }

    fn is_here(self) -> bool {
        match self {
            Level::Scalar => true,
            Level::Neon => cfg!(target_arch = "aarch64"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                Level::Avx2.is_here()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Panics on a machine without the level.
    pub(crate) fn expect_here(self) {
        assert!(self.is_here(), "this machine has no {}", self.name());
    }

    /// Those that this machine has, the best first.
    pub fn available() -> Vec<Level> {
        Self::ALL.into_iter().map(|(level, _)| level).filter(|level| level.is_here()).collect()
    }

    /// The level that batches run on: the best, or the one that the environment variable IPMAN_SIMD names. It is read once.
    pub fn current() -> Result<Level> {
        static LEVEL: OnceLock<Result<Level>> = OnceLock::new();
        LEVEL.get_or_init(|| Self::chosen(std::env::var("IPMAN_SIMD").ok().as_deref())).clone()
    }

    fn chosen(wish: Option<&str>) -> Result<Level> {
        let available = Self::available();
        match wish {
            None | Some("") => Ok(available[0]),
            Some(name) => available.iter().find(|level| level.name() == name).copied().ok_or_else(|| {
                let names: Vec<_> = available.iter().map(|level| level.name()).collect();
                Error::Argument {
                    name: "IPMAN_SIMD",
                    expected: format!("one of this machine's levels, {}", names.join(", ")),
                    got: format!("{name:?}"),
                }
            }),
        }
    }
}

impl Gates for f32 {
    fn widths(level: Level) -> &'static [usize] {
        match level {
            Level::Scalar => &[1],
            Level::Neon => &[4, 1],
            Level::Avx2 => &[8, 1],
            Level::Avx512 => &[16, 8, 1],
        }
    }

    fn enter<W: Work<f32>>(level: Level, width: usize, work: W) -> W::Output {
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

    fn enter_registers<W: Work<f32>>(level: Level, work: W) -> W::Output {
        Self::enter(level, Self::widths(level)[0], work)
    }
}

/// Double precision is for exactness: it runs one body at a time.
impl Gates for f64 {
    fn widths(_: Level) -> &'static [usize] {
        &[1]
    }

    fn enter<W: Work<f64>>(level: Level, _: usize, work: W) -> W::Output {
        level.expect_here();
        match level {
            Level::Scalar => work.run::<f64>(),
            _ => work.run::<Fused<f64>>(),
        }
    }

    fn enter_registers<W: Work<f64>>(level: Level, work: W) -> W::Output {
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

/// [`Real::apart`] of a number whose level is known only when it runs.
#[inline(always)]
pub(super) fn apart_at_current_level<F: Room<A>, A>(arguments: A) -> F::Output {
    #[cfg(target_arch = "x86_64")]
    match Level::current() {
        // SAFETY: the level has been asked of the CPU.
        Ok(Level::Avx512) => return unsafe { super::simd::apart512::<F, A>(arguments) },
        // SAFETY: the level has been asked of the CPU.
        Ok(Level::Avx2) => return unsafe { super::simd::apart256::<F, A>(arguments) },
        _ => {}
    }
    F::enter(arguments)
}

#[cfg(test)]
mod tests {
    use super::*;
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
                let entered = catch_unwind(|| f32::enter(level, width, Nothing)).ok();
                assert_eq!(entered, widths.contains(&width).then_some(width), "{level:?}, {width} lanes");
            }
            assert_eq!(catch_unwind(|| f32::enter_registers(level, Nothing)).is_ok(), level.is_here());
            assert_eq!(catch_unwind(|| f64::enter_registers(level, Nothing)).is_ok(), level.is_here());
            assert_eq!(catch_unwind(|| f64::enter(level, 1, Nothing)).is_ok(), level.is_here());
        }
    }

    #[test]
    fn the_environment_chooses_among_what_is_there() {
        assert_eq!(Level::chosen(Some("scalar")), Ok(Level::Scalar));
        assert_eq!(Level::chosen(None), Ok(Level::available()[0]));
        let error = Level::chosen(Some("mmx")).unwrap_err().to_string();
        assert!(error.contains("IPMAN_SIMD") && error.contains("scalar") && error.contains("mmx"), "{error}");
    }
}
