//! The centre of mass: the paper's pCoM, the alternatives of its supplement, and the exact integral.

use crate::error::{Result, unknown_choice};
use crate::memory;
use crate::moments::{Moments, part_moments, part_moments_backward};
use crate::number::vector::{Vec3, add, add_scaled, add_to, cross, dot, narrow, over, scale, sub, widen};
use crate::number::{BLOCK, Kernel, Real};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::signed_volume::{SignedVolumes, absolute};
use crate::template::Template;

/// How the centre of mass is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Samples weighted by their part's volume (Eq. 1): m̄ = Σ_i vol(part(i)) v_i / Σ_i vol(part(i)).
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
    pub const COUNT: usize = Method::Exact as usize + 1;

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

    pub fn forward<R: Real>(self, posed: &PosedBody<R>) -> Centre<R> {
        R::dispatch::<Forward, _>((self, posed))
    }

    pub fn backward<R: Real>(
        self,
        posed: &PosedBody<R>,
        centre: &Centre<R>,
        d_centre: Vec3<R::Wide>,
        d_points: &mut [Vec3<R>],
    ) {
        R::dispatch::<Backward, _>((self, posed, centre, d_centre, d_points));
    }
}

/// [`Method::forward`]
struct Forward;

impl<R: Real> Kernel<(Method, &PosedBody<'_, R>)> for Forward {
    type Output = Centre<R>;

    #[inline(always)]
    fn run((method, posed): (Method, &PosedBody<R>)) -> Centre<R> {
        match method {
            Method::Pcom => pcom(posed),
            Method::VertexMean => vertex_mean(posed),
            Method::SampleMean => sample_mean(posed),
            Method::FaceArea => face_area(posed),
            Method::Exact => exact(posed),
        }
    }
}

/// [`Method::backward`]
struct Backward;

impl<R: Real> Kernel<(Method, &PosedBody<'_, R>, &Centre<R>, Vec3<R::Wide>, &mut [Vec3<R>])> for Backward {
    type Output = ();

    #[inline(always)]
    fn run(
        (method, posed, centre, d_centre, d_points): (Method, &PosedBody<R>, &Centre<R>, Vec3<R::Wide>, &mut [Vec3<R>]),
    ) {
        match method {
            Method::Pcom => pcom_backward(posed, centre, d_centre, d_points),
            Method::VertexMean => vertex_mean_backward(posed, d_centre, d_points),
            Method::SampleMean => sample_mean_backward(posed, d_centre, d_points),
            Method::FaceArea => face_area_backward(posed, centre, d_centre, d_points),
            Method::Exact => exact_backward(posed, centre, d_centre, d_points),
        }
    }
}

/// A centre of mass in local coordinates, with what its backward needs.
pub struct Centre<R: Real> {
    pub point: Vec3<R::Wide>,
    /// The total weight: sample volumes, area or volume.
    total: R::Wide,
    /// pCoM only.
    parts: Option<Parts<R>>,
}

struct Parts<R: Real> {
    signed: SignedVolumes<R>,
    of_parts: Vec<Part<R>>,
}

struct Part<R: Real> {
    /// The absolute value of the signed volume, and the sign.
    volume: R::Wide,
    sign: R::Wide,
    /// Of the part's samples.
    sum: Vec3<R::Wide>,
}

impl<R: Real> Centre<R> {
    /// [`Method::Exact`] from the parts' moments.
    #[inline(always)]
    pub fn exact(parts: &[Moments<R::Wide>]) -> Self {
        let mut whole = Moments::zero();
        for part in parts {
            whole.add_scaled(R::Wide::of(1.0), part);
        }
        Centre::plain(whole.first, whole.volume)
    }

    /// The signed volumes of the parts, if [`Method::Pcom`] has computed them.
    pub fn signed_volumes(&self) -> Option<&[R::Wide]> {
        self.parts.as_ref().map(|parts| parts.signed.of_parts.as_slice())
    }

