//! Neighbourhoods on the rest shape: what lies within a distance of each vertex, along the edges of the mesh.

use super::tree::Tree;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::number::vector::{Vec3, dot, sub};
use crate::threads;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

pub struct Neighbourhoods {
    /// Of each vertex: which vertices are near.
    vertices: Bits,
    /// Of each vertex: of which nodes of the tree every face is near.
    nodes: Bits,
}

impl Neighbourhoods {
    pub fn new(
        mesh: &Mesh,
        tree: &Tree,
        vertices: &[Vec3<f64>],
        radius: f64,
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self> {
        let edges = edges(mesh, vertices);
        let mut near = Bits::new(vertices.len(), vertices.len());
        let mut nodes = Bits::new(vertices.len(), tree.nodes.len());
        let rows: Vec<_> = near.rows().zip(nodes.rows()).enumerate().collect();
        threads::each(rows, true, interrupted, &|(vertex, (near, nodes))| {
            spread(vertex, &edges, radius, near);
            for (index, node) in tree.nodes.iter().enumerate().rev() {
                let whole = match node.children {
                    Some([left, right]) => has(nodes, left) && has(nodes, right),
                    None => tree.faces[node.faces.clone()].iter().all(|&face| touches(near, face)),
                };
                if whole {
                    set(nodes, index);
                }
            }
        })?;
        Ok(Neighbourhoods { vertices: near, nodes })
    }

    /// Whether a corner of the face is near the vertex.
    pub fn has_face(&self, vertex: u32, face: [u32; 3]) -> bool {
        touches(self.vertices.row(vertex as usize), face)
    }

    /// Whether every face of the node is.
    pub fn has_node(&self, vertex: u32, node: usize) -> bool {
        has(self.nodes.row(vertex as usize), node)
    }
}

/// Of each vertex: its neighbours, and how far they are.
fn edges(mesh: &Mesh, vertices: &[Vec3<f64>]) -> Vec<Vec<(u32, f64)>> {
    let mut edges = vec![Vec::new(); vertices.len()];
    for &face in &mesh.faces {
        for (a, b) in Mesh::edges(face) {
            let along = sub(vertices[b as usize], vertices[a as usize]);
            let length = dot(along, along).sqrt();
            edges[a as usize].push((b, length));
            edges[b as usize].push((a, length));
        }
    }
    for row in &mut edges {
        row.sort_unstable_by_key(|(vertex, _)| *vertex);
        row.dedup_by_key(|(vertex, _)| *vertex);
    }
    edges
}

/// Dijkstra's walk from a vertex, as far as the radius. Lengths are ordered as their bits are: none is negative.
fn spread(start: usize, edges: &[Vec<(u32, f64)>], radius: f64, near: &mut [u64]) {
    let mut lengths = vec![f64::INFINITY; edges.len()];
    let mut next = BinaryHeap::from([Reverse((0.0_f64.to_bits(), start as u32))]);
    lengths[start] = 0.0;
    while let Some(Reverse((bits, vertex))) = next.pop() {
        let length = f64::from_bits(bits);
        if length > lengths[vertex as usize] {
            continue;
        }
        set(near, vertex as usize);
        for &(other, step) in &edges[vertex as usize] {
            let there = length + step;
            if there <= radius && there < lengths[other as usize] {
                lengths[other as usize] = there;
                next.push(Reverse((there.to_bits(), other)));
            }
        }
    }
}

fn touches(near: &[u64], face: [u32; 3]) -> bool {
    face.iter().any(|&corner| has(near, corner as usize))
}

/// A table of bits.
struct Bits {
    words: Vec<u64>,
    width: usize,
}

impl Bits {
    fn new(rows: usize, columns: usize) -> Self {
        let width = columns.div_ceil(64);
        Bits { words: vec![0; rows * width], width }
    }

    fn row(&self, row: usize) -> &[u64] {
        &self.words[row * self.width..][..self.width]
    }

    fn rows(&mut self) -> impl Iterator<Item = &mut [u64]> {
        self.words.chunks_exact_mut(self.width)
    }
}

fn has(row: &[u64], bit: usize) -> bool {
    row[bit / 64] >> (bit % 64) & 1 == 1
}

fn set(row: &mut [u64], bit: usize) {
    row[bit / 64] |= 1 << (bit % 64);
}
