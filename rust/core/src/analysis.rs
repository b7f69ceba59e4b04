//! The analysis: all results for a body in one pass. Heights, samples, volumes, moments and centre of mass are computed
//! once and shared; each result has the bits of its own quantity.

use crate::error::{Error, Result, status};
use crate::losses::balance::{BalanceCost, Wrap};
use crate::losses::ground::{GroundLoss, Tanh};
use crate::losses::stability::distance_on_ground;
use crate::losses::term::{ByHeights, Shared, Term};
use crate::mass::{Centre, Method};
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::moments::part_moments;
use crate::number::vector::{Vec3, sub};
use crate::number::{Real, Scalar};
use crate::points::Points;
use crate::posed::{self, PosedBody};
use crate::pressure::{CenterOfPressure, Cop, LoadSums, PressureCurve};
use crate::quantity::Quantity;
use crate::sampling::CHUNK;
use crate::support::{BaseOfSupport, Contact, ContactRule};
use crate::template::Template;
use crate::volume::PartVolumes;

/// The constants of all results.
pub struct Analysis {
    method: Method,
    pressure: CenterOfPressure,
    ground: GroundLoss,
    contact: Contact,
    balance: BalanceCost,
    mass: MassProperties,
}

/// The corners of a base of support, see [`BaseOfSupport::polygon`].
pub type Polygon = Vec<Vec3<f64>>;

/// The first column of each result in a body's row: single numbers, then points, then the solid, then the parts' volumes.
mod at {
    use crate::mass_properties::MassProperties;

    pub const STATUS: usize = 0;
    pub const NUM_CONTACTS: usize = 1;
    pub const AREA: usize = 2;
    pub const MARGIN: usize = 3;
    pub const LOWEST: usize = 4;
    pub const PRESSURE_SUM: usize = 5;
    pub const PRESSURE_MAX: usize = 6;
    pub const STABILITY: usize = 7;
    pub const PULL: usize = 8;
    pub const PUSH: usize = 9;
    pub const BALANCE: usize = 10;
    pub const CENTER_OF_MASS: usize = 11;
    pub const CENTER_OF_MASS_EXACT: usize = 14;
    pub const CENTER_OF_PRESSURE: usize = 17;
    pub const SOLID: usize = 20;
    pub const PART_VOLUMES: usize = SOLID + MassProperties::ROW;
}

/// Name and first column of each result in a body's row. Points take three columns, the inertia nine (row by row), the
/// parts' volumes one per part, all others one.
pub const COLUMNS: [(&str, usize); 18] = [
    ("status", at::STATUS),
    ("num_contacts", at::NUM_CONTACTS),
    ("area", at::AREA),
    ("margin", at::MARGIN),
    ("lowest", at::LOWEST),
    ("pressure_sum", at::PRESSURE_SUM),
    ("pressure_max", at::PRESSURE_MAX),
    ("stability", at::STABILITY),
    ("pull", at::PULL),
    ("push", at::PUSH),
    ("balance", at::BALANCE),
    ("center_of_mass", at::CENTER_OF_MASS),
    ("center_of_mass_exact", at::CENTER_OF_MASS_EXACT),
    ("center_of_pressure", at::CENTER_OF_PRESSURE),
    ("volume", at::SOLID + MassProperties::VOLUME),
    ("mass", at::SOLID + MassProperties::MASS),
    ("inertia", at::SOLID + MassProperties::INERTIA),
    ("part_volumes", at::PART_VOLUMES),
];

/// Results of the pass over the samples.
struct SampleResults<R: Real> {
    cop: Cop<R>,
    pressure_sum: R,
    pressure_max: R,
}

impl Analysis {
    /// `options` are alpha, gamma, epsilon, alpha1, alpha2, beta1, beta2, threshold, balance gamma and sigma; `densities`
    /// one for all parts or one for each.
    pub fn new(method: &str, rule: &str, options: &[f64], densities: &[f64]) -> Result<Self> {
        let method = Method::named(method)?;
        let bad = || {
            let expected = "ten finite numbers, and densities".into();
            Error::Argument { name: "options", expected, got: format!("{options:?}, {densities:?}") }
        };
        let &[alpha, gamma, epsilon, alpha1, alpha2, beta1, beta2, threshold, balance_gamma, sigma] = options else {
            return Err(bad());
        };
        if densities.is_empty() || options.iter().chain(densities).any(|x| !x.is_finite()) {
            return Err(bad());
        }
        let curve = PressureCurve { alpha, gamma: balance_gamma };
        Ok(Analysis {
            method,
            pressure: CenterOfPressure { curve: PressureCurve { alpha, gamma }, epsilon },
            ground: GroundLoss { points: Points::Samples, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 },
            contact: Contact { rule: ContactRule::named(rule)?, threshold },
            balance: BalanceCost { method, wrap: Wrap::Log, curve, sigma },
            mass: MassProperties { densities: densities.to_vec() },
        })
    }

