//! Volume: signed tetrahedra from the origin to each face of each closed part (the paper's "fill"), and the exact mass
//! properties of the solid they fill.
//!
//! A closed part's volume does not depend on the origin; the coordinates are local to the body ([`crate::scene`]), which
//! is the paper's "translate".

use crate::closing::Closing;
use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, narrow, scale, sub, widen};
use crate::quantity::Quantity;
use crate::scene::Scene;
use crate::template::Template;

/// Twice the area vector of a face, from its edges: they keep single precision where products of positions cancel.
fn area_vector<R: Real>(a: Vec3<R>, b: Vec3<R>, c: Vec3<R>) -> Vec3<R> {
    cross(sub(b, a), sub(c, a))
}

/// Signed volume of each part, m³: vol^P = Σ a·(b × c) / 6 = Σ a·N / 6 over the part's faces and caps, N = (b−a) × (c−a).
pub fn signed_volumes<R: Real>(closing: &Closing, points: &[Vec3<R>]) -> Vec<R::Wide> {
    let sixth = R::Wide::of(1.0 / 6.0);
    let volume = |part: &std::ops::Range<usize>| {
        let mut sum = R::Wide::zero();
        for face in &closing.faces[part.clone()] {
            let [a, b, c] = face.map(|index| points[index as usize]);
            dot(a, area_vector(a, b, c)).add_to(&mut sum);
        }
        sum * sixth
    };
    closing.parts.iter().map(volume).collect()
}

/// Adds Σ_p d_volumes[p] ∂vol_p/∂points. A corner's derivative is the cross product of the other two, over 6; around a
/// vertex of a closed part these add up to the faces' N/6, so every corner gets N/6.
pub fn signed_volumes_backward<R: Real>(
    closing: &Closing,
    points: &[Vec3<R>],
    d_volumes: &[R::Wide],
    d_points: &mut [Vec3<R>],
) {
    for (part, &d_volume) in closing.parts.iter().zip(d_volumes) {
        let factor = R::narrow(d_volume * R::Wide::of(1.0 / 6.0));
        for face in &closing.faces[part.clone()] {
            let [a, b, c] = face.map(|index| points[index as usize]);
            let d_corner = scale(factor, area_vector(a, b, c));
            for &index in face {
                d_points[index as usize] = add(d_points[index as usize], d_corner);
            }
        }
    }
}

/// The volumes' absolute values, and the signs that lead back.
pub fn absolute<W: Real>(signed: &[W]) -> (Vec<W>, Vec<W>) {
    let sign = |v: &W| v.if_negative(W::of(-1.0), W::of(1.0));
    (signed.iter().map(|v| v.abs()).collect(), signed.iter().map(sign).collect())
}

/// The volume of each part, m³ (the paper's vol^P).
pub struct PartVolumes;

impl Quantity for PartVolumes {
    /// The sign of each part's volume.
    type Saved<R: Real> = Vec<R::Wide>;

