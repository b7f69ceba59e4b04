//! Intuitive physics of human bodies (Tripathi et al., *3D Human Pose Estimation via Intuitive Physics*, CVPR 2023):
//! volume, centre of mass, pressure and base of support of a body mesh over a ground, and losses made of them, with their
//! derivatives.
//!
//! A [`Template`] holds everything about a body's surface that does not depend on its pose. A [`Batch`] is many poses of
//! a template, each over its [`Ground`], in f32 or f64. It evaluates every [`quantity`] and its derivatives, over SIMD
//! lanes and threads, with bits that depend on neither.
//!
//! ```
//! use ipman::losses::stability::StabilityLoss;
//! use ipman::mass::Method;
//! use ipman::pressure::{CenterOfPressure, PressureCurve};
//! use ipman::{Batch, Template};
//!
//! // A square pyramid, 1 m high, that stands on the ground y = 0: one triangle per row, outward.
//! let mut vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.5, 1.0, 0.5]];
//! let faces = [[0, 1, 2], [0, 2, 3], [0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]];
//! let template = Template::new(&vertices, &faces, &[], 2_000, 0)?;
//!
//! // The same body with its tip pulled 40 cm to the side.
//! vertices[4][0] += 0.4;
//! let never = || false; // whether to interrupt the computation
//! let batch = Batch::new(&template, vertices.as_flattened(), &[0.0, 1.0, 0.0], &[0.0], &never)?;
//!
//! let pressure = CenterOfPressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 }, epsilon: 0.0 };
//! let loss = StabilityLoss { method: Method::Exact, pressure };
//! let (value, gradient) = batch.value_and_vjp(&loss, &[1.0])?;
//! assert!(value[0] > 0.05, "the centre of mass is no longer over the centre of pressure");
//! assert!(gradient[3 * 4] > 0.0, "the loss decreases when the tip moves back");
//! # Ok::<(), ipman::Error>(())
//! ```
//!
//! Every formula is written once, for any number type ([`number::Real`]). (Eq. N) is the paper's equation N;
//! `docs/understand/paper.md` lists the equations with all the places that implement them.
//!
//! # The body and its ground
//! - [`ground`] – the ground plane, signed height h(u), projection g(u)
//! - [`mesh`] – the checked topology of a mesh
//! - [`closing`] – *close*: interfaces between parts get shared virtual vertices and caps
//! - [`rings`] – the neighbours around each point of a closed part; area vectors
//! - [`template`] – everything about a body's surface that is computed once
//! - [`posed`] – a posed body over its ground, in local coordinates
//!
//! # Physical quantities
//! - [`volume`], with [`signed_volume`] – *fill*: the volume of each part
//! - [`mass_properties`], with [`moments`] – mass, centre and inertia of the body and of its parts
//! - [`sampling`], with [`sample_surface`] and [`points`] – N_U points on the surface, V_U = W V, and passes over them
//! - [`mass`] – the centre of mass, pCoM (Eq. 1) and its alternatives
//! - [`pressure`] – from height to pressure (Eq. 2) to the centre of pressure (Eq. 3)
//! - [`support`] – contact, base of support, signed margin, BoSE (Eq. 10)
//!
//! # Losses
//! - [`losses::stability`] – L_stability (Eq. 4)
//! - [`losses::ground`] – L_ground = L_pull + L_push (Eqs. 5 to 7)
//! - [`losses::balance`] – the balance cost
//! - [`losses::terms`] – the terms of a training step in one pass
//! - [`reduction`] – their reduction over a batch
//!
//! # Evaluation
//! - [`quantity`] – what every differentiable quantity implements
//! - [`registry`] – all quantities by name
//! - [`batch`] – many bodies, over SIMD lanes and threads
//! - [`analysis`] – all results for a body in one pass
//!
//! # Stiff bodies
//! - [`solid`] – a posed body as one stiff solid
//! - [`tipping`] – how firmly it stands, in closed form, and where it rolls to
#![cfg_attr(feature = "simulation", doc = "- [`simulation`] – released on its ground, in the engine rapier")]
//!
//! # Self-contact and skinning
//! - [`collision`] – where a body touches or penetrates itself
//! - [`skinning`] – linear blend skinning, from a body model's parameters to vertices and joints
//!
//! # Foundations
//! - [`number`] – the number types: f32, f64, SIMD lanes, dual numbers; CPU levels
//! - [`error`] – invalid calls, and the status bits of a body
//! - [`options`] – range checks
//! - [`memory`] – allocations that fail with an error
//! - [`threads`] – how many threads, and the pool

pub mod error;
pub mod memory;
pub mod number;
pub mod options;
pub mod threads;

pub mod ground;
pub mod mesh;
pub mod closing;
pub mod rings;
pub mod template;
pub mod posed;

pub mod signed_volume;
pub mod volume;
pub mod moments;
pub mod mass_properties;
pub mod sampling;
pub mod sample_surface;
pub mod points;
pub mod mass;
pub mod pressure;
pub mod support;

pub mod losses;

pub mod quantity;
pub mod registry;
pub mod batch;
pub mod analysis;
pub mod reduction;

pub mod solid;
pub mod tipping;
#[cfg(feature = "simulation")]
pub mod simulation;

pub mod collision;
pub mod skinning;

#[doc(hidden)]
pub mod example;

pub use batch::Batch;
pub use error::{Error, Result};
pub use ground::Ground;
pub use template::Template;
