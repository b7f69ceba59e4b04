//! SIMD types for x86-64, 256 and 512 bits wide.

use super::registers::*;
use super::target::{run_avx2, run_avx512};
use core::arch::x86_64::*;

/// One intrinsic for each operation of a register, by the operation's name.
mod single512 {
    use core::arch::x86_64::*;
    pub use core::arch::x86_64::{
        _mm512_add_ps as add, _mm512_div_ps as div, _mm512_fmadd_ps as fmadd, _mm512_fnmadd_ps as fnmadd,
        _mm512_max_ps as max, _mm512_min_ps as min, _mm512_mul_ps as mul, _mm512_set1_ps as splat,
        _mm512_sqrt_ps as sqrt, _mm512_sub_ps as sub,
    };
    #[inline(always)]
    pub unsafe fn if_negative(x: __m512, below: __m512, otherwise: __m512) -> __m512 {
        // SAFETY: the CPU has the level.
        unsafe {
            let negative = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(x, _mm512_setzero_ps());
            _mm512_mask_blend_ps(negative, otherwise, below)
        }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m512) -> __m512 {
        // SAFETY: the CPU has the level.
        unsafe { _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_castps_si512(x))) }
    }
    pub const LANES: u32 = 16;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m512) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(x, _mm512_setzero_ps()) as u32 }
    }
}

mod double512 {
    use core::arch::x86_64::*;
    pub use core::arch::x86_64::{
        _mm512_add_pd as add, _mm512_div_pd as div, _mm512_fmadd_pd as fmadd, _mm512_fnmadd_pd as fnmadd,
        _mm512_max_pd as max, _mm512_min_pd as min, _mm512_mul_pd as mul, _mm512_set1_pd as splat,
        _mm512_sqrt_pd as sqrt, _mm512_sub_pd as sub,
    };
    #[inline(always)]
    pub unsafe fn if_negative(x: __m512d, below: __m512d, otherwise: __m512d) -> __m512d {
        // SAFETY: the CPU has the level.
        unsafe {
            let negative = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(x, _mm512_setzero_pd());
            _mm512_mask_blend_pd(negative, otherwise, below)
        }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m512d) -> __m512d {
        // SAFETY: the CPU has the level.
        unsafe { _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(x))) }
    }
    pub const LANES: u32 = 8;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m512d) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(x, _mm512_setzero_pd()) as u32 }
    }
}

mod single256 {
    use core::arch::x86_64::*;
    pub use core::arch::x86_64::{
        _mm256_add_ps as add, _mm256_div_ps as div, _mm256_fmadd_ps as fmadd, _mm256_fnmadd_ps as fnmadd,
        _mm256_max_ps as max, _mm256_min_ps as min, _mm256_mul_ps as mul, _mm256_set1_ps as splat,
        _mm256_sqrt_ps as sqrt, _mm256_sub_ps as sub,
    };
    #[inline(always)]
    pub unsafe fn if_negative(x: __m256, below: __m256, otherwise: __m256) -> __m256 {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_blendv_ps(otherwise, below, _mm256_cmp_ps::<_CMP_LT_OQ>(x, _mm256_setzero_ps())) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m256) -> __m256 {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_castps_si256(x))) }
    }
    pub const LANES: u32 = 8;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m256) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(x, _mm256_setzero_ps())) as u32 }
    }
}

mod double256 {
    use core::arch::x86_64::*;
    pub use core::arch::x86_64::{
        _mm256_add_pd as add, _mm256_div_pd as div, _mm256_fmadd_pd as fmadd, _mm256_fnmadd_pd as fnmadd,
        _mm256_max_pd as max, _mm256_min_pd as min, _mm256_mul_pd as mul, _mm256_set1_pd as splat,
        _mm256_sqrt_pd as sqrt, _mm256_sub_pd as sub,
    };
    #[inline(always)]
    pub unsafe fn if_negative(x: __m256d, below: __m256d, otherwise: __m256d) -> __m256d {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_blendv_pd(otherwise, below, _mm256_cmp_pd::<_CMP_LT_OQ>(x, _mm256_setzero_pd())) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m256d) -> __m256d {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(x))) }
    }
    pub const LANES: u32 = 4;
    /// One bit per lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m256d) -> u32 {
        // SAFETY: the CPU has the level.
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(x, _mm256_setzero_pd())) as u32 }
    }
}

