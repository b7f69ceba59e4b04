//! SIMD types for aarch64, 128 bits wide: every such CPU has NEON.

use super::registers::*;
use super::target::run_neon;
use core::arch::aarch64::*;

/// One intrinsic for each operation of a register, by the operation's name.
mod single128 {
    use core::arch::aarch64::*;
    pub use core::arch::aarch64::{
        vaddq_f32 as add, vdivq_f32 as div, vdupq_n_f32 as splat, vmulq_f32 as mul, vsqrtq_f32 as sqrt,
        vsubq_f32 as sub,
    };
    #[inline(always)]
    pub unsafe fn fmadd(x: float32x4_t, factor: float32x4_t, term: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vfmaq_f32(term, x, factor) }
    }
    #[inline(always)]
    pub unsafe fn fnmadd(x: float32x4_t, factor: float32x4_t, term: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vfmsq_f32(term, x, factor) }
    }
    // NEON's own maximum and minimum are NaN where either operand is, and tell +0 from -0.
    #[inline(always)]
    pub unsafe fn max(a: float32x4_t, b: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f32(vcgtq_f32(a, b), a, b) }
    }
    #[inline(always)]
    pub unsafe fn min(a: float32x4_t, b: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f32(vcltq_f32(a, b), a, b) }
    }
    #[inline(always)]
    pub unsafe fn if_negative(x: float32x4_t, below: float32x4_t, otherwise: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f32(vcltzq_f32(x), below, otherwise) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: float32x4_t) -> float32x4_t {
        // SAFETY: the CPU has the level.
        unsafe { vreinterpretq_f32_u32(vshlq_n_u32::<23>(vreinterpretq_u32_f32(x))) }
    }
    pub const LANES: u32 = 4;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: float32x4_t) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { vaddvq_u32(vandq_u32(vcltzq_f32(x), vld1q_u32([1, 2, 4, 8].as_ptr()))) }
    }
}

mod double128 {
    use core::arch::aarch64::*;
    pub use core::arch::aarch64::{
        vaddq_f64 as add, vdivq_f64 as div, vdupq_n_f64 as splat, vmulq_f64 as mul, vsqrtq_f64 as sqrt,
        vsubq_f64 as sub,
    };
    #[inline(always)]
    pub unsafe fn fmadd(x: float64x2_t, factor: float64x2_t, term: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vfmaq_f64(term, x, factor) }
    }
    #[inline(always)]
    pub unsafe fn fnmadd(x: float64x2_t, factor: float64x2_t, term: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vfmsq_f64(term, x, factor) }
    }
    #[inline(always)]
    pub unsafe fn max(a: float64x2_t, b: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f64(vcgtq_f64(a, b), a, b) }
    }
    #[inline(always)]
    pub unsafe fn min(a: float64x2_t, b: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f64(vcltq_f64(a, b), a, b) }
    }
    #[inline(always)]
    pub unsafe fn if_negative(x: float64x2_t, below: float64x2_t, otherwise: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vbslq_f64(vcltzq_f64(x), below, otherwise) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: float64x2_t) -> float64x2_t {
        // SAFETY: the CPU has the level.
        unsafe { vreinterpretq_f64_u64(vshlq_n_u64::<52>(vreinterpretq_u64_f64(x))) }
    }
    pub const LANES: u32 = 2;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: float64x2_t) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { vaddvq_u64(vandq_u64(vcltzq_f64(x), vld1q_u64([1, 2].as_ptr()))) as u32 }
    }
}

double!(F64x4: 4, float64x2_t, double128, run_neon);
single!(F32x4: 4, F64x4, float32x4_t, single128, run_neon, border128);

border!(
    border128,
    "neon",
    F32x4,
    F64x4,
    4,
    |x: F32x4| F64x4(vcvt_f64_f32(vget_low_f32(x.0)), vcvt_high_f64_f32(x.0)),
    |x: F64x4| F32x4(vcvt_high_f32_f64(vcvt_f32_f64(x.0), x.1))
);

impl Square for F32x4 {
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        F32x4(unsafe { vld1q_f32(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        unsafe { vst1q_f32(to, self.0) }
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        // SAFETY: the CPU has the level.
        unsafe {
            // Within quarters of 2 × 2 first, then the quarters, each row of one a double, among each other.
            let [a, b, c, d] = [block[0].0, block[1].0, block[2].0, block[3].0];
            let (ab, ab_odd) = (vreinterpretq_f64_f32(vtrn1q_f32(a, b)), vreinterpretq_f64_f32(vtrn2q_f32(a, b)));
            let (cd, cd_odd) = (vreinterpretq_f64_f32(vtrn1q_f32(c, d)), vreinterpretq_f64_f32(vtrn2q_f32(c, d)));
            block[0] = F32x4(vreinterpretq_f32_f64(vtrn1q_f64(ab, cd)));
            block[1] = F32x4(vreinterpretq_f32_f64(vtrn1q_f64(ab_odd, cd_odd)));
            block[2] = F32x4(vreinterpretq_f32_f64(vtrn2q_f64(ab, cd)));
            block[3] = F32x4(vreinterpretq_f32_f64(vtrn2q_f64(ab_odd, cd_odd)));
        }
    }
}
