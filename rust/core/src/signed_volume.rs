//! Signed volumes of the closed parts: tetrahedra from the origin to each face (the paper's "fill", section 3.2).
//!
//! A closed part's volume does not depend on the origin; the coordinates are local to the body ([`crate::posed`]), which
//! is the paper's "translate". The volumes are summed by rings around the points ([`crate::rings`]), which is the same
//! sum in another order and gives the gradient on the way.

use crate::closing::Closing;
use crate::memory;
use crate::number::vector::{Vec3, add_scaled, dot};
use crate::number::{BLOCK, Kernel, Real};
use crate::rings::Rings;

/// Signed volume of each part, m³, with what its backward needs.
pub struct SignedVolumes<R: Real> {
    pub of_parts: Vec<R::Wide>,
    /// Twice the area vector of each ring, part after part.
    doubled: Vec<Vec3<R>>,
}

impl<R: Real> SignedVolumes<R> {
    /// vol^P = Σ_v v·A_v / 9 over the rings of the part ([`crate::rings`]).
    pub fn forward(closing: &Closing, points: &[Vec3<R>]) -> Self {
        R::dispatch::<Forward, _>((closing, points))
    }

    /// Adds Σ_p d_volumes[p] ∂vol_p/∂points, where ∂vol/∂v = A_v / 3.
    pub fn backward(&self, closing: &Closing, d_volumes: &[R::Wide], d_points: &mut [Vec3<R>]) {
        R::dispatch::<Backward, _>((self, closing, d_volumes, d_points));
    }
}

/// [`SignedVolumes::forward`]
struct Forward;

impl<R: Real> Kernel<(&Closing, &[Vec3<R>])> for Forward {
    type Output = SignedVolumes<R>;

    #[inline(always)]
    fn run((closing, points): (&Closing, &[Vec3<R>])) -> SignedVolumes<R> {
        let mut of_parts = memory::with_capacity(closing.rings.len());
        let mut all_doubled = memory::with_capacity(closing.rings.iter().map(Rings::len).sum());
        let mut doubled = [[R::zero(); 3]; BLOCK];
        for rings in &closing.rings {
            let mut sum = R::Wide::zero();
            for block in rings.blocks() {
                rings.area_vectors(block, points, &mut doubled);
                let mut partial = R::zero();
                for (&point, &doubled) in rings.points[block.rings.clone()].iter().zip(&doubled) {
                    partial = partial + dot(points[point as usize], doubled);
                }
                partial.add_to(&mut sum);
                all_doubled.extend_from_slice(&doubled[..block.rings.len()]);
            }
            of_parts.push(sum * R::Wide::of(1.0 / 18.0));
        }
        SignedVolumes { of_parts, doubled: all_doubled }
    }
}

/// [`SignedVolumes::backward`]
struct Backward;

impl<R: Real> Kernel<(&SignedVolumes<R>, &Closing, &[R::Wide], &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn run((signed, closing, d_volumes, d_points): (&SignedVolumes<R>, &Closing, &[R::Wide], &mut [Vec3<R>])) {
        let mut all_doubled = signed.doubled.iter();
        for (rings, &d_volume) in closing.rings.iter().zip(d_volumes) {
            let factor = R::narrow(d_volume * R::Wide::of(1.0 / 6.0));
            for (&point, &doubled) in rings.points.iter().zip(&mut all_doubled) {
                add_scaled(&mut d_points[point as usize], factor, doubled);
            }
        }
    }
}

/// Absolute values of the volumes, and their signs for the backward.
#[inline(always)]
pub fn absolute<W: Real>(signed: &[W]) -> (Vec<W>, Vec<W>) {
    let sign = |v: &W| v.if_negative(W::of(-1.0), W::of(1.0));
    (memory::collect(signed.iter().map(|v| v.abs())), memory::collect(signed.iter().map(sign)))
}