    /// Number of columns of a body's row.
    pub fn size(&self, template: &Template) -> usize {
        at::PART_VOLUMES + template.mesh.num_parts
    }

    /// The error names the constant that is out of range.
    pub fn check(&self, template: &Template) -> Result<()> {
        self.pressure.check(template)?;
        Term::check(&self.ground, template)?;
        self.contact.check()?;
        Term::check(&self.balance, template)?;
        self.mass.check(template)
    }

    /// Writes the row and returns the polygon of each lane.
    pub fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Vec<Polygon> {
        let shared = Shared::new(posed);
        out[at::LOWEST] = posed::lowest(&shared.heights);
        let samples = self.pass_over_samples(&shared, &mut out[at::PULL..at::BALANCE]);
        out[at::PRESSURE_SUM] = samples.pressure_sum;
        out[at::PRESSURE_MAX] = samples.pressure_max;

        let parts = part_moments(&posed.template.closing, posed.points);
        let exact = Centre::<R>::exact(&parts);
        let centre = shared.centre(self.method);
        match centre.signed_volumes() {
            Some(volumes) => {
                for (out, volume) in out[at::PART_VOLUMES..].iter_mut().zip(volumes) {
                    *out = R::narrow(volume.abs());
                }
            }
            None => drop(PartVolumes.forward(posed, &mut out[at::PART_VOLUMES..])),
        }
        self.mass.write(posed, &parts, &mut out[at::SOLID..at::PART_VOLUMES]);
        posed.write_world(centre.point, &mut out[at::CENTER_OF_MASS..][..3]);
        posed.write_world(exact.point, &mut out[at::CENTER_OF_MASS_EXACT..][..3]);
        posed.write_world(samples.cop.point, &mut out[at::CENTER_OF_PRESSURE..][..3]);
        out[at::STABILITY] = R::narrow(distance_on_ground(posed, centre, &samples.cop).0);
        let supports = BaseOfSupport::new(posed, &self.contact, centre);
        self.balance.forward_about(posed, centre, &mut out[at::BALANCE..][..1]);
        let number = |of: &dyn Fn(usize) -> f64| R::narrow(R::Wide::from_lanes(|lane| Real::of(of(lane))));
        out[at::NUM_CONTACTS] = number(&|lane| supports[lane].num_contacts as f64);
        out[at::AREA] = number(&|lane| supports[lane].area);
        out[at::MARGIN] = number(&|lane| supports[lane].margin);
        let [low, high] = posed.bounds();
        out[at::STATUS] = number(&|lane| {
            let volumes = memory::collect(parts.iter().map(|part| part.volume.lane(lane).value()));
            let corner = |corner: Vec3<R>| corner.map(|x| x.lane(lane).value());
            status::bits(&volumes, sub(corner(high), corner(low)), supports[lane].has_contact()) as f64
        });
        supports.into_iter().map(|support| support.polygon).collect()
    }

    /// Pressure and ground losses.
    fn pass_over_samples<R: Real>(&self, shared: &Shared<R>, ground: &mut [R]) -> SampleResults<R> {
        let (template, unasked) = (shared.template(), &mut ByHeights::Unasked);
        let mut loads = LoadSums::new(self.pressure, template, &shared.heights);
        let mut sums = self.ground.begin(shared, &[R::zero(); 2], unasked);
        let mut lowest = R::of(1e30);
        let mut row = [R::zero(); CHUNK];
        for chunk in Points::Samples.chunks(template) {
            chunk.gather(&shared.heights, &mut row);
            loads.add(&chunk, &row);
            self.ground.add(&mut sums, &chunk, &row, unasked);
            lowest = lowest.at_most(posed::lowest(&row[..chunk.len()]));
        }
        self.ground.finish(shared, sums, ground);
        SampleResults {
            pressure_sum: R::narrow(loads.total_pressure()),
            // ρ decreases with height, so the lowest sample has the largest.
            pressure_max: self.pressure.curve.density(lowest, R::zero()),
            cop: loads.finish(shared.posed),
        }
    }
}
