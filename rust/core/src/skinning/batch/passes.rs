//! Passes over a model's tiles: each tile is read once for a group of bodies.

use super::arguments::{TILE, rows};
use crate::number::{Data, Kernel, Real, Scalar};
use crate::skinning::blend::{Registers, Tile};
use crate::skinning::{Block, Body, Gradient, Parameters, Skin, Start, Sums, Totals, VertexGradient, Wanted};

/// A pass with vertices in the registers V: P of them make up a tile, and the sums of N bodies over a tile fill those
/// that the CPU has.
pub(super) trait Pass<V: Real>: Sized {
    fn run<const P: usize, const N: usize>(self);
}

/// Runs a pass compiled for its registers' instruction set.
pub(super) fn run<V: Real, A: Pass<V>>(pass: A) {
    V::dispatch::<Widths<V>, _>((pass,))
}

struct Widths<V>(std::marker::PhantomData<V>);

impl<V: Real, A: Pass<V>> Kernel<(A,)> for Widths<V> {
    type Output = ();

    #[inline(always)]
    fn run((pass,): (A,)) {
        match (V::LANES, size_of::<V>()) {
            (16, 64) => pass.run::<1, 8>(),
            (16, _) => pass.run::<1, 4>(),
            (8, 32) => pass.run::<2, 2>(),
            (8, _) => pass.run::<2, 1>(),
            (4, 16) => pass.run::<4, 2>(),
            (4, _) => pass.run::<4, 1>(),
            _ => pass.run::<TILE, 1>(),
        }
    }
}

pub(super) struct Forward<'a, T, R: Real, F> {
    pub skin: &'a Skin<T, TILE>,
    pub start: Start<'a, T, TILE>,
    pub bodies: &'a [Body<R>],
    pub vertices: &'a mut [T],
    pub number: F,
}

impl<T: Scalar, V: Real, F: Fn(V::Scalar) -> T> Pass<V> for Forward<'_, T, V::Scalar, F> {
    #[inline(always)]
    fn run<const P: usize, const N: usize>(self) {
        let row = 3 * self.skin.num_vertices;
        let (blocks, singles) = self.bodies.as_chunks::<N>();
        let (vertices, vertices_of_singles) = self.vertices.split_at_mut(blocks.len() * N * row);
        let (blocks, singles) = (together(blocks), together(singles.as_chunks::<1>().0));
        for tile in 0..self.skin.num_tiles() {
            for (block, vertices) in blocks.iter().zip(vertices.chunks_exact_mut(N * row)) {
                write::<V, T, P, N>(self.skin.forward(self.start, tile, block), tile, vertices, &self.number);
            }
            for (single, vertices) in singles.iter().zip(vertices_of_singles.chunks_exact_mut(row)) {
                write::<V, T, P, 1>(self.skin.forward(self.start, tile, single), tile, vertices, &self.number);
            }
        }
    }
}

/// The vertices of a tile of N bodies, each body's to its row.
#[inline(always)]
fn write<V: Real, T, const P: usize, const N: usize>(
    tiles: [Registers<V, P>; N],
    tile: usize,
    vertices: &mut [T],
    number: &impl Fn(V::Scalar) -> T,
) {
    let row = vertices.len() / N;
    for (points, vertices) in tiles.iter().zip(vertices.chunks_exact_mut(row)) {
        let out = &mut vertices[3 * TILE * tile..];
        // A constant length lets the compiler unroll the loop.
        match out.first_chunk_mut::<{ 3 * TILE }>() {
            Some(out) => interleave(points, out, number),
            None => interleave(points, out, number),
        }
    }
}

#[inline(always)]
fn interleave<V: Real, T, const P: usize>(tile: &Registers<V, P>, out: &mut [T], number: &impl Fn(V::Scalar) -> T) {
    for (i, out) in out.chunks_exact_mut(3).enumerate() {
        for axis in 0..3 {
            out[axis] = number(tile[axis][i / V::LANES].lane(i % V::LANES));
        }
    }
}

/// Tiles of a backward pass that share a visit to its sums: few enough that their directions stay in the cache.
const VISIT: usize = 8;

pub(super) struct Backward<'a, T, R: Real, F, G> {
    pub skin: &'a Skin<T, TILE>,
    pub start: Start<'a, T, TILE>,
    pub bodies: &'a [Body<R>],
    /// One row per body; empty means zeros.
    pub d_vertices: &'a [T],
    pub d_joints: &'a [T],
    pub constant: F,
    pub wanted: Wanted,
    /// Takes the gradient of each body.
    pub take: G,
}

