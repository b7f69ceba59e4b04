//! The traits of numbers ([`Real`], [`Scalar`], [`Data`]) and of what is computed with them ([`Kernel`], [`Work`]).

use super::simd_level::Level;
use std::mem::MaybeUninit;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// How many numbers are summed in their own precision before the sum continues in [`Real::Wide`]: such short sums lose
/// almost no accuracy, and the conversion is paid once per block.
pub const BLOCK: usize = 16;

/// Number of interleaved partial sums over a row: a single body's sum vectorises, and has the same order as in a lane.
pub const SUMS: usize = 8;

/// A computation that is generic over the number type; the numbers are read from and written to arrays of `D`.
pub trait Work<D> {
    type Output;
    fn run<R: Real<Data = D>>(self) -> Self::Output;
}

/// A function that is compiled separately for each number type and its instruction set, see [`Real::dispatch`].
pub trait Kernel<Arguments> {
    type Output;
    /// Implementations must be `#[inline(always)]`.
    fn run(arguments: Arguments) -> Self::Output;
}

/// A number, or one number for each lane.
pub trait Real:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One lane of it.
    type Scalar: Scalar<Data = Self::Data>;
    /// The format of one lane in the caller's arrays.
    type Data: Data;
    /// The type that long sums run in: the same lanes in double precision.
    type Wide: Real<Wide = Self::Wide>;
    const LANES: usize;

    fn of(value: f64) -> Self;
    /// The same number in all lanes.
    fn splat(number: Self::Data) -> Self;
    /// self · factor + term, rounded once where the CPU level has fused operations.
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    /// `below` where self < 0, else `otherwise` (at 0, and for NaN).
    fn if_negative(self, below: Self, otherwise: Self) -> Self;
    fn at_least(self, floor: Self) -> Self;
    fn at_most(self, ceiling: Self) -> Self;
    /// Square root, with derivative 0 at 0: a subgradient of the norm, which the losses rely on.
    fn sqrt(self) -> Self;
    fn ln(self) -> Self;
    /// 2^self, relative error of a few ulp, within the type's normal range (no underflow to 0, no infinity).
    fn exp2(self) -> Self;
    fn tanh(self) -> Self;
    /// tanh for self ≥ 0.
    #[inline(always)]
    fn tanh_of_positive(self) -> Self {
        self.tanh()
    }
    /// The nearest integer, with slope zero; |self| below 2^22 (2^51 in double precision).
    fn nearest(self) -> Self;
    fn widen(self) -> Self::Wide;
    /// [`Real::widen`], inlined: for loops that compute in double precision anyway, where the call would cost more than
    /// the registers that it saves.
    #[inline(always)]
    fn widen_in_line(self) -> Self::Wide {
        self.widen()
    }
    fn narrow(wide: Self::Wide) -> Self;
    /// Runs kernel `F` in a non-inlined function compiled for this number's instruction set.
    #[inline(never)]
    fn dispatch<F: Kernel<A>, A>(arguments: A) -> F::Output {
        F::run(arguments)
    }
    fn lane(self, lane: usize) -> Self::Scalar;
    fn from_lanes(lane: impl FnMut(usize) -> Self::Scalar) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }

    /// −(self · factor) + term
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        (-self).mul_add(factor, term)
    }

    #[inline(always)]
    fn add_to(self, sum: &mut Self::Wide) {
        *sum = *sum + self.widen();
    }

    /// A bit mask of the lanes in which self < 0.
    #[inline(always)]
    fn negative(self) -> u32 {
        let mut lanes = 0;
        for lane in 0..Self::LANES {
            lanes |= u32::from(self.lane(lane).value() < 0.0) << lane;
        }
        lanes
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.if_negative(-self, self)
    }

    /// e^self.
    #[inline(always)]
    fn exp(self) -> Self {
        (self * Self::of(std::f64::consts::LOG2_E)).exp2()
    }

    /// Transposes rows of coordinates, one row per lane and each as long as `out`, into one row of lanes; `origin[k %
    /// 3]` of the lane is subtracted from coordinate k. Writes all of `out`.
    fn read_rows(rows: &[&[Self::Data]], origin: &[[Self::Data; 3]], out: &mut [MaybeUninit<Self>]) {
        read_rows_one_by_one(rows, origin, out);
    }

    /// The inverse of [`Real::read_rows`] without the origin: writes lane l of every number to `rows[l]`.
    fn write_rows(numbers: &[Self], rows: &mut [&mut [Self::Data]]) {
        write_rows_one_by_one(numbers, rows);
    }
}

/// One lane of a number in double precision.
pub type WideScalar<R> = <<R as Real>::Wide as Real>::Scalar;

/// A number with one lane, so that decisions (contact, hull) can be taken on its value.
pub trait Scalar: Real<Scalar = Self> {
    fn value(self) -> f64;
    fn read(data: Self::Data) -> Self;
    fn data(self) -> Self::Data;
}

/// Whether all numbers are finite. Checks 1,024 values at a time so that the loop vectorises.
pub fn all_finite<S: Scalar>(numbers: &[S]) -> bool {
    let broken = |piece: &[S]| piece.iter().fold(false, |broken, x| broken | !x.value().is_finite());
    !numbers.chunks(1024).any(broken)
}

/// A floating-point format of the caller's arrays, f32 or f64; itself a number with one lane.
pub trait Data: Scalar<Data = Self> {
    /// The distance from 1 to the next number.
    const EPSILON: f64;
    /// Selects the copy in this format of constants that are stored in both.
    fn pick<'a>(single: &'a [f32], double: &'a [f64]) -> &'a [Self];
    /// The lane counts available at a level, largest first.
    fn widths(level: Level) -> &'static [usize];
    /// Runs `work` on the number type with `width` lanes. Panics unless `width` is one of [`Data::widths`] and the CPU
    /// supports the level: SIMD types are reachable only through here, because their operations require the level's
    /// instructions.
    fn run_on_lanes<W: Work<Self>>(level: Level, width: usize, work: W) -> W::Output;
    /// Runs `work` on the widest number type of the level in this format, for work on many numbers of one body. Panics
    /// unless the CPU supports the level.
    fn run_on_registers<W: Work<Self>>(level: Level, work: W) -> W::Output;
}

/// See [`Real::read_rows`].
#[inline(always)]
fn read_rows_one_by_one<R: Real>(rows: &[&[R::Data]], origin: &[[R::Data; 3]], out: &mut [MaybeUninit<R>]) {
    let origin: [R; 3] = [0, 1, 2].map(|k| R::from_lanes(|lane| R::Scalar::read(origin[lane][k])));
    for (i, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        for k in 0..3 {
            out[k].write(R::from_lanes(|lane| R::Scalar::read(rows[lane][3 * i + k])) - origin[k]);
        }
    }
}

/// See [`Real::write_rows`].
#[inline(always)]
fn write_rows_one_by_one<R: Real>(numbers: &[R], rows: &mut [&mut [R::Data]]) {
    for (lane, row) in rows.iter_mut().enumerate() {
        for (out, number) in row.iter_mut().zip(numbers) {
            *out = number.lane(lane).data();
        }
    }
}
