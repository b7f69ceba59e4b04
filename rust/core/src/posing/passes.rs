//! The passes over a model's tiles: every tile is read once for a group of bodies.

use super::TILE;
#[cfg(target_arch = "x86_64")]
use crate::number::gate::Level;
use crate::number::{Real, Scalar};
use crate::skinning::blend::Tile;
use crate::skinning::{Body, Skin, Start, Sums};

/// Work that runs with the widest registers of the machine. No fused operations are used, so that every width gives the
/// same bits.
pub(super) trait Work {
    /// Whether the 512-bit registers pay.
    #[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
    const IN_AVX512: bool;
    fn run(self);
}

pub(super) fn wide<W: Work>(work: W) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2(work: impl Work) {
            work.run();
        }
        #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
        fn with_avx512(work: impl Work) {
            work.run();
        }
        // SAFETY: the level has been asked of the CPU.
        match Level::current() {
            Ok(Level::Avx512) if W::IN_AVX512 => return unsafe { with_avx512(work) },
            Ok(Level::Avx512 | Level::Avx2) => return unsafe { with_avx2(work) },
            _ => {}
        }
    }
    work.run();
}

pub(super) struct Forward<'a, T, R: Real, F> {
    pub skin: &'a Skin<T, TILE>,
    pub start: Start<'a, T, TILE>,
    pub bodies: &'a [Body<R>],
    pub vertices: &'a mut [T],
    pub number: F,
}

impl<T: Scalar, R: Scalar, F: Fn(R) -> T> Work for Forward<'_, T, R, F> {
    const IN_AVX512: bool = true;

    #[inline(always)]
    fn run(self) {
        let row = 3 * self.skin.num_vertices;
        for tile in 0..self.skin.num_tiles() {
            for (body, vertices) in self.bodies.iter().zip(self.vertices.chunks_exact_mut(row)) {
                let posed = self.skin.forward(self.start, tile, body);
                let out = &mut vertices[3 * TILE * tile..];
                // A constant length lets the compiler unroll.
                match out.first_chunk_mut::<{ 3 * TILE }>() {
                    Some(out) => interleave(&posed, out, &self.number),
                    None => interleave(&posed, out, &self.number),
                }
            }
        }
    }
}

pub(super) struct Backward<'a, T, R: Real, F> {
    pub skin: &'a Skin<T, TILE>,
    pub start: Start<'a, T, TILE>,
    pub bodies: &'a [Body<R>],
    pub d_vertices: &'a [T],
    pub constant: F,
    pub sums: &'a mut [Sums<R, TILE>],
}

impl<T: Scalar, R: Scalar, F: Fn(T) -> R> Work for Backward<'_, T, R, F> {
    /// The compiler would vectorise over the blend shapes, with scatters: three times slower than AVX2.
    const IN_AVX512: bool = false;

    #[inline(always)]
    fn run(self) {
        let row = 3 * self.skin.num_vertices;
        for tile in 0..self.skin.num_tiles() {
            let bodies = self.bodies.iter().zip(self.sums.iter_mut());
            for ((body, sums), d) in bodies.zip(self.d_vertices.chunks_exact(row)) {
                let d = &d[3 * TILE * tile..];
                let d = match d.first_chunk::<{ 3 * TILE }>() {
                    Some(d) => separate(d, &self.constant),
                    None => separate(d, &self.constant),
                };
                self.skin.backward(self.start, tile, body, &d, sums);
            }
        }
    }
}

#[inline(always)]
fn interleave<R: Real, T>(tile: &Tile<R, TILE>, out: &mut [T], number: impl Fn(R) -> T) {
    for (i, out) in out.chunks_exact_mut(3).enumerate() {
        for axis in 0..3 {
            out[axis] = number(tile[axis][i]);
        }
    }
}

#[inline(always)]
fn separate<R: Real, T: Copy>(points: &[T], number: impl Fn(T) -> R) -> Tile<R, TILE> {
    let mut tile = [[R::zero(); TILE]; 3];
    for (i, point) in points.chunks_exact(3).take(TILE).enumerate() {
        for axis in 0..3 {
            tile[axis][i] = number(point[axis]);
        }
    }
    tile
}
