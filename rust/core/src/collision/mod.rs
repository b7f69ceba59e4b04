//! Self-contact: which vertices of a body are inside another part of it, the nearest surface of other parts, and the
//! cost of both.
//!
//! Nearby skin does not count: faces within a given distance of a vertex along the rest shape's surface are not
//! opposite to it. A vertex is inside another part if the body's winding number there is larger than its own surface
//! explains ([`winding`]) and the opposite surface contributes most of it, so that a crease of skin does not count.

pub mod contact;
pub mod geodesic;
pub mod nearest;
pub mod tree;
pub mod winding;

use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::Mesh;
use crate::number::Data;
use crate::number::simd_level::Level;
use crate::number::vector::{Vec3, add_scaled, cross, dot, scale, sub, zero};
use crate::threads;
use contact::{SelfContact, Touch};
use geodesic::Neighbourhoods;
use nearest::{Nearest, nearest};
use tree::{Aabb, Tree};
use winding::OfTriangles;

/// The body's winding number above which a vertex is inside another part.
pub const INSIDE: f64 = 0.99;
/// The winding number of the opposite surface above which it counts: half of the directions, so that a limb that ends
/// inside another part counts.
const OPPOSITE: f64 = 0.5;
/// Winding numbers closer than this to a threshold are computed again in double precision: single precision is accurate
/// to 1e-4.
const CLOSE: f64 = 0.01;
/// Least cosine between the direction to the nearest opposite point and the surface normal there. Below it the nearest
/// point is the rim of the vertex's own neighbourhood, where opposite surface begins, and no way out.
const FACING: f64 = 0.5;
/// Total number of vertices from which on a second thread pays.
const INLINE_VERTICES: usize = 100;

/// Pose-independent data for the self-contact of a template.
pub struct Collision {
    num_vertices: usize,
    tree: Tree,
    neighbourhoods: Neighbourhoods,
}

impl Collision {
    /// Surface within `geodesic` metres of a vertex along the edges of the rest shape `vertices` is not opposite to it.
    pub fn new(
        mesh: &Mesh,
        vertices: &[Vec3<f64>],
        geodesic: f64,
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self> {
        let wrong = |name, expected: String, got: String| Err(Error::Argument { name, expected, got });
        if vertices.len() != mesh.num_vertices {
            return wrong("vertices", format!("{} vertices", mesh.num_vertices), vertices.len().to_string());
        }
        if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(Error::TemplateNotFinite { vertex });
        }
        if !(geodesic >= 0.0 && geodesic.is_finite()) {
            return wrong("geodesic", "zero metres or more".into(), geodesic.to_string());
        }
        memory::guarded(|| {
            let tree = Tree::new(mesh, vertices);
            let neighbourhoods = Neighbourhoods::new(mesh, &tree, vertices, geodesic, interrupted)?;
            Ok(Collision { num_vertices: mesh.num_vertices, tree, neighbourhoods })
        })
    }

    pub fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// The body's winding number at each vertex: B·V numbers, NaN for bodies that are not finite.
    pub fn windings_into<T: Data>(
        &self,
        vertices: &[T],
        out: &mut [T],
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        self.each(vertices, [(out, self.num_vertices)], interrupted, |body, [out]| {
            for (out, winding) in out.iter_mut().zip(body.windings::<T>()) {
                *out = T::of(winding);
            }
        })
    }

    /// How deep each vertex is inside another part, B·V metres, 0 outside; NaN for bodies that are not finite.
    pub fn depths_into<T: Data>(
        &self,
        vertices: &[T],
        out: &mut [T],
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        self.each(vertices, [(out, self.num_vertices)], interrupted, |body, [out]| {
            out.fill(T::zero());
            for touch in body.touches(0.0) {
                out[touch.vertex as usize] = T::of(touch.nearest.squared_distance.sqrt());
            }
        })
    }

