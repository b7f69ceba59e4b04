//! The test of a pose by simulation: the stiff body is placed on its ground and released, in the engine rapier.
//!
//! On a plane only the corners of the convex hull touch, so they alone collide: as tiny balls over a half-space,
//! because a hull against a plane creeps in this engine. Mass, centre and inertia are the solid's, never the hull's.
//! Each body has a world of its own in double precision with the engine's deterministic arithmetic.

pub mod contact;
mod world;

use crate::batch::Batch;
use crate::error::{Error, Result, status};
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::number::vector::{Vec3, add_scaled, dot};
use crate::number::{Data, all_finite};
use crate::options::{not_negative, positive};
use crate::solid::Solid;
use crate::threads;
use contact::Shape;
pub use world::Placement;

/// How bodies are placed on their ground and released.
pub struct Simulation {
    pub densities: MassProperties,
    /// A body whose lowest vertex is higher than this counts as in the air, m.
    pub contact: f64,
    pub shape: Shape,
    /// First moves the lowest point of the collision shape to the ground. Otherwise the body starts where it is, even
    /// in the air.
    pub snap: bool,
    /// s
    pub step: f64,
    pub friction: f64,
    /// Steps after which the body's placement is recorded, ascending.
    pub looks: Vec<usize>,
}

/// The recorded motion of one body.
#[derive(Clone, Debug)]
pub struct Motion {
    pub status: u32,
    /// The placement at release, then one per recorded step; NaN for a body that is not simulated.
    pub places: Vec<Placement>,
}

impl Simulation {
    /// The error names the number that is out of range.
    pub fn check(&self) -> Result<()> {
        positive("contact", self.contact)?;
        positive("step", self.step)?;
        not_negative("friction", self.friction)?;
        self.shape.check()?;
        if !self.looks.is_sorted() {
            let got = format!("{:?}", self.looks);
            return Err(Error::Argument { name: "looks", expected: "ascending steps".into(), got });
        }
        Ok(())
    }

    fn unknown(&self, status: u32) -> Motion {
        Motion { status, places: memory::filled(Placement::nowhere(), 1 + self.looks.len()) }
    }

    /// A panic of the engine on one body does not affect the others.
    fn run(&self, solid: &Solid, normal: Vec3<f64>, height: f64, points: impl FnOnce() -> Vec<Vec3<f64>>) -> Motion {
        let places = memory::isolated(|| {
            let points = self.shape.touching(&points())?;
            let depth = points.iter().map(|point| -dot(normal, *point)).fold(f64::NEG_INFINITY, f64::max);
            let mut centre = solid.centre;
            if self.snap {
                let up = height + depth - dot(normal, centre);
                add_scaled(&mut centre, up, normal);
            }
            let fall = world::Fall { solid, normal, height, points: &points, friction: self.friction, step: self.step };
            let mut places = vec![Placement::at(centre)];
            places.extend(fall.run(centre, &self.looks)?);
            Some(places)
        });
        match places {
            Some(Some(places)) => Motion { status: solid.status, places },
            _ => self.unknown(solid.status | status::NOT_SIMULATED),
        }
    }
}

impl<T: Data> Batch<'_, T> {
    /// The motion of each body. Bodies without a volume are not simulated, nor, with `snap`, are those in the air.
    pub fn simulate(&self, simulation: &Simulation) -> Result<Vec<Motion>> {
        simulation.check()?;
        let solids = self.solids(&simulation.densities, simulation.contact)?;
        memory::guarded(|| {
            let mut motions = memory::collect(solids.iter().map(|solid| simulation.unknown(solid.status)));
            let starts = |solid: &Solid| solid.is_grounded() || (solid.is_solid() && !simulation.snap);
            let bodies = solids.iter().zip(&mut motions).enumerate().filter(|(_, (solid, _))| starts(solid));
            simulation.shape.ask(self.template().mesh.num_vertices);
            threads::each(memory::collect(bodies), true, self.interrupted(), &|(body, (solid, motion))| {
                let ground = self.ground_of(body);
                let offset = |vertex: &[T; 3]| std::array::from_fn(|k| vertex[k].value() - solid.centre[k]);
                let points = || memory::collect(self.vertices_of(body).as_chunks::<3>().0.iter().map(offset));
                *motion = simulation.run(solid, ground.normal, ground.height, points);
            })?;
            Ok(motions)
        })
    }

    /// The points of each body that can touch a plane, in the world; none for a body that is not finite or has no hull.
    pub fn touching(&self, shape: &Shape) -> Result<Vec<Vec<Vec3<f64>>>> {
        shape.check()?;
        memory::guarded(|| {
            let mut found = memory::filled(Vec::new(), self.len());
            let bodies = memory::collect(found.iter_mut().enumerate());
            shape.ask(self.template().mesh.num_vertices);
            threads::each(bodies, true, self.interrupted(), &|(body, found)| {
                if all_finite(self.vertices_of(body)) {
                    let point = |vertex: &[T; 3]| std::array::from_fn(|k| vertex[k].value());
                    let points = memory::collect(self.vertices_of(body).as_chunks::<3>().0.iter().map(point));
                    *found = memory::isolated(|| shape.touching(&points)).flatten().unwrap_or_default();
                }
            })?;
            Ok(found)
        })
    }
}
