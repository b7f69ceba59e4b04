//! Blend shapes: directions in which the resting vertices move, times amounts.
//!
//! Vertices come in tiles of W, x, y and z apart, so that a loop over a tile fills vector registers. The sums of N bodies
//! stay in registers while a tile's directions stream past once.

use crate::memory;
use crate::number::{Real, Scalar};

/// One number of each of W vertices, aligned to a cache line, so that no register load crosses two lines.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Row<C, const W: usize>(pub [C; W]);

/// W vertices: x of each, y of each, z of each.
pub type Tile<C, const W: usize> = [Row<C, W>; 3];

/// The same in P registers per axis.
pub type Registers<V, const P: usize> = [[V; P]; 3];

/// A register of constants: the part-th of a row.
#[inline(always)]
pub fn load<V: Real, C: Scalar, const W: usize>(row: &Row<C, W>, part: usize) -> V {
    let numbers = &row.0[part * V::LANES..][..V::LANES];
    V::from_lanes(|lane| V::Scalar::of(numbers[lane].value()))
}

/// Points (V, 3) cut into tiles, the last one filled up with zeros.
pub fn tiles<C: Scalar, const W: usize>(numbers: &[f64]) -> Vec<Tile<C, W>> {
    let points = numbers.as_chunks::<3>().0;
    let tile = |points: &[[f64; 3]]| {
        // −0 + 0 is 0: adding a direction zero times must change no bit.
        std::array::from_fn(|axis| Row(std::array::from_fn(|i| C::of(points.get(i).map_or(0.0, |p| p[axis] + 0.0)))))
    };
    memory::collect(points.chunks(W).map(tile))
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
        let mut directions = memory::with_capacity(num_tiles * count);
        for tile in 0..num_tiles {
            for k in 0..count {
                directions
                    .push(std::array::from_fn(|axis| Row(std::array::from_fn(|i| number(tile * W + i, axis, k)))));
            }
        }
        Blend { count, directions }
    }

    /// K.
    pub fn count(&self) -> usize {
        self.count
    }

    /// One direction of one point.
    pub fn direction(&self, vertex: usize, k: usize) -> [f64; 3] {
        let tile = &self.directions[vertex / W * self.count + k];
        std::array::from_fn(|axis| tile[axis].0[vertex % W].value())
    }

    /// totals += Σ amounts · directions, for N bodies; amounts left out are zero.
    #[inline(always)]
    pub fn forward<V: Real, const P: usize, const N: usize>(
        &self,
        tile: usize,
        amounts: &[[V::Scalar; N]],
        totals: &mut [Registers<V, P>; N],
    ) {
        let directions = &self.directions[tile * self.count..][..amounts.len()];
        let mut sums = *totals;
        for (direction, amounts) in directions.iter().zip(amounts) {
            // This order needs few registers beside those of the sums.
            for part in 0..P {
                let mut along = [V::zero(); 3];
                for axis in 0..3 {
                    along[axis] = load(&direction[axis], part);
                }
                for body in 0..N {
                    let amount: V = all(amounts[body]);
                    for axis in 0..3 {
                        sums[body][axis][part] = along[axis].mul_add(amount, sums[body][axis][part]);
                    }
                }
            }
        }
        *totals = sums;
    }

    /// The gradient by the amounts, as W partial sums each, from that by the points of a few tiles: few enough that
    /// their directions stay in the cache, and enough that the sums are rarely reloaded.
    #[inline(always)]
    pub fn backward<V: Real, const P: usize, const N: usize>(
        &self,
        first_tile: usize,
        d_points: &[[Registers<V, P>; N]],
        d_amounts: &mut [[[V; P]; N]],
    ) {
        let (blocks, rest) = d_amounts.as_chunks_mut::<TOGETHER>();
        let past = blocks.len() * TOGETHER;
        for (block, d_amounts) in blocks.iter_mut().enumerate() {
            self.backward_block(first_tile, block * TOGETHER, d_points, d_amounts);
        }
        for (k, d_amount) in rest.iter_mut().enumerate() {
            self.backward_block(first_tile, past + k, d_points, std::array::from_mut(d_amount));
        }
    }

    /// [`Blend::backward`] for K directions from the first on.
    #[inline(always)]
    fn backward_block<V: Real, const P: usize, const N: usize, const K: usize>(
        &self,
        first_tile: usize,
        first: usize,
        d_points: &[[Registers<V, P>; N]],
        d_amounts: &mut [[[V; P]; N]; K],
    ) {
        let mut sums = [[[V::zero(); P]; N]; K];
        for (tile, d_points) in d_points.iter().enumerate() {
            let start = (first_tile + tile) * self.count + first;
            let directions: &[Tile<C, W>; K] = self.directions[start..].first_chunk().expect("as many as counted");
            for axis in 0..3 {
                for part in 0..P {
                    let mut along = [V::zero(); K];
                    for k in 0..K {
                        along[k] = load(&directions[k][axis], part);
                    }
                    for body in 0..N {
                        for k in 0..K {
                            sums[k][body][part] = along[k].mul_add(d_points[body][axis][part], sums[k][body][part]);
                        }
                    }
                }
            }
        }
        for k in 0..K {
            for body in 0..N {
                for part in 0..P {
                    d_amounts[k][body][part] = d_amounts[k][body][part] + sums[k][body][part];
                }
            }
        }
    }
}

/// One number in all lanes.
#[inline(always)]
pub fn all<V: Real>(number: V::Scalar) -> V {
    V::from_lanes(|_| number)
}

/// Directions whose sums stay in registers together.
const TOGETHER: usize = 3;

#[inline(always)]
pub fn constants<V: Real, C: Scalar, const W: usize, const P: usize>(tile: &Tile<C, W>) -> Registers<V, P> {
    let mut numbers = [[V::zero(); P]; 3];
    for axis in 0..3 {
        for part in 0..P {
            numbers[axis][part] = load(&tile[axis], part);
        }
    }
    numbers
}

#[inline(always)]
pub fn plus<V: Real, const P: usize>(mut a: Registers<V, P>, b: Registers<V, P>) -> Registers<V, P> {
    for axis in 0..3 {
        for part in 0..P {
            a[axis][part] = a[axis][part] + b[axis][part];
        }
    }
    a
}
