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
use crate::quantity::Quantity;
use crate::scene::Scene;
use crate::signed_volume::SignedVolumes;
use crate::solid::{Extent, Solid};
use crate::support::{BaseOfSupport, Contact};
use crate::tipping::{Footing, TipTest, Tipping};

impl<T: Data> Batch<'_, T> {
    /// The base of support of each body.
    pub fn base_of_support(&self, contact: &Contact, method: Method) -> Result<Vec<BaseOfSupport>> {
        contact.check()?;
        let nowhere = BaseOfSupport { polygon: Vec::new(), area: f64::NAN, margin: f64::NAN, num_contacts: 0 };
        self.find(nowhere, &Support { contact, method })
    }

    /// All figures of each body ([`Analysis`]): B·K numbers, and the corners of the base of support.
    pub fn analysis_into(&self, analysis: &Analysis, out: &mut [T]) -> Result<Vec<Polygon>> {
        let size = analysis.size(self.template);
        analysis.check(self.template)?;
        memory::guarded(|| {
            let mut polygons = memory::filled(Polygon::new(), self.len());
            let mut bodies = memory::with_capacity(self.len());
            for (body, (row, polygon)) in out.chunks_exact_mut(size).zip(&mut polygons).enumerate() {
                match self.origin(body) {
                    Some(origin) => bodies.push((body, origin, (row, polygon))),
                    None => row.fill(T::of(f64::NAN)),
                }
            }
            self.each_group(bodies, |group, rows| {
                let (out, polygons) = rows.into_iter().unzip();
                self.on_lanes(group, Figures { analysis, size, out, polygons });
            })?;
            Ok(polygons)
        })
    }

    /// BoSE by the linear programme.
    #[cfg(feature = "lp")]
    pub fn is_supported_lp(&self, contact: &Contact, method: Method) -> Result<Vec<bool>> {
        contact.check()?;
        self.find(false, &SupportedLp { contact, method })
    }

    /// The bits of [`status`].
    pub fn status(&self, contact: &Contact) -> Result<Vec<u32>> {
        contact.check()?;
        self.find(status::NON_FINITE, &Status { contact })
    }

    /// Each body as one solid. One with its lowest vertex higher than `contact` metres is in the air.
    pub fn solids(&self, densities: &MassProperties, contact: f64) -> Result<Vec<Solid>> {
        densities.check(self.template)?;
        positive("contact", contact)?;
        self.find(Solid::nowhere(), &Solids { densities, contact })
    }

    /// The tip test of each body.
    pub fn tip_test(&self, test: &TipTest) -> Result<Vec<Tipping>> {
        test.check(self.template)?;
        memory::guarded(|| {
            let mut out = memory::filled(Tipping::nowhere(), self.len());
            self.each_group(self.finite(&mut out), |group, out| {
                let mut footings = vec![Footing::nowhere(); out.len()];
                self.on_lanes(group, Find { finding: test, out: footings.iter_mut().collect() });
                for ((out, footing), &body) in out.into_iter().zip(footings).zip(&group.bodies) {
                    *out = test.of_body(footing, self.vertices_of(body));
                }
            })?;
            Ok(out)
        })
    }

    /// What is found of each body; `bad` for a body that is not finite.
    fn find<F: Finding>(&self, bad: F::Of, finding: &F) -> Result<Vec<F::Of>> {
        memory::guarded(|| {
            let mut out = memory::filled(bad, self.len());
            self.each_group(self.finite(&mut out), |group, out| self.on_lanes(group, Find { finding, out }))?;
            Ok(out)
        })
    }
}

/// What is found of a body besides quantities.
trait Finding: Sync {
    type Of: Clone + Send;
    /// That of each lane.
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<Self::Of>;
}

struct Find<'a, F: Finding> {
    finding: &'a F,
    out: Vec<&'a mut F::Of>,
}

impl<T: Data, F: Finding> OnLanes<T> for Find<'_, F> {
    fn run<R: Real<Data = T>>(self, scene: &Scene<R>) {
        self.out.into_iter().zip(self.finding.find(scene)).for_each(|(out, found)| *out = found);
    }
}

struct Support<'a> {
    contact: &'a Contact,
    method: Method,
}

impl Finding for Support<'_> {
    type Of = BaseOfSupport;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<BaseOfSupport> {
        BaseOfSupport::new(scene, self.contact, &self.method.forward(scene))
    }
}

#[cfg(feature = "lp")]
struct SupportedLp<'a> {
    contact: &'a Contact,
    method: Method,
}

#[cfg(feature = "lp")]
impl Finding for SupportedLp<'_> {
    type Of = bool;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<bool> {
        crate::support::is_supported_lp(scene, self.contact, self.method)
    }
}

struct Status<'a> {
    contact: &'a Contact,
}

impl Finding for Status<'_> {
    type Of = u32;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<u32> {
        let contacts = self.contact.find(scene);
        (0..R::LANES).map(|lane| status_of(scene, lane, contacts.count(lane))).collect()
    }
}

struct Solids<'a> {
    densities: &'a MassProperties,
    contact: f64,
}

impl Finding for Solids<'_> {
    type Of = Solid;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<Solid> {
        let origin = |lane: usize| scene.origin.map(|x| x.lane(lane).value());
        let solids = Solid::of_lanes(scene, &Extent::of(scene), self.densities, self.contact);
        solids.into_iter().enumerate().map(|(lane, solid)| solid.moved(origin(lane)).or_nowhere()).collect()
    }
}

impl Finding for TipTest {
    type Of = Footing;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<Footing> {
        self.footings(scene)
    }
}

/// The bits of one lane. Whether a volume is nothing or less is decided in double precision.
fn status_of<R: Real>(scene: &Scene<R>, lane: usize, num_contacts: usize) -> u32 {
    let vertices = &scene.points[..scene.template.mesh.num_vertices];
    let mut points: Vec<Vec3<f64>> = memory::with_capacity(scene.points.len());
    points.extend(vertices.iter().map(|v| v.map(|x| x.lane(lane).value())));
    let [low, high] = scene.bounds().map(|corner| corner.map(|x| x.lane(lane).value()));
    scene.template.closing.forward(&mut points);
    let volumes = SignedVolumes::forward(&scene.template.closing, &points).of_parts;
    status::bits(&volumes, sub(high, low), num_contacts > 0)
}

struct Figures<'a, T> {
    analysis: &'a Analysis,
    size: usize,
    out: Vec<&'a mut [T]>,
    polygons: Vec<&'a mut Polygon>,
}

impl<T: Data> OnLanes<T> for Figures<'_, T> {
    fn run<R: Real<Data = T>>(mut self, scene: &Scene<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        let polygons = self.analysis.forward(scene, &mut out);
        self.polygons.into_iter().zip(polygons).for_each(|(own, polygon)| *own = polygon);
        R::write_rows(&out, &mut self.out);
    }
}