double!(F64x16: 16, __m512d, double512, run_avx512);
double!(F64x8: 8, __m256d, double256, run_avx2);
single!(F32x16: 16, F64x16, __m512, single512, run_avx512, border512);
single!(F32x8: 8, F64x8, __m256, single256, run_avx2, border256);

border!(
    border512,
    "avx512f,avx512vl,avx512dq,avx2,fma",
    F32x16,
    F64x16,
    16,
    |x: F32x16| F64x16(_mm512_cvtps_pd(_mm512_castps512_ps256(x.0)), _mm512_cvtps_pd(_mm512_extractf32x8_ps::<1>(x.0))),
    |x: F64x16| F32x16(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(_mm512_cvtpd_ps(x.0)), _mm512_cvtpd_ps(x.1)))
);
border!(
    border256,
    "avx2,fma",
    F32x8,
    F64x8,
    8,
    |x: F32x8| F64x8(_mm256_cvtps_pd(_mm256_castps256_ps128(x.0)), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(x.0))),
    |x: F64x8| F32x8(_mm256_set_m128(_mm256_cvtpd_ps(x.1), _mm256_cvtpd_ps(x.0)))
);

impl Square for F32x16 {
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        F32x16(unsafe { _mm512_loadu_ps(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        unsafe { _mm512_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        // SAFETY: the CPU has the level.
        unsafe {
            // Within quarters of 4 × 4 first, then the quarters among each other.
            for group in block.chunks_exact_mut(4) {
                let [a, b, c, d] = [group[0].0, group[1].0, group[2].0, group[3].0];
                let (ab, ab_high) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
                let (cd, cd_high) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
                group[0] = F32x16(_mm512_shuffle_ps::<0x44>(ab, cd));
                group[1] = F32x16(_mm512_shuffle_ps::<0xee>(ab, cd));
                group[2] = F32x16(_mm512_shuffle_ps::<0x44>(ab_high, cd_high));
                group[3] = F32x16(_mm512_shuffle_ps::<0xee>(ab_high, cd_high));
            }
            for i in 0..4 {
                let [a, b, c, d] = [block[i].0, block[4 + i].0, block[8 + i].0, block[12 + i].0];
                let (ab, ab_odd) = (_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xdd>(a, b));
                let (cd, cd_odd) = (_mm512_shuffle_f32x4::<0x88>(c, d), _mm512_shuffle_f32x4::<0xdd>(c, d));
                block[i] = F32x16(_mm512_shuffle_f32x4::<0x88>(ab, cd));
                block[4 + i] = F32x16(_mm512_shuffle_f32x4::<0x88>(ab_odd, cd_odd));
                block[8 + i] = F32x16(_mm512_shuffle_f32x4::<0xdd>(ab, cd));
                block[12 + i] = F32x16(_mm512_shuffle_f32x4::<0xdd>(ab_odd, cd_odd));
            }
        }
    }
}

impl Square for F32x8 {
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        F32x8(unsafe { _mm256_loadu_ps(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the CPU has the level; the caller says that as many numbers lie there as there are lanes.
        unsafe { _mm256_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        // SAFETY: the CPU has the level.
        unsafe {
            for group in block.chunks_exact_mut(4) {
                let [a, b, c, d] = [group[0].0, group[1].0, group[2].0, group[3].0];
                let (ab, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
                let (cd, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
                group[0] = F32x8(_mm256_shuffle_ps::<0x44>(ab, cd));
                group[1] = F32x8(_mm256_shuffle_ps::<0xee>(ab, cd));
                group[2] = F32x8(_mm256_shuffle_ps::<0x44>(ab_high, cd_high));
                group[3] = F32x8(_mm256_shuffle_ps::<0xee>(ab_high, cd_high));
            }
            for i in 0..4 {
                let (low, high) = (block[i].0, block[4 + i].0);
                block[i] = F32x8(_mm256_permute2f128_ps::<0x20>(low, high));
                block[4 + i] = F32x8(_mm256_permute2f128_ps::<0x31>(low, high));
            }
        }
    }
}
