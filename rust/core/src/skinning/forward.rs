//! From placed joints to posed vertices, tile by tile.

use super::blend::{Registers, Tile, all, constants, plus};
use super::{Block, Skin, Start};
use crate::memory;
use crate::number::{Real, Scalar};

impl<C: Scalar, const W: usize> Skin<C, W> {
    /// The resting tiles of one shape, for bodies that all have it.
    #[inline(always)]
    pub fn shaped<V: Real<Data = C>, const P: usize>(
        &self,
        betas: &[V::Scalar],
        expression: &[V::Scalar],
    ) -> Vec<Tile<C, W>> {
        let (betas, expression) = (betas.as_chunks::<1>().0, expression.as_chunks::<1>().0);
        let mut shaped = memory::copied(&self.template);
        for (tile, points) in shaped.iter_mut().enumerate() {
            let [displacement]: [Registers<V, P>; 1] = self.shape(tile, betas, expression);
            let rest = plus(constants(points), displacement);
            for axis in 0..3 {
                for i in 0..W {
                    points[axis].0[i] = rest[axis][i / V::LANES].lane(i % V::LANES).data();
                }
            }
        }
        shaped
    }

    /// The resting vertices of one tile.
    #[inline(always)]
    pub(super) fn rest<V: Real, const P: usize, const N: usize>(
        &self,
        start: Start<C, W>,
        tile: usize,
        block: &Block<V::Scalar, N>,
    ) -> [Registers<V, P>; N] {
        // Displacements are summed separately: added to the template's coordinates one by one, each would round.
        let mut rest = [constants(&start.tiles[tile]); N];
        if !start.shaped {
            let displacements = self.shape(tile, &block.betas, &block.expression);
            for body in 0..N {
                rest[body] = plus(rest[body], displacements[body]);
            }
        }
        if !block.features.is_empty() {
            let mut displacements = [[[V::zero(); P]; 3]; N];
            self.pose.forward(tile, &block.features, &mut displacements);
            for body in 0..N {
                rest[body] = plus(rest[body], displacements[body]);
            }
        }
        rest
    }

    /// The displacements of one tile by the shape.
    #[inline(always)]
    fn shape<V: Real, const P: usize, const N: usize>(
        &self,
        tile: usize,
        betas: &[[V::Scalar; N]],
        expression: &[[V::Scalar; N]],
    ) -> [Registers<V, P>; N] {
        let mut displacements = [[[V::zero(); P]; 3]; N];
        self.betas.surface.forward(tile, betas, &mut displacements);
        self.expression.surface.forward(tile, expression, &mut displacements);
        displacements
    }

    /// The posed vertices of one tile.
    #[inline(always)]
    pub fn forward<V: Real, const P: usize, const N: usize>(
        &self,
        start: Start<C, W>,
        tile: usize,
        block: &Block<V::Scalar, N>,
    ) -> [Registers<V, P>; N] {
        let mut tiles = self.rest(start, tile, block);
        for i in 0..N {
            let body = &block.bodies[i];
            tiles[i] = self.weights.forward(tile, &body.transforms, &tiles[i]);
            for axis in 0..3 {
                for part in 0..P {
                    tiles[i][axis][part] = tiles[i][axis][part] + all(body.shift[axis]);
                }
            }
        }
        tiles
    }
}
