//! Sampling: N_U points on the surface that move with it, and the passes over them.
//!
//! Triangle point picking, area-weighted on the template: the points are fixed barycentric weights on fixed faces, so a
//! posed body's samples are W V with a sparse W with three weights per row, and gradients return by Wᵀ. Most quantities
//! need only one or two numbers of a sample, such as its height. These are interpolated from the vertices' numbers
//! ([`Walk`]), and gradients by them are added to the vertices' by the same weights.

mod walk;

use walk::Weights;
pub use walk::{CHUNK, Chunk, Row, Walk, fold, sum_row};

use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::Mesh;
use crate::number::vector::{Vec3, add_scaled, add_to, cross, dot, narrow, sub, widen};
use crate::number::{BLOCK, Real, Scalar, WideScalar};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

const MAX_SAMPLES: usize = 10_000_000;

#[derive(Clone, Debug)]
pub struct Samples {
    /// The face of each sample, ascending.
    pub faces: Vec<u32>,
    /// The vertices of that face.
    pub corners: Vec<[u32; 3]>,
    pub barycentric: Vec<[f64; 3]>,
    /// The part of each sample: its face's.
    pub parts: Vec<u32>,
    /// Σ of the samples of each part as a sparse row over the vertices.
    pub part_sums: Vec<PartSum>,
    pub walk: Walk,
}

/// Σ_{i in part} (W V)_i = Σ weight · vertex.
#[derive(Clone, Debug, Default)]
pub struct PartSum {
    pub count: usize,
    pub vertices: Vec<u32>,
    weights: Weights,
}

impl Samples {
    pub fn new(mesh: &Mesh, vertices: &[Vec3<f64>], num_samples: usize, seed: u64) -> Result<Self> {
        if num_samples == 0 || num_samples > MAX_SAMPLES {
            return Err(Error::SampleCount { got: num_samples, limit: MAX_SAMPLES });
        }
        memory::guarded(|| {
            let (faces, barycentric) = pick(&areas(mesh, vertices), num_samples, seed);
            let corners = memory::collect(faces.iter().map(|&face| mesh.faces[face as usize]));
            let parts = memory::collect(faces.iter().map(|&face| mesh.face_parts[face as usize]));
            let part_sums = part_sums(mesh, &parts, &corners, &barycentric);
            let walk = Walk::new(&faces, &corners, &barycentric);
            Ok(Samples { faces, corners, barycentric, parts, part_sums, walk })
        })
    }

    pub fn len(&self) -> usize {
        self.faces.len()
    }

    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// (W V)_i
    #[inline(always)]
    pub fn point<R: Real>(&self, sample: usize, vertices: &[Vec3<R>]) -> Vec3<R> {
        blend(self.corners[sample].map(|corner| vertices[corner as usize]), self.barycentric[sample])
    }

    /// (W V)_i in double precision, for decisions and for inner solvers.
    #[inline(always)]
    pub fn wide_point<R: Real>(&self, sample: usize, vertices: &[Vec3<R>]) -> Vec3<R::Wide> {
        let [a, b, c] = self.corners[sample];
        let corner = |index: u32| widen(vertices[index as usize]);
        blend([corner(a), corner(b), corner(c)], self.barycentric[sample])
    }

    /// One lane's (W V)_i in double precision.
    #[inline(always)]
    pub fn point_of_lane<R: Real>(&self, sample: usize, vertices: &[Vec3<R>], lane: usize) -> Vec3<WideScalar<R>> {
        let [a, b, c] = self.corners[sample];
        let corner = |index: u32| {
            let vertex = &vertices[index as usize];
            [
                WideScalar::<R>::of(vertex[0].lane(lane).value()),
                WideScalar::<R>::of(vertex[1].lane(lane).value()),
                WideScalar::<R>::of(vertex[2].lane(lane).value()),
            ]
        };
        blend([corner(a), corner(b), corner(c)], self.barycentric[sample])
    }

    /// Adds the sample's gradient to its face's vertices: a row of Wᵀ.
    #[inline(always)]
    pub fn point_backward<R: Real>(&self, sample: usize, d_point: Vec3<R>, d_vertices: &mut [Vec3<R>]) {
        for (&corner, &weight) in self.corners[sample].iter().zip(&self.barycentric[sample]) {
            add_scaled(&mut d_vertices[corner as usize], R::of(weight), d_point);
        }
    }
}

