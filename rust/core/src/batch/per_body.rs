//! Per-body results that are not differentiable: base of support, status, rigid-body properties, the whole analysis.

use super::Batch;
use super::groups::OnLanes;
use crate::analysis::{Analysis, Polygon};
use crate::error::{Result, status};
use crate::mass::Method;
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::number::vector::{Vec3, sub};
use crate::number::{Data, Real, Scalar};
use crate::options::positive;
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::signed_volume::SignedVolumes;
use crate::solid::{Extent, Solid};
use crate::support::{BaseOfSupport, Contact};
use crate::tipping::{TipTest, Tipping};

impl<T: Data> Batch<'_, T> {
    /// The base of support of each body.
    pub fn base_of_support(&self, contact: &Contact, method: Method) -> Result<Vec<BaseOfSupport>> {
        contact.check()?;
        let nowhere = BaseOfSupport { polygon: Vec::new(), area: f64::NAN, margin: f64::NAN, num_contacts: 0 };
        self.per_body(nowhere, &Support { contact, method })
    }

    /// All results for each body ([`Analysis`]): writes B·K numbers and returns the corners of the bases of support.
    pub fn analysis_into(&self, analysis: &Analysis, out: &mut [T]) -> Result<Vec<Polygon>> {
        let size = analysis.size(self.template);
        analysis.check(self.template)?;
        memory::guarded(|| {
            let mut polygons = memory::filled(Polygon::new(), self.len());
            let rows = out.chunks_exact_mut(size).zip(&mut polygons);
            let not_finite = |(row, _): (&mut [T], _)| row.fill(T::of(f64::NAN));
            self.each_group(rows, not_finite, |_, rows| {
                let (out, polygons) = rows.into_iter().unzip();
                WriteAnalysis { analysis, size, out, polygons }
            })?;
            Ok(polygons)
        })
    }

    /// BoSE by the linear programme.
    #[cfg(feature = "lp")]
    pub fn is_supported_lp(&self, contact: &Contact, method: Method) -> Result<Vec<bool>> {
        contact.check()?;
        self.per_body(false, &SupportedLp { contact, method })
    }

    /// The bits of [`status`].
    pub fn status(&self, contact: &Contact) -> Result<Vec<u32>> {
        contact.check()?;
        self.per_body(status::NON_FINITE, &Status { contact })
    }

    /// Each body as one solid. A body whose lowest vertex is higher than `contact` metres counts as in the air.
    pub fn solids(&self, densities: &MassProperties, contact: f64) -> Result<Vec<Solid>> {
        densities.check(self.template)?;
        positive("contact", contact)?;
        self.per_body(Solid::nowhere(), &Solids { densities, contact })
    }

    /// The tip test of each body.
    pub fn tip_test(&self, test: &TipTest) -> Result<Vec<Tipping>> {
        test.check(self.template)?;
        memory::guarded(|| {
            let mut out = memory::filled(Tipping::nowhere(), self.len());
            self.each_group(
                out.iter_mut(),
                |_| {},
                |group, out| {
                    let vertices = group.bodies.iter().map(|&body| self.vertices_of(body)).collect();
                    WriteTipping { test, vertices, out }
                },
            )?;
            Ok(out)
        })
    }

    /// The result for each body; `bad` for bodies that are not finite.
    fn per_body<F: PerBody>(&self, bad: F::Output, result: &F) -> Result<Vec<F::Output>> {
        memory::guarded(|| {
            let mut out = memory::filled(bad, self.len());
            self.each_group(out.iter_mut(), |_| {}, |_, out| WritePerBody { result, out })?;
            Ok(out)
        })
    }
}

/// A result per body that is not a [`Quantity`].
trait PerBody: Sync {
    type Output: Clone + Send;
    /// One per lane.
    fn of_lanes<R: Real>(&self, posed: &PosedBody<R>) -> Vec<Self::Output>;
}

struct WritePerBody<'a, F: PerBody> {
    result: &'a F,
    out: Vec<&'a mut F::Output>,
}

