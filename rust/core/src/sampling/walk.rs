//! The walk: the order in which passes visit the samples, interpolation from vertices to samples, and its transpose.

use crate::memory;
use crate::number::{Data, Kernel, Real, SUMS};
use std::ops::Range;

/// Constants stored in both precisions, so that no loop has to convert them.
#[derive(Clone, Debug, Default)]
pub struct Weights {
    single: Vec<f32>,
    double: Vec<f64>,
}

impl Weights {
    pub fn new(double: Vec<f64>) -> Self {
        Weights { single: memory::collect(double.iter().map(|&weight| weight as f32)), double }
    }

    #[inline(always)]
    pub fn get<R: Real>(&self, index: usize) -> R {
        R::splat(R::Data::pick(&self.single, &self.double)[index])
    }
}

/// The order in which passes visit the samples: faces with equally many samples follow each other, so that the loops
/// over a face's samples have lengths known at compile time.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    /// Each sample's index in the public order.
    pub order: Vec<u32>,
    pub chunks: Vec<Chunk>,
    /// The vertices of each group of samples that share a face.
    corners: Vec<[u32; 3]>,
    /// Three per sample.
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

/// One number per sample of a chunk. Entries beyond the chunk's end are finite, and must not be summed.
pub type Row<R> = [R; CHUNK];

/// Samples of a face that are visited together; a face with more has several groups.
const GROUP: usize = 8;

impl Walk {
    pub(super) fn new(faces: &[u32], corners: &[[u32; 3]], barycentric: &[[f64; 3]]) -> Self {
        let samples = memory::collect(0..faces.len() as u32);
        let same_face = |a: &u32, b: &u32| faces[*a as usize] == faces[*b as usize];
        let mut walk = Walk { order: memory::with_capacity(samples.len()), ..Walk::default() };
        for size in 1..=GROUP {
            let groups = samples.chunk_by(same_face).flat_map(|face| face.chunks(GROUP));
            for (i, group) in groups.filter(|group| group.len() == size).enumerate() {
                let (sample, place) = (walk.order.len(), walk.corners.len());
                if i.is_multiple_of(CHUNK / size) {
                    memory::push(&mut walk.chunks, Chunk { samples: sample..sample, groups: place..place });
                }
                walk.order.extend_from_slice(group);
                memory::push(&mut walk.corners, corners[group[0] as usize]);
                let chunk = walk.chunks.last_mut().expect("one was begun");
                (chunk.samples.end, chunk.groups.end) = (sample + size, place + 1);
            }
        }
        let mut weights = memory::with_capacity(3 * samples.len());
        weights.extend(walk.order.iter().flat_map(|&sample| barycentric[sample as usize]));
        walk.weights = Weights::new(weights);
        walk
    }

    /// (W x)_i for the samples of a chunk: the vertices' numbers x interpolated.
    pub fn interpolate<R: Real>(&self, chunk: &Chunk, vertices: &[R], row: &mut Row<R>) {
        match chunk.group_size() {
            1 => R::dispatch::<Interpolate<1>, _>((self, chunk, vertices, row)),
            2 => R::dispatch::<Interpolate<2>, _>((self, chunk, vertices, row)),
            3 => R::dispatch::<Interpolate<3>, _>((self, chunk, vertices, row)),
            4 => R::dispatch::<Interpolate<4>, _>((self, chunk, vertices, row)),
            5 => R::dispatch::<Interpolate<5>, _>((self, chunk, vertices, row)),
            6 => R::dispatch::<Interpolate<6>, _>((self, chunk, vertices, row)),
            7 => R::dispatch::<Interpolate<7>, _>((self, chunk, vertices, row)),
            _ => R::dispatch::<Interpolate<8>, _>((self, chunk, vertices, row)),
        }
    }

    /// The vertices of each of a chunk's groups, and how many samples a group has.
    #[inline(always)]
    pub fn groups(&self, chunk: &Chunk) -> (&[[u32; 3]], usize) {
        (&self.corners[chunk.groups.clone()], chunk.group_size())
    }

    /// The weights of the sample at a position of the walk.
    #[inline(always)]
    pub fn weights<R: Real>(&self, place: usize) -> [R; 3] {
        [self.weights.get(3 * place), self.weights.get(3 * place + 1), self.weights.get(3 * place + 2)]
    }

    /// Adds (Wᵀ y)_v of a chunk's samples to the vertices' numbers.
    pub fn scatter<R: Real>(&self, chunk: &Chunk, row: &Row<R>, vertices: &mut [R]) {
        match chunk.group_size() {
            1 => R::dispatch::<Scatter<1>, _>((self, chunk, row, vertices)),
            2 => R::dispatch::<Scatter<2>, _>((self, chunk, row, vertices)),
            3 => R::dispatch::<Scatter<3>, _>((self, chunk, row, vertices)),
            4 => R::dispatch::<Scatter<4>, _>((self, chunk, row, vertices)),
            5 => R::dispatch::<Scatter<5>, _>((self, chunk, row, vertices)),
            6 => R::dispatch::<Scatter<6>, _>((self, chunk, row, vertices)),
            7 => R::dispatch::<Scatter<7>, _>((self, chunk, row, vertices)),
            _ => R::dispatch::<Scatter<8>, _>((self, chunk, row, vertices)),
        }
    }
}

/// [`Walk::interpolate`] for groups of N samples.
struct Interpolate<const N: usize>;

impl<R: Real, const N: usize> Kernel<(&Walk, &Chunk, &[R], &mut Row<R>)> for Interpolate<N> {
    type Output = ();

    #[inline(always)]
    fn run((walk, chunk, vertices, row): (&Walk, &Chunk, &[R], &mut Row<R>)) {
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

impl<R: Real, const N: usize> Kernel<(&Walk, &Chunk, &Row<R>, &mut [R])> for Scatter<N> {
    type Output = ();

    #[inline(always)]
    fn run((walk, chunk, row, vertices): (&Walk, &Chunk, &Row<R>, &mut [R])) {
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
