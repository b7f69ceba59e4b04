//! Skinning weights: each vertex follows a few joints, and neighbours mostly follow the same ones.

use super::blend::Tile;
use crate::number::{Real, Scalar};

/// A joint's rigid motion: rows (rotation, offset) of a 3 × 4 matrix.
pub type Transform<R> = [[R; 4]; 3];

/// For each tile the joints that move any of its vertices, with W weights each.
pub struct Weights<C, const W: usize> {
    starts: Vec<usize>,
    joints: Vec<usize>,
    weights: Vec<[C; W]>,
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
                    table.joints.push(joint);
                    table.weights.push(column.map(C::of));
                }
            }
            table.starts.push(table.joints.len());
        }
        table
    }

    #[inline(always)]
    fn of_tile(&self, tile: usize) -> impl Iterator<Item = (usize, &[C; W])> {
        let range = self.starts[tile]..self.starts[tile + 1];
        self.joints[range.clone()].iter().copied().zip(&self.weights[range])
    }

    /// Σ weights · transforms, applied to each vertex.
    #[inline(always)]
    pub fn forward<R: Real>(&self, tile: usize, transforms: &[Transform<R>], rest: &Tile<R, W>) -> Tile<R, W> {
        let mut posed = [[R::zero(); W]; 3];
        for row in 0..3 {
            let blended = |column: usize| self.blended(tile, transforms, row, column);
            let [x, y, z, offset] = [blended(0), blended(1), blended(2), blended(3)];
            for i in 0..W {
                posed[row][i] = x[i] * rest[0][i] + y[i] * rest[1][i] + z[i] * rest[2][i] + offset[i];
            }
        }
        posed
    }

    /// One number of each vertex's blended transform.
    #[inline(always)]
    fn blended<R: Real>(&self, tile: usize, transforms: &[Transform<R>], row: usize, column: usize) -> [R; W] {
        let mut sum = [R::zero(); W];
        for (joint, weights) in self.of_tile(tile) {
            let number = transforms[joint][row][column];
            for i in 0..W {
                sum[i] = sum[i] + R::of(weights[i].value()) * number;
            }
        }
        sum
    }

    /// The gradient by the resting vertices.
    #[inline(always)]
    pub fn backward_rest<R: Real>(&self, tile: usize, transforms: &[Transform<R>], d: &Tile<R, W>) -> Tile<R, W> {
        let mut d_rest = [[R::zero(); W]; 3];
        for (joint, weights) in self.of_tile(tile) {
            let transform = &transforms[joint];
            for column in 0..3 {
                for i in 0..W {
                    let pulled = transform[0][column] * d[0][i]
                        + transform[1][column] * d[1][i]
                        + transform[2][column] * d[2][i];
                    d_rest[column][i] = d_rest[column][i] + R::of(weights[i].value()) * pulled;
                }
            }
        }
        d_rest
    }

    /// The gradient by the transforms, as W sums each.
    #[inline(always)]
    pub fn backward<R: Real>(
        &self,
        tile: usize,
        rest: &Tile<R, W>,
        d: &Tile<R, W>,
        d_transforms: &mut [Transform<[R; W]>],
    ) {
        for (joint, weights) in self.of_tile(tile) {
            for row in 0..3 {
                let mut pull = [R::zero(); W];
                for i in 0..W {
                    pull[i] = R::of(weights[i].value()) * d[row][i];
                }
                let [x, y, z, offset] = &mut d_transforms[joint][row];
                for i in 0..W {
                    x[i] = x[i] + pull[i] * rest[0][i];
                    y[i] = y[i] + pull[i] * rest[1][i];
                    z[i] = z[i] + pull[i] * rest[2][i];
                    offset[i] = offset[i] + pull[i];
                }
            }
        }
    }
}
