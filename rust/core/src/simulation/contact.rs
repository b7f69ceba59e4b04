//! What of a body can touch a plane: the corners of its convex hull, or those of the hulls of its convex decomposition.

use crate::error::{Error, Result};
use crate::memory;
use crate::number::vector::Vec3;
use crate::threads::num_threads;
use rapier3d_f64::math::Vector;
use rapier3d_f64::parry::transformation::try_convex_hull;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};

/// What collides.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The convex hull of all vertices.
    Hull,
    /// The paper's: the hulls of V-HACD on a grid of so many voxels along the body's longest side. They move the soles by
    /// up to a voxel.
    Decomposition { resolution: u32, faces: Vec<[u32; 3]> },
}

/// Bytes that the engine takes: for a vertex, where all of them are corners, about 4,000 were measured; a voxel of the grid is
/// one, and those inside are listed besides.
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

    /// Asks for what the engine takes for bodies of so many vertices on all threads, for it does not do so itself. Before
    /// they start: a thread that asks would take from the others meanwhile.
    pub(super) fn ask(&self, num_vertices: usize) {
        let voxels = match self {
            Shape::Hull => 0,
            Shape::Decomposition { resolution, .. } => (*resolution as usize).pow(3),
        };
        memory::ask(num_threads() * (VERTEX_BYTES * num_vertices + VOXEL_BYTES * voxels));
    }

    /// The points that can touch a plane. None where there is no hull.
    pub fn touching(&self, points: &[Vec3<f64>]) -> Option<Vec<Vec3<f64>>> {
        let points = memory::collect(points.iter().map(|&[x, y, z]| Vector::new(x, y, z)));
        let corners = match self {
            Shape::Hull => corners(&points)?,
            Shape::Decomposition { resolution, faces } => {
                let parameters = VHACDParameters { resolution: *resolution, ..VHACDParameters::default() };
                let parts = VHACD::decompose(&parameters, &points, faces, false);
                let hulls = parts.compute_convex_hulls(parameters.convex_hull_downsampling);
                // All hulls are of one stiff body: on a plane it is their common hull that touches.
                corners(&hulls.into_iter().flat_map(|(points, _)| points).collect::<Vec<_>>())?
            }
        };
        Some(corners.into_iter().map(|point| [point.x, point.y, point.z]).collect())
    }
}

fn corners(points: &[Vector]) -> Option<Vec<Vector>> {
    try_convex_hull(points).ok().map(|(corners, _)| corners).filter(|corners| corners.len() >= 4)
}
