//! Skinning weights: each vertex follows a few joints, and neighbours mostly follow the same ones.

use super::blend::{Registers, Row, all, load};
use crate::memory;
use crate::number::{Real, Scalar};

/// A joint's rigid motion: rows (rotation, offset) of a 3 × 4 matrix.
pub type Transform<R> = [[R; 4]; 3];

/// For each tile the joints that move any of its vertices, with W weights each.
pub struct Weights<C, const W: usize> {
    starts: Vec<usize>,
    joints: Vec<usize>,
    weights: Vec<Row<C, W>>,
}

impl<C: Scalar, const W: usize> Weights<C, W> {
    /// `numbers` as (V, J). Only weights that are exactly zero are left out.
    pub fn new(numbers: &[f64], num_joints: usize) -> Self {
        let mut table = Weights { starts: vec![0], joints: Vec::new(), weights: Vec::new() };
        for rows in numbers.chunks(W * num_joints) {
            for joint in 0..num_joints {
                let column: [f64; W] =
                    std::array::from_fn(|i| rows.get(i * num_joints + joint).copied().unwrap_or_default());
                if column.iter().any(|&weight| weight != 0.0) {
                    memory::push(&mut table.joints, joint);
                    memory::push(&mut table.weights, Row(column.map(C::of)));
                }
            }
            memory::push(&mut table.starts, table.joints.len());
        }
        table
    }

    /// The joints that move one vertex, and by how much.
    pub fn of_vertex(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let weights = self.of_tile(vertex / W).map(move |(joint, row)| (joint, row.0[vertex % W].value()));
        weights.filter(|(_, weight)| *weight != 0.0)
    }

    #[inline(always)]
    fn of_tile(&self, tile: usize) -> impl Iterator<Item = (usize, &Row<C, W>)> {
        let range = self.starts[tile]..self.starts[tile + 1];
        self.joints[range.clone()].iter().copied().zip(&self.weights[range])
    }

    /// Σ weights · transforms, applied to each vertex.
    #[inline(always)]
    pub fn forward<V: Real, const P: usize>(
        &self,
        tile: usize,
        transforms: &[Transform<V::Scalar>],
        rest: &Registers<V, P>,
    ) -> Registers<V, P> {
        let mut posed = [[V::zero(); P]; 3];
        for row in 0..3 {
            let [x, y, z, offset]: [[V; P]; 4] = self.blended(tile, transforms, row);
            for i in 0..P {
                let turned = z[i].mul_add(rest[2][i], y[i].mul_add(rest[1][i], x[i] * rest[0][i]));
                posed[row][i] = turned + offset[i];
            }
        }
        posed
    }

    /// One row of each vertex's blended transform, or its first numbers.
    #[inline(always)]
    fn blended<V: Real, const P: usize, const COLUMNS: usize>(
        &self,
        tile: usize,
        transforms: &[Transform<V::Scalar>],
        row: usize,
    ) -> [[V; P]; COLUMNS] {
        let mut sums = [[V::zero(); P]; COLUMNS];
        for (joint, weights) in self.of_tile(tile) {
            let numbers = &transforms[joint][row];
            for part in 0..P {
                let weight: V = load(weights, part);
                for column in 0..COLUMNS {
                    sums[column][part] = weight.mul_add(all(numbers[column]), sums[column][part]);
                }
            }
        }
        sums
    }

    /// The gradient by the resting vertices.
    #[inline(always)]
    pub fn backward_rest<V: Real, const P: usize>(
        &self,
        tile: usize,
        transforms: &[Transform<V::Scalar>],
        d: &Registers<V, P>,
    ) -> Registers<V, P> {
        let mut d_rest = [[V::zero(); P]; 3];
        for row in 0..3 {
            let blended: [[V; P]; 3] = self.blended(tile, transforms, row);
            for column in 0..3 {
                for i in 0..P {
                    d_rest[column][i] = blended[column][i].mul_add(d[row][i], d_rest[column][i]);
                }
            }
        }
        d_rest
    }

    /// The gradient by the transforms, as W sums each.
    #[inline(always)]
    pub fn backward<V: Real, const P: usize>(
        &self,
        tile: usize,
        rest: &Registers<V, P>,
        d: &Registers<V, P>,
        d_transforms: &mut [Transform<[V; P]>],
    ) {
        for (joint, weights) in self.of_tile(tile) {
            for row in 0..3 {
                let [x, y, z, offset] = &mut d_transforms[joint][row];
                for i in 0..P {
                    let pull = load::<V, C, W>(weights, i) * d[row][i];
                    x[i] = pull.mul_add(rest[0][i], x[i]);
                    y[i] = pull.mul_add(rest[1][i], y[i]);
                    z[i] = pull.mul_add(rest[2][i], z[i]);
                    offset[i] = offset[i] + pull;
                }
            }
        }
    }
}