impl<T: Data, F: PerBody> OnLanes<T> for WritePerBody<'_, F> {
    fn run<R: Real<Data = T>>(self, posed: &PosedBody<R>) {
        self.out.into_iter().zip(self.result.of_lanes(posed)).for_each(|(out, own)| *out = own);
    }
}

struct Support<'a> {
    contact: &'a Contact,
    method: Method,
}

impl PerBody for Support<'_> {
    type Output = BaseOfSupport;
    fn of_lanes<R: Real>(&self, posed: &PosedBody<R>) -> Vec<BaseOfSupport> {
        BaseOfSupport::new(posed, self.contact, &self.method.forward(posed))
    }
}

#[cfg(feature = "lp")]
struct SupportedLp<'a> {
    contact: &'a Contact,
    method: Method,
}

#[cfg(feature = "lp")]
impl PerBody for SupportedLp<'_> {
    type Output = bool;
    fn of_lanes<R: Real>(&self, posed: &PosedBody<R>) -> Vec<bool> {
        crate::support::is_supported_lp(posed, self.contact, self.method)
    }
}

struct Status<'a> {
    contact: &'a Contact,
}

impl PerBody for Status<'_> {
    type Output = u32;
    fn of_lanes<R: Real>(&self, posed: &PosedBody<R>) -> Vec<u32> {
        let contacts = self.contact.find(posed);
        (0..R::LANES).map(|lane| status_of(posed, lane, contacts.count(lane))).collect()
    }
}

struct Solids<'a> {
    densities: &'a MassProperties,
    contact: f64,
}

impl PerBody for Solids<'_> {
    type Output = Solid;
    fn of_lanes<R: Real>(&self, posed: &PosedBody<R>) -> Vec<Solid> {
        let origin = |lane: usize| posed.origin.map(|x| x.lane(lane).value());
        let solids = Solid::of_lanes(posed, &Extent::of(posed), self.densities, self.contact);
        solids.into_iter().enumerate().map(|(lane, solid)| solid.moved(origin(lane)).or_nowhere()).collect()
    }
}

struct WriteTipping<'a, T> {
    test: &'a TipTest,
    vertices: Vec<&'a [T]>,
    out: Vec<&'a mut Tipping>,
}

impl<T: Data> OnLanes<T> for WriteTipping<'_, T> {
    fn run<R: Real<Data = T>>(self, posed: &PosedBody<R>) {
        let footings = self.test.footings(posed);
        for ((out, footing), vertices) in self.out.into_iter().zip(footings).zip(self.vertices) {
            *out = self.test.of_body(footing, vertices);
        }
    }
}

/// The status bits of one lane. Volumes are computed in double precision, because their sign decides.
fn status_of<R: Real>(posed: &PosedBody<R>, lane: usize, num_contacts: usize) -> u32 {
    let vertices = &posed.points[..posed.template.mesh.num_vertices];
    let mut points: Vec<Vec3<f64>> = memory::with_capacity(posed.points.len());
    points.extend(vertices.iter().map(|v| v.map(|x| x.lane(lane).value())));
    let [low, high] = posed.bounds().map(|corner| corner.map(|x| x.lane(lane).value()));
    posed.template.closing.forward(&mut points);
    let volumes = SignedVolumes::forward(&posed.template.closing, &points).of_parts;
    status::bits(&volumes, sub(high, low), num_contacts > 0)
}

struct WriteAnalysis<'a, T> {
    analysis: &'a Analysis,
    size: usize,
    out: Vec<&'a mut [T]>,
    polygons: Vec<&'a mut Polygon>,
}

impl<T: Data> OnLanes<T> for WriteAnalysis<'_, T> {
    fn run<R: Real<Data = T>>(mut self, posed: &PosedBody<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        let polygons = self.analysis.forward(posed, &mut out);
        self.polygons.into_iter().zip(polygons).for_each(|(own, polygon)| *own = polygon);
        R::write_rows(&out, &mut self.out);
    }
}
