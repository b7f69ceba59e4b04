//! A scene: one closed body over its ground, in coordinates local to the body.
//!
//! The origin is near the first vertex ([`origin`]). Far from the world's origin this keeps single precision; positions
//! that leave a room get the origin back.

use crate::ground::{Ground, Plane};
use crate::number::Real;
use crate::number::vector::{Vec3, add, of};
use crate::template::Template;

pub struct Scene<'a, R: Real> {
    pub template: &'a Template,
    /// The mesh's vertices, then the virtual vertices of its closing.
    pub points: &'a [Vec3<R>],
    /// The ground in local coordinates.
    pub ground: Ground<R::Wide>,
    pub plane: Plane<R::Wide>,
    /// The local origin in the world.
    pub origin: Vec3<R::Wide>,
}

impl<'a, R: Real> Scene<'a, R> {
    pub fn new(template: &'a Template, points: &'a [Vec3<R>], ground: &Ground<f64>, origin: Vec3<f64>) -> Self {
        Scene {
            template,
            points,
            ground: ground.seen_from(origin).cast(),
            plane: Plane::of(ground.axes()),
            origin: of(origin),
        }
    }

    /// The ground in the precision of the points.
    pub fn narrow_ground(&self) -> Ground<R> {
        Ground { normal: self.ground.normal.map(R::narrow), height: R::narrow(self.ground.height) }
    }

    /// Writes a local position as a position in the world.
    pub fn put(&self, point: Vec3<R::Wide>, out: &mut [R]) {
        for (out, x) in out.iter_mut().zip(add(point, self.origin)) {
            *out = R::narrow(x);
        }
    }
}

/// The grid of local origins, metres: longer than a body.
const GRID: f64 = 4.0;

/// The grid point next to a body's first vertex, towards the world's origin: subtracting it from a vertex is exact, for
/// it is 0 or within a factor of two of the vertex (Sterbenz), where subtracting a vertex would round away the small
/// edges of hands and faces.
pub fn origin(first_vertex: Vec3<f64>) -> Vec3<f64> {
    first_vertex.map(|x| GRID * (x / GRID).trunc())
}
