//! A posed body over its ground, closed, in local coordinates; with SIMD numbers one body per lane.
//!
//! The origin is near the first vertex ([`origin`]). This keeps single precision accurate far from the world's origin;
//! results in world coordinates have the origin added back.

use crate::ground::{Ground, Plane};
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, narrow};
use crate::number::{Kernel, Real, SUMS, Scalar};
use crate::template::Template;

pub struct PosedBody<'a, R: Real> {
    pub template: &'a Template,
    /// The mesh's vertices, then the virtual vertices of its closing.
    pub points: &'a [Vec3<R>],
    /// The ground in local coordinates.
    pub ground: Ground<R::Wide>,
    pub plane: Plane<R::Wide>,
    /// The local origin in the world.
    pub origin: Vec3<R::Wide>,
}

impl<'a, R: Real> PosedBody<'a, R> {
    /// `grounds` and `origins` have one entry per lane.
    pub fn new(template: &'a Template, points: &'a [Vec3<R>], grounds: &[Ground<f64>], origins: &[Vec3<f64>]) -> Self {
        let number = |value: &dyn Fn(usize) -> f64| R::Wide::from_lanes(|lane| Real::of(value(lane)));
        let local: Vec<_> = grounds.iter().zip(origins).map(|(ground, &origin)| ground.seen_from(origin)).collect();
        let axes: Vec<_> = local.iter().map(Ground::axes).collect();
        let vector = |of: &dyn Fn(usize) -> Vec3<f64>| std::array::from_fn(|k| number(&|lane| of(lane)[k]));
        PosedBody {
            template,
            points,
            ground: Ground { normal: vector(&|lane| local[lane].normal), height: number(&|lane| local[lane].height) },
            plane: Plane { axes: [vector(&|lane| axes[lane][0]), vector(&|lane| axes[lane][1])] },
            origin: vector(&|lane| origins[lane]),
        }
    }

    /// The ground in the precision of the points.
    #[inline(always)]
    pub fn narrow_ground(&self) -> Ground<R> {
        let [x, y, z] = self.ground.normal;
        Ground { normal: [R::narrow(x), R::narrow(y), R::narrow(z)], height: R::narrow(self.ground.height) }
    }

    /// The plane's axes in the precision of the points.
    #[inline(always)]
    pub fn narrow_plane(&self) -> Plane<R> {
        let [e1, e2] = self.plane.axes;
        Plane { axes: [narrow::<R>(e1), narrow::<R>(e2)] }
    }

    /// h of each vertex of the mesh; h of a point on a face is interpolated from them.
    pub fn heights(&self) -> Vec<R> {
        let vertices = &self.points[..self.template.mesh.num_vertices];
        R::dispatch::<Heights, _>((self.narrow_ground(), vertices))
    }

    /// The lowest and the highest coordinates of the mesh's vertices.
    pub fn bounds(&self) -> [Vec3<R>; 2] {
        R::dispatch::<Bounds, _>((&self.points[..self.template.mesh.num_vertices],))
    }

    /// Adds the gradient by the vertices' heights to that by their positions.
    pub fn heights_backward(&self, d_heights: &[R], d_points: &mut [Vec3<R>]) {
        R::dispatch::<HeightsBackward, _>((self.narrow_ground().normal, d_heights, d_points));
    }

    /// Converts a local position to world coordinates and writes it.
    #[inline(always)]
    pub fn write_world(&self, point: Vec3<R::Wide>, out: &mut [R]) {
        for (out, x) in out.iter_mut().zip(add(point, self.origin)) {
            *out = R::narrow(x);
        }
    }
}

/// [`PosedBody::heights`]
struct Heights;

impl<R: Real> Kernel<(Ground<R>, &[Vec3<R>])> for Heights {
    type Output = Vec<R>;

    #[inline(always)]
    fn run((ground, vertices): (Ground<R>, &[Vec3<R>])) -> Vec<R> {
        let mut heights = memory::filled(R::zero(), vertices.len());
        for (height, &vertex) in heights.iter_mut().zip(vertices) {
            *height = ground.signed_height(vertex);
        }
        heights
    }
}

/// The least of some heights.
pub fn lowest<R: Real>(heights: &[R]) -> R {
    R::dispatch::<Lowest, _>((heights, R::of(1.0)))
}

/// The largest of some heights.
pub fn highest<R: Real>(heights: &[R]) -> R {
    -R::dispatch::<Lowest, _>((heights, R::of(-1.0)))
}

/// [`lowest`] of the heights times a sign.
struct Lowest;

impl<R: Real> Kernel<(&[R], R)> for Lowest {
    type Output = R;

    #[inline(always)]
    fn run((heights, sign): (&[R], R)) -> R {
        let mut lowest = [R::of(1e30); SUMS];
        let (whole, rest) = heights.as_chunks::<SUMS>();
        for heights in whole {
            for k in 0..SUMS {
                lowest[k] = lowest[k].at_most(sign * heights[k]);
            }
        }
        for k in 1..SUMS {
            lowest[0] = lowest[0].at_most(lowest[k]);
        }
        for &height in rest {
            lowest[0] = lowest[0].at_most(sign * height);
        }
        lowest[0]
    }
}

/// [`PosedBody::bounds`]
struct Bounds;

impl<R: Real> Kernel<(&[Vec3<R>],)> for Bounds {
    type Output = [Vec3<R>; 2];

    #[inline(always)]
    fn run((vertices,): (&[Vec3<R>],)) -> [Vec3<R>; 2] {
        let (mut low, mut high) = (vertices[0], vertices[0]);
        for vertex in vertices {
            for k in 0..3 {
                low[k] = low[k].at_most(vertex[k]);
                high[k] = high[k].at_least(vertex[k]);
            }
        }
        [low, high]
    }
}

/// [`PosedBody::heights_backward`]
struct HeightsBackward;

impl<R: Real> Kernel<(Vec3<R>, &[R], &mut [Vec3<R>])> for HeightsBackward {
    type Output = ();

    #[inline(always)]
    fn run((normal, d_heights, d_points): (Vec3<R>, &[R], &mut [Vec3<R>])) {
        for (d_point, &d_height) in d_points.iter_mut().zip(d_heights) {
            add_scaled(d_point, d_height, normal);
        }
    }
}

/// Spacing of the grid of local origins, metres: longer than a body.
const GRID: f64 = 4.0;

/// The grid point next to a body's first vertex, towards the world's origin. Subtracting it from a vertex is exact,
/// because each coordinate is 0 or within a factor of two of the vertex's (Sterbenz); subtracting the first vertex
/// itself would round, and lose the small edges of hands and faces.
pub fn origin(first_vertex: Vec3<f64>) -> Vec3<f64> {
    first_vertex.map(|x| GRID * (x / GRID).trunc())
}

/// One lane of a vector.
pub fn lane<R: Real>(vector: [R; 2], lane: usize) -> [f64; 2] {
    vector.map(|x| x.lane(lane).value())
}