/// The weighted corners, from the first along the edges: the weights' rounding then scales with the face, not the body.
#[inline(always)]
fn blend<R: Real>([a, b, c]: [Vec3<R>; 3], [_, v, w]: [f64; 3]) -> Vec3<R> {
    let (v, w) = (R::of(v), R::of(w));
    let along = |k: usize| w.mul_add(c[k] - a[k], v.mul_add(b[k] - a[k], a[k]));
    [along(0), along(1), along(2)]
}

fn areas(mesh: &Mesh, vertices: &[Vec3<f64>]) -> Vec<f64> {
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|index| vertices[index as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        dot(normal, normal).sqrt() / 2.0
    };
    memory::collect(mesh.faces.iter().map(area))
}

/// A uniform number in [0, 1) from the generator's 53 highest bits, the same on every machine.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Faces by cumulated area, then a uniform point in the triangle: (1−√r, √r(1−s), √r s).
fn pick(areas: &[f64], num_samples: usize, seed: u64) -> (Vec<u32>, Vec<[f64; 3]>) {
    let mut cumulated = memory::with_capacity(areas.len());
    let mut total = 0.0;
    for area in areas {
        total += area;
        cumulated.push(total);
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut picks = memory::with_capacity(num_samples);
    let mut points = memory::with_capacity(num_samples);
    for pick in 0..num_samples {
        let target = uniform(&mut random) * total;
        let face = cumulated.partition_point(|&sum| sum <= target).min(areas.len() - 1);
        let (root, s) = (uniform(&mut random).sqrt(), uniform(&mut random));
        picks.push((face as u32, pick as u32));
        points.push([1.0 - root, root * (1.0 - s), root * s]);
    }
    // Sorted by face, so that a pass visits the vertices in order; within a face as they were picked, because the order
    // is part of what a seed means.
    picks.sort_unstable();
    let barycentric = memory::collect(picks.iter().map(|&(_, pick)| points[pick as usize]));
    (memory::collect(picks.iter().map(|&(face, _)| face)), barycentric)
}

fn part_sums(mesh: &Mesh, parts: &[u32], corners: &[[u32; 3]], barycentric: &[[f64; 3]]) -> Vec<PartSum> {
    let mut members = memory::filled(Vec::new(), mesh.num_parts);
    for (sample, &part) in parts.iter().enumerate() {
        memory::push(&mut members[part as usize], sample);
    }
    let mut sums = memory::filled(PartSum::default(), mesh.num_parts);
    let mut weight_of = memory::filled(0.0, mesh.num_vertices);
    for (sum, members) in sums.iter_mut().zip(members) {
        let mut touched = memory::with_capacity(3 * members.len());
        sum.count = members.len();
        for sample in members {
            for (&corner, &weight) in corners[sample].iter().zip(&barycentric[sample]) {
                touched.push(corner);
                weight_of[corner as usize] += weight;
            }
        }
        touched.sort_unstable();
        touched.dedup();
        let weights = touched.iter().map(|&vertex| std::mem::take(&mut weight_of[vertex as usize]));
        sum.weights = Weights::new(memory::collect(weights));
        sum.vertices = memory::copied(&touched);
    }
    sums
}

impl PartSum {
    /// The sum of the part's sample positions.
    #[inline(always)]
    pub fn forward<R: Real>(&self, vertices: &[Vec3<R>]) -> Vec3<R::Wide> {
        let mut sum = [R::Wide::zero(); 3];
        for (block, indices) in self.vertices.chunks(BLOCK).enumerate() {
            let mut partial = [R::zero(); 3];
            for (i, &vertex) in indices.iter().enumerate() {
                add_scaled(&mut partial, self.weights.get(block * BLOCK + i), vertices[vertex as usize]);
            }
            add_to(partial, &mut sum);
        }
        sum
    }

    #[inline(always)]
    pub fn backward<R: Real>(&self, d_sum: Vec3<R::Wide>, d_vertices: &mut [Vec3<R>]) {
        let d_sum = narrow::<R>(d_sum);
        for (i, &vertex) in self.vertices.iter().enumerate() {
            add_scaled(&mut d_vertices[vertex as usize], self.weights.get(i), d_sum);
        }
    }
}