    #[inline(always)]
    fn plain(moment: Vec3<R::Wide>, total: R::Wide) -> Self {
        Centre { point: over(moment, total), total, parts: None }
    }
}

/// (Eq. 1), part by part: Σ_p vol_p c_p / Σ_p vol_p n_p, c_p the sum of the part's n_p samples.
#[inline(always)]
fn pcom<R: Real>(posed: &PosedBody<R>) -> Centre<R> {
    let signed = SignedVolumes::forward(&posed.template.closing, posed.points);
    let (volumes, signs) = absolute(&signed.of_parts);
    let mut total = R::Wide::zero();
    let mut moment = [R::Wide::zero(); 3];
    let mut of_parts = memory::with_capacity(volumes.len());
    for ((row, volume), sign) in posed.template.samples.part_sums.iter().zip(volumes).zip(signs) {
        let sum = row.forward(posed.points);
        total = volume.mul_add(R::Wide::of(row.count as f64), total);
        add_scaled(&mut moment, volume, sum);
        of_parts.push(Part { volume, sign, sum });
    }
    Centre { parts: Some(Parts { signed, of_parts }), ..Centre::plain(moment, total) }
}

/// ∂m̄/∂c_p = vol_p / Σ vol n and ∂m̄/∂vol_p = (c_p − n_p m̄) / Σ vol n, c_p the sum of the part's n_p samples.
#[inline(always)]
fn pcom_backward<R: Real>(posed: &PosedBody<R>, centre: &Centre<R>, d_centre: Vec3<R::Wide>, d_points: &mut [Vec3<R>]) {
    let Some(Parts { signed, of_parts }) = &centre.parts else { unreachable!("pcom keeps its parts") };
    let d_moment = over(d_centre, centre.total);
    let mut d_volumes = memory::with_capacity(of_parts.len());
    for (row, &Part { volume, sign, sum }) in posed.template.samples.part_sums.iter().zip(of_parts) {
        let arm = sub(sum, scale(R::Wide::of(row.count as f64), centre.point));
        d_volumes.push(sign * dot(d_moment, arm));
        row.backward(scale(volume, d_moment), d_points);
    }
    signed.backward(&posed.template.closing, &d_volumes, d_points);
}

#[inline(always)]
fn vertex_mean<R: Real>(posed: &PosedBody<R>) -> Centre<R> {
    let vertices = &posed.points[..posed.template.mesh.num_vertices];
    let mut moment = [R::Wide::zero(); 3];
    for block in vertices.chunks(BLOCK) {
        let mut partial = [R::zero(); 3];
        for &vertex in block {
            partial = add(partial, vertex);
        }
        add_to(partial, &mut moment);
    }
    Centre::plain(moment, R::Wide::of(vertices.len() as f64))
}

#[inline(always)]
fn vertex_mean_backward<R: Real>(posed: &PosedBody<R>, d_centre: Vec3<R::Wide>, d_points: &mut [Vec3<R>]) {
    let num_vertices = posed.template.mesh.num_vertices;
    let share = narrow::<R>(scale(R::Wide::of(1.0 / num_vertices as f64), d_centre));
    for d_point in &mut d_points[..num_vertices] {
        *d_point = add(*d_point, share);
    }
}

#[inline(always)]
fn sample_mean<R: Real>(posed: &PosedBody<R>) -> Centre<R> {
    let samples = &posed.template.samples;
    let mut moment = [R::Wide::zero(); 3];
    for row in &samples.part_sums {
        moment = add(moment, row.forward(posed.points));
    }
    Centre::plain(moment, R::Wide::of(samples.len() as f64))
}

#[inline(always)]
fn sample_mean_backward<R: Real>(posed: &PosedBody<R>, d_centre: Vec3<R::Wide>, d_points: &mut [Vec3<R>]) {
    let samples = &posed.template.samples;
    let share = scale(R::Wide::of(1.0 / samples.len() as f64), d_centre);
    for row in &samples.part_sums {
        row.backward(share, d_points);
    }
}

