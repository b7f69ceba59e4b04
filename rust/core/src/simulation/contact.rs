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

    /// The points that can touch a plane. None where there is no hull.
    pub fn touching(&self, points: &[Vec3<f64>]) -> Option<Vec<Vec3<f64>>> {
        let points = memory::collect(points.iter().map(|&[x, y, z]| Vector::new(x, y, z)));
        let corners = match self {
            Shape::Hull => corners(&points)?,
            Shape::Decomposition { resolution, faces } => {
                memory::ask(VOXEL_BYTES * (*resolution as usize).pow(3) * num_threads());
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

/// What the engine's voxels and hulls take at most, bytes each: it does not ask for them, and every thread may be there.
const VOXEL_BYTES: usize = 32;
const HULL_BYTES: usize = 512;

fn corners(points: &[Vector]) -> Option<Vec<Vector>> {
    memory::ask(HULL_BYTES * points.len() * num_threads());
    try_convex_hull(points).ok().map(|(corners, _)| corners).filter(|corners| corners.len() >= 4)
}