    /// The distance of each vertex to the nearest opposite surface, B·V metres: negative inside another part, infinite
    /// where there is none less than `near` away; NaN for bodies that are not finite.
    pub fn distances_into<T: Data>(
        &self,
        near: f64,
        vertices: &[T],
        out: &mut [T],
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        self.each(vertices, [(out, self.num_vertices)], interrupted, |body, [out]| {
            out.fill(T::of(f64::INFINITY));
            for touch in body.touches(near) {
                let distance = touch.nearest.squared_distance.sqrt();
                out[touch.vertex as usize] = T::of(if touch.inside { -distance } else { distance });
            }
        })
    }

    /// push and pull of each body, B·2 numbers, and their gradients, B·2·V·3. NaN and zero for bodies that are not finite.
    pub fn self_contact_into<T: Data>(
        &self,
        contact: &SelfContact,
        vertices: &[T],
        out: &mut [T],
        jacobian: &mut [T],
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        let row = 3 * self.num_vertices;
        self.each(vertices, [(out, 2), (jacobian, 2 * row)], interrupted, |body, [out, jacobian]| {
            let mut gradients =
                [memory::filled(zero::<f64>(), self.num_vertices), memory::filled(zero::<f64>(), self.num_vertices)];
            let costs =
                contact.cost(&body.touches(contact.near), &self.tree.faces, gradients.each_mut().map(|g| &mut g[..]));
            out.iter_mut().zip(costs).for_each(|(out, cost)| *out = T::of(cost));
            for (own, gradient) in jacobian.chunks_exact_mut(row).zip(&gradients) {
                own.iter_mut().zip(gradient.as_flattened()).for_each(|(own, x)| *own = T::of(*x));
            }
        })
    }

    /// Runs `f` on every finite body with its rows of the outputs. Rows of other bodies become NaN in the first output
    /// and zero in the second.
    fn each<T: Data, const N: usize>(
        &self,
        vertices: &[T],
        outputs: [(&mut [T], usize); N],
        interrupted: &(dyn Fn() -> bool + Sync),
        f: impl Fn(&Posed, [&mut [T]; N]) + Sync,
    ) -> Result<()> {
        let level = Level::current()?;
        let mut rest = outputs.map(|(data, size)| data.chunks_exact_mut(size));
        let bodies = vertices.chunks_exact(3 * self.num_vertices);
        let parallel = bodies.len() * self.num_vertices >= INLINE_VERTICES;
        memory::guarded(|| {
            let rows = || rest.each_mut().map(|rows| rows.next().expect("one row a body"));
            let items = memory::collect(bodies.zip(std::iter::repeat_with(rows)));
            threads::each(items, parallel, interrupted, &|(body, mut rows)| {
                if body.iter().all(|x| x.value().is_finite()) {
                    return f(&Posed::new(self, body, level), rows);
                }
                rows.iter_mut().enumerate().for_each(|(k, row)| row.fill(T::of([f64::NAN, 0.0][k])));
            })
        })
    }
}

/// A posed body in local coordinates.
struct Posed<'a> {
    collision: &'a Collision,
    points: Vec<Vec3<f64>>,
    boxes: Vec<Aabb>,
    /// Outward unit normals of the vertices.
    normals: Vec<Vec3<f64>>,
    level: Level,
}

impl<'a> Posed<'a> {
    fn new<T: Data>(collision: &'a Collision, vertices: &[T], level: Level) -> Self {
        let origin = crate::posed::origin(std::array::from_fn(|k| vertices[k].value()));
        let local = |vertex: &[T; 3]| [0, 1, 2].map(|k| vertex[k].value() - origin[k]);
        let points = memory::collect(vertices.as_chunks::<3>().0.iter().map(local));
        let boxes = collision.tree.boxes(&points);
        let normals = normals(&collision.tree.faces, &points);
        Posed { collision, points, boxes, normals, level }
    }

