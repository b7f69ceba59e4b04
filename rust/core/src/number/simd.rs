//! Lane types on x86-64: the only file with intrinsics. A number is one or two registers; lane l is one body.
//!
//! Their operations may run only behind a gate ([`super::gate`]) of their CPU level, which the gate has made sure of: that
//! is the SAFETY of every `unsafe` here. The crossings between single and double precision are kept out of line, so that
//! sums in double precision do not take registers from the loops around them.

use super::curves::{self, Format};
use super::{Fused, Real, Room, Scalar};
use core::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

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
        unsafe {
            let negative = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(x, _mm512_setzero_ps());
            _mm512_mask_blend_ps(negative, otherwise, below)
        }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m512) -> __m512 {
        unsafe { _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_castps_si512(x))) }
    }
    pub const LANES: u32 = 16;
    /// One bit a lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m512) -> u32 {
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
        unsafe {
            let negative = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(x, _mm512_setzero_pd());
            _mm512_mask_blend_pd(negative, otherwise, below)
        }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m512d) -> __m512d {
        unsafe { _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(x))) }
    }
    pub const LANES: u32 = 8;
    /// One bit a lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m512d) -> u32 {
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
        unsafe { _mm256_blendv_ps(otherwise, below, _mm256_cmp_ps::<_CMP_LT_OQ>(x, _mm256_setzero_ps())) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m256) -> __m256 {
        unsafe { _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_castps_si256(x))) }
    }
    pub const LANES: u32 = 8;
    /// One bit a lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m256) -> u32 {
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
        unsafe { _mm256_blendv_pd(otherwise, below, _mm256_cmp_pd::<_CMP_LT_OQ>(x, _mm256_setzero_pd())) }
    }
    #[inline(always)]
    pub unsafe fn low_bits_as_power(x: __m256d) -> __m256d {
        unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(x))) }
    }
    pub const LANES: u32 = 4;
    /// One bit a lane.
    #[inline(always)]
    pub unsafe fn negative(x: __m256d) -> u32 {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(x, _mm256_setzero_pd())) as u32 }
    }
}

macro_rules! operator {
    ($name:ident, $intrinsics:ident, $trait:ident, $method:ident, $($part:tt)+) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                $name($(unsafe { $intrinsics::$method(self.$part, other.$part) }),+)
            }
        }
    };
}

/// A register for each part, whatever the part's number is.
macro_rules! splat_part {
    ($intrinsics:ident, $value:expr, $part:tt) => {
        $intrinsics::splat($value)
    };
}

/// A lane type of `$lanes` numbers `$float` in the registers `$part`.
macro_rules! lanes {
    ($name:ident: $lanes:literal x $float:ty, $register:ty, $intrinsics:ident, $($part:tt)+) => {
        impl $name {
            #[inline(always)]
            fn array(self) -> [$float; $lanes] {
                unsafe { std::mem::transmute(self) }
            }
        }

        operator!($name, $intrinsics, Add, add, $($part)+);
        operator!($name, $intrinsics, Sub, sub, $($part)+);
        operator!($name, $intrinsics, Mul, mul, $($part)+);
        operator!($name, $intrinsics, Div, div, $($part)+);

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                $name($(unsafe { $intrinsics::sub($intrinsics::splat(-0.0), self.$part) }),+)
            }
        }

        impl Format for $name {
            const ROUNDER: f64 = <$float as Format>::ROUNDER;
            const EXPONENTS: (f64, f64) = <$float as Format>::EXPONENTS;
            const POWERS: &'static [f64] = <$float as Format>::POWERS;
            #[inline(always)]
            fn low_bits_as_power(self) -> Self {
                $name($(unsafe { $intrinsics::low_bits_as_power(self.$part) }),+)
            }
        }
    };
}

