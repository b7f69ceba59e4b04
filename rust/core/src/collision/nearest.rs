//! The point of a surface that is nearest to a point.

use super::tree::{Aabb, Tree};
use crate::number::vector::{Vec3, add_scaled, cross, dot, scale, sub};

/// A point of a face: Σ weights · corners.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Among [`Tree::faces`].
    pub face: usize,
    pub weights: [f64; 3],
    /// Vector from the nearest point to the given point.
    pub offset: Vec3<f64>,
    pub squared_distance: f64,
}

/// The nearest point less than `reach` away on the faces that are not skipped, by whole nodes or one by one.
pub fn nearest(
    tree: &Tree,
    boxes: &[Aabb],
    points: &[Vec3<f64>],
    at: Vec3<f64>,
    reach: f64,
    whole: &impl Fn(usize) -> bool,
    single: &impl Fn([u32; 3]) -> bool,
) -> Option<Nearest> {
    let (mut best, mut limit) = (None, reach * reach);
    let mut stack = vec![(0, boxes[0].squared_distance(at))];
    while let Some((index, distance)) = stack.pop() {
        if distance >= limit || whole(index) {
            continue;
        }
        let node = &tree.nodes[index];
        if let Some(children) = node.children {
            let [left, right] = children.map(|child| (child, boxes[child].squared_distance(at)));
            stack.extend(if left.1 <= right.1 { [right, left] } else { [left, right] });
            continue;
        }
        for face in node.faces.clone().filter(|&face| !single(tree.faces[face])) {
            let (weights, offset) = on_triangle(tree.faces[face].map(|corner| points[corner as usize]), at);
            let squared_distance = dot(offset, offset);
            if squared_distance < limit {
                limit = squared_distance;
                best = Some(Nearest { face, weights, offset, squared_distance });
            }
        }
    }
    best
}

/// The weights of the triangle's point nearest to `at`, and the vector from it to `at`.
fn on_triangle(corners: [Vec3<f64>; 3], at: Vec3<f64>) -> ([f64; 3], Vec3<f64>) {
    let [a, b, c] = corners;
    let normal = cross(sub(b, a), sub(c, a));
    let squared = dot(normal, normal);
    let from = corners.map(|corner| sub(at, corner));
    if squared > 0.0 {
        let area = |k: usize| dot(normal, cross(sub(corners[(k + 2) % 3], corners[(k + 1) % 3]), from[(k + 1) % 3]));
        let weights = [area(0), area(1), area(2)].map(|area| area / squared);
        if weights.iter().all(|weight| *weight >= 0.0) {
            return (weights, scale(dot(normal, from[0]) / squared, normal));
        }
    }
    let edges = [0, 1, 2].map(|k| on_edge(corners, from, k));
    edges.into_iter().reduce(|best, next| if dot(next.1, next.1) < dot(best.1, best.1) { next } else { best }).unwrap()
}

/// The same for the edge from corner k to the next.
fn on_edge(corners: [Vec3<f64>; 3], from: [Vec3<f64>; 3], k: usize) -> ([f64; 3], Vec3<f64>) {
    let next = (k + 1) % 3;
    let along = sub(corners[next], corners[k]);
    let squared = dot(along, along);
    let part = if squared > 0.0 { (dot(from[k], along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let (mut weights, mut offset) = ([0.0; 3], from[k]);
    (weights[k], weights[next]) = (1.0 - part, part);
    add_scaled(&mut offset, -part, along);
    (weights, offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_in_it_on_an_edge_or_a_corner() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let cases = [
            ([0.5, 0.5, 3.0], [0.5, 0.25, 0.25], [0.0, 0.0, 3.0]),
            ([1.0, -1.0, 0.0], [0.5, 0.5, 0.0], [0.0, -1.0, 0.0]),
            ([2.0, 2.0, 1.0], [0.0, 0.5, 0.5], [1.0, 1.0, 1.0]),
            ([5.0, -1.0, 0.0], [0.0, 1.0, 0.0], [3.0, -1.0, 0.0]),
        ];
        for (at, weights, offset) in cases {
            assert_eq!(on_triangle(corners, at), (weights, offset));
        }
        assert_eq!(on_triangle([[0.0; 3]; 3], [1.0, 0.0, 0.0]).1, [1.0, 0.0, 0.0]);
    }
}
