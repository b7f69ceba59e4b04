//! What is found of bodies besides quantities: their bases of support and their status.

use super::lanes::OnLanes;
use crate::error::status;
use crate::mass::Method;
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::number::vector::{Vec3, sub};
use crate::number::{Data, Real, Scalar};
use crate::scene::Scene;
use crate::signed_volume::SignedVolumes;
use crate::solid::{Extent, Solid};
use crate::support::{BaseOfSupport, Contact};
use crate::tipping::{Footing, TipTest};

/// What is found of a body besides quantities.
pub(super) trait Finding: Sync {
    type Of: Clone + Send;
    /// That of each lane.
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<Self::Of>;
}

pub(super) struct Find<'a, F: Finding> {
    pub finding: &'a F,
    pub out: Vec<&'a mut F::Of>,
}

impl<T: Data, F: Finding> OnLanes<T> for Find<'_, F> {
    fn run<R: Real<Data = T>>(self, scene: &Scene<R>) {
        self.out.into_iter().zip(self.finding.find(scene)).for_each(|(out, found)| *out = found);
    }
}

pub(super) struct Support<'a> {
    pub contact: &'a Contact,
    pub method: Method,
}

impl Finding for Support<'_> {
    type Of = BaseOfSupport;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<BaseOfSupport> {
        BaseOfSupport::new(scene, self.contact, &self.method.forward(scene))
    }
}

#[cfg(feature = "lp")]
pub(super) struct SupportedLp<'a> {
    pub contact: &'a Contact,
    pub method: Method,
}

#[cfg(feature = "lp")]
impl Finding for SupportedLp<'_> {
    type Of = bool;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<bool> {
        crate::support::is_supported_lp(scene, self.contact, self.method)
    }
}

pub(super) struct Status<'a> {
    pub contact: &'a Contact,
}

impl Finding for Status<'_> {
    type Of = u32;
    fn find<R: Real>(&self, scene: &Scene<R>) -> Vec<u32> {
        let contacts = self.contact.find(scene);
        (0..R::LANES).map(|lane| status_of(scene, lane, contacts.count(lane))).collect()
    }
}

pub(super) struct Solids<'a> {
    pub densities: &'a MassProperties,
    pub contact: f64,
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
