//! The points of a body that can touch a plane: the corners of its convex hull, or of the hulls of its convex
//! decomposition.

use crate::error::{Error, Result};
use crate::memory;
use crate::number::vector::Vec3;
use crate::threads::num_threads;
use rapier3d_f64::math::Vector;
use rapier3d_f64::parry::transformation::try_convex_hull;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};

/// The collision shape.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The convex hull of all vertices.
    Hull,
    /// The paper's: the hulls of V-HACD on a grid with `resolution` voxels along the body's longest side. They move the
    /// soles by up to a voxel.
    Decomposition { resolution: u32, faces: Vec<[u32; 3]> },
}

/// Memory that the engine takes, bytes. About 4,000 per vertex were measured where all are corners; a voxel of the grid
/// takes one, and inner voxels are listed besides.
const VERTEX_BYTES: usize = 6_000;
const VOXEL_BYTES: usize = 4;

impl Shape {
    pub fn check(&self) -> Result<()> {
        match self {
            Shape::Decomposition { resolution, .. } if !(2..=1024).contains(resolution) => {
                let (expected, got) = ("2 to 1024".into(), resolution.to_string());
                Err(Error::Argument { name: "resolution", expected, got })
            }
            _ => Ok(()),
        }
    }

    /// Checks that the engine's memory for bodies of `num_vertices` vertices on all threads can be allocated, because
    /// the engine does not. Called before the threads start, since a probing thread would take memory from the others.
    pub(super) fn ask(&self, num_vertices: usize) {
        let voxels = match self {
            Shape::Hull => 0,
            Shape::Decomposition { resolution, .. } => (*resolution as usize).pow(3),
        };
        memory::ask(num_threads() * (VERTEX_BYTES * num_vertices + VOXEL_BYTES * voxels));
    }

    /// The points that can touch a plane; None if there is no hull.
    pub fn touching(&self, points: &[Vec3<f64>]) -> Option<Vec<Vec3<f64>>> {
        let points = memory::collect(points.iter().map(|&[x, y, z]| Vector::new(x, y, z)));
        let corners = match self {
            Shape::Hull => corners(&points)?,
            Shape::Decomposition { resolution, faces } => {
                let parameters = VHACDParameters { resolution: *resolution, ..VHACDParameters::default() };
                let parts = VHACD::decompose(&parameters, &points, faces, false);
                let hulls = parts.compute_convex_hulls(parameters.convex_hull_downsampling);
                // The hulls belong to one stiff body, so on a plane their common hull touches.
                corners(&hulls.into_iter().flat_map(|(points, _)| points).collect::<Vec<_>>())?
            }
        };
        Some(corners.into_iter().map(|point| [point.x, point.y, point.z]).collect())
    }
}

fn corners(points: &[Vector]) -> Option<Vec<Vector>> {
    try_convex_hull(points).ok().map(|(corners, _)| corners).filter(|corners| corners.len() >= 4)
}
