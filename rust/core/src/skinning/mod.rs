//! Linear blend skinning (Loper et al., *SMPL*, 2015), forward and backward.
//!
//! rest   = template + Σ betas · shapes + Σ expression · expressions + Σ (R − I) · pose blend shapes
//! vertex = Σ_j w_j (turned_j · rest + offset_j) + translation
//!
//! Rotations and the chain run in double precision, which costs little; the vertices run in the data's precision. Sums
//! have the same order in any batch.

mod backward;
pub mod batch;
pub mod blend;
pub mod chain;
mod forward;
mod jacobian;
mod matrix;
mod model;
mod place;
pub mod rotation;
pub mod weights;

use crate::error::Result;
use crate::memory;
use crate::number::vector::Vec3;
use crate::number::{Real, Scalar};
use blend::{Blend, Registers, Tile, tiles};
use chain::{Chain, Skeleton};
use matrix::Mat3;
pub use model::Model;
use rotation::Form;
use weights::{Transform, Weights};

/// A body model ready for skinning: its large arrays in precision C, in tiles of W vertices.
pub struct Skin<C, const W: usize> {
    pub num_vertices: usize,
    skeleton: Skeleton,
    template: Vec<Tile<C, W>>,
    betas: Directions<C, W>,
    expression: Directions<C, W>,
    pose: Blend<C, W>,
    joints: Vec<Vec3<f64>>,
    pose_mean: Vec<Vec3<f64>>,
    weights: Weights<C, W>,
}

/// Shape directions of the vertices and of the joints, (J, 3, K).
struct Directions<C, const W: usize> {
    surface: Blend<C, W>,
    joints: Vec<f64>,
}

/// The parameters of one body; trailing betas and expressions may be left out and are zero.
pub struct Parameters<R> {
    pub form: Form,
    pub pose: Vec<R>,
    pub betas: Vec<R>,
    pub expression: Vec<R>,
    pub transl: Vec3<R>,
}

/// One body with its joints placed, ready to move vertices.
pub struct Body<R: Real> {
    parameters: Parameters<R>,
    pose: Vec<R::Wide>,
    local: Vec<Mat3<R::Wide>>,
    rest_joints: Vec<Vec3<R::Wide>>,
    chain: Chain<R::Wide>,
    transforms: Vec<Transform<R>>,
    features: Vec<R>,
    /// The translation; NaN if any parameter is not finite, so that the whole body becomes NaN.
    pub shift: Vec3<R>,
}

/// The resting body before the pose shapes: the template, or with `shaped` a shape that all bodies share.
#[derive(Clone, Copy)]
pub struct Start<'a, C, const W: usize> {
    pub tiles: &'a [Tile<C, W>],
    pub shaped: bool,
}

/// Which gradients are requested beside the translation's: the pose's, and how many of the shape's.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub pose: bool,
    pub betas: usize,
    pub expression: usize,
}

/// N bodies that are skinned together, so that the directions are read once for all of them.
pub struct Block<'a, R: Real, const N: usize> {
    pub bodies: &'a [Body<R>; N],
    betas: Vec<[R; N]>,
    expression: Vec<[R; N]>,
    features: Vec<[R; N]>,
}

/// The gradient of N bodies, accumulated tile by tile; each sum consists of one partial sum per vertex of a tile.
pub struct Sums<V: Real, const P: usize, const N: usize> {
    betas: Vec<[[V; P]; N]>,
    expression: Vec<[[V; P]; N]>,
    features: Vec<[[V; P]; N]>,
    rigid: Vec<Rigid<V, P>>,
}

/// The gradient of one body by its joints' transforms and its translation.
struct Rigid<V: Real, const P: usize> {
    transforms: Vec<Transform<[V; P]>>,
    transl: Vec3<Wide<V>>,
}

/// The sums of one body.
pub struct Totals<R: Real> {
    transforms: Vec<Transform<R::Wide>>,
    betas: Vec<R::Wide>,
    expression: Vec<R::Wide>,
    features: Vec<R::Wide>,
    transl: Vec3<R::Wide>,
}

/// One lane of a register in double precision.
type Wide<V> = <<V as Real>::Scalar as Real>::Wide;

/// Source of ∂loss/∂vertices for one tile of one body.
pub trait VertexGradient<V, const P: usize> {
    fn of(&self, body: usize, tile: usize) -> Registers<V, P>;
}

/// The gradient of one body by its parameters.
pub struct Gradient<R> {
    pub pose: Vec<R>,
    pub betas: Vec<R>,
    pub expression: Vec<R>,
    pub transl: Vec3<R>,
}

impl<C: Scalar, const W: usize> Skin<C, W> {
    pub fn new(model: &Model) -> Result<Self> {
        let (num_betas, num_expressions) = model.check()?;
        let (num_vertices, num_joints) = (model.v_template.len() / 3, model.parents.len());
        let triples = |numbers: &[f64]| memory::copied(numbers.as_chunks::<3>().0);
        let directions = |surface, joints: &[f64], len| Directions {
            surface: Blend::new(num_vertices, surface, len),
            joints: memory::copied(joints),
        };
        memory::guarded(|| {
            Ok(Skin {
                num_vertices,
                skeleton: Skeleton::new(model.parents, triples(model.rest_rotation).as_chunks::<3>().0.to_vec())?,
                template: tiles(model.v_template),
                betas: directions(model.shapedirs, model.joint_shapes, num_betas),
                expression: directions(model.expressiondirs, model.joint_expressions, num_expressions),
                pose: Blend::new(num_vertices, model.posedirs, model.posedirs.len() / (3 * num_vertices)),
                joints: triples(model.joints),
                pose_mean: triples(model.pose_mean),
                weights: Weights::new(model.weights, num_joints),
            })
        })
    }

    pub fn num_joints(&self) -> usize {
        self.skeleton.num_joints()
    }

    pub fn num_betas(&self) -> usize {
        self.betas.surface.count()
    }

    pub fn num_expressions(&self) -> usize {
        self.expression.surface.count()
    }

    pub fn num_tiles(&self) -> usize {
        self.template.len()
    }

    pub fn start(&self) -> Start<'_, C, W> {
        Start { tiles: &self.template, shaped: false }
    }
}

impl<'a, R: Real, const N: usize> Block<'a, R, N> {
    pub fn new(bodies: &'a [Body<R>; N]) -> Self {
        let together = |of: fn(&Body<R>) -> &[R]| {
            let numbers = bodies.each_ref().map(of);
            (0..numbers[0].len()).map(|k| numbers.map(|numbers| numbers[k])).collect()
        };
        Block {
            bodies,
            betas: together(|body| &body.parameters.betas),
            expression: together(|body| &body.parameters.expression),
            features: together(|body| &body.features),
        }
    }
}

impl<C: Scalar, const W: usize> Directions<C, W> {
    #[inline(always)]
    fn joint<R: Real>(&self, joint: usize, k: usize) -> Vec3<R> {
        let len = self.surface.count();
        std::array::from_fn(|axis| R::of(self.joints[(3 * joint + axis) * len + k]))
    }
}
