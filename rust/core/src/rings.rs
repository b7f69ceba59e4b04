//! Rings: around each point of a closed part its neighbours in cyclic order.
//!
//! The faces at a point v close a fan; the sum of their area vectors is the area vector A of the ring, whatever point
//! the fan has. So ∂vol/∂v = A/3, and since the volume is homogeneous of degree three, vol = ⅓ Σ_v v·∂vol/∂v = Σ_v
//! v·A_v/9: one pass over the rings gives the part's volume and its gradient. A ring's edges are taken relative to its
//! first neighbour, so they are short and keep their accuracy in single precision.

use crate::memory;
use crate::number::vector::{Vec3, add_cross, sub};
use crate::number::{BLOCK, Real};
use std::ops::Range;

/// The rings of one closed part. A point where the part touches itself has several.
#[derive(Clone, Debug, Default)]
pub struct Rings {
    /// The point of each ring.
    pub points: Vec<u32>,
    neighbours: Vec<u32>,
    blocks: Vec<Block>,
}

/// Up to [`BLOCK`] consecutive rings of one size.
#[derive(Clone, Debug)]
pub struct Block {
    pub rings: Range<usize>,
    size: usize,
    /// Where the rings' neighbours start.
    start: usize,
}

impl Rings {
    pub fn new(faces: &[[u32; 3]]) -> Self {
        let (mut cycles, corners) = cycles(faces);
        cycles.sort_unstable_by_key(|cycle| (cycle.corners.len(), cycle.point, cycle.corners.start));
        let mut all = Rings {
            points: memory::with_capacity(cycles.len()),
            neighbours: memory::with_capacity(corners.len()),
            blocks: Vec::new(),
        };
        for run in cycles.chunk_by(|a, b| a.corners.len() == b.corners.len()) {
            for block in run.chunks(BLOCK) {
                let first = all.points.len();
                let (size, start) = (block[0].corners.len(), all.neighbours.len());
                for cycle in block {
                    all.points.push(cycle.point);
                    all.neighbours.extend_from_slice(&corners[cycle.corners.clone()]);
                }
                memory::push(&mut all.blocks, Block { rings: first..all.points.len(), size, start });
            }
        }
        all
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Twice the area vector of each ring of a block; nothing is written beyond the block's end.
    #[inline(always)]
    pub fn area_vectors<R: Real>(&self, block: &Block, points: &[Vec3<R>], doubled: &mut [Vec3<R>; BLOCK]) {
        match block.size {
            3 => self.of_size::<R, 3>(block, points, doubled),
            4 => self.of_size::<R, 4>(block, points, doubled),
            5 => self.of_size::<R, 5>(block, points, doubled),
            6 => self.of_size::<R, 6>(block, points, doubled),
            7 => self.of_size::<R, 7>(block, points, doubled),
            8 => self.of_size::<R, 8>(block, points, doubled),
            size => {
                let rings = self.neighbours[block.start..].chunks_exact(size).take(block.rings.len());
                for (doubled, ring) in doubled.iter_mut().zip(rings) {
                    *doubled = area_vector(ring, points);
                }
            }
        }
    }

    /// The same with a size known at compile time.
    #[inline(always)]
    fn of_size<R: Real, const N: usize>(&self, block: &Block, points: &[Vec3<R>], doubled: &mut [Vec3<R>; BLOCK]) {
        let rings = self.neighbours[block.start..].as_chunks::<N>().0;
        for (doubled, ring) in doubled.iter_mut().zip(&rings[..block.rings.len()]) {
            *doubled = area_vector(ring, points);
        }
    }
}

/// Twice the area vector of a closed polygon, as a fan from its first corner.
#[inline(always)]
fn area_vector<R: Real>(ring: &[u32], points: &[Vec3<R>]) -> Vec3<R> {
    let apex = points[ring[0] as usize];
    let mut edge = sub(points[ring[1] as usize], apex);
    let mut doubled = [R::zero(); 3];
    for &corner in &ring[2..] {
        let next = sub(points[corner as usize], apex);
        doubled = add_cross(doubled, edge, next);
        edge = next;
    }
    doubled
}

/// A ring before it is assigned to a block.
struct Cycle {
    point: u32,
    /// Where its corners are.
    corners: Range<usize>,
}

/// The cycles that the edges opposite to each point form, and their corners. In a closed part every point has as many
/// edges in as out.
fn cycles(faces: &[[u32; 3]]) -> (Vec<Cycle>, Vec<u32>) {
    let mut opposite = memory::with_capacity(3 * faces.len());
    for (face, &[a, b, c]) in faces.iter().enumerate() {
        for (point, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            opposite.push((point, face as u32, from, to));
        }
    }
    opposite.sort_unstable();
    let (mut all, mut corners) = (Vec::new(), memory::with_capacity(opposite.len()));
    let mut edges = Vec::new();
    for around in opposite.chunk_by(|a, b| a.0 == b.0) {
        edges.clear();
        memory::extend(&mut edges, around.iter().map(|&(_, _, from, to)| (from, to)));
        while let Some((first, mut at)) = edges.pop() {
            let start = corners.len();
            corners.push(first);
            while at != first {
                corners.push(at);
                let next = edges.iter().position(|&(from, _)| from == at).expect("the part is closed");
                at = edges.swap_remove(next).1;
            }
            memory::push(&mut all, Cycle { point: around[0].0, corners: start..corners.len() });
        }
    }
    (all, corners)
}
