//! Building blocks of the SIMD types of all CPUs: one or two registers, with an intrinsic for each operation.
//!
//! `simd` and `neon` name a CPU's intrinsics, and these macros generate its types. Their operations require the CPU
//! level's instructions. That is sound because the types are reachable only through [`super::Data::run_on_lanes`] and
//! [`super::Data::run_on_registers`], which check the level first; the safety comments *the CPU has the level* refer to
//! this. Conversions between single and double precision are not inlined, so that sums in double precision do not take
//! registers from the surrounding loops.

// Names used in the macros' expansions; `simd` and `neon` import all of this file.
pub(super) use super::curves::{self, Format};
pub(super) use super::{Fused, Kernel, Real, Scalar};
pub(super) use std::mem::MaybeUninit;
pub(super) use std::ops::{Add, Div, Mul, Neg, Sub};

macro_rules! operator {
    ($name:ident, $intrinsics:ident, $trait:ident, $method:ident, $($part:tt)+) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the CPU has the level.
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

/// A SIMD type of `$lanes` numbers `$float` in the registers `$part`.
macro_rules! lanes {
    ($name:ident: $lanes:literal x $float:ty, $register:ty, $intrinsics:ident, $($part:tt)+) => {
        impl $name {
            #[inline(always)]
            fn array(self) -> [$float; $lanes] {
                // SAFETY: a lane type is its registers in a row (repr(C)), as long as the array, and every bit pattern is a number.
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
                // SAFETY: the CPU has the level.
                $name($(unsafe { $intrinsics::sub($intrinsics::splat(-0.0), self.$part) }),+)
            }
        }

        impl Format for $name {
            const ROUNDER: f64 = <$float as Format>::ROUNDER;
            const EXPONENTS: (f64, f64) = <$float as Format>::EXPONENTS;
            const POWERS: &'static [f64] = <$float as Format>::POWERS;
            #[inline(always)]
            fn low_bits_as_power(self) -> Self {
                // SAFETY: the CPU has the level.
                $name($(unsafe { $intrinsics::low_bits_as_power(self.$part) }),+)
            }
        }
    };
}

/// The methods of `Real` that all SIMD types share.
macro_rules! arithmetic {
    ($name:ident: $lanes:literal x $float:ty, $intrinsics:ident, $($part:tt)+) => {
        type Scalar = Fused<$float>;
        type Data = $float;
        const LANES: usize = $lanes;

        #[inline(always)]
        fn of(value: f64) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { splat_part!($intrinsics, value as $float, $part) }),+)
        }
        #[inline(always)]
        fn splat(number: $float) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { splat_part!($intrinsics, number, $part) }),+)
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { $intrinsics::fmadd(self.$part, factor.$part, term.$part) }),+)
        }
        #[inline(always)]
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { $intrinsics::fnmadd(self.$part, factor.$part, term.$part) }),+)
        }
        #[inline(always)]
        fn if_negative(self, below: Self, otherwise: Self) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { $intrinsics::if_negative(self.$part, below.$part, otherwise.$part) }),+)
        }
        #[inline(always)]
        fn negative(self) -> u32 {
            // SAFETY: the CPU has the level.
            0 $(| (unsafe { $intrinsics::negative(self.$part) } << ($part * $intrinsics::LANES)))+
        }
        // The instructions return their second operand if either is NaN.
        #[inline(always)]
        fn at_least(self, floor: Self) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { $intrinsics::max(floor.$part, self.$part) }),+)
        }
        #[inline(always)]
        fn at_most(self, ceiling: Self) -> Self {
            // SAFETY: the CPU has the level.
            $name($(unsafe { $intrinsics::min(ceiling.$part, self.$part) }),+)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: the CPU has the level.
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
        fn tanh_of_positive(self) -> Self {
            curves::tanh_of_positive(self)
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
            // SAFETY: a lane type is its registers in a row (repr(C)), as long as the array, and every bit pattern is a number.
            unsafe { std::mem::transmute(numbers) }
        }
    };
}

