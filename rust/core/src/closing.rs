//! Closing: the first step of the paper's "close, translate, fill" (section 3.2).
//!
//! Where two parts meet, or where the surface is open, there is an interface of edges. Each connected component of all
//! interfaces gets one virtual vertex, the mean of its vertices, and every part that meets there is capped by a fan of
//! triangles to it. Because the virtual vertex is shared, the caps of neighbouring parts cancel and the part volumes
//! add up to the whole body's. The topology is computed once; the virtual vertices move with the body.
//!
//! After closing, the body is a list of vertices (the mesh's, then the virtual ones) and closed faces, sorted by part;
//! no later step needs to know which of them were added.

use crate::memory;
use crate::mesh::Mesh;
use crate::number::vector::{Vec3, add, narrow, scale, widen, zero};
use crate::number::{Kernel, Real};
use crate::rings::Rings;
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
        let (components, component_of) = connect(mesh.num_vertices, &interface);
        let mut by_part = memory::filled(Vec::new(), mesh.num_parts);
        for (face, &part) in mesh.faces.iter().zip(&mesh.face_parts) {
            memory::push(&mut by_part[part as usize], *face);
        }
        for &(from, to, part) in &interface {
            let centre = mesh.num_vertices as u32 + component_of[from as usize];
            memory::push(&mut by_part[part as usize], [to, from, centre]);
        }
        let mut faces = memory::with_capacity(mesh.faces.len() + interface.len());
        let mut parts = memory::with_capacity(mesh.num_parts);
        let mut rings = memory::with_capacity(mesh.num_parts);
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
        R::dispatch::<Forward, _>((self, vertices));
    }

    /// Distributes the virtual vertices' gradients to the vertices whose means they are.
    pub fn backward<R: Real>(&self, d_points: &mut [Vec3<R>]) {
        R::dispatch::<Backward, _>((self, d_points));
    }
}

/// [`Closing::forward`]
struct Forward;

impl<R: Real> Kernel<(&Closing, &mut Vec<Vec3<R>>)> for Forward {
    type Output = ();

    #[inline(always)]
    fn run((closing, vertices): (&Closing, &mut Vec<Vec3<R>>)) {
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

impl<R: Real> Kernel<(&Closing, &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn run((closing, d_points): (&Closing, &mut [Vec3<R>])) {
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
                memory::push(&mut edges, (from, to, part));
            }
        }
    }
    edges
}

/// No component.
const NONE: u32 = u32::MAX;

/// The connected components of the edges, in the order of their lowest vertex, and the component of each vertex.
fn connect(num_vertices: usize, edges: &[(u32, u32, u32)]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut links = memory::collect(edges.iter().flat_map(|&(from, to, _)| [(from, to), (to, from)]));
    links.sort_unstable();
    let mut component_of = memory::filled(NONE, num_vertices);
    let mut components = Vec::new();
    let mut open = Vec::new();
    for &(start, _) in &links {
        if component_of[start as usize] != NONE {
            continue;
        }
        let (own, mut component) = (components.len() as u32, Vec::new());
        component_of[start as usize] = own;
        memory::push(&mut open, start);
        while let Some(vertex) = open.pop() {
            memory::push(&mut component, vertex);
            let first = links.partition_point(|link| link.0 < vertex);
            for &(_, next) in links[first..].iter().take_while(|link| link.0 == vertex) {
                if std::mem::replace(&mut component_of[next as usize], own) == NONE {
                    memory::push(&mut open, next);
                }
            }
        }
        component.sort_unstable();
        memory::push(&mut components, component);
    }
    (components, component_of)
}
