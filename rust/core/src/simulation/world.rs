//! One body in its own world of the engine rapier.

use crate::memory;
use crate::number::vector::{Vec3, add_scaled, scale};
use crate::solid::{GRAVITY, Solid};
use rapier3d_f64::prelude::*;

/// Radius of the balls at the corners, m. The half-space lies lower by as much, so a ball touches where its corner
/// would.
const RADIUS: f64 = 1e-4;

/// Where a body is: its centre of mass in the world, and its rotation since release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    pub centre: Vec3<f64>,
    pub rotation: [Vec3<f64>; 3],
}

impl Placement {
    pub(super) fn nowhere() -> Self {
        Placement { centre: [f64::NAN; 3], rotation: [[f64::NAN; 3]; 3] }
    }

    pub(super) fn at(centre: Vec3<f64>) -> Self {
        Placement { centre, rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }
}

pub struct Fall<'a> {
    pub solid: &'a Solid,
    /// Normal of the ground, and its height along the normal, m.
    pub normal: Vec3<f64>,
    pub height: f64,
    /// The points that can touch, relative to the centre of mass.
    pub points: &'a [Vec3<f64>],
    pub friction: f64,
    /// s
    pub step: f64,
}

impl Fall<'_> {
    /// The placement after each of the given numbers of steps, ascending; None if it becomes non-finite.
    pub fn run(&self, centre: Vec3<f64>, looks: &[usize]) -> Option<Vec<Placement>> {
        let mut world = PhysicsWorld::new();
        world.gravity = vector(scale(-GRAVITY, self.normal));
        self.set_accuracy(&mut world.integration_parameters);
        self.lay_ground(&mut world);
        let body = self.put_body(&mut world, centre);
        let mut places = memory::with_capacity(looks.len());
        let mut done = 0;
        for &look in looks {
            for _ in done..look {
                world.step();
            }
            done = look;
            places.push(self.place(&world.bodies[body])?);
        }
        Some(places)
    }

    /// Contacts are detected anew in every step, each with its own friction. With the engine's default iterations a box
    /// landing on four corners rocks; with its default softness bodies close to tipping sink and tip over.
    fn set_accuracy(&self, parameters: &mut IntegrationParameters) {
        parameters.dt = self.step;
        parameters.contact_recycling = false;
        parameters.friction_model = FrictionModel::Coulomb;
        parameters.max_ccd_substeps = 0; // nothing is thin here
        parameters.static_contact_softness = SpringCoefficients { natural_frequency: 240.0, damping_ratio: 5.0 };
        parameters.num_internal_pgs_iterations = 8;
        parameters.num_internal_stabilization_iterations = 4;
    }

    fn lay_ground(&self, world: &mut PhysicsWorld) {
        let mut at = scale(self.height, self.normal);
        add_scaled(&mut at, -RADIUS, self.normal);
        let plane = ColliderBuilder::new(SharedShape::halfspace(vector(self.normal)));
        world.colliders.insert(plane.translation(vector(at)).friction(self.friction));
    }

    fn put_body(&self, world: &mut PhysicsWorld, centre: Vec3<f64>) -> RigidBodyHandle {
        let [x, y, z] = self.solid.inertia.map(vector);
        let mass = MassProperties::with_inertia_matrix(Vector::ZERO, self.solid.mass, Matrix::from_cols(x, y, z));
        let body = RigidBodyBuilder::dynamic()
            .translation(vector(centre))
            .additional_mass_properties(mass)
            .gyroscopic_forces_enabled(true)
            .can_sleep(false);
        let body = world.bodies.insert(body);
        for &point in self.points {
            let ball = ColliderBuilder::ball(RADIUS).translation(vector(point)).density(0.0).friction(self.friction);
            world.colliders.insert_with_parent(ball, body, &mut world.bodies);
        }
        body
    }

    fn place(&self, body: &RigidBody) -> Option<Placement> {
        let centre = body.translation().to_array();
        let columns = Matrix::from_quat(*body.rotation()).to_cols_array_2d();
        let rotation = [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row]));
        let finite = centre.iter().chain(rotation.as_flattened()).all(|x| x.is_finite());
        finite.then_some(Placement { centre, rotation })
    }
}

fn vector([x, y, z]: Vec3<f64>) -> Vector {
    Vector::new(x, y, z)
}