/// Twice the area vector of a triangle, its length, and three times its centroid.
#[inline(always)]
fn triangle<R: Real>(corners: [Vec3<R>; 3]) -> (Vec3<R>, R, Vec3<R>) {
    let [a, b, c] = corners;
    let normal = cross(sub(b, a), sub(c, a));
    (normal, dot(normal, normal).sqrt(), add(add(a, b), c))
}

#[inline(always)]
fn face_area<R: Real>(posed: &PosedBody<R>) -> Centre<R> {
    let mut total = R::Wide::zero();
    let mut moment = [R::Wide::zero(); 3];
    for block in posed.template.mesh.faces.chunks(BLOCK) {
        let (mut area, mut partial) = (R::zero(), [R::zero(); 3]);
        for &[a, b, c] in block {
            let point = |index: u32| posed.points[index as usize];
            let (_, doubled, tripled) = triangle([point(a), point(b), point(c)]);
            area = area + doubled;
            add_scaled(&mut partial, doubled, tripled);
        }
        area.add_to(&mut total);
        add_to(partial, &mut moment);
    }
    Centre::plain(scale(R::Wide::of(1.0 / 3.0), moment), total)
}

/// With A = |N|/2: ∂A/∂a = (b − c) × N/|N| / 2, and each corner is a third of the centroid.
#[inline(always)]
fn face_area_backward<R: Real>(
    posed: &PosedBody<R>,
    centre: &Centre<R>,
    d_centre: Vec3<R::Wide>,
    d_points: &mut [Vec3<R>],
) {
    let d_moment = narrow::<R>(over(d_centre, centre.total));
    let centre = narrow::<R>(centre.point);
    let third = R::of(1.0 / 3.0);
    for face in &posed.template.mesh.faces {
        let point = |k: usize| posed.points[face[k] as usize];
        let [a, b, c] = [point(0), point(1), point(2)];
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

#[inline(always)]
fn exact<R: Real>(posed: &PosedBody<R>) -> Centre<R> {
    Centre::exact(&part_moments(&posed.template.closing, posed.points))
}

#[inline(always)]
fn exact_backward<R: Real>(
    posed: &PosedBody<R>,
    centre: &Centre<R>,
    d_centre: Vec3<R::Wide>,
    d_points: &mut [Vec3<R>],
) {
    let first = over(d_centre, centre.total);
    let d_whole = Moments { volume: -dot(first, centre.point), first, ..Moments::zero() };
    let d_parts = memory::filled(d_whole, posed.template.mesh.num_parts);
    part_moments_backward(&posed.template.closing, posed.points, &d_parts, d_points);
}

/// The centre of mass in the world, metres.
///
/// ```
/// use ipman::Batch;
/// use ipman::mass::{CenterOfMass, Method};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let exact = batch.value(&CenterOfMass { method: Method::Exact })?;
/// assert!(exact.iter().all(|x| (x - 0.5).abs() < 1e-12));
/// // The paper's pCoM, from 2,000 samples: their spread of 0.4 m over √2000 is 9 mm.
/// let pcom = batch.value(&CenterOfMass { method: Method::Pcom })?;
/// assert!(pcom.iter().all(|x| (x - 0.5).abs() < 0.05));
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct CenterOfMass {
    pub method: Method,
}

impl Quantity for CenterOfMass {
    type Saved<R: Real> = Centre<R>;

    fn num_outputs(&self, _: &Template) -> usize {
        3
    }

    fn check(&self, _: &Template) -> Result<()> {
        Ok(())
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Centre<R> {
        let centre = self.method.forward(posed);
        posed.write_world(centre.point, out);
        centre
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, centre: &Centre<R>, d_out: &[R], d_points: &mut [Vec3<R>]) {
        self.method.backward(posed, centre, widen([d_out[0], d_out[1], d_out[2]]), d_points);
    }
}
