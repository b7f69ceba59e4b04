//! What lane types share: rows of many bodies turned into rows of lanes, one number at a time.

use super::{Data, Real, Scalar};

/// See [`Real::read_rows`].
#[inline(always)]
pub(super) fn read_rows_one_by_one<R: Real>(rows: &[&[R::Data]], origin: &[[R::Data; 3]], out: &mut [R]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = R::from_lanes(|lane| R::Scalar::read(less(rows[lane][i], origin[lane][i % 3])));
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

#[inline(always)]
fn less<D: Data>(number: D, origin: D) -> D {
    number - origin
}
