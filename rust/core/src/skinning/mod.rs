//! Linear blend skinning (Loper et al., *SMPL*, 2015), forward and backward.
//!
//! rest   = template + Σ betas · shapes + Σ expression · expressions + Σ (R − I) · pose blend shapes
//! vertex = Σ_j w_j (turned_j · rest + offset_j) + translation
//!
//! Rotations and the chain run in double precision, which costs little; the vertices run in the data's precision. Sums
//! have one order, whatever the batch.

pub mod blend;
pub mod chain;
mod model;
pub mod rotation;
pub mod weights;

use crate::error::Result;
use crate::number::vector::{Vec3, add, add_scaled, narrow, of, sub, widen};
use crate::number::{Real, Scalar};
use blend::{Blend, Tile, tiles};
use chain::{Chain, Skeleton, add_outer, apply, apply_transposed};
pub use model::Model;
use rotation::Form;
use weights::{Transform, Weights};

pub type Mat3<R> = [[R; 3]; 3];

/// A body model ready for skinning, its large arrays in the precision C, W vertices a tile.
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

/// What poses one body; missing betas and expressions at the end are zero.
pub struct Parameters<R> {
    pub form: Form,
    pub pose: Vec<R>,
    pub betas: Vec<R>,
    pub expression: Vec<R>,
    pub transl: Vec3<R>,
}

/// One body's joints in their places, ready to move vertices.
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

/// How many shape gradients are asked for, beside the pose's and the translation's.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub pose: bool,
    pub betas: usize,
    pub expression: usize,
}

/// The gradient of one body, gathered tile by tile; W sums each.
pub struct Sums<R: Real, const W: usize> {
    transforms: Vec<Transform<[R; W]>>,
    betas: Vec<[R; W]>,
    expression: Vec<[R; W]>,
    features: Vec<[R; W]>,
    transl: Tile<R::Wide, W>,
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
        let triples = |numbers: &[f64]| numbers.as_chunks::<3>().0.to_vec();
        let directions = |surface, joints: &[f64], len| Directions {
            surface: Blend::new(num_vertices, surface, len),
            joints: joints.to_vec(),
        };
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

    /// The resting tiles of one shape, for bodies that all have it.
    pub fn shaped(&self, betas: &[C], expression: &[C]) -> Vec<Tile<C, W>> {
        let shaped = |(tile, &points)| plus(points, self.shape(tile, betas, expression));
        self.template.iter().enumerate().map(shaped).collect()
    }

    /// Puts the joints of one body in their places.
    #[inline(always)]
    pub fn place<R: Real>(&self, parameters: Parameters<R>) -> Body<R> {
        let mut pose: Vec<R::Wide> = parameters.pose.iter().map(|&x| x.widen()).collect();
        if parameters.form == Form::AxisAngle {
            for (x, &mean) in pose.iter_mut().zip(self.pose_mean.as_flattened()) {
                *x = *x + R::Wide::of(mean);
            }
        }
        let local: Vec<_> = pose.chunks_exact(parameters.form.width()).map(|x| parameters.form.forward(x)).collect();
        let mut rest_joints: Vec<Vec3<R::Wide>> = self.joints.iter().map(|&joint| of(joint)).collect();
        self.betas.move_joints(&parameters.betas, &mut rest_joints);
        self.expression.move_joints(&parameters.expression, &mut rest_joints);
        let chain = self.skeleton.forward(&local, &rest_joints);

        let mut poison = R::Wide::zero();
        let amounts = parameters.betas.iter().chain(&parameters.expression).chain(&parameters.transl);
        for &amount in amounts {
            poison = poison + amount.widen() * R::Wide::zero();
        }
        let mut transforms = Vec::with_capacity(self.num_joints());
        for (j, turned) in chain.turned.iter().enumerate() {
            let offset = sub(chain.joints[j], apply(turned, rest_joints[j]));
            for row in 0..3 {
                let sum = turned[row][0] + turned[row][1] + turned[row][2] + offset[row];
                poison = poison + sum * R::Wide::zero();
            }
            transforms.push(std::array::from_fn(|row| {
                let [x, y, z] = turned[row];
                [x, y, z, offset[row]].map(R::narrow)
            }));
        }
        let features = if self.pose.count() == 0 { Vec::new() } else { features(&local) };
        let shift = parameters.transl.map(|x| x + R::narrow(poison));
        Body { parameters, pose, local, rest_joints, chain, transforms, features, shift }
    }

