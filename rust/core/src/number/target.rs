//! Functions compiled for a CPU level's instructions, which run a kernel.

use super::Kernel;
use super::simd_level::Level;

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
pub(super) fn run_avx512<F: Kernel<A>, A>(arguments: A) -> F::Output {
    F::run(arguments)
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_avx2<F: Kernel<A>, A>(arguments: A) -> F::Output {
    F::run(arguments)
}

#[cfg(target_arch = "aarch64")]
#[inline(never)]
#[target_feature(enable = "neon")]
pub(super) fn run_neon<F: Kernel<A>, A>(arguments: A) -> F::Output {
    F::run(arguments)
}

/// [`super::Real::dispatch`] for number types that exist on several levels: asks for the current one.
#[inline(always)]
pub(super) fn dispatch_at_current_level<F: Kernel<A>, A>(arguments: A) -> F::Output {
    #[cfg(target_arch = "x86_64")]
    match Level::current() {
        // SAFETY: `Level::current` is a level that this CPU supports.
        Ok(Level::Avx512) => return unsafe { run_avx512::<F, A>(arguments) },
        // SAFETY: `Level::current` is a level that this CPU supports.
        Ok(Level::Avx2) => return unsafe { run_avx2::<F, A>(arguments) },
        _ => {}
    }
    F::run(arguments)
}
