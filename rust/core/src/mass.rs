//! The centre of mass: the paper's pCoM, the alternatives of its supplement, and the exact integral.

use crate::error::Result;
use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, narrow, scale, sub, widen};
use crate::quantity::{Quantity, unknown_choice};
use crate::scene::Scene;
use crate::template::Template;
use crate::volume::{Moments, absolute, part_moments, part_moments_backward, signed_volumes, signed_volumes_backward};

/// How a body's mass is spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Samples weighted by their part's volume: m̄ = Σ_i vol(part(i)) v_i / Σ_i vol(part(i)).
    Pcom,
    /// Mean of the mesh's vertices.
    VertexMean,
    /// Mean of the surface samples.
    SampleMean,
    /// Centroids of the triangles weighted by area.
    FaceArea,
    /// Volume integral of uniform density.
    Exact,
}

impl Method {
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "pcom" => Ok(Method::Pcom),
            "vertex_mean" => Ok(Method::VertexMean),
            "sample_mean" => Ok(Method::SampleMean),
            "face_area" => Ok(Method::FaceArea),
            "exact" => Ok(Method::Exact),
            _ => {
                let choices = "\"pcom\", \"vertex_mean\", \"sample_mean\", \"face_area\", \"exact\"";
                Err(unknown_choice("method", choices, name))
            }
        }
    }

    pub fn forward<R: Real>(self, scene: &Scene<R>) -> Centre<R::Wide> {
        match self {
            Method::Pcom => pcom(scene),
            Method::VertexMean => vertex_mean(scene),
            Method::SampleMean => sample_mean(scene),
            Method::FaceArea => face_area(scene),
            Method::Exact => exact(scene),
        }
    }

    pub fn backward<R: Real>(
        self,
        scene: &Scene<R>,
        centre: &Centre<R::Wide>,
        d_centre: Vec3<R::Wide>,
        d_points: &mut [Vec3<R>],
    ) {
        match self {
            Method::Pcom => pcom_backward(scene, centre, d_centre, d_points),
            Method::VertexMean => vertex_mean_backward(scene, d_centre, d_points),
            Method::SampleMean => sample_mean_backward(scene, d_centre, d_points),
            Method::FaceArea => face_area_backward(scene, centre, d_centre, d_points),
            Method::Exact => exact_backward(scene, centre, d_centre, d_points),
        }
    }
}

/// A centre of mass in local coordinates, with what its backward needs.
pub struct Centre<W> {
    pub point: Vec3<W>,
    /// The total weight: sample volumes, area or volume.
    total: W,
    /// pCoM: each part's volume, its sign, and the sum of its samples.
    parts: Vec<(W, W, Vec3<W>)>,
}

impl<W: Real> Centre<W> {
    fn plain(moment: Vec3<W>, total: W) -> Self {
        Centre { point: moment.map(|x| x / total), total, parts: Vec::new() }
    }
}

fn pcom<R: Real>(scene: &Scene<R>) -> Centre<R::Wide> {
    let (volumes, signs) = absolute(&signed_volumes(&scene.template.closing, scene.points));
    let mut total = R::Wide::zero();
    let mut moment = [R::Wide::zero(); 3];
    let mut parts = Vec::with_capacity(volumes.len());
    for ((row, volume), sign) in scene.template.samples.part_sums.iter().zip(volumes).zip(signs) {
        let sum = row.forward(scene.points);
        total = total + volume * R::Wide::of(row.count as f64);
        add_scaled(&mut moment, volume, sum);
        parts.push((volume, sign, sum));
    }
    Centre { parts, ..Centre::plain(moment, total) }
}

/// ∂m̄/∂c_p = vol_p / Σ vol n and ∂m̄/∂vol_p = (c_p − n_p m̄) / Σ vol n, c_p the sum of the part's n_p samples.
fn pcom_backward<R: Real>(
    scene: &Scene<R>,
    centre: &Centre<R::Wide>,
    d_centre: Vec3<R::Wide>,
    d_points: &mut [Vec3<R>],
) {
    let d_moment = d_centre.map(|d| d / centre.total);
    let mut d_volumes = Vec::with_capacity(centre.parts.len());
    for (row, &(volume, sign, sum)) in scene.template.samples.part_sums.iter().zip(&centre.parts) {
        let arm = sub(sum, scale(R::Wide::of(row.count as f64), centre.point));
        d_volumes.push(sign * dot(d_moment, arm));
        row.backward(scale(volume, d_moment), d_points);
    }
    signed_volumes_backward(&scene.template.closing, scene.points, &d_volumes, d_points);
}

fn vertex_mean<R: Real>(scene: &Scene<R>) -> Centre<R::Wide> {
    let vertices = &scene.points[..scene.template.mesh.num_vertices];
    let moment = vertices.iter().fold([R::Wide::zero(); 3], |sum, v| add(sum, widen(*v)));
    Centre::plain(moment, R::Wide::of(vertices.len() as f64))
}