    /// The resting vertices of one tile.
    #[inline(always)]
    fn rest<R: Real>(&self, start: Start<C, W>, tile: usize, body: &Body<R>) -> Tile<R, W> {
        // Displacements are summed by themselves: beside the template's metres each addition would round.
        let mut rest = constants(&start.tiles[tile]);
        if !start.shaped {
            let Parameters { betas, expression, .. } = &body.parameters;
            rest = plus(rest, self.shape(tile, betas, expression));
        }
        if !body.features.is_empty() {
            let mut displacement = [[R::zero(); W]; 3];
            self.pose.forward(tile, &body.features, &mut displacement);
            rest = plus(rest, displacement);
        }
        rest
    }

    /// The displacements of one tile by the shape.
    #[inline(always)]
    fn shape<R: Real>(&self, tile: usize, betas: &[R], expression: &[R]) -> Tile<R, W> {
        let mut displacement = [[R::zero(); W]; 3];
        self.betas.surface.forward(tile, betas, &mut displacement);
        self.expression.surface.forward(tile, expression, &mut displacement);
        displacement
    }

    /// The posed vertices of one tile.
    #[inline(always)]
    pub fn forward<R: Real>(&self, start: Start<C, W>, tile: usize, body: &Body<R>) -> Tile<R, W> {
        let rest = self.rest(start, tile, body);
        let mut posed = self.weights.forward(tile, &body.transforms, &rest);
        for axis in 0..3 {
            for i in 0..W {
                posed[axis][i] = posed[axis][i] + body.shift[axis];
            }
        }
        posed
    }

    /// Empty sums for the gradient of one body.
    pub fn sums<R: Real>(&self, wanted: Wanted) -> Sums<R, W> {
        let none = [R::zero(); W];
        Sums {
            transforms: vec![[[none; 4]; 3]; self.num_joints()],
            betas: vec![none; wanted.betas],
            expression: vec![none; wanted.expression],
            features: vec![none; if wanted.pose { self.pose.count() } else { 0 }],
            transl: [[R::Wide::zero(); W]; 3],
        }
    }

    /// Adds the share of one tile, whose vertices have the gradient `d`.
    #[inline(always)]
    pub fn backward<R: Real>(
        &self,
        start: Start<C, W>,
        tile: usize,
        body: &Body<R>,
        d: &Tile<R, W>,
        sums: &mut Sums<R, W>,
    ) {
        let rest = self.rest(start, tile, body);
        self.weights.backward(tile, &rest, d, &mut sums.transforms);
        for axis in 0..3 {
            for i in 0..W {
                d[axis][i].add_to(&mut sums.transl[axis][i]);
            }
        }
        if sums.betas.len() + sums.expression.len() + sums.features.len() > 0 {
            let d_rest = self.weights.backward_rest(tile, &body.transforms, d);
            self.betas.surface.backward(tile, &d_rest, &mut sums.betas);
            self.expression.surface.backward(tile, &d_rest, &mut sums.expression);
            self.pose.backward(tile, &d_rest, &mut sums.features);
        }
    }