/// The methods of `Real` that every lane type has.
macro_rules! arithmetic {
    ($name:ident: $lanes:literal x $float:ty, $intrinsics:ident, $($part:tt)+) => {
        type Scalar = Fused<$float>;
        type Data = $float;
        const LANES: usize = $lanes;

        #[inline(always)]
        fn of(value: f64) -> Self {
            $name($(unsafe { splat_part!($intrinsics, value as $float, $part) }),+)
        }
        #[inline(always)]
        fn splat(number: $float) -> Self {
            $name($(unsafe { splat_part!($intrinsics, number, $part) }),+)
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            $name($(unsafe { $intrinsics::fmadd(self.$part, factor.$part, term.$part) }),+)
        }
        #[inline(always)]
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            $name($(unsafe { $intrinsics::fnmadd(self.$part, factor.$part, term.$part) }),+)
        }
        #[inline(always)]
        fn if_negative(self, below: Self, otherwise: Self) -> Self {
            $name($(unsafe { $intrinsics::if_negative(self.$part, below.$part, otherwise.$part) }),+)
        }
        #[inline(always)]
        fn negative(self) -> u32 {
            0 $(| (unsafe { $intrinsics::negative(self.$part) } << ($part * $intrinsics::LANES)))+
        }
        // The instructions give their second operand where the first is NaN.
        #[inline(always)]
        fn at_least(self, floor: Self) -> Self {
            $name($(unsafe { $intrinsics::max(floor.$part, self.$part) }),+)
        }
        #[inline(always)]
        fn at_most(self, ceiling: Self) -> Self {
            $name($(unsafe { $intrinsics::min(ceiling.$part, self.$part) }),+)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            $name($(unsafe { $intrinsics::sqrt(self.$part) }),+)
        }
        #[inline(always)]
        fn ln(self) -> Self {
            let numbers = self.array();
            Self::from_lanes(|lane| Fused(numbers[lane].ln()))
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
            curves::nearest(self)
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> Fused<$float> {
            Fused(self.array()[lane])
        }
        #[inline(always)]
        fn from_lanes(mut lane: impl FnMut(usize) -> Fused<$float>) -> Self {
            let mut numbers = [0.0; $lanes];
            for (l, number) in numbers.iter_mut().enumerate() {
                *number = lane(l).0;
            }
            unsafe { std::mem::transmute(numbers) }
        }
    };
}

macro_rules! double {
    ($name:ident: $lanes:literal, $register:ty, $intrinsics:ident, $apart:ident) => {
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($register, $register);
        lanes!($name: $lanes x f64, $register, $intrinsics, 0 1);

        impl Real for $name {
            arithmetic!($name: $lanes x f64, $intrinsics, 0 1);
            type Wide = Self;
            #[inline(always)]
            fn apart<F: Room<A>, A>(arguments: A) -> F::Output {
                unsafe { $apart::<F, A>(arguments) }
            }
            #[inline(always)]
            fn widen(self) -> Self {
                self
            }
            #[inline(always)]
            fn narrow(wide: Self) -> Self {
                wide
            }
        }
    };
}

macro_rules! single {
    ($name:ident: $lanes:literal, $wide:ident, $register:ty, $intrinsics:ident, $apart:ident, $border:ident) => {
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($register);
        lanes!($name: $lanes x f32, $register, $intrinsics, 0);

        impl Real for $name {
            arithmetic!($name: $lanes x f32, $intrinsics, 0);
            type Wide = $wide;
            #[inline(always)]
            fn apart<F: Room<A>, A>(arguments: A) -> F::Output {
                unsafe { $apart::<F, A>(arguments) }
            }
            #[inline(always)]
            fn widen(self) -> $wide {
                unsafe { $border::widen(self) }
            }
            #[inline(always)]
            fn widen_in_line(self) -> $wide {
                unsafe { $border::widen_in_line(self) }
            }
            #[inline(always)]
            fn narrow(wide: $wide) -> Self {
                unsafe { $border::narrow(wide) }
            }
            #[inline(always)]
            fn add_to(self, sum: &mut $wide) {
                unsafe { $border::add_to(self, sum) }
            }
            #[inline(always)]
            fn read_rows(rows: &[&[f32]], origin: &[[f32; 3]], out: &mut [Self]) {
                unsafe { $border::read_rows(rows, origin, out) }
            }
            #[inline(always)]
            fn write_rows(numbers: &[Self], rows: &mut [&mut [f32]]) {
                unsafe { $border::write_rows(numbers, rows) }
            }
        }
    };
}

