//! A bounding-volume tree over the faces of a template, built on its rest shape. The boxes are refitted to every pose.

use crate::memory;
use crate::mesh::Mesh;
use crate::number::vector::Vec3;
use std::ops::Range;

/// Faces in a leaf, at most.
const LEAF: usize = 8;

pub struct Tree {
    /// Parents before their children; the first is the root.
    pub nodes: Vec<Node>,
    /// The mesh's faces, leaf by leaf.
    pub faces: Vec<[u32; 3]>,
    pub face_indices: Vec<u32>,
    pub closures: Vec<[u32; 3]>,
    /// The vertices that belong to a face, ordered so that neighbours are close.
    pub vertices: Vec<u32>,
}

pub struct Node {
    /// Into [`Tree::faces`].
    pub faces: Range<usize>,
    pub children: Option<[usize; 2]>,
    /// Into [`Tree::closures`]: few triangles with the same boundary as the node's faces. Outside the node's box the
    /// two have the same winding number, because together they enclose nothing there.
    pub closure: Range<usize>,
}

impl Tree {
    pub fn new(mesh: &Mesh, vertices: &[Vec3<f64>]) -> Self {
        let centers = memory::collect(mesh.faces.iter().map(|&face| center(face, vertices)));
        let mut order = memory::collect(0..mesh.faces.len() as u32);
        let mut nodes = Vec::new();
        split(&mut order, 0, &centers, &mut nodes);
        let faces = memory::collect(order.iter().map(|&face| mesh.faces[face as usize]));
        let mut closures = Vec::new();
        for node in &mut nodes {
            let start = closures.len();
            memory::extend(&mut closures, closure(&faces[node.faces.clone()]));
            node.closure = start..closures.len();
        }
        let mut seen = memory::filled(false, mesh.num_vertices);
        let mut in_order = memory::with_capacity(mesh.num_vertices);
        for &vertex in faces.as_flattened() {
            if !std::mem::replace(&mut seen[vertex as usize], true) {
                in_order.push(vertex);
            }
        }
        Tree { nodes, faces, face_indices: order, closures, vertices: in_order }
    }

    /// The box of each node.
    pub fn boxes(&self, points: &[Vec3<f64>]) -> Vec<Aabb> {
        let mut boxes = memory::filled(Aabb::NOTHING, self.nodes.len());
        for (index, node) in self.nodes.iter().enumerate().rev() {
            boxes[index] = match node.children {
                Some([left, right]) => boxes[left].with(&boxes[right]),
                None => Aabb::around(self.faces[node.faces.clone()].as_flattened().iter().map(|&v| points[v as usize])),
            };
        }
        boxes
    }
}

fn center(face: [u32; 3], vertices: &[Vec3<f64>]) -> Vec3<f64> {
    let [a, b, c] = face.map(|vertex| vertices[vertex as usize]);
    [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
}

/// Adds the node of these faces, whose first index in the order of all is `start`, and its descendants; returns its
/// index.
fn split(faces: &mut [u32], start: usize, centers: &[Vec3<f64>], nodes: &mut Vec<Node>) -> usize {
    let index = nodes.len();
    memory::push(nodes, Node { faces: start..start + faces.len(), children: None, closure: 0..0 });
    if faces.len() > LEAF {
        let sides = Aabb::around(faces.iter().map(|&face| centers[face as usize])).sides();
        let axis = (1..3).fold(0, |longest, k| if sides[k] > sides[longest] { k } else { longest });
        let place = |face: &u32| centers[*face as usize][axis];
        faces.sort_unstable_by(|a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
        let middle = faces.len() / 2;
        let (low, high) = faces.split_at_mut(middle);
        let left = split(low, start, centers, nodes);
        nodes[index].children = Some([left, split(high, start + middle, centers, nodes)]);
    }
    index
}

/// A fan over the boundary of a patch, or the patch where that is less.
fn closure(faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let edges = || faces.iter().flat_map(|&face| Mesh::edges(face));
    let mut sorted = memory::collect(edges());
    sorted.sort_unstable();
    let boundary = memory::collect(edges().filter(|&(a, b)| sorted.binary_search(&(b, a)).is_err()));
    let Some(&(apex, _)) = boundary.first() else { return Vec::new() };
    let far = boundary.iter().filter(|&&(a, b)| a != apex && b != apex);
    let fan = memory::collect(far.map(|&(a, b)| [apex, a, b]));
    if fan.len() < faces.len() { fan } else { memory::copied(faces) }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub struct Aabb {
    low: Vec3<f64>,
    high: Vec3<f64>,
}

impl Aabb {
    const NOTHING: Aabb = Aabb { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    pub fn around(points: impl Iterator<Item = Vec3<f64>>) -> Self {
        points.fold(Aabb::NOTHING, |all, point| all.with(&Aabb { low: point, high: point }))
    }

    fn with(&self, other: &Aabb) -> Aabb {
        let low = [0, 1, 2].map(|k| self.low[k].min(other.low[k]));
        Aabb { low, high: [0, 1, 2].map(|k| self.high[k].max(other.high[k])) }
    }

    fn sides(&self) -> Vec3<f64> {
        [0, 1, 2].map(|k| self.high[k] - self.low[k])
    }

    pub fn is_apart_from(&self, other: &Aabb) -> bool {
        (0..3).any(|k| self.high[k] < other.low[k] || other.high[k] < self.low[k])
    }

    pub fn squared_distance(&self, point: Vec3<f64>) -> f64 {
        (0..3).map(|k| (self.low[k] - point[k]).max(point[k] - self.high[k]).max(0.0).powi(2)).sum()
    }
}
