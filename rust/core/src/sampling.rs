//! Sampling: N_U points on the surface that move with it, and the passes over them.
//!
//! Triangle point picking, area-weighted on the template: the points are fixed barycentric weights on fixed faces, so a
//! posed body's samples are W V with a sparse W of three weights a row, and gradients return by Wᵀ. A pass interpolates
//! [`CHUNK`] points at a time, together with their heights, and shows them to the rooms that need them.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, narrow, scale, sub, widen};
use crate::quantity::{Quantity, unknown_choice};
use crate::scene::Scene;
use crate::template::Template;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Points that a pass handles at once: short enough for single-precision partial sums.
pub const CHUNK: usize = 64;

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
}

/// Σ_{i in part} (W V)_i = Σ weight · vertex.
#[derive(Clone, Debug, Default)]
pub struct PartSum {
    pub count: usize,
    pub vertices: Vec<u32>,
    pub weights: Vec<f64>,
}

impl Samples {
    pub fn new(mesh: &Mesh, vertices: &[Vec3<f64>], num_samples: usize, seed: u64) -> Result<Self> {
        if num_samples == 0 || num_samples > MAX_SAMPLES {
            return Err(Error::SampleCount { got: num_samples, limit: MAX_SAMPLES });
        }
        let picks = pick(&areas(mesh, vertices), num_samples, seed);
        let faces: Vec<u32> = picks.iter().map(|pick| pick.0).collect();
        let barycentric: Vec<_> = picks.iter().map(|pick| pick.1).collect();
        let corners: Vec<_> = faces.iter().map(|&face| mesh.faces[face as usize]).collect();
        let parts: Vec<_> = faces.iter().map(|&face| mesh.face_parts[face as usize]).collect();
        let part_sums = part_sums(mesh, &parts, &corners, &barycentric);
        Ok(Samples { faces, corners, barycentric, parts, part_sums })
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
    pub fn wide_point<R: Real>(&self, sample: usize, vertices: &[Vec3<R>]) -> Vec3<R::Wide> {
        blend(self.corners[sample].map(|corner| widen(vertices[corner as usize])), self.barycentric[sample])
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
fn blend<R: Real>([a, b, c]: [Vec3<R>; 3], weights: [f64; 3]) -> Vec3<R> {
    let [_, v, w] = weights.map(R::of);
    std::array::from_fn(|k| a[k] + (v * (b[k] - a[k]) + w * (c[k] - a[k])))
}

fn areas(mesh: &Mesh, vertices: &[Vec3<f64>]) -> Vec<f64> {
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|index| vertices[index as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        dot(normal, normal).sqrt() / 2.0
    };
    mesh.faces.iter().map(area).collect()
}

/// A uniform number in [0, 1) from the generator's 53 highest bits, the same on every machine.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Faces by cumulated area, then a uniform point in the triangle: (1−√r, √r(1−s), √r s).
fn pick(areas: &[f64], num_samples: usize, seed: u64) -> Vec<(u32, [f64; 3])> {
    let mut cumulated = Vec::with_capacity(areas.len());
    let mut total = 0.0;
    for area in areas {
        total += area;
        cumulated.push(total);
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut picks: Vec<(u32, [f64; 3])> = (0..num_samples)
        .map(|_| {
            let target = uniform(&mut random) * total;
            let face = cumulated.partition_point(|&sum| sum <= target).min(areas.len() - 1);
            let (root, s) = (uniform(&mut random).sqrt(), uniform(&mut random));
            (face as u32, [1.0 - root, root * (1.0 - s), root * s])
        })
        .collect();
    // By face, so that a pass walks the vertices in order. The sort is stable: the order is part of the seed's meaning.
    picks.sort_by_key(|pick| pick.0);
    picks
}

fn part_sums(mesh: &Mesh, parts: &[u32], corners: &[[u32; 3]], barycentric: &[[f64; 3]]) -> Vec<PartSum> {
    let mut members = vec![Vec::new(); mesh.num_parts];
    for (sample, &part) in parts.iter().enumerate() {
        members[part as usize].push(sample);
    }
    let mut sums = vec![PartSum::default(); mesh.num_parts];
    let mut weight_of = vec![0.0; mesh.num_vertices];
    for (sum, members) in sums.iter_mut().zip(members) {
        let mut touched = Vec::new();
        sum.count = members.len();
        for sample in members {
            for (&corner, &weight) in corners[sample].iter().zip(&barycentric[sample]) {
                touched.push(corner);
                weight_of[corner as usize] += weight;
            }
        }
        touched.sort_unstable();
        touched.dedup();
        sum.weights = touched.iter().map(|&vertex| std::mem::take(&mut weight_of[vertex as usize])).collect();
        sum.vertices = touched;
    }
    sums
}

/// The points that a pass runs over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Points {
    Samples,
    Vertices,
}

/// Up to [`CHUNK`] consecutive points with their heights above the ground, or their gradients. Rooms may compute on the
/// places from `len` on (they hold old points), so that their loops have a fixed length, but must not sum over them.
pub struct Chunk<R> {
    /// The first point's index.
    pub start: usize,
    pub len: usize,
    pub position: [[R; CHUNK]; 3],
    pub height: [R; CHUNK],
}

/// A room that looks at every point once, and hands gradients back at a second look.
pub trait Pass<R: Real> {
    fn read(&mut self, chunk: &Chunk<R>);
    /// Adds to `d_chunk`'s positions and heights.
    fn hand_back(&self, chunk: &Chunk<R>, d_chunk: &mut Chunk<R>);
}

/// Two rooms in one pass.
impl<R: Real, A: Pass<R>, B: Pass<R>> Pass<R> for (&mut A, &mut B) {
    fn read(&mut self, chunk: &Chunk<R>) {
        self.0.read(chunk);
        self.1.read(chunk);
    }
    fn hand_back(&self, chunk: &Chunk<R>, d_chunk: &mut Chunk<R>) {
        self.0.hand_back(chunk, d_chunk);
        self.1.hand_back(chunk, d_chunk);
    }
}

impl Points {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "samples" => Ok(Points::Samples),
            "vertices" => Ok(Points::Vertices),
            _ => Err(unknown_choice("points", "\"samples\", \"vertices\"", name)),
        }
    }

    pub fn count(self, template: &Template) -> usize {
        match self {
            Points::Samples => template.samples.len(),
            Points::Vertices => template.mesh.num_vertices,
        }
    }

    /// Shows every point to the room.
    pub fn read<R: Real>(self, scene: &Scene<R>, room: &mut impl Pass<R>) {
        let mut chunk = Chunk::empty();
        for start in (0..self.count(scene.template)).step_by(CHUNK) {
            self.load(scene, start, &mut chunk);
            room.read(&chunk);
        }
    }

    /// Shows every point again and adds the gradients that the room hands back.
    pub fn hand_back<R: Real>(self, scene: &Scene<R>, room: &impl Pass<R>, d_points: &mut [Vec3<R>]) {
        let normal = scene.narrow_ground().normal;
        let (mut chunk, mut d_chunk) = (Chunk::empty(), Chunk::empty());
        for start in (0..self.count(scene.template)).step_by(CHUNK) {
            self.load(scene, start, &mut chunk);
            d_chunk.clear();
            room.hand_back(&chunk, &mut d_chunk);
            for i in 0..chunk.len {
                let mut d_point = d_chunk.point(i);
                add_scaled(&mut d_point, d_chunk.height[i], normal);
                match self {
                    Points::Samples => scene.template.samples.point_backward(start + i, d_point, d_points),
                    Points::Vertices => d_points[start + i] = add(d_points[start + i], d_point),
                }
            }
        }
    }

    fn load<R: Real>(self, scene: &Scene<R>, start: usize, chunk: &mut Chunk<R>) {
        let ground = scene.narrow_ground();
        chunk.start = start;
        chunk.len = CHUNK.min(self.count(scene.template) - start);
        for i in 0..chunk.len {
            let point = match self {
                Points::Samples => scene.template.samples.point(start + i, scene.points),
                Points::Vertices => scene.points[start + i],
            };
            for k in 0..3 {
                chunk.position[k][i] = point[k];
            }
            chunk.height[i] = ground.signed_height(point);
        }
    }
}

impl<R: Real> Chunk<R> {
    fn empty() -> Self {
        Chunk { start: 0, len: 0, position: [[R::zero(); CHUNK]; 3], height: [R::zero(); CHUNK] }
    }

