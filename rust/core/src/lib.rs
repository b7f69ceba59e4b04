//! Intuitive physics of human bodies (Tripathi et al., *3D Human Pose Estimation via Intuitive Physics*, CVPR 2023), in
//! the paper's order: a body mesh over a ground, its parts closed and filled, its surface sampled, its centre of mass,
//! pressure and base of support, and the losses made of them. Every formula is written once, for any [`number::Real`].
//! (Eq. N) is the paper's equation N; `docs/understand/paper.md` lists them with all the places that hold them.

/// What can be wrong with a call, and with one body of a batch.
pub mod error;
/// Options that are finite and in their range.
pub mod options;
/// Memory that grows with the input: a lack of it is an error.
pub mod memory;
/// The numbers that rooms compute with: f32, f64, lanes of them, dual numbers; the gates to the CPU's levels.
pub mod number;

/// The ground plane: signed height h(u), projection g(u).
pub mod ground;
/// The checked topology: the only way in for vertices and faces.
pub mod mesh;
/// Close: interfaces between parts get shared virtual vertices and caps.
pub mod closing;
/// Around each point of a closed part its neighbours: area vectors, the volume's gradient.
pub mod rings;
/// Fill: signed tetrahedra of each closed part, and the gradient of their volumes.
pub mod signed_volume;
/// The volume of each part.
pub mod volume;
/// Exact first and second moments of each closed part.
pub mod moments;
/// Mass, centre and inertia of the body and of its parts.
pub mod mass_properties;
/// Triangle point picking, W and Wᵀ, and the passes over the samples.
pub mod sampling;
/// The samples' positions.
pub mod sample_surface;
/// Samples or vertices, a row of them at a time.
pub mod points;
/// The centre of mass in all its formulations.
pub mod mass;
/// Height to pressure to centre of pressure.
pub mod pressure;
/// Contact set, hull, signed margin; the linear programme.
pub mod support;
/// Stability, ground, balance.
pub mod losses;

/// Everything about a body's surface that is computed once.
pub mod template;
/// One closed body over its ground, in local coordinates.
pub mod posed;
/// All figures of a body at one look.
pub mod analysis;
/// What a differentiable module offers.
pub mod quantity;
/// All quantities by name.
pub mod registry;
/// Many bodies over lanes and threads.
pub mod batch;
/// The weighted total of a training step, reduced over a batch, with its gradient.
pub mod reduction;
/// How many threads, and the pool.
pub mod threads;

/// A posed body as one stiff solid.
pub mod solid;
/// How firmly a stiff body stands, in closed form; where it rolls to.
pub mod tipping;
/// The stiff body let go on its ground, in the engine rapier.
#[cfg(feature = "simulation")]
pub mod simulation;

/// A body that touches or penetrates itself.
pub mod collision;

/// Linear blend skinning: from a body model's parameters to its vertices and joints.
pub mod skinning;

pub use batch::Batch;
pub use error::{Error, Result};
pub use ground::Ground;
pub use template::Template;
