//! The moments of each closed part: volume, first and second moments, exact integrals over the solid that its surface
//! bounds.

use crate::closing::Closing;
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, narrow, widen, widen_in_line};
use crate::number::{Kernel, Real};

/// Integrals over a solid: ∫1, ∫x and the second moments ∫xxᵀ as (xx, yy, zz, xy, xz, yz).
#[derive(Clone, Copy)]
pub struct Moments<W> {
    pub volume: W,
    pub first: Vec3<W>,
    pub second: [W; 6],
}

/// The axes of each entry of [`Moments::second`].
pub(crate) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl<W: Real> Moments<W> {
    #[inline(always)]
    pub fn zero() -> Self {
        Moments { volume: W::zero(), first: [W::zero(); 3], second: [W::zero(); 6] }
    }

    #[inline(always)]
    pub fn add_scaled(&mut self, factor: W, other: &Self) {
        self.volume = self.volume + factor * other.volume;
        for k in 0..3 {
            self.first[k] = self.first[k] + factor * other.first[k];
        }
        for k in 0..6 {
            self.second[k] = self.second[k] + factor * other.second[k];
        }
    }

    /// Adds 6 ∫1, 24 ∫x and 120 ∫xxᵀ of one tetrahedron: with d = a·(b×c) and s = a+b+c they are d, d s and
    /// d (aaᵀ+bbᵀ+ccᵀ+ssᵀ).
    #[inline(always)]
    fn add_tetrahedron(&mut self, a: Vec3<W>, b: Vec3<W>, c: Vec3<W>) {
        let d = dot(a, cross(b, c));
        let s = add(add(a, b), c);
        self.volume = self.volume + d;
        add_scaled(&mut self.first, d, s);
        for (k, &(i, j)) in PAIRS.iter().enumerate() {
            let corners = c[i].mul_add(c[j], b[i].mul_add(b[j], a[i] * a[j]));
            self.second[k] = d.mul_add(s[i].mul_add(s[j], corners), self.second[k]);
        }
    }

    /// From the sums of [`Moments::add_tetrahedron`] to the moments.
    #[inline(always)]
    fn scaled(&self) -> Self {
        let mut moments = *self;
        moments.volume = self.volume * W::of(1.0 / 6.0);
        for k in 0..3 {
            moments.first[k] = self.first[k] * W::of(1.0 / 24.0);
        }
        for k in 0..6 {
            moments.second[k] = self.second[k] * W::of(1.0 / 120.0);
        }
        moments
    }

    /// The derivatives of Σ d_moments · moments for one tetrahedron, at its corners a, b, c.
    #[inline(always)]
    fn tetrahedron_backward(d_moments: &Self, corners: [Vec3<W>; 3]) -> [Vec3<W>; 3] {
        let [a, b, c] = corners;
        let s = add(add(a, b), c);
        let d = dot(a, cross(b, c));
        // The derivative by d …
        let mut quadratic = W::zero();
        for (k, &(i, j)) in PAIRS.iter().enumerate() {
            let products = a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j];
            quadratic = quadratic + d_moments.second[k] * products;
        }
        let d_d = d_moments.volume * W::of(1.0 / 6.0)
            + dot(d_moments.first, s) * W::of(1.0 / 24.0)
            + quadratic * W::of(1.0 / 120.0);
        // … and by the corners at fixed d: through s, and through each corner's own square.
        let through_s = second_backward(&d_moments.second, s);
        let mut d_corners = [cross(b, c), cross(c, a), cross(a, b)];
        for (d_corner, corner) in d_corners.iter_mut().zip(corners) {
            let own = second_backward(&d_moments.second, corner);
            for k in 0..3 {
                let through_sums =
                    d_moments.first[k] * W::of(1.0 / 24.0) + (own[k] + through_s[k]) * W::of(1.0 / 120.0);
                d_corner[k] = d_d * d_corner[k] + d * through_sums;
            }
        }
        d_corners
    }
}

/// The derivative of Σ d_second · vvᵀ by v. No closure: those need not be inlined, and then lanes are lost.
#[inline(always)]
fn second_backward<W: Real>(d_second: &[W; 6], v: Vec3<W>) -> Vec3<W> {
    let mut product = [W::zero(); 3];
    for (k, &(i, j)) in PAIRS.iter().enumerate() {
        product[i] = product[i] + d_second[k] * v[j];
        product[j] = product[j] + d_second[k] * v[i];
    }
    product
}

/// The moments of each closed part, about the local origin.
pub fn part_moments<R: Real>(closing: &Closing, points: &[Vec3<R>]) -> Vec<Moments<R::Wide>> {
    R::dispatch::<MomentsForward, _>((closing, points))
}

/// [`part_moments`]
struct MomentsForward;

impl<R: Real> Kernel<(&Closing, &[Vec3<R>])> for MomentsForward {
    type Output = Vec<Moments<R::Wide>>;

    #[inline(always)]
    fn run((closing, points): (&Closing, &[Vec3<R>])) -> Vec<Moments<R::Wide>> {
        let mut all = memory::with_capacity(closing.parts.len());
        for part in &closing.parts {
            let mut sum = Moments::zero();
            for &[a, b, c] in &closing.faces[part.clone()] {
                // Inlined, because widened copies of all points would not fit the cache.
                sum.add_tetrahedron(
                    widen_in_line(points[a as usize]),
                    widen_in_line(points[b as usize]),
                    widen_in_line(points[c as usize]),
                );
            }
            all.push(sum.scaled());
        }
        all
    }
}

pub fn part_moments_backward<R: Real>(
    closing: &Closing,
    points: &[Vec3<R>],
    d_moments: &[Moments<R::Wide>],
    d_points: &mut [Vec3<R>],
) {
    R::dispatch::<MomentsBackward, _>((closing, points, d_moments, d_points));
}

/// [`part_moments_backward`]
struct MomentsBackward;

impl<R: Real> Kernel<(&Closing, &[Vec3<R>], &[Moments<R::Wide>], &mut [Vec3<R>])> for MomentsBackward {
    type Output = ();

    #[inline(always)]
    fn run((closing, points, d_moments, d_points): (&Closing, &[Vec3<R>], &[Moments<R::Wide>], &mut [Vec3<R>])) {
        let points = widen_all(points);
        let mut d_wide = memory::filled([R::Wide::zero(); 3], points.len());
        for (part, d_part) in closing.parts.iter().zip(d_moments) {
            for &[a, b, c] in &closing.faces[part.clone()] {
                let corners = [points[a as usize], points[b as usize], points[c as usize]];
                let d_corners = Moments::tetrahedron_backward(d_part, corners);
                for (index, d_corner) in [a, b, c].into_iter().zip(d_corners) {
                    d_wide[index as usize] = add(d_wide[index as usize], d_corner);
                }
            }
        }
        for (d_point, &d) in d_points.iter_mut().zip(&d_wide) {
            *d_point = add(*d_point, narrow::<R>(d));
        }
    }
}

#[inline(always)]
fn widen_all<R: Real>(points: &[Vec3<R>]) -> Vec<Vec3<R::Wide>> {
    let mut wide = memory::with_capacity(points.len());
    for &point in points {
        wide.push(widen(point));
    }
    wide
}
