//! Sampling: N_U points on the surface that move with it, and the passes over them.
//!
//! Triangle point picking, area-weighted on the template: the points are fixed barycentric weights on fixed faces, so a
//! posed body's samples are W V with a sparse W of three weights a row, and gradients return by Wᵀ. Rooms need little
//! more of a sample than a number or two, such as its height: these are interpolated from the vertices' numbers
//! ([`Walk`]), and what a room finds for each sample is added to the vertices by the same weights.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::number::vector::{Vec3, add_scaled, add_to, cross, dot, narrow, sub, widen};
use crate::number::{BLOCK, Data, Real, Room, Scalar, WideScalar};
use crate::quantity::{Quantity, unknown_choice};
use crate::scene::Scene;
use crate::template::Template;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::ops::Range;

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

/// Constants that are kept in both precisions, so that no loop has to convert them.
#[derive(Clone, Debug, Default)]
pub struct Weights {
    single: Vec<f32>,
    double: Vec<f64>,
}

impl Weights {
    pub fn new(double: Vec<f64>) -> Self {
        Weights { single: double.iter().map(|&weight| weight as f32).collect(), double }
    }

    #[inline(always)]
    pub fn get<R: Real>(&self, index: usize) -> R {
        R::splat(R::Data::pick(&self.single, &self.double)[index])
    }
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
        let picks = pick(&areas(mesh, vertices), num_samples, seed);
        let faces: Vec<u32> = picks.iter().map(|pick| pick.0).collect();
        let barycentric: Vec<_> = picks.iter().map(|pick| pick.1).collect();
        let corners: Vec<_> = faces.iter().map(|&face| mesh.faces[face as usize]).collect();
        let parts: Vec<_> = faces.iter().map(|&face| mesh.face_parts[face as usize]).collect();
        let part_sums = part_sums(mesh, &parts, &corners, &barycentric);
        let walk = Walk::new(&faces, &corners, &barycentric);
        Ok(Samples { faces, corners, barycentric, parts, part_sums, walk })
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
        sum.weights =
            Weights::new(touched.iter().map(|&vertex| std::mem::take(&mut weight_of[vertex as usize])).collect());
        sum.vertices = touched;
    }
    sums
}

/// The order in which passes visit the samples: faces with equally many samples one after the other, so that the loops
/// over a face's samples have lengths that the compiler knows.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    /// Each sample's place in the public order.
    pub order: Vec<u32>,
    pub chunks: Vec<Chunk>,
    /// The vertices of each group of samples that share a face.
    corners: Vec<[u32; 3]>,
    /// Three a sample.
    weights: Weights,
}

/// Consecutive samples of the walk, whole groups of one size.
#[derive(Clone, Debug)]
pub struct Chunk {
    pub samples: Range<usize>,
    groups: Range<usize>,
}

/// Samples that a pass handles at once: short enough for single-precision partial sums.
pub const CHUNK: usize = 64;

/// A number for each sample of a chunk. What lies behind the chunk's end is finite and must not be summed.
pub type Row<R> = [R; CHUNK];

/// Samples of a face that are visited together; a face with more has several groups.
const GROUP: usize = 8;

impl Walk {
    fn new(faces: &[u32], corners: &[[u32; 3]], barycentric: &[[f64; 3]]) -> Self {
        let samples: Vec<u32> = (0..faces.len() as u32).collect();
        let same_face = |a: &u32, b: &u32| faces[*a as usize] == faces[*b as usize];
        let mut groups: Vec<&[u32]> = samples.chunk_by(same_face).flat_map(|face| face.chunks(GROUP)).collect();
        groups.sort_by_key(|group| group.len());
        let mut walk = Walk::default();
        for run in groups.chunk_by(|a, b| a.len() == b.len()) {
            for chunk in run.chunks(CHUNK / run[0].len()) {
                let (first_sample, first_group) = (walk.order.len(), walk.corners.len());
                for group in chunk {
                    walk.order.extend_from_slice(group);
                    walk.corners.push(corners[group[0] as usize]);
                }
                let (samples, groups) = (first_sample..walk.order.len(), first_group..walk.corners.len());
                walk.chunks.push(Chunk { samples, groups });
            }
        }
        walk.weights = Weights::new(walk.order.iter().flat_map(|&sample| barycentric[sample as usize]).collect());
        walk
    }

