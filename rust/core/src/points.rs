//! The points that a loss is computed over, samples or vertices, a row of them at a time.

use crate::error::{Result, unknown_choice};
use crate::memory;
use crate::number::Real;
use crate::sampling::{CHUNK, Chunk, Row, Walk};
use crate::template::Template;
use std::ops::Range;

/// The points that a loss is computed over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Points {
    Samples,
    Vertices,
}

/// Up to [`CHUNK`] points that are processed together.
pub enum PointChunk<'a> {
    Samples(&'a Walk, &'a Chunk),
    Vertices(Range<usize>),
}

impl Points {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "samples" => Ok(Points::Samples),
            "vertices" => Ok(Points::Vertices),
            _ => Err(unknown_choice("points", "\"samples\", \"vertices\"", name)),
        }
    }

    pub fn count(self, template: &Template) -> usize {
        match self {
            Points::Samples => template.samples.len(),
            Points::Vertices => template.mesh.num_vertices,
        }
    }

    /// All points, in the order in which they are summed.
    pub fn chunks(self, template: &Template) -> Vec<PointChunk<'_>> {
        let walk = &template.samples.walk;
        let count = template.mesh.num_vertices;
        match self {
            Points::Samples => memory::collect(walk.chunks.iter().map(|chunk| PointChunk::Samples(walk, chunk))),
            Points::Vertices => {
                let chunk = |start| PointChunk::Vertices(start..count.min(start + CHUNK));
                memory::collect((0..count).step_by(CHUNK).map(chunk))
            }
        }
    }
}

impl PointChunk<'_> {
    #[inline(always)]
    pub fn len(&self) -> usize {
        match self {
            PointChunk::Samples(_, chunk) => chunk.len(),
            PointChunk::Vertices(range) => range.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Interpolates the vertices' numbers at these points.
    #[inline(always)]
    pub fn gather<R: Real>(&self, vertices: &[R], row: &mut Row<R>) {
        match self {
            PointChunk::Samples(walk, chunk) => walk.interpolate(chunk, vertices, row),
            PointChunk::Vertices(range) => row[..range.len()].copy_from_slice(&vertices[range.clone()]),
        }
    }

    /// Adds the points' numbers to the vertices' by the transposed weights.
    #[inline(always)]
    pub fn scatter_add<R: Real>(&self, row: &Row<R>, vertices: &mut [R]) {
        match self {
            PointChunk::Samples(walk, chunk) => walk.scatter(chunk, row, vertices),
            PointChunk::Vertices(range) => {
                for (vertex, &number) in vertices[range.clone()].iter_mut().zip(row) {
                    *vertex = *vertex + number;
                }
            }
        }
    }
}
