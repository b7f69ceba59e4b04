//! What lane types share: rows of many bodies turned into rows of lanes, one number at a time.

use super::{Real, Scalar};
use std::mem::MaybeUninit;

/// See [`Real::read_rows`].
#[inline(always)]
pub(super) fn read_rows_one_by_one<R: Real>(rows: &[&[R::Data]], origin: &[[R::Data; 3]], out: &mut [MaybeUninit<R>]) {
    let origin: [R; 3] = [0, 1, 2].map(|k| R::from_lanes(|lane| R::Scalar::read(origin[lane][k])));
    for (i, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        for k in 0..3 {
            out[k].write(R::from_lanes(|lane| R::Scalar::read(rows[lane][3 * i + k])) - origin[k]);
        }
    }
}

/// See [`Real::write_rows`].
#[inline(always)]
pub(super) fn write_rows_one_by_one<R: Real>(numbers: &[R], rows: &mut [&mut [R::Data]]) {
    for (lane, row) in rows.iter_mut().enumerate() {
        for (out, number) in row.iter_mut().zip(numbers) {
            *out = number.lane(lane).data();
        }
    }
}
