//! Blend shapes: directions in which the resting vertices move, times amounts.
//!
//! Vertices come in tiles of W, x, y and z apart, so that a loop over a tile fills vector registers. A tile's sums stay
//! in registers while its directions stream past once, and the next body finds them in the cache.

use crate::number::{Real, Scalar};

/// W vertices: x of each, y of each, z of each.
pub type Tile<R, const W: usize> = [[R; W]; 3];

/// Points (V, 3) cut into tiles, the last one filled up with zeros.
pub fn tiles<C: Scalar, const W: usize>(numbers: &[f64]) -> Vec<Tile<C, W>> {
    let points = numbers.as_chunks::<3>().0;
    let tile = |points: &[[f64; 3]]| {
        // −0 + 0 is 0: adding a direction zero times must change no bit.
        std::array::from_fn(|axis| std::array::from_fn(|i| C::of(points.get(i).map_or(0.0, |p| p[axis] + 0.0))))
    };
    points.chunks(W).map(tile).collect()
}

/// K directions of a set of points.
pub struct Blend<C, const W: usize> {
    count: usize,
    /// The K directions of the first tile, those of the second, …
    directions: Vec<Tile<C, W>>,
}

impl<C: Scalar, const W: usize> Blend<C, W> {
    /// `numbers` as (V, 3, K).
    pub fn new(num_vertices: usize, numbers: &[f64], count: usize) -> Self {
        let num_tiles = num_vertices.div_ceil(W);
        let number = |vertex: usize, axis: usize, k: usize| {
            C::of(if vertex < num_vertices { numbers[(3 * vertex + axis) * count + k] } else { 0.0 })
        };
        let mut directions = Vec::with_capacity(num_tiles * count);
        for tile in 0..num_tiles {
            for k in 0..count {
                directions.push(std::array::from_fn(|axis| std::array::from_fn(|i| number(tile * W + i, axis, k))));
            }
        }
        Blend { count, directions }
    }

    /// K.
    pub fn count(&self) -> usize {
        self.count
    }

    /// total += Σ amounts · directions; amounts left out are zero.
    #[inline(always)]
    pub fn forward<R: Real>(&self, tile: usize, amounts: &[R], total: &mut Tile<R, W>) {
        let directions = &self.directions[tile * self.count..][..amounts.len()];
        let mut sum = *total;
        for (direction, &amount) in directions.iter().zip(amounts) {
            for axis in 0..3 {
                for i in 0..W {
                    sum[axis][i] = sum[axis][i] + amount * R::of(direction[axis][i].value());
                }
            }
        }
        *total = sum;
    }

    /// The gradient by the amounts, as W sums each.
    #[inline(always)]
    pub fn backward<R: Real>(&self, tile: usize, d_points: &Tile<R, W>, d_amounts: &mut [[R; W]]) {
        let directions = &self.directions[tile * self.count..][..d_amounts.len()];
        let d_points = *d_points;
        for (direction, d_amount) in directions.iter().zip(d_amounts) {
            let mut sum = *d_amount;
            for axis in 0..3 {
                for i in 0..W {
                    sum[i] = sum[i] + R::of(direction[axis][i].value()) * d_points[axis][i];
                }
            }
            *d_amount = sum;
        }
    }
}