    fn windings<T: Data>(&self) -> Vec<f64> {
        let Posed { collision, points, boxes, level, .. } = self;
        let rounded = memory::collect(points.iter().map(|point| point.map(T::of)));
        let work = winding::AtVertices { tree: &collision.tree, boxes, points, rounded: &rounded };
        T::run_on_lanes(*level, T::widths(*level)[0], work)
    }

    /// Whether a vertex with this winding number is inside another part.
    fn is_inside(&self, vertex: u32, winding: f64) -> bool {
        let Collision { tree, neighbourhoods, .. } = self.collision;
        let at = self.points[vertex as usize];
        let sum = |triangles: &[[u32; 3]], precisely: bool| {
            let work = OfTriangles { triangles, points: &self.points, at };
            if precisely { work.sum::<f64>(self.level) } else { work.sum::<f32>(self.level) }
        };
        let own = || {
            let whole = |node: usize| neighbourhoods.has_node(vertex, node);
            let single = |face: [u32; 3]| neighbourhoods.has_face(vertex, face);
            winding::of_some(tree, &self.boxes, at, &whole, &single)
        };
        let all = || winding::of_some(tree, &self.boxes, at, &|_| true, &|_| true);
        let is_close = |winding: f64, limit: f64| winding.is_nan() || (winding - limit).abs() <= CLOSE;
        let winding = if is_close(winding, INSIDE) { sum(&all(), true) } else { winding };
        if winding.is_nan() || winding <= INSIDE {
            return false;
        }
        let own = own();
        let opposite = winding - sum(&own, false);
        if is_close(opposite, OPPOSITE) { sum(&all(), true) - sum(&own, true) > OPPOSITE } else { opposite > OPPOSITE }
    }

    /// The vertices inside another part, and those outside with opposite surface less than `near` away, ascending.
    fn touches(&self, near: f64) -> Vec<Touch> {
        let Collision { tree, neighbourhoods, .. } = self.collision;
        let mut touches = Vec::new();
        let windings = self.windings::<f32>();
        let mut vertices = memory::copied(&tree.vertices);
        vertices.sort_unstable();
        for vertex in vertices {
            let at = self.points[vertex as usize];
            let whole = |node: usize| neighbourhoods.has_node(vertex, node);
            let single = |face: [u32; 3]| neighbourhoods.has_face(vertex, face);
            let inside = self.is_inside(vertex, windings[vertex as usize]);
            let reach = if inside { f64::INFINITY } else { near };
            let found = nearest(tree, &self.boxes, &self.points, at, reach, &whole, &single);
            if let Some(nearest) = found.filter(|nearest| !inside || self.leads_out(nearest)) {
                memory::push(&mut touches, Touch { vertex, inside, nearest });
            }
        }
        touches
    }

    /// Whether the direction to the nearest point leaves the body there. The normal is interpolated at the point rather
    /// than taken from the face, because on an edge it is arbitrary which face is found.
    fn leads_out(&self, nearest: &Nearest) -> bool {
        let mut normal = zero();
        for (&corner, weight) in self.collision.tree.faces[nearest.face].iter().zip(nearest.weights) {
            add_scaled(&mut normal, weight, self.normals[corner as usize]);
        }
        -dot(normal, nearest.offset) >= FACING * (dot(normal, normal) * nearest.squared_distance).sqrt()
    }
}

fn normals(faces: &[[u32; 3]], points: &[Vec3<f64>]) -> Vec<Vec3<f64>> {
    let mut normals = memory::filled(zero(), points.len());
    for &face in faces {
        let [a, b, c] = face.map(|corner| points[corner as usize]);
        let area = cross(sub(b, a), sub(c, a));
        face.iter().for_each(|&corner| add_scaled(&mut normals[corner as usize], 1.0, area));
    }
    for normal in &mut normals {
        let length = dot(*normal, *normal).sqrt();
        if length > 0.0 {
            *normal = scale(1.0 / length, *normal);
        }
    }
    normals
}
