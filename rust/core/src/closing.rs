//! Closing: the first step of the paper's "close, translate, fill" (section 3.2).
//!
//! Where two parts meet, or where the surface is open, there is an interface of edges. Each connected component of all
//! interfaces gets one virtual vertex, the mean of its vertices, and every part that meets there is capped by a fan of
//! triangles to it. Because the virtual vertex is shared, the caps of neighbouring parts cancel and the part volumes add
//! up to the whole body's. The topology is found once; the virtual vertices move with the body.
//!
//! After closing, the body is a list of vertices (the mesh's, then the virtual ones) and closed faces, sorted by part;
//! no later room needs to know which of them were added.

use crate::mesh::Mesh;
use crate::number::vector::{Vec3, add, narrow, scale, widen, zero};
use crate::number::{Real, Room};
use crate::rings::Rings;
use std::collections::BTreeMap;
use std::ops::Range;

#[derive(Clone, Debug)]
pub struct Closing {
    pub num_vertices: usize,
    /// The vertices of each interface component, each once.
    pub components: Vec<Vec<u32>>,
    /// Faces and caps, part after part.
    pub faces: Vec<[u32; 3]>,
    /// Where each part's faces and caps lie in `faces`.
    pub parts: Vec<Range<usize>>,
    /// The rings of each part's points.
    pub rings: Vec<Rings>,
}

impl Closing {
    pub fn new(mesh: &Mesh) -> Self {
        let interface = interface_edges(mesh);
        let (components, component_of) = connect(&interface);
        let mut by_part = vec![Vec::new(); mesh.num_parts];
        for (face, &part) in mesh.faces.iter().zip(&mesh.face_parts) {
            by_part[part as usize].push(*face);
        }
        for &(from, to, part) in &interface {
            let centre = (mesh.num_vertices + component_of[&from]) as u32;
            by_part[part as usize].push([to, from, centre]);
        }
        let mut faces = Vec::new();
        let mut parts = Vec::new();
        let mut rings = Vec::new();
        for part in by_part {
            rings.push(Rings::new(&part));
            parts.push(faces.len()..faces.len() + part.len());
            faces.extend(part);
        }
        Closing { num_vertices: mesh.num_vertices, components, faces, parts, rings }
    }

    /// Number of vertices of the closed body: the mesh's and the virtual ones.
    pub fn num_points(&self) -> usize {
        self.num_vertices + self.components.len()
    }

    /// Appends the virtual vertices to the mesh's.
    pub fn forward<R: Real>(&self, vertices: &mut Vec<Vec3<R>>) {
        debug_assert_eq!(vertices.len(), self.num_vertices);
        R::apart::<Forward, _>((self, vertices));
    }

    /// Hands the virtual vertices' gradients to the vertices they are means of.
    pub fn backward<R: Real>(&self, d_points: &mut [Vec3<R>]) {
        R::apart::<Backward, _>((self, d_points));
    }
}

/// [`Closing::forward`]
struct Forward;

impl<R: Real> Room<(&Closing, &mut Vec<Vec3<R>>)> for Forward {
    type Output = ();

    #[inline(always)]
    fn enter((closing, vertices): (&Closing, &mut Vec<Vec3<R>>)) {
        for component in &closing.components {
            let mut sum = zero::<R::Wide>();
            for &vertex in component {
                sum = add(sum, widen(vertices[vertex as usize]));
            }
            vertices.push(narrow::<R>(scale(R::Wide::of(1.0 / component.len() as f64), sum)));
        }
    }
}

/// [`Closing::backward`]
struct Backward;

impl<R: Real> Room<(&Closing, &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn enter((closing, d_points): (&Closing, &mut [Vec3<R>])) {
        let (d_vertices, d_centres) = d_points.split_at_mut(closing.num_vertices);
        for (component, d_centre) in closing.components.iter().zip(d_centres) {
            let share = scale(R::of(1.0 / component.len() as f64), *d_centre);
            for &vertex in component {
                d_vertices[vertex as usize] = add(d_vertices[vertex as usize], share);
            }
        }
    }
}

/// Directed edges (from, to, part) with no face of the same part on the other side.
fn interface_edges(mesh: &Mesh) -> Vec<(u32, u32, u32)> {
    let mut edges = Vec::new();
    for (face, (corners, neighbours)) in mesh.faces.iter().zip(&mesh.neighbours).enumerate() {
        let part = mesh.face_parts[face];
        for ((from, to), neighbour) in Mesh::edges(*corners).into_iter().zip(neighbours) {
            if neighbour.is_none_or(|other| mesh.face_parts[other as usize] != part) {
                edges.push((from, to, part));
            }
        }
    }
    edges
}

/// The connected components of the edges, in the order of their lowest vertex, and the component of each vertex.
fn connect(edges: &[(u32, u32, u32)]) -> (Vec<Vec<u32>>, BTreeMap<u32, usize>) {
    let mut linked: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &(from, to, _) in edges {
        linked.entry(from).or_default().push(to);
        linked.entry(to).or_default().push(from);
    }
    let mut component_of = BTreeMap::new();
    let mut components = Vec::new();
    for &start in linked.keys() {
        if component_of.contains_key(&start) {
            continue;
        }
        let mut component = Vec::new();
        let mut open = vec![start];
        component_of.insert(start, components.len());
        while let Some(vertex) = open.pop() {
            component.push(vertex);
            for &next in &linked[&vertex] {
                if component_of.insert(next, components.len()).is_none() {
                    open.push(next);
                }
            }
        }
        component.sort_unstable();
        components.push(component);
    }
    (components, component_of)
}