    /// From the sums over all tiles, and the gradient `d_joints` (J, 3) by the posed joints, to the parameters.
    #[inline(always)]
    pub fn gradient<R: Real>(&self, body: &Body<R>, sums: &Sums<R, W>, d_joints: &[R]) -> Gradient<R> {
        let mut transl = sums.transl.map(total::<R::Wide, W>);
        let mut d_turned = Vec::with_capacity(self.num_joints());
        let mut d_offsets = Vec::with_capacity(self.num_joints());
        for transform in &sums.transforms {
            let rows = transform.map(|row| row.map(total));
            d_turned.push(rows.map(|[x, y, z, _]| [x, y, z]));
            d_offsets.push(rows.map(|row| row[3]));
        }
        // offset = joint − turned · rest joint
        let mut d_posed = d_offsets.clone();
        for (joint, d) in d_posed.iter_mut().zip(d_joints.as_chunks::<3>().0) {
            let d = widen(*d);
            *joint = add(*joint, d);
            transl = add(transl, d);
        }
        for (j, &d_offset) in d_offsets.iter().enumerate() {
            add_outer(&mut d_turned[j], d_offset.map(|x| -x), body.rest_joints[j]);
        }
        let mut d_chain = self.skeleton.backward(&body.local, &body.rest_joints, &body.chain, d_turned, d_posed);
        for (j, &d_offset) in d_offsets.iter().enumerate() {
            let pulled = apply_transposed(&body.chain.turned[j], d_offset);
            d_chain.rest_joints[j] = sub(d_chain.rest_joints[j], pulled);
        }
        for (feature, sum) in sums.features.iter().enumerate() {
            let entry = &mut d_chain.local[1 + feature / 9][feature % 9 / 3][feature % 3];
            *entry = *entry + total(*sum);
        }

        let form = body.parameters.form;
        let mut d_pose = vec![R::Wide::zero(); body.pose.len()];
        for (j, d_local) in d_chain.local.iter().enumerate() {
            let range = j * form.width()..(j + 1) * form.width();
            form.backward(&body.pose[range.clone()], d_local, &mut d_pose[range]);
        }
        Gradient {
            pose: d_pose.into_iter().map(R::narrow).collect(),
            betas: self.betas.gradient(&sums.betas, &d_chain.rest_joints),
            expression: self.expression.gradient(&sums.expression, &d_chain.rest_joints),
            transl: narrow(transl),
        }
    }
}

impl<R: Real> Body<R> {
    /// The posed joints (J, 3).
    #[inline(always)]
    pub fn joints(&self) -> impl Iterator<Item = Vec3<R>> {
        self.chain.joints.iter().map(|&joint| add(narrow(joint), self.shift))
    }
}

impl<C: Scalar, const W: usize> Directions<C, W> {
    #[inline(always)]
    fn move_joints<R: Real>(&self, amounts: &[R], joints: &mut [Vec3<R::Wide>]) {
        for (k, amount) in amounts.iter().enumerate() {
            for (j, joint) in joints.iter_mut().enumerate() {
                add_scaled(joint, amount.widen(), self.joint(j, k));
            }
        }
    }

    #[inline(always)]
    fn gradient<R: Real>(&self, sums: &[[R; W]], d_joints: &[Vec3<R::Wide>]) -> Vec<R> {
        let mut d_amounts = Vec::with_capacity(sums.len());
        for (k, &sum) in sums.iter().enumerate() {
            let mut d = total(sum);
            for (j, d_joint) in d_joints.iter().enumerate() {
                let direction = self.joint::<R::Wide>(j, k);
                for axis in 0..3 {
                    d = d + direction[axis] * d_joint[axis];
                }
            }
            d_amounts.push(R::narrow(d));
        }
        d_amounts
    }

    #[inline(always)]
    fn joint<R: Real>(&self, joint: usize, k: usize) -> Vec3<R> {
        let len = self.surface.count();
        std::array::from_fn(|axis| R::of(self.joints[(3 * joint + axis) * len + k]))
    }
}

/// What the pose blend shapes are multiplied with: R − I of every joint but the root, row by row.
#[inline(always)]
fn features<R: Real>(local: &[Mat3<R::Wide>]) -> Vec<R> {
    let mut features = Vec::with_capacity(9 * local.len());
    for matrix in &local[1..] {
        for row in 0..3 {
            for column in 0..3 {
                features.push(R::narrow(matrix[row][column] - R::Wide::of((row == column) as i32 as f64)));
            }
        }
    }
    features
}

#[inline(always)]
fn constants<R: Real, C: Scalar, const W: usize>(tile: &Tile<C, W>) -> Tile<R, W> {
    let mut numbers = [[R::zero(); W]; 3];
    for axis in 0..3 {
        for i in 0..W {
            numbers[axis][i] = R::of(tile[axis][i].value());
        }
    }
    numbers
}

#[inline(always)]
fn plus<R: Real, const W: usize>(mut a: Tile<R, W>, b: Tile<R, W>) -> Tile<R, W> {
    for axis in 0..3 {
        for i in 0..W {
            a[axis][i] = a[axis][i] + b[axis][i];
        }
    }
    a
}

#[inline(always)]
fn total<R: Real, const W: usize>(sums: [R; W]) -> R::Wide {
    let mut sum = R::Wide::zero();
    for part in sums {
        part.add_to(&mut sum);
    }
    sum
}