    fn len(&self, template: &Template) -> usize {
        template.mesh.num_parts
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Vec<R::Wide> {
        let (volumes, signs) = absolute(&signed_volumes(&scene.template.closing, scene.points));
        for (out, volume) in out.iter_mut().zip(volumes) {
            *out = R::narrow(volume);
        }
        signs
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, signs: &Vec<R::Wide>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        let d_volumes: Vec<R::Wide> = d_out.iter().zip(signs).map(|(d, &sign)| d.widen() * sign).collect();
        signed_volumes_backward(&scene.template.closing, scene.points, &d_volumes, d_points);
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
    pub fn zero() -> Self {
        Moments { volume: W::zero(), first: [W::zero(); 3], second: [W::zero(); 6] }
    }

    pub fn add_scaled(&mut self, factor: W, other: &Self) {
        self.volume = self.volume + factor * other.volume;
        for k in 0..3 {
            self.first[k] = self.first[k] + factor * other.first[k];
        }
        for k in 0..6 {
            self.second[k] = self.second[k] + factor * other.second[k];
        }
    }

    /// With d = a·(b×c) and s = a+b+c: ∫1 = d/6, ∫x = d s/24, ∫xxᵀ = d (aaᵀ+bbᵀ+ccᵀ+ssᵀ)/120.
    fn add_tetrahedron(&mut self, a: Vec3<W>, b: Vec3<W>, c: Vec3<W>) {
        let d = dot(a, cross(b, c));
        let s: Vec3<W> = std::array::from_fn(|k| a[k] + b[k] + c[k]);
        self.volume = self.volume + d * W::of(1.0 / 6.0);
        add_scaled(&mut self.first, d * W::of(1.0 / 24.0), s);
        let weight = d * W::of(1.0 / 120.0);
        for (sum, (i, j)) in self.second.iter_mut().zip(PAIRS) {
            *sum = *sum + weight * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
        }
    }

    /// The derivatives of Σ d_moments · moments for one tetrahedron, at its corners a, b, c.
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
    let moments = |part: &std::ops::Range<usize>| {
        let mut sum = Moments::zero();
        for face in &closing.faces[part.clone()] {
            let [a, b, c] = face.map(|index| widen(points[index as usize]));
            sum.add_tetrahedron(a, b, c);
        }
        sum
    };
    closing.parts.iter().map(moments).collect()
}

pub fn part_moments_backward<R: Real>(
    closing: &Closing,
    points: &[Vec3<R>],
    d_moments: &[Moments<R::Wide>],
    d_points: &mut [Vec3<R>],
) {
    for (part, d_part) in closing.parts.iter().zip(d_moments) {
        for face in &closing.faces[part.clone()] {
            let corners = face.map(|index| widen(points[index as usize]));
            for (index, d_corner) in face.iter().zip(Moments::tetrahedron_backward(d_part, corners)) {
                let d_point = &mut d_points[*index as usize];
                *d_point = add(*d_point, narrow::<R>(d_corner));
            }
        }
    }
}

/// Exact volume (m³), mass (kg), centre (m) and inertia about the centre (kg m²) of the body and of each part.
/// Numbers a solid: volume, mass, centre, inertia row by row; row 0 is the whole body, then the parts.
pub struct MassProperties {
    /// kg/m³, one for all parts or one for each.
    pub densities: Vec<f64>,
}

impl MassProperties {
    pub const ROW: usize = 14;

    fn density(&self, part: usize) -> f64 {
        self.densities[if self.densities.len() == 1 { 0 } else { part }]
    }
}

/// mass, centre and inertia from the density-weighted moments.
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

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Vec<Moments<R::Wide>> {
        let parts = part_moments(&scene.template.closing, scene.points);
        let (volumes, weighted) = self.weigh(&parts);
        for (out, (volume, weighted)) in out.chunks_exact_mut(Self::ROW).zip(volumes.into_iter().zip(weighted)) {
            let mut wide = [R::Wide::zero(); Self::ROW];
            row(volume, &weighted, scene.origin, &mut wide);
            for (out, wide) in out.iter_mut().zip(wide) {
                *out = R::narrow(wide);
            }
        }
        parts
    }

    fn backward<R: Real>(
        &self,
        scene: &Scene<R>,
        parts: &Vec<Moments<R::Wide>>,
        d_out: &[R],
        d_points: &mut [Vec3<R>],
    ) {
        let d_out: Vec<R::Wide> = d_out.iter().map(|d| d.widen()).collect();
        let (_, weighted) = self.weigh(parts);
        let d_whole = row_backward(&weighted[0], &d_out[..Self::ROW]);
        let d_parts: Vec<_> = (0..parts.len())
            .map(|p| {
                let d_row = &d_out[Self::ROW * (p + 1)..Self::ROW * (p + 2)];
                let mut d_weighted = row_backward(&weighted[p + 1], d_row);
                d_weighted.add_scaled(R::Wide::of(1.0), &d_whole);
                let mut d_moments = Moments::zero();
                d_moments.add_scaled(R::Wide::of(self.density(p)), &d_weighted);
                d_moments.volume = d_moments.volume + d_out[0] + d_row[0];
                d_moments
            })
            .collect();
        part_moments_backward(&scene.template.closing, scene.points, &d_parts, d_points);
    }
}

impl MassProperties {
    /// Volume and density-weighted moments: the whole body's first, then each part's.
    fn weigh<W: Real>(&self, parts: &[Moments<W>]) -> (Vec<W>, Vec<Moments<W>>) {
        let mut volumes = vec![W::zero()];
        let mut weighted = vec![Moments::zero()];
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