fn vertex_mean_backward<R: Real>(scene: &Scene<R>, d_centre: Vec3<R::Wide>, d_points: &mut [Vec3<R>]) {
    let num_vertices = scene.template.mesh.num_vertices;
    let share = narrow::<R>(scale(R::Wide::of(1.0 / num_vertices as f64), d_centre));
    for d_point in &mut d_points[..num_vertices] {
        *d_point = add(*d_point, share);
    }
}

fn sample_mean<R: Real>(scene: &Scene<R>) -> Centre<R::Wide> {
    let samples = &scene.template.samples;
    let moment = samples.part_sums.iter().fold([R::Wide::zero(); 3], |sum, row| add(sum, row.forward(scene.points)));
    Centre::plain(moment, R::Wide::of(samples.len() as f64))
}

fn sample_mean_backward<R: Real>(scene: &Scene<R>, d_centre: Vec3<R::Wide>, d_points: &mut [Vec3<R>]) {
    let samples = &scene.template.samples;
    let share = scale(R::Wide::of(1.0 / samples.len() as f64), d_centre);
    for row in &samples.part_sums {
        row.backward(share, d_points);
    }
}

/// Twice the area vector of a triangle, its length, and three times its centroid.
fn triangle<R: Real>(corners: [Vec3<R>; 3]) -> (Vec3<R>, R, Vec3<R>) {
    let [a, b, c] = corners;
    let normal = cross(sub(b, a), sub(c, a));
    (normal, dot(normal, normal).sqrt(), add(add(a, b), c))
}

fn face_area<R: Real>(scene: &Scene<R>) -> Centre<R::Wide> {
    let mut total = R::Wide::zero();
    let mut moment = [R::Wide::zero(); 3];
    for face in &scene.template.mesh.faces {
        let (_, doubled, tripled) = triangle(face.map(|index| scene.points[index as usize]));
        doubled.add_to(&mut total);
        moment = add(moment, widen(scale(doubled, tripled)));
    }
    Centre::plain(scale(R::Wide::of(1.0 / 3.0), moment), total)
}

/// With A = |N|/2: ∂A/∂a = (b − c) × N/|N| / 2, and each corner is a third of the centroid.
fn face_area_backward<R: Real>(
    scene: &Scene<R>,
    centre: &Centre<R::Wide>,
    d_centre: Vec3<R::Wide>,
    d_points: &mut [Vec3<R>],
) {
    let d_moment = narrow::<R>(d_centre.map(|d| d / centre.total));
    let centre = narrow::<R>(centre.point);
    let third = R::of(1.0 / 3.0);
    for face in &scene.template.mesh.faces {
        let [a, b, c] = face.map(|index| scene.points[index as usize]);
        let (normal, doubled, tripled) = triangle([a, b, c]);
        let unit = scale(R::of(1.0) / doubled.at_least(R::of(1e-30)), normal);
        let d_doubled = dot(d_moment, sub(scale(third, tripled), centre));
        for (index, opposite) in face.iter().zip([sub(b, c), sub(c, a), sub(a, b)]) {
            let d_point = &mut d_points[*index as usize];
            add_scaled(d_point, d_doubled, cross(opposite, unit));
            add_scaled(d_point, doubled * third, d_moment);
        }
    }
}

fn exact<R: Real>(scene: &Scene<R>) -> Centre<R::Wide> {
    let mut whole = Moments::zero();
    for part in part_moments(&scene.template.closing, scene.points) {
        whole.add_scaled(R::Wide::of(1.0), &part);
    }
    Centre::plain(whole.first, whole.volume)
}

fn exact_backward<R: Real>(
    scene: &Scene<R>,
    centre: &Centre<R::Wide>,
    d_centre: Vec3<R::Wide>,
    d_points: &mut [Vec3<R>],
) {
    let first = d_centre.map(|d| d / centre.total);
    let d_whole = Moments { volume: -dot(first, centre.point), first, ..Moments::zero() };
    let d_parts = vec![d_whole; scene.template.mesh.num_parts];
    part_moments_backward(&scene.template.closing, scene.points, &d_parts, d_points);
}

/// The centre of mass in the world, metres.
pub struct CenterOfMass {
    pub method: Method,
}

impl Quantity for CenterOfMass {
    type Saved<R: Real> = Centre<R::Wide>;

    fn len(&self, _: &Template) -> usize {
        3
    }

    fn forward<R: Real>(&self, scene: &Scene<R>, out: &mut [R]) -> Centre<R::Wide> {
        let centre = self.method.forward(scene);
        scene.put(centre.point, out);
        centre
    }

    fn backward<R: Real>(&self, scene: &Scene<R>, centre: &Centre<R::Wide>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.method.backward(scene, centre, widen([d_out[0], d_out[1], d_out[2]]), d_points);
    }
}