    /// (W x)_i for the samples of a chunk: the vertices' numbers x interpolated.
    pub fn interpolate<R: Real>(&self, chunk: &Chunk, vertices: &[R], row: &mut Row<R>) {
        match chunk.group_size() {
            1 => R::apart::<Interpolate<1>, _>((self, chunk, vertices, row)),
            2 => R::apart::<Interpolate<2>, _>((self, chunk, vertices, row)),
            3 => R::apart::<Interpolate<3>, _>((self, chunk, vertices, row)),
            4 => R::apart::<Interpolate<4>, _>((self, chunk, vertices, row)),
            5 => R::apart::<Interpolate<5>, _>((self, chunk, vertices, row)),
            6 => R::apart::<Interpolate<6>, _>((self, chunk, vertices, row)),
            7 => R::apart::<Interpolate<7>, _>((self, chunk, vertices, row)),
            _ => R::apart::<Interpolate<8>, _>((self, chunk, vertices, row)),
        }
    }

    /// The vertices of each of a chunk's groups, and how many samples a group has.
    #[inline(always)]
    pub fn groups(&self, chunk: &Chunk) -> (&[[u32; 3]], usize) {
        (&self.corners[chunk.groups.clone()], chunk.group_size())
    }

    /// The weights of the sample at a place of the walk.
    #[inline(always)]
    pub fn weights<R: Real>(&self, place: usize) -> [R; 3] {
        [self.weights.get(3 * place), self.weights.get(3 * place + 1), self.weights.get(3 * place + 2)]
    }

    /// Adds (Wᵀ y)_v of a chunk's samples to the vertices' numbers.
    pub fn scatter<R: Real>(&self, chunk: &Chunk, row: &Row<R>, vertices: &mut [R]) {
        match chunk.group_size() {
            1 => R::apart::<Scatter<1>, _>((self, chunk, row, vertices)),
            2 => R::apart::<Scatter<2>, _>((self, chunk, row, vertices)),
            3 => R::apart::<Scatter<3>, _>((self, chunk, row, vertices)),
            4 => R::apart::<Scatter<4>, _>((self, chunk, row, vertices)),
            5 => R::apart::<Scatter<5>, _>((self, chunk, row, vertices)),
            6 => R::apart::<Scatter<6>, _>((self, chunk, row, vertices)),
            7 => R::apart::<Scatter<7>, _>((self, chunk, row, vertices)),
            _ => R::apart::<Scatter<8>, _>((self, chunk, row, vertices)),
        }
    }
}

/// [`Walk::interpolate`] for groups of N samples.
struct Interpolate<const N: usize>;

impl<R: Real, const N: usize> Room<(&Walk, &Chunk, &[R], &mut Row<R>)> for Interpolate<N> {
    type Output = ();

    #[inline(always)]
    fn enter((walk, chunk, vertices, row): (&Walk, &Chunk, &[R], &mut Row<R>)) {
        let weights = walk.weights.of_samples::<R, N>(chunk);
        let rows = row.as_chunks_mut::<N>().0;
        for ((&[a, b, c], weights), row) in walk.corners[chunk.groups.clone()].iter().zip(weights).zip(rows) {
            let start = vertices[a as usize];
            let (to_b, to_c) = (vertices[b as usize] - start, vertices[c as usize] - start);
            for (number, &[_, v, w]) in row.iter_mut().zip(weights) {
                *number = R::splat(w).mul_add(to_c, R::splat(v).mul_add(to_b, start));
            }
        }
    }
}

/// [`Walk::scatter`] for groups of N samples.
struct Scatter<const N: usize>;

impl<R: Real, const N: usize> Room<(&Walk, &Chunk, &Row<R>, &mut [R])> for Scatter<N> {
    type Output = ();

    #[inline(always)]
    fn enter((walk, chunk, row, vertices): (&Walk, &Chunk, &Row<R>, &mut [R])) {
        let weights = walk.weights.of_samples::<R, N>(chunk);
        let rows = row.as_chunks::<N>().0;
        for ((&[a, b, c], weights), row) in walk.corners[chunk.groups.clone()].iter().zip(weights).zip(rows) {
            let mut shares = [R::zero(); 3];
            for (&number, weights) in row.iter().zip(weights) {
                for corner in 0..3 {
                    shares[corner] = R::splat(weights[corner]).mul_add(number, shares[corner]);
                }
            }
            vertices[a as usize] = vertices[a as usize] + shares[0];
            vertices[b as usize] = vertices[b as usize] + shares[1];
            vertices[c as usize] = vertices[c as usize] + shares[2];
        }
    }
}