double!(F64x16: 16, __m512d, double512, apart512);
double!(F64x8: 8, __m256d, double256, apart256);
single!(F32x16: 16, F64x16, __m512, single512, apart512, border512);
single!(F32x8: 8, F64x8, __m256, single256, apart256, border256);

#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
pub(super) fn apart512<F: Room<A>, A>(arguments: A) -> F::Output {
    F::enter(arguments)
}

#[inline(never)]
#[target_feature(enable = "avx2,fma")]
pub(super) fn apart256<F: Room<A>, A>(arguments: A) -> F::Output {
    F::enter(arguments)
}

/// Blocks of bodies and numbers that are turned in registers.
trait Square: Real<Data = f32> {
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// Number i of body l becomes lane l of number i, and back.
    fn turn(block: &mut [Self]);
}

#[inline(always)]
fn read_squares<S: Square, const N: usize>(rows: &[&[f32]], origin: &[[f32; 3]], out: &mut [S]) {
    assert!(rows.len() == N && rows.iter().all(|row| row.len() == out.len()));
    let origins: [S; 3] = std::array::from_fn(|k| S::from_lanes(|lane| S::Scalar::read(origin[lane][k])));
    let whole = out.len() / N * N;
    for start in (0..whole).step_by(N) {
        let mut block = [S::zero(); N];
        for (number, row) in block.iter_mut().zip(rows) {
            // start + N ≤ out.len() = row.len()
            *number = unsafe { S::load(row.as_ptr().add(start)) };
        }
        S::turn(&mut block);
        for (i, &number) in block.iter().enumerate() {
            out[start + i] = number - origins[(start + i) % 3];
        }
    }
    for i in whole..out.len() {
        out[i] = S::from_lanes(|lane| S::Scalar::read(rows[lane][i])) - origins[i % 3];
    }
}

#[inline(always)]
fn write_squares<S: Square, const N: usize>(numbers: &[S], rows: &mut [&mut [f32]]) {
    assert!(rows.len() <= N && rows.iter().all(|row| row.len() == numbers.len()));
    let whole = numbers.len() / N * N;
    for start in (0..whole).step_by(N) {
        let mut block = [S::zero(); N];
        block.copy_from_slice(&numbers[start..start + N]);
        S::turn(&mut block);
        for (number, row) in block.iter().zip(rows.iter_mut()) {
            // start + N ≤ numbers.len() = row.len()
            unsafe { number.store(row.as_mut_ptr().add(start)) };
        }
    }
    for (lane, row) in rows.iter_mut().enumerate() {
        for i in whole..numbers.len() {
            row[i] = numbers[i].lane(lane).data();
        }
    }
}

/// What crosses between single and double precision or between bodies and lanes: out of line.
macro_rules! border {
    ($module:ident, $features:literal, $single:ident, $double:ident, $lanes:literal, $widen:expr, $narrow:expr) => {
        mod $module {
            use super::*;

            #[inline(never)]
            #[target_feature(enable = $features)]
            pub fn widen(number: $single) -> $double {
                $widen(number)
            }
            #[inline]
            #[target_feature(enable = $features)]
            pub fn widen_in_line(number: $single) -> $double {
                $widen(number)
            }
            #[inline(never)]
            #[target_feature(enable = $features)]
            pub fn narrow(wide: $double) -> $single {
                $narrow(wide)
            }
            #[inline(never)]
            #[target_feature(enable = $features)]
            pub fn add_to(number: $single, sum: &mut $double) {
                *sum = *sum + $widen(number);
            }
            #[inline(never)]
            #[target_feature(enable = $features)]
            pub fn read_rows(rows: &[&[f32]], origin: &[[f32; 3]], out: &mut [$single]) {
                read_squares::<$single, $lanes>(rows, origin, out);
            }
            #[inline(never)]
            #[target_feature(enable = $features)]
            pub fn write_rows(numbers: &[$single], rows: &mut [&mut [f32]]) {
                write_squares::<$single, $lanes>(numbers, rows);
            }
        }
    };
}

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
        F32x16(unsafe { _mm512_loadu_ps(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm512_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    fn turn(block: &mut [Self]) {
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
        F32x8(unsafe { _mm256_loadu_ps(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm256_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    fn turn(block: &mut [Self]) {
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
