//! Volume: signed tetrahedra from the origin to each face of each closed part (the paper's "fill", section 3.2), and
//! the exact mass properties of the solid they fill.
//!
//! A closed part's volume does not depend on the origin; the coordinates are local to the body ([`crate::scene`]), which
//! is the paper's "translate". The volumes alone are summed by rings around the points, which is the same sum in another
//! order and hands the gradient over on the way.

use crate::closing::Closing;
use crate::error::{Error, Result};
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, narrow, widen, widen_in_line};
use crate::number::{BLOCK, Real, Room};
use crate::options::positive;
use crate::quantity::Quantity;
use crate::rings::Rings;
use crate::scene::Scene;
use crate::template::Template;

/// Signed volume of each part, m³, and what its gradient is made of.
pub struct SignedVolumes<R: Real> {
    pub of_parts: Vec<R::Wide>,
    /// Twice the area vector of each ring, part after part.
    doubled: Vec<Vec3<R>>,
}

impl<R: Real> SignedVolumes<R> {
    /// vol^P = Σ_v v·A_v / 9 over the rings of the part ([`crate::rings`]).
    pub fn forward(closing: &Closing, points: &[Vec3<R>]) -> Self {
        R::apart::<Forward, _>((closing, points))
    }

    /// Adds Σ_p d_volumes[p] ∂vol_p/∂points, where ∂vol/∂v = A_v / 3.
    pub fn backward(&self, closing: &Closing, d_volumes: &[R::Wide], d_points: &mut [Vec3<R>]) {
        R::apart::<Backward, _>((self, closing, d_volumes, d_points));
    }
}

/// [`SignedVolumes::forward`]
struct Forward;

impl<R: Real> Room<(&Closing, &[Vec3<R>])> for Forward {
    type Output = SignedVolumes<R>;

    #[inline(always)]
    fn enter((closing, points): (&Closing, &[Vec3<R>])) -> SignedVolumes<R> {
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

impl<R: Real> Room<(&SignedVolumes<R>, &Closing, &[R::Wide], &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn enter((signed, closing, d_volumes, d_points): (&SignedVolumes<R>, &Closing, &[R::Wide], &mut [Vec3<R>])) {
        let mut all_doubled = signed.doubled.iter();
        for (rings, &d_volume) in closing.rings.iter().zip(d_volumes) {
            let factor = R::narrow(d_volume * R::Wide::of(1.0 / 6.0));
            for (&point, &doubled) in rings.points.iter().zip(&mut all_doubled) {
                add_scaled(&mut d_points[point as usize], factor, doubled);
            }
        }
    }
}

/// The volumes' absolute values, and the signs that lead back.
#[inline(always)]
pub fn absolute<W: Real>(signed: &[W]) -> (Vec<W>, Vec<W>) {
    let sign = |v: &W| v.if_negative(W::of(-1.0), W::of(1.0));
    (memory::collect(signed.iter().map(|v| v.abs())), memory::collect(signed.iter().map(sign)))
}

/// The volume of each part, m³ (the paper's vol^P).
pub struct PartVolumes;

impl Quantity for PartVolumes {
    /// The volumes before the absolute value, and the sign of each.
    type Saved<R: Real> = (SignedVolumes<R>, Vec<R::Wide>);

    fn len(&self, template: &Template) -> usize {
        template.mesh.num_parts
    }

    fn check(&self, _: &Template) -> Result<()> {
        Ok(())
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Self::Saved<R> {
        let signed = SignedVolumes::forward(&scene.template.closing, scene.points);
        let (volumes, signs) = absolute(&signed.of_parts);
        for (out, volume) in out.iter_mut().zip(volumes) {
            *out = R::narrow(volume);
        }
        (signed, signs)
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, saved: &Self::Saved<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let (signed, signs) = saved;
        let d_volumes = memory::collect(d_out.iter().zip(signs).map(|(d, &sign)| d.widen() * sign));
        signed.backward(&scene.template.closing, &d_volumes, d_points);
    }
}

/// Integrals over a solid: ∫1, ∫x and the second moments ∫xxᵀ as (xx, yy, zz, xy, xz, yz).
#[derive(Clone, Copy)]
pub struct Moments<W> {
    pub volume: W,
    pub first: Vec3<W>,
    pub second: [W; 6],
}

const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

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
        let s: Vec3<W> = std::array::from_fn(|k| a[k] + b[k] + c[k]);
        let d = dot(a, cross(b, c));
        // The derivative by d …
        let mut quadratic = W::zero();
        for (d_second, (i, j)) in d_moments.second.iter().zip(PAIRS) {
            quadratic = quadratic + *d_second * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
        }
        let d_d = d_moments.volume * W::of(1.0 / 6.0)
            + dot(d_moments.first, s) * W::of(1.0 / 24.0)
            + quadratic * W::of(1.0 / 120.0);
        // … and by the corners at fixed d: through s, and through each corner's own square.
        let twice = |v: Vec3<W>| -> Vec3<W> {
            let mut product = [W::zero(); 3];
            for (&d_second, (i, j)) in d_moments.second.iter().zip(PAIRS) {
                product[i] = product[i] + d_second * v[j];
                product[j] = product[j] + d_second * v[i];
            }
            product
        };
        let through_s = twice(s);
        let others = [cross(b, c), cross(c, a), cross(a, b)];
        std::array::from_fn(|corner| {
            let own = twice(corners[corner]);
            std::array::from_fn(|k| {
                d_d * others[corner][k]
                    + d * (d_moments.first[k] * W::of(1.0 / 24.0) + (own[k] + through_s[k]) * W::of(1.0 / 120.0))
            })
        })
    }
}

/// The moments of each closed part, about the scene's origin.
pub fn part_moments<R: Real>(closing: &Closing, points: &[Vec3<R>]) -> Vec<Moments<R::Wide>> {
    R::apart::<MomentsForward, _>((closing, points))
}

/// [`part_moments`]
struct MomentsForward;

impl<R: Real> Room<(&Closing, &[Vec3<R>])> for MomentsForward {
    type Output = Vec<Moments<R::Wide>>;

