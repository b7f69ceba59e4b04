//! Generalised winding numbers: how often a surface goes around a point (Jacobson et al. 2013).
//!
//! Exact: a group of faces whose box does not contain the point is replaced by the few triangles that close it, which
//! have the same winding number there. The solid angle of a triangle is van Oosterom and Strackee's; a triangle with
//! the point as a corner contributes nothing. At a vertex of the surface the winding number is therefore the fraction
//! of directions that point into the body, between 0 and 1, plus 1 for every other part of the body that the vertex is
//! inside of.

use super::tree::{Aabb, Tree};
use crate::memory;
use crate::number::simd_level::Level;
use crate::number::vector::{Vec3, cross, dot, sub};
use crate::number::{Data, Kernel, Real, Scalar, Work};
use std::f64::consts::TAU;

/// The winding number of the whole surface at each vertex.
pub struct AtVertices<'a, T> {
    pub tree: &'a Tree,
    pub boxes: &'a [Aabb],
    pub points: &'a [Vec3<f64>],
    /// The same, in the caller's precision.
    pub rounded: &'a [Vec3<T>],
}

impl<T: Data> Work<T> for AtVertices<'_, T> {
    type Output = Vec<f64>;

    /// Lanes are neighbouring vertices, which share their triangles.
    fn run<R: Real<Data = T>>(self) -> Vec<f64> {
        let mut windings = memory::filled(0.0, self.points.len());
        let mut triangles = Vec::new();
        for group in self.tree.vertices.chunks(R::LANES) {
            let own = Aabb::around(group.iter().map(|&vertex| self.points[vertex as usize]));
            triangles.clear();
            gather(self.tree, self.boxes, &own, 0, &mut triangles);
            let vertex = |lane: usize| self.rounded[group[lane.min(group.len() - 1)] as usize];
            let at: Vec3<R> = [0, 1, 2].map(|k| R::from_lanes(|lane| R::Scalar::read(vertex(lane)[k])));
            let [re, im, turns] = R::dispatch::<SumOfAngles, _>((triangles.as_slice(), self.rounded, at));
            for (lane, &vertex) in group.iter().enumerate() {
                let [re, im, turns] = [re, im, turns].map(|x| x.lane(lane).value());
                windings[vertex as usize] = im.atan2(re) / TAU + turns;
            }
        }
        windings
    }
}

/// The winding number of some triangles at one point. Lanes are triangles.
pub struct OfTriangles<'a> {
    pub triangles: &'a [[u32; 3]],
    pub points: &'a [Vec3<f64>],
    pub at: Vec3<f64>,
}

impl OfTriangles<'_> {
    /// The same, in the precision of T.
    pub fn sum<T: Data>(self, level: Level) -> f64 {
        T::run_on_lanes(level, T::widths(level)[0], self)
    }
}

impl<T: Data> Work<T> for OfTriangles<'_> {
    type Output = f64;

    fn run<R: Real<Data = T>>(self) -> f64 {
        let share = self.triangles.len().div_ceil(R::LANES);
        let mut numbers = memory::filled(T::zero(), 9 * share * R::LANES);
        for (corner, numbers) in self.triangles.as_flattened().iter().zip(numbers.as_chunks_mut::<3>().0) {
            *numbers = sub(self.points[*corner as usize], self.at).map(T::of);
        }
        let lane = |lane: usize| &numbers[9 * share * lane..][..9 * share];
        let rows: Vec<_> = (0..R::LANES).map(lane).collect();
        let mut corners = memory::filled(R::zero(), 9 * share);
        for (k, corner) in corners.iter_mut().enumerate() {
            *corner = R::from_lanes(|lane| R::Scalar::read(rows[lane][k]));
        }
        let [re, im, turns] = R::dispatch::<SumOfLanes, _>(corners.as_chunks::<3>().0.as_chunks::<3>().0);
        let winding = |lane: usize| im.lane(lane).value().atan2(re.lane(lane).value()) / TAU + turns.lane(lane).value();
        (0..R::LANES).map(winding).sum()
    }
}

/// Triangles with the same winding number at `at` as the faces chosen by `whole` (all faces of a node) and `single`
/// (one face).
pub fn of_some(
    tree: &Tree,
    boxes: &[Aabb],
    at: Vec3<f64>,
    whole: &impl Fn(usize) -> bool,
    single: &impl Fn([u32; 3]) -> bool,
) -> Vec<[u32; 3]> {
    let own = Aabb::around(std::iter::once(at));
    let (mut triangles, mut stack) = (Vec::new(), vec![0]);
    while let Some(index) = stack.pop() {
        let node = &tree.nodes[index];
        match node.children {
            _ if whole(index) => gather(tree, boxes, &own, index, &mut triangles),
            Some(children) => stack.extend(children),
            None => {
                let faces = tree.faces[node.faces.clone()].iter().copied();
                memory::extend(&mut triangles, faces.filter(|&face| single(face)));
            }
        }
    }
    triangles
}

/// The triangles that replace `node` for points in a box.
fn gather(tree: &Tree, boxes: &[Aabb], from: &Aabb, node: usize, triangles: &mut Vec<[u32; 3]>) {
    let mut stack = vec![node];
    while let Some(index) = stack.pop() {
        let node = &tree.nodes[index];
        if boxes[index].is_apart_from(from) {
            memory::extend(triangles, tree.closures[node.closure.clone()].iter().copied());
        } else if let Some(children) = node.children {
            stack.extend(children);
        } else {
            memory::extend(triangles, tree.faces[node.faces.clone()].iter().copied());
        }
    }
}

/// Half the solid angles of triangles at several points, one per lane.
struct SumOfAngles;