impl Chunk {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    #[inline(always)]
    fn group_size(&self) -> usize {
        self.samples.len() / self.groups.len()
    }
}

impl Weights {
    /// The weights of a chunk's samples, by group.
    #[inline(always)]
    fn of_samples<R: Real, const N: usize>(&self, chunk: &Chunk) -> &[[[R::Data; 3]; N]] {
        let weights = &R::Data::pick(&self.single, &self.double)[3 * chunk.samples.start..3 * chunk.samples.end];
        weights.as_chunks::<3>().0.as_chunks::<N>().0
    }
}

/// Running sums over a row: one body alone sums in the same order as in a lane, and yet its sums vectorise.
pub const SUMS: usize = 8;

/// Σ of a row's first `len` numbers.
#[inline(always)]
pub fn sum_row<R: Real>(row: &Row<R>, len: usize) -> R {
    let mut sums = [R::zero(); SUMS];
    let (whole, rest) = row[..len].as_chunks::<SUMS>();
    for numbers in whole {
        for k in 0..SUMS {
            sums[k] = sums[k] + numbers[k];
        }
    }
    for (k, &number) in rest.iter().enumerate() {
        sums[k] = sums[k] + number;
    }
    fold(sums)
}

/// The sum of the running sums.
#[inline(always)]
pub fn fold<R: Real>(sums: [R; SUMS]) -> R {
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}

/// The points that a loss looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Points {
    Samples,
    Vertices,
}

/// Up to [`CHUNK`] points that are looked at together.
pub enum Place<'a> {
    Samples(&'a Walk, &'a Chunk),
    Vertices(Range<usize>),
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

    /// All points, in the order of the sums over them.
    pub fn places(self, template: &Template) -> Vec<Place<'_>> {
        let walk = &template.samples.walk;
        let count = template.mesh.num_vertices;
        match self {
            Points::Samples => walk.chunks.iter().map(|chunk| Place::Samples(walk, chunk)).collect(),
            Points::Vertices => {
                (0..count).step_by(CHUNK).map(|start| Place::Vertices(start..count.min(start + CHUNK))).collect()
            }
        }
    }
}

impl Place<'_> {
    #[inline(always)]
    pub fn len(&self) -> usize {
        match self {
            Place::Samples(_, chunk) => chunk.len(),
            Place::Vertices(range) => range.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vertices' numbers at these points.
    #[inline(always)]
    pub fn read<R: Real>(&self, vertices: &[R], row: &mut Row<R>) {
        match self {
            Place::Samples(walk, chunk) => walk.interpolate(chunk, vertices, row),
            Place::Vertices(range) => row[..range.len()].copy_from_slice(&vertices[range.clone()]),
        }
    }

    /// Adds the points' numbers to the vertices', by the transposed weights.
    #[inline(always)]
    pub fn hand_back<R: Real>(&self, row: &Row<R>, vertices: &mut [R]) {
        match self {
            Place::Samples(walk, chunk) => walk.scatter(chunk, row, vertices),
            Place::Vertices(range) => {
                for (vertex, &number) in vertices[range.clone()].iter_mut().zip(row) {
                    *vertex = *vertex + number;
                }
            }
        }
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
        R::apart::<SurfaceForward, _>((scene, out));
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        R::apart::<SurfaceBackward, _>((&scene.template.samples, d_out, d_points));
    }
}

struct SurfaceForward;

impl<R: Real> Room<(&Scene<'_, R>, &mut [R])> for SurfaceForward {
    type Output = ();

    #[inline(always)]
    fn enter((scene, out): (&Scene<'_, R>, &mut [R])) {
        for (sample, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            scene.put(widen(scene.template.samples.point(sample, scene.points)), out);
        }
    }
}

struct SurfaceBackward;

impl<R: Real> Room<(&Samples, &[R], &mut [Vec3<R>])> for SurfaceBackward {
    type Output = ();

    #[inline(always)]
    fn enter((samples, d_out, d_points): (&Samples, &[R], &mut [Vec3<R>])) {
        for (sample, &d_point) in d_out.as_chunks::<3>().0.iter().enumerate() {
            samples.point_backward(sample, d_point, d_points);
        }
    }
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