macro_rules! double {
    ($name:ident: $lanes:literal, $register:ty, $intrinsics:ident, $run:ident) => {
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($register, $register);
        lanes!($name: $lanes x f64, $register, $intrinsics, 0 1);

        impl Real for $name {
            arithmetic!($name: $lanes x f64, $intrinsics, 0 1);
            type Wide = Self;
            #[inline(always)]
            fn dispatch<F: Kernel<A>, A>(arguments: A) -> F::Output {
                // SAFETY: the CPU has the level.
                unsafe { $run::<F, A>(arguments) }
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
    ($name:ident: $lanes:literal, $wide:ident, $register:ty, $intrinsics:ident, $run:ident, $border:ident) => {
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($register);
        lanes!($name: $lanes x f32, $register, $intrinsics, 0);

        impl Real for $name {
            arithmetic!($name: $lanes x f32, $intrinsics, 0);
            type Wide = $wide;
            #[inline(always)]
            fn dispatch<F: Kernel<A>, A>(arguments: A) -> F::Output {
                // SAFETY: the CPU has the level.
                unsafe { $run::<F, A>(arguments) }
            }
            #[inline(always)]
            fn widen(self) -> $wide {
                // SAFETY: the CPU has the level.
                unsafe { $border::widen(self) }
            }
            #[inline(always)]
            fn widen_in_line(self) -> $wide {
                // SAFETY: the CPU has the level.
                unsafe { $border::widen_in_line(self) }
            }
            #[inline(always)]
            fn narrow(wide: $wide) -> Self {
                // SAFETY: the CPU has the level.
                unsafe { $border::narrow(wide) }
            }
            #[inline(always)]
            fn add_to(self, sum: &mut $wide) {
                // SAFETY: the CPU has the level.
                unsafe { $border::add_to(self, sum) }
            }
            #[inline(always)]
            fn read_rows(rows: &[&[f32]], origin: &[[f32; 3]], out: &mut [MaybeUninit<Self>]) {
                // SAFETY: the CPU has the level.
                unsafe { $border::read_rows(rows, origin, out) }
            }
            #[inline(always)]
            fn write_rows(numbers: &[Self], rows: &mut [&mut [f32]]) {
                // SAFETY: the CPU has the level.
                unsafe { $border::write_rows(numbers, rows) }
            }
        }
    };
}

/// Square blocks of bodies × numbers, transposed in registers.
pub(super) trait Square: Real<Data = f32> {
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// Number i of body l becomes lane l of number i, and back.
    fn transpose(block: &mut [Self]);
}

#[inline(always)]
pub(super) fn read_squares<S: Square, const N: usize>(
    rows: &[&[f32]],
    origin: &[[f32; 3]],
    out: &mut [MaybeUninit<S>],
) {
    assert!(rows.len() == N && rows.iter().all(|row| row.len() == out.len()));
    let origins: [S; 3] = std::array::from_fn(|k| S::from_lanes(|lane| S::Scalar::read(origin[lane][k])));
    let whole = out.len() / N * N;
    for start in (0..whole).step_by(N) {
        let mut block = [S::zero(); N];
        for (number, row) in block.iter_mut().zip(rows) {
            // SAFETY: the CPU has the level; start + N ≤ out.len() = row.len().
            *number = unsafe { S::load(row.as_ptr().add(start)) };
        }
        S::transpose(&mut block);
        for (i, &number) in block.iter().enumerate() {
            out[start + i].write(number - origins[(start + i) % 3]);
        }
    }
    for i in whole..out.len() {
        out[i].write(S::from_lanes(|lane| S::Scalar::read(rows[lane][i])) - origins[i % 3]);
    }
}

#[inline(always)]
pub(super) fn write_squares<S: Square, const N: usize>(numbers: &[S], rows: &mut [&mut [f32]]) {
    assert!(rows.len() <= N && rows.iter().all(|row| row.len() == numbers.len()));
    let whole = numbers.len() / N * N;
    for start in (0..whole).step_by(N) {
        let mut block = [S::zero(); N];
        for (i, number) in block.iter_mut().enumerate() {
            *number = numbers[start + i];
        }
        S::transpose(&mut block);
        for (number, row) in block.iter().zip(rows.iter_mut()) {
            // SAFETY: the CPU has the level; start + N ≤ numbers.len() = row.len().
            unsafe { number.store(row.as_mut_ptr().add(start)) };
        }
    }
    for (lane, row) in rows.iter_mut().enumerate() {
        for i in whole..numbers.len() {
            row[i] = numbers[i].lane(lane).data();
        }
    }
}

/// Non-inlined conversions between single and double precision, and between rows of bodies and lanes.
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
            pub fn read_rows(rows: &[&[f32]], origin: &[[f32; 3]], out: &mut [MaybeUninit<$single>]) {
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