impl<R: Real> Kernel<(&[[u32; 3]], &[Vec3<R::Data>], Vec3<R>)> for SumOfAngles {
    type Output = [R; 3];

    #[inline(always)]
    fn run((triangles, points, at): (&[[u32; 3]], &[Vec3<R::Data>], Vec3<R>)) -> [R; 3] {
        let mut sum = [R::of(1.0), R::zero(), R::zero()];
        for triangle in triangles {
            let a = seen_from(at, points[triangle[0] as usize]);
            let b = seen_from(at, points[triangle[1] as usize]);
            let c = seen_from(at, points[triangle[2] as usize]);
            add_angle(&mut sum, [a, b, c]);
        }
        sum
    }
}

/// The same at the origin, with one triangle per lane.
struct SumOfLanes;

impl<R: Real> Kernel<&[[Vec3<R>; 3]]> for SumOfLanes {
    type Output = [R; 3];

    #[inline(always)]
    fn run(triangles: &[[Vec3<R>; 3]]) -> [R; 3] {
        let mut sum = [R::of(1.0), R::zero(), R::zero()];
        for triangle in triangles {
            add_angle(&mut sum, *triangle);
        }
        sum
    }
}

/// A sum of angles by multiplying complex numbers: (re, im) points along the sum, and whole turns are counted, so that
/// one arc tangent at the end suffices.
#[inline(always)]
fn add_angle<R: Real>(sum: &mut [R; 3], [a, b, c]: [Vec3<R>; 3]) {
    let [re, im, turns] = *sum;
    let (zero, one, tiny) = (R::zero(), R::of(1.0), R::of(1e-37));
    let (la, lb, lc) = (dot(a, a).sqrt(), dot(b, b).sqrt(), dot(c, c).sqrt());
    let y = dot(a, cross(b, c));
    let x = la * lb * lc + (dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    // At a corner or on an edge the angle is undefined and counts as 0.
    let nothing = x.abs() + y.abs() - tiny;
    let (x, y) = (nothing.if_negative(one, x), nothing.if_negative(zero, y));
    let (next_re, next_im) = (re * x - im * y, re * y + im * x);
    // Two angles above the axis whose sum lies below it, or the reverse: the sum has passed half a turn.
    let down = next_im.if_negative(one, zero);
    let above = im.if_negative(zero, y.if_negative(zero, one));
    let below = im.if_negative(y.if_negative(one, zero), zero);
    let size = one / (next_re.abs() + next_im.abs());
    *sum = [next_re * size, next_im * size, turns + above * down - below * (one - down)];
}

#[inline(always)]
fn seen_from<R: Real>(at: Vec3<R>, point: Vec3<R::Data>) -> Vec3<R> {
    sub([R::splat(point[0]), R::splat(point[1]), R::splat(point[2])], at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    /// A torus of 20 × 12 quads.
    fn torus() -> (Mesh, Vec<Vec3<f64>>) {
        let (around, across) = (20, 12);
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for i in 0..around {
            for j in 0..across {
                let (u, v) = (TAU * i as f64 / around as f64, TAU * j as f64 / across as f64);
                let radius = 0.6 + 0.2 * v.cos();
                points.push([radius * u.cos(), radius * u.sin(), 0.2 * v.sin()]);
                let at = |i: usize, j: usize| ((i % around) * across + j % across) as i64;
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        (Mesh::new(points.len(), &faces, &[]).unwrap(), points)
    }

    /// Winding numbers by the arc tangent of every face.
    fn plainly(faces: &[[u32; 3]], points: &[Vec3<f64>], at: Vec3<f64>) -> f64 {
        let angle = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|corner| sub(points[corner as usize], at));
            let [la, lb, lc] = [a, b, c].map(|x| dot(x, x).sqrt());
            let beside = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            dot(a, cross(b, c)).atan2(beside) / TAU
        };
        faces.iter().map(angle).sum()
    }

    #[test]
    fn short_cuts_change_nothing() {
        let (mesh, points) = torus();
        let tree = Tree::new(&mesh, &points);
        let boxes = tree.boxes(&points);
        for (at, expected) in
            [([0.6, 0.0, 0.05], 1.0), ([0.0, 0.0, 0.0], 0.0), ([-0.5, 0.31, -0.02], 1.0), ([2.0; 3], 0.0)]
        {
            let all = of_some(&tree, &boxes, at, &|_| true, &|_| true);
            assert!(all.len() < mesh.faces.len());
            let work = || OfTriangles { triangles: &all, points: &points, at };
            for level in Level::available() {
                assert!((work().sum::<f64>(level) - expected).abs() < 1e-13);
                assert!((work().sum::<f32>(level) - expected).abs() < 1e-5);
            }
            let half = |face: [u32; 3]| face[0].is_multiple_of(2);
            let some = of_some(&tree, &boxes, at, &|_| false, &half);
            let work = OfTriangles { triangles: &some, points: &points, at };
            let faces: Vec<_> = mesh.faces.iter().copied().filter(|&face| half(face)).collect();
            assert!((work.sum::<f64>(Level::Scalar) - plainly(&faces, &points, at)).abs() < 1e-13);
        }
    }

    #[test]
    fn a_vertex_sees_the_inside_of_its_own_surface() {
        let (mesh, points) = torus();
        let tree = Tree::new(&mesh, &points);
        let boxes = tree.boxes(&points);
        for level in Level::available() {
            let work = AtVertices { tree: &tree, boxes: &boxes, points: &points, rounded: &points };
            for (winding, &at) in f64::run_on_lanes(level, 1, work).iter().zip(&points) {
                assert!((winding - plainly(&mesh.faces, &points, at)).abs() < 1e-13);
                assert!((0.3..0.7).contains(winding));
            }
        }
    }
}
