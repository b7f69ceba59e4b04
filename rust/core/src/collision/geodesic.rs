//! Neighbourhoods on the rest shape: what lies within a given distance of each vertex along the edges of the mesh.

use super::tree::Tree;
use crate::error::Result;
use crate::memory;
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
        let edges = Edges::new(mesh, vertices);
        let mut near = Bits::new(vertices.len(), vertices.len());
        let mut nodes = Bits::new(vertices.len(), tree.nodes.len());
        // For the heap of every thread's search: at most one entry per edge.
        memory::ask(threads::num_threads() * edges.neighbours.len() * size_of::<(u64, u32)>());
        let rows = memory::collect(near.rows().zip(nodes.rows()).enumerate());
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
struct Edges {
    starts: Vec<usize>,
    neighbours: Vec<(u32, f64)>,
}

impl Edges {
    fn new(mesh: &Mesh, vertices: &[Vec3<f64>]) -> Self {
        let edges = mesh.faces.iter().flat_map(|&face| Mesh::edges(face));
        let mut both = memory::with_capacity(6 * mesh.faces.len());
        both.extend(edges.flat_map(|(a, b)| [(a, b), (b, a)]));
        both.sort_unstable();
        both.dedup();
        let starts = (0..=vertices.len() as u32).map(|vertex| both.partition_point(|edge| edge.0 < vertex));
        let length = |&(a, b): &(u32, u32)| {
            let along = sub(vertices[b as usize], vertices[a as usize]);
            (b, dot(along, along).sqrt())
        };
        Edges { starts: memory::collect(starts), neighbours: memory::collect(both.iter().map(length)) }
    }

    fn of(&self, vertex: u32) -> &[(u32, f64)] {
        &self.neighbours[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }
}

/// Dijkstra's algorithm from a vertex, up to the radius. Lengths are not negative, so they are ordered as their bits.
fn spread(start: usize, edges: &Edges, radius: f64, near: &mut [u64]) {
    let mut lengths = memory::filled(f64::INFINITY, edges.starts.len() - 1);
    let mut next = BinaryHeap::from([Reverse((0.0_f64.to_bits(), start as u32))]);
    lengths[start] = 0.0;
    while let Some(Reverse((bits, vertex))) = next.pop() {
        let length = f64::from_bits(bits);
        if length > lengths[vertex as usize] {
            continue;
        }
        set(near, vertex as usize);
        for &(other, step) in edges.of(vertex) {
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
        Bits { words: memory::filled(0, rows.saturating_mul(width)), width }
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