    #[inline(always)]
    fn enter((closing, points): (&Closing, &[Vec3<R>])) -> Vec<Moments<R::Wide>> {
        let mut all = memory::with_capacity(closing.parts.len());
        for part in &closing.parts {
            let mut sum = Moments::zero();
            for &[a, b, c] in &closing.faces[part.clone()] {
                // In line, for widened copies of all points would leave the cache.
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
    R::apart::<MomentsBackward, _>((closing, points, d_moments, d_points));
}

/// [`part_moments_backward`]
struct MomentsBackward;

impl<R: Real> Room<(&Closing, &[Vec3<R>], &[Moments<R::Wide>], &mut [Vec3<R>])> for MomentsBackward {
    type Output = ();

    #[inline(always)]
    fn enter((closing, points, d_moments, d_points): (&Closing, &[Vec3<R>], &[Moments<R::Wide>], &mut [Vec3<R>])) {
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

/// Exact volume (m³), mass (kg), centre (m) and inertia about the centre (kg m²) of the body and of each part.
/// Numbers a solid: volume, mass, centre, inertia row by row; row 0 is the whole body, then the parts.
pub struct MassProperties {
    /// kg/m³, one for all parts or one for each.
    pub densities: Vec<f64>,
}

impl MassProperties {
    pub const ROW: usize = 14;

    /// An error unless there is one positive number, or one for each part.
    pub fn check_densities(&self, num_parts: usize) -> Result<()> {
        if ![1, num_parts].contains(&self.densities.len()) {
            let (expected, got) = (format!("1 or {num_parts} numbers"), self.densities.len().to_string());
            return Err(Error::Argument { name: "densities", expected, got });
        }
        self.densities.iter().try_for_each(|&density| positive("densities", density))
    }

    #[inline(always)]
    fn density(&self, part: usize) -> f64 {
        self.densities[if self.densities.len() == 1 { 0 } else { part }]
    }
}

/// mass, centre and inertia from the density-weighted moments.
#[inline(always)]
fn row<W: Real>(volume: W, weighted: &Moments<W>, origin: Vec3<W>, out: &mut [W]) {
    let mass = weighted.volume;
    let centre: Vec3<W> = weighted.first.map(|x| x / mass);
    let mut spread = weighted.second;
    for (value, (i, j)) in spread.iter_mut().zip(PAIRS) {
        *value = *value - mass * centre[i] * centre[j];
    }
    let [xx, yy, zz, xy, xz, yz] = spread;
    out[0] = volume;
    out[1] = mass;
    for k in 0..3 {
        out[2 + k] = centre[k] + origin[k];
    }
    out[5..14].copy_from_slice(&[yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy]);
}

/// The gradient of [`row`] by the weighted moments.
#[inline(always)]
fn row_backward<W: Real>(weighted: &Moments<W>, d_out: &[W]) -> Moments<W> {
    let mass = weighted.volume;
    let centre: Vec3<W> = weighted.first.map(|x| x / mass);
    let i = &d_out[5..14];
    let d_spread = [i[4] + i[8], i[0] + i[8], i[0] + i[4], -(i[1] + i[3]), -(i[2] + i[6]), -(i[5] + i[7])];
    // spread = second − first firstᵀ / mass = second − mass centre centreᵀ
    let mut d_centre: Vec3<W> = [d_out[2], d_out[3], d_out[4]];
    let mut d_mass = d_out[1];
    for (&d, (i, j)) in d_spread.iter().zip(PAIRS) {
        d_mass = d_mass - d * centre[i] * centre[j];
        d_centre[i] = d_centre[i] - d * mass * centre[j];
        d_centre[j] = d_centre[j] - d * mass * centre[i];
    }
    let d_first = d_centre.map(|d| d / mass);
    Moments { volume: d_mass - dot(d_first, centre), first: d_first, second: d_spread }
}

impl Quantity for MassProperties {
    /// The moments of each part.
    type Saved<R: Real> = Vec<Moments<R::Wide>>;

    fn len(&self, template: &Template) -> usize {
        Self::ROW * (1 + template.mesh.num_parts)
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.check_densities(template.mesh.num_parts)
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Vec<Moments<R::Wide>> {
        let parts = part_moments(&scene.template.closing, scene.points);
        self.write(scene, &parts, out);
        parts
    }

    fn backward<R: Real>(
        &self,
        scene: &Scene<R>,
        parts: &Vec<Moments<R::Wide>>,
        d_out: &[R],
        d_points: &mut [Vec3<R>],
    ) {
        let d_out = memory::collect(d_out.iter().map(|d| d.widen()));
        let (_, weighted) = self.weigh(parts);
        let d_whole = row_backward(&weighted[0], &d_out[..Self::ROW]);
        let d_parts = memory::collect((0..parts.len()).map(|p| {
            let d_row = &d_out[Self::ROW * (p + 1)..Self::ROW * (p + 2)];
            let mut d_weighted = row_backward(&weighted[p + 1], d_row);
            d_weighted.add_scaled(R::Wide::of(1.0), &d_whole);
            let mut d_moments = Moments::zero();
            d_moments.add_scaled(R::Wide::of(self.density(p)), &d_weighted);
            d_moments.volume = d_moments.volume + d_out[0] + d_row[0];
            d_moments
        }));
        part_moments_backward(&scene.template.closing, scene.points, &d_parts, d_points);
    }
}

impl MassProperties {
    /// As many rows as `out` holds.
    pub fn write<R: Real>(&self, scene: &Scene<R>, parts: &[Moments<R::Wide>], out: &mut [R]) {
        let (volumes, weighted) = self.weigh(parts);
        for (out, (volume, weighted)) in out.chunks_exact_mut(Self::ROW).zip(volumes.into_iter().zip(weighted)) {
            let mut wide = [R::Wide::zero(); Self::ROW];
            row(volume, &weighted, scene.origin, &mut wide);
            for (out, wide) in out.iter_mut().zip(wide) {
                *out = R::narrow(wide);
            }
        }
    }

    /// The whole body's row, in the scene's own coordinates.
    pub fn whole<W: Real>(&self, parts: &[Moments<W>]) -> [W; Self::ROW] {
        let (volumes, weighted) = self.weigh(parts);
        let mut out = [W::zero(); Self::ROW];
        row(volumes[0], &weighted[0], [W::zero(); 3], &mut out);
        out
    }

    /// Volume and density-weighted moments: the whole body's first, then each part's.
    #[inline(always)]
    fn weigh<W: Real>(&self, parts: &[Moments<W>]) -> (Vec<W>, Vec<Moments<W>>) {
        let mut volumes = memory::with_capacity(1 + parts.len());
        let mut weighted = memory::with_capacity(1 + parts.len());
        volumes.push(W::zero());
        weighted.push(Moments::zero());
        for (p, part) in parts.iter().enumerate() {
            let density = W::of(self.density(p));
            let mut own = Moments::zero();
            own.add_scaled(density, part);
            volumes[0] = volumes[0] + part.volume;
            weighted[0].add_scaled(density, part);
            volumes.push(part.volume);
            weighted.push(own);
        }
        (volumes, weighted)
    }
}
