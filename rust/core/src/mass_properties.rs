//! The mass properties of a body and of its parts, as solids of given densities.

use crate::error::{Error, Result};
use crate::memory;
use crate::moments::{Moments, PAIRS, part_moments, part_moments_backward};
use crate::number::Real;
use crate::number::vector::{Vec3, dot};
use crate::options::positive;
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::template::Template;

/// Exact volume (m³), mass (kg), centre (m) and inertia about the centre (kg m²) of the body and of each part. 14
/// numbers per solid: volume, mass, centre, inertia row by row. The whole body comes first, then the parts.
///
/// ```
/// use ipman::Batch;
/// use ipman::mass_properties::MassProperties;
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let row = batch.value(&MassProperties { densities: vec![985.0] })?;
/// assert!((row[MassProperties::MASS] - 985.0).abs() < 1e-9);
/// // The inertia of a cube about its centre: m a² / 6.
/// assert!((row[MassProperties::INERTIA] - 985.0 / 6.0).abs() < 1e-9);
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct MassProperties {
    /// kg/m³, one for all parts or one for each.
    pub densities: Vec<f64>,
}

impl MassProperties {
    /// Numbers per solid.
    pub const ROW: usize = 14;
    /// Where a solid's row has its volume, mass, centre and inertia.
    pub const VOLUME: usize = 0;
    pub const MASS: usize = 1;
    pub const CENTER: usize = 2;
    pub const INERTIA: usize = 5;

    /// Fails unless there is one positive number, or one per part.
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

/// Volume, mass, centre and inertia from the density-weighted moments.
#[inline(always)]
fn row<W: Real>(volume: W, weighted: &Moments<W>, origin: Vec3<W>, out: &mut [W]) {
    let mass = weighted.volume;
    let centre: Vec3<W> = weighted.first.map(|x| x / mass);
    let mut spread = weighted.second;
    for (value, (i, j)) in spread.iter_mut().zip(PAIRS) {
        *value = *value - mass * centre[i] * centre[j];
    }
    let [xx, yy, zz, xy, xz, yz] = spread;
    out[MassProperties::VOLUME] = volume;
    out[MassProperties::MASS] = mass;
    for k in 0..3 {
        out[MassProperties::CENTER + k] = centre[k] + origin[k];
    }
    out[MassProperties::INERTIA..].copy_from_slice(&[yy + zz, -xy, -xz, -xy, xx + zz, -yz, -xz, -yz, xx + yy]);
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

    fn num_outputs(&self, template: &Template) -> usize {
        Self::ROW * (1 + template.mesh.num_parts)
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.check_densities(template.mesh.num_parts)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Vec<Moments<R::Wide>> {
        let parts = part_moments(&posed.template.closing, posed.points);
        self.write(posed, &parts, out);
        parts
    }

    fn backward<R: Real>(
        &self,
        posed: &PosedBody<R>,
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
        part_moments_backward(&posed.template.closing, posed.points, &d_parts, d_points);
    }
}

impl MassProperties {
    /// Writes as many rows as `out` holds.
    pub fn write<R: Real>(&self, posed: &PosedBody<R>, parts: &[Moments<R::Wide>], out: &mut [R]) {
        let (volumes, weighted) = self.weigh(parts);
        for (out, (volume, weighted)) in out.chunks_exact_mut(Self::ROW).zip(volumes.into_iter().zip(weighted)) {
            let mut wide = [R::Wide::zero(); Self::ROW];
            row(volume, &weighted, posed.origin, &mut wide);
            for (out, wide) in out.iter_mut().zip(wide) {
                *out = R::narrow(wide);
            }
        }
    }

    /// The whole body's row, in local coordinates.
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