    #[inline(always)]
    pub fn point(&self, i: usize) -> Vec3<R> {
        [self.position[0][i], self.position[1][i], self.position[2][i]]
    }

    fn clear(&mut self) {
        self.position.iter_mut().chain([&mut self.height]).for_each(|axis| axis.fill(R::zero()));
    }
}

/// The samples' positions in the world, metres: W V.
pub struct SampleSurface;

impl Quantity for SampleSurface {
    type Saved<R: Real> = ();

    fn len(&self, template: &Template) -> usize {
        3 * template.samples.len()
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) {
        for (sample, out) in out.chunks_exact_mut(3).enumerate() {
            scene.put(widen(scene.template.samples.point(sample, scene.points)), out);
        }
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        for (sample, d) in d_out.chunks_exact(3).enumerate() {
            scene.template.samples.point_backward(sample, [d[0], d[1], d[2]], d_points);
        }
    }
}

impl PartSum {
    /// The sum of the part's sample positions.
    pub fn forward<R: Real>(&self, vertices: &[Vec3<R>]) -> Vec3<R::Wide> {
        let mut sum = [R::Wide::zero(); 3];
        for (&vertex, &weight) in self.vertices.iter().zip(&self.weights) {
            sum = add(sum, widen(scale(R::of(weight), vertices[vertex as usize])));
        }
        sum
    }

    pub fn backward<R: Real>(&self, d_sum: Vec3<R::Wide>, d_vertices: &mut [Vec3<R>]) {
        let d_sum = narrow::<R>(d_sum);
        for (&vertex, &weight) in self.vertices.iter().zip(&self.weights) {
            add_scaled(&mut d_vertices[vertex as usize], R::of(weight), d_sum);
        }
    }
}