impl<T, V, F, G> Pass<V> for Backward<'_, T, V::Scalar, F, G>
where
    T: Scalar,
    V: Real,
    F: Fn(T) -> V::Scalar,
    G: FnMut(usize, &Body<V::Scalar>, Gradient<V::Scalar>),
{
    #[inline(always)]
    fn run<const P: usize, const N: usize>(mut self) {
        let row = 3 * self.skin.num_vertices;
        let (blocks, singles) = self.bodies.as_chunks::<N>();
        let (blocks, singles) = (together(blocks), together(singles.as_chunks::<1>().0));
        let mut sums: Vec<Sums<V, P, N>> = blocks.iter().map(|_| self.skin.sums(self.wanted)).collect();
        let mut sums_of_singles: Vec<Sums<V, P, 1>> = singles.iter().map(|_| self.skin.sums(self.wanted)).collect();
        if !self.d_vertices.is_empty() {
            let (d, d_of_singles) = self.d_vertices.split_at(blocks.len() * N * row);
            for first in (0..self.skin.num_tiles()).step_by(VISIT) {
                for ((block, sums), d) in blocks.iter().zip(&mut sums).zip(d.chunks_exact(N * row)) {
                    let upstream = Separate { d, row, constant: &self.constant };
                    self.skin.backward::<V, P, N, VISIT>(self.start, first, block, &upstream, sums);
                }
                for ((single, sums), d) in singles.iter().zip(&mut sums_of_singles).zip(d_of_singles.chunks_exact(row))
                {
                    let upstream = Separate { d, row, constant: &self.constant };
                    self.skin.backward::<V, P, 1, VISIT>(self.start, first, single, &upstream, sums);
                }
            }
        }
        for (i, sums) in sums.iter().enumerate() {
            for place in 0..N {
                self.finish(i * N + place, self.skin.totals(sums, place));
            }
        }
        for (i, sums) in sums_of_singles.iter().enumerate() {
            self.finish(blocks.len() * N + i, self.skin.totals(sums, 0));
        }
    }
}

impl<T: Scalar, R: Scalar, F: Fn(T) -> R, G: FnMut(usize, &Body<R>, Gradient<R>)> Backward<'_, T, R, F, G> {
    fn finish(&mut self, at: usize, totals: Totals<R>) {
        let d_joints = rows(self.d_joints, at..at + 1, 3 * self.skin.num_joints());
        let d_joints: Vec<R> = d_joints.iter().map(|&x| (self.constant)(x)).collect();
        let body = &self.bodies[at];
        (self.take)(at, body, R::dispatch::<Finish, _>((self.skin, body, &totals, &d_joints[..])));
    }
}

/// The gradient by the vertices of several bodies, one row each.
struct Separate<'a, T, F> {
    d: &'a [T],
    row: usize,
    constant: &'a F,
}

impl<T: Copy, V: Real, F: Fn(T) -> V::Scalar, const P: usize> VertexGradient<V, P> for Separate<'_, T, F> {
    #[inline(always)]
    fn of(&self, body: usize, tile: usize) -> Registers<V, P> {
        let d = &self.d[body * self.row + 3 * TILE * tile..(body + 1) * self.row];
        match d.first_chunk::<{ 3 * TILE }>() {
            Some(d) => separate(d, self.constant),
            None => separate(d, self.constant),
        }
    }
}

#[inline(always)]
fn separate<V: Real, T: Copy, const P: usize>(points: &[T], number: &impl Fn(T) -> V::Scalar) -> Registers<V, P> {
    let mut numbers = [[V::Scalar::zero(); TILE]; 3];
    for (i, point) in points.chunks_exact(3).take(TILE).enumerate() {
        for axis in 0..3 {
            numbers[axis][i] = number(point[axis]);
        }
    }
    let mut tile = [[V::zero(); P]; 3];
    for axis in 0..3 {
        for part in 0..P {
            tile[axis][part] = V::from_lanes(|lane| numbers[axis][part * V::LANES + lane]);
        }
    }
    tile
}

/// The resting tiles of one shape.
pub(super) struct Shape<'a, T, R> {
    pub skin: &'a Skin<T, TILE>,
    pub betas: &'a [R],
    pub expression: &'a [R],
    pub shaped: &'a mut Vec<Tile<T, TILE>>,
}

impl<T: Data, V: Real<Data = T>> Pass<V> for Shape<'_, T, V::Scalar> {
    #[inline(always)]
    fn run<const P: usize, const N: usize>(self) {
        *self.shaped = self.skin.shaped::<V, P>(self.betas, self.expression);
    }
}

fn together<R: Real, const N: usize>(bodies: &[[Body<R>; N]]) -> Vec<Block<'_, R, N>> {
    bodies.iter().map(Block::new).collect()
}

/// [`Skin::place`] in a function of its own.
pub(super) struct PlaceJoints;

impl<T: Scalar, R: Scalar> Kernel<(&Skin<T, TILE>, Parameters<R>)> for PlaceJoints {
    type Output = Body<R>;

    #[inline(always)]
    fn run((skin, parameters): (&Skin<T, TILE>, Parameters<R>)) -> Body<R> {
        skin.place(parameters)
    }
}

/// [`Skin::gradient`] in a function of its own.
struct Finish;

impl<T: Scalar, R: Scalar> Kernel<(&Skin<T, TILE>, &Body<R>, &Totals<R>, &[R])> for Finish {
    type Output = Gradient<R>;

    #[inline(always)]
    fn run((skin, body, totals, d_joints): (&Skin<T, TILE>, &Body<R>, &Totals<R>, &[R])) -> Gradient<R> {
        skin.gradient(body, totals, d_joints)
    }
}
