//! Kernels in functions that are compiled for a CPU level's instructions.

use super::Room;
use super::simd_level::Level;

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
pub(super) fn apart512<F: Room<A>, A>(arguments: A) -> F::Output {
    F::enter(arguments)
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn apart256<F: Room<A>, A>(arguments: A) -> F::Output {
    F::enter(arguments)
}

#[cfg(target_arch = "aarch64")]
#[inline(never)]
#[target_feature(enable = "neon")]
pub(super) fn apart128<F: Room<A>, A>(arguments: A) -> F::Output {
    F::enter(arguments)
}

/// [`Real::apart`] of a number whose level is known only when it runs.
#[inline(always)]
pub(super) fn apart_at_current_level<F: Room<A>, A>(arguments: A) -> F::Output {
    #[cfg(target_arch = "x86_64")]
    match Level::current() {
        // SAFETY: the level has been asked of the CPU.
        Ok(Level::Avx512) => return unsafe { apart512::<F, A>(arguments) },
        // SAFETY: the level has been asked of the CPU.
        Ok(Level::Avx2) => return unsafe { apart256::<F, A>(arguments) },
        _ => {}
    }
    F::enter(arguments)
}
