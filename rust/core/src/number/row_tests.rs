//! Rows of bodies turned into rows of lanes and back ([`Real::read_rows`], [`Real::write_rows`]), on every CPU level.

use super::simd_level::Level;
use super::{Data, Fused, Real, Scalar, Work};
use std::mem::MaybeUninit;

const NUMBERS: [f32; 18] = {
    let [subnormal, largest, infinity, nan] = [1e-40, f32::MAX, f32::INFINITY, f32::NAN];
    [
        0.0, -0.0, 1.0, -1.0, 0.1, -0.3, 3.5, -2.5, 1e-3, 7e8, 1e20, -1e30, -9e-9, subnormal, largest, infinity,
        -infinity, nan,
    ]
};

/// Every operation on every three of the numbers, as many at a time as there are lanes.
struct Operations;

impl Work<f32> for Operations {
    type Output = Vec<[u32; 17]>;
    fn run<R: Real<Data = f32>>(self) -> Self::Output {
        let n = NUMBERS.len();
        let triple = |i: usize| [i % n, i / n % n, i / n / n].map(|k| NUMBERS[k]);
        let mut all = Vec::new();
        for start in (0..n * n * n).step_by(R::LANES) {
            // Lanes past the end repeat the first triples.
            let [x, y, z] = [0, 1, 2].map(|k| R::from_lanes(|l| R::Scalar::read(triple((start + l) % (n * n * n))[k])));
            let results = [
                x + y,
                x - y,
                x * y,
                x / y,
                -x,
                x.mul_add(y, z),
                x.neg_mul_add(y, z),
                x.if_negative(y, z),
                x.at_least(y),
                x.at_most(y),
                x.sqrt(),
                x.ln(),
                x.exp2(),
                x.tanh(),
                R::narrow(x.widen() * y.widen()),
                R::narrow(x.widen().mul_add(y.widen(), z.widen()).at_least(y.widen()).exp2()),
                R::narrow(x.widen().if_negative(y.widen(), z.widen()).sqrt()),
            ];
            all.extend((0..R::LANES).map(|l| results.map(|number| bits(number.lane(l).data()))));
        }
        all.truncate(n * n * n);
        all
    }
}

/// All NaNs are one: their signs and payloads mean nothing.
fn bits(number: f32) -> u32 {
    if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() }
}

fn each_width(mut check: impl FnMut(Level, usize)) {
    for level in Level::available().into_iter().filter(|&level| level != Level::Scalar) {
        f32::widths(level).iter().for_each(|&width| check(level, width));
    }
}

#[test]
fn a_lane_computes_as_one_number() {
    let alone = Operations.run::<Fused<f32>>();
    each_width(|level, width| {
        for (i, (got, want)) in f32::run_on_lanes(level, width, Operations).iter().zip(&alone).enumerate() {
            assert_eq!(got, want, "{level:?}, {width} lanes, numbers {i}");
        }
    });
}

/// Rows of lengths that whole squares fill and that they do not.
struct Rows;

impl Work<f32> for Rows {
    type Output = ();
    fn run<R: Real<Data = f32>>(self) {
        for length in [3, 48, 51, 54, 57] {
            let number = |lane: usize, i: usize| (lane * length + i) as f32;
            let rows: Vec<Vec<f32>> =
                (0..R::LANES).map(|lane| (0..length).map(|i| number(lane, i)).collect()).collect();
            let rows: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
            let origins: Vec<[f32; 3]> = (0..R::LANES).map(|lane| [0.5, 1.5, lane as f32]).collect();
            let mut written = vec![MaybeUninit::new(R::of(f64::NAN)); length];
            R::read_rows(&rows, &origins, &mut written);
            // SAFETY: even what was not written is NaN.
            let read: Vec<R> = written.into_iter().map(|number| unsafe { number.assume_init() }).collect();
            let less = |lane: usize, i: usize| number(lane, i) - origins[lane][i % 3];
            for (i, lanes) in read.iter().enumerate() {
                (0..R::LANES).for_each(|lane| assert_eq!(lanes.lane(lane).data(), less(lane, i)));
            }
            // The last lanes of a batch may have no body.
            for bodies in 1..=R::LANES {
                let mut back = vec![vec![f32::NAN; length]; bodies];
                R::write_rows(&read, &mut back.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
                for (lane, row) in back.iter().enumerate() {
                    (0..length).for_each(|i| assert_eq!(row[i], less(lane, i)));
                }
            }
        }
    }
}

#[test]
fn rows_turn_into_lanes_and_back() {
    each_width(|level, width| f32::run_on_lanes(level, width, Rows));
}
