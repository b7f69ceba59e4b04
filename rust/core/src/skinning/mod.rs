//! Linear blend skinning (Loper et al., *SMPL*, 2015), forward and backward.
//!
//! rest   = template + Σ betas · shapes + Σ expression · expressions + Σ (R − I) · pose blend shapes
//! vertex = Σ_j w_j (turned_j · rest + offset_j) + translation
//!
//! Rotations and the chain run in double precision, which costs little; the vertices run in the data's precision. Sums
//! have one order, whatever the batch.

pub mod blend;
pub mod chain;
mod jacobian;
mod matrix;
mod model;
pub mod rotation;
pub mod weights;

use crate::error::Result;
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, narrow, of, sub, widen};
use crate::number::{Real, Scalar};
use blend::{Blend, Registers, Tile, all, load, tiles};
use chain::{Chain, Skeleton};
use matrix::{Mat3, add_outer, apply, apply_transposed};
pub use model::Model;
use rotation::Form;
use weights::{Transform, Weights};

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

/// N bodies that move their vertices together, so that the directions are read once for all of them.
pub struct Block<'a, R: Real, const N: usize> {
    pub bodies: &'a [Body<R>; N],
    betas: Vec<[R; N]>,
    expression: Vec<[R; N]>,
    features: Vec<[R; N]>,
}

/// The gradient of N bodies, gathered tile by tile; as many sums each as a tile has vertices.
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

/// Tells the gradient by a body's vertices in a tile.
pub trait Pulls<V, const P: usize> {
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

    /// The resting tiles of one shape, for bodies that all have it.
    #[inline(always)]
    pub fn shaped<V: Real<Data = C>, const P: usize>(
        &self,
        betas: &[V::Scalar],
        expression: &[V::Scalar],
    ) -> Vec<Tile<C, W>> {
        let (betas, expression) = (betas.as_chunks::<1>().0, expression.as_chunks::<1>().0);
        let mut shaped = memory::copied(&self.template);
        for (tile, points) in shaped.iter_mut().enumerate() {
            let [displacement]: [Registers<V, P>; 1] = self.shape(tile, betas, expression);
            let rest = plus(constants(points), displacement);
            for axis in 0..3 {
                for i in 0..W {
                    points[axis].0[i] = rest[axis][i / V::LANES].lane(i % V::LANES).data();
                }
            }
        }
        shaped
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
    fn rest<V: Real, const P: usize, const N: usize>(
        &self,
        start: Start<C, W>,
        tile: usize,
        block: &Block<V::Scalar, N>,
    ) -> [Registers<V, P>; N] {
        // Displacements are summed by themselves: beside the template's metres each addition would round.
        let mut rest = [constants(&start.tiles[tile]); N];
        if !start.shaped {
            let displacements = self.shape(tile, &block.betas, &block.expression);
            for body in 0..N {
                rest[body] = plus(rest[body], displacements[body]);
            }
        }
        if !block.features.is_empty() {
            let mut displacements = [[[V::zero(); P]; 3]; N];
            self.pose.forward(tile, &block.features, &mut displacements);
            for body in 0..N {
                rest[body] = plus(rest[body], displacements[body]);
            }
        }
        rest
    }

    /// The displacements of one tile by the shape.
    #[inline(always)]
    fn shape<V: Real, const P: usize, const N: usize>(
        &self,
        tile: usize,
        betas: &[[V::Scalar; N]],
        expression: &[[V::Scalar; N]],
    ) -> [Registers<V, P>; N] {
        let mut displacements = [[[V::zero(); P]; 3]; N];
        self.betas.surface.forward(tile, betas, &mut displacements);
        self.expression.surface.forward(tile, expression, &mut displacements);
        displacements
    }

    /// The posed vertices of one tile.
    #[inline(always)]
    pub fn forward<V: Real, const P: usize, const N: usize>(
        &self,
        start: Start<C, W>,
        tile: usize,
        block: &Block<V::Scalar, N>,
    ) -> [Registers<V, P>; N] {
        let mut tiles = self.rest(start, tile, block);
        for i in 0..N {
            let body = &block.bodies[i];
            tiles[i] = self.weights.forward(tile, &body.transforms, &tiles[i]);
            for axis in 0..3 {
                for part in 0..P {
                    tiles[i][axis][part] = tiles[i][axis][part] + all(body.shift[axis]);
                }
            }
        }
        tiles
    }

    /// Empty sums for the gradient of N bodies.
    pub fn sums<V: Real, const P: usize, const N: usize>(&self, wanted: Wanted) -> Sums<V, P, N> {
        let none = [V::zero(); P];
        let rigid = || Rigid { transforms: vec![[[none; 4]; 3]; self.num_joints()], transl: [Wide::<V>::zero(); 3] };
        Sums {
            betas: vec![[none; N]; wanted.betas],
            expression: vec![[none; N]; wanted.expression],
            features: vec![[none; N]; if wanted.pose { self.pose.count() } else { 0 }],
            rigid: (0..N).map(|_| rigid()).collect(),
        }
    }

    /// Adds the share of the tiles from the first on, up to T; `upstream` tells the gradient by a body's vertices in a
    /// tile.
    #[inline(always)]
    pub fn backward<V: Real, const P: usize, const N: usize, const T: usize>(
        &self,
        start: Start<C, W>,
        first: usize,
        block: &Block<V::Scalar, N>,
        upstream: &impl Pulls<V, P>,
        sums: &mut Sums<V, P, N>,
    ) {
        let blends = sums.betas.len() + sums.expression.len() + sums.features.len() > 0;
        let count = T.min(self.num_tiles() - first);
        let mut d_rest = [[[[V::zero(); P]; 3]; N]; T];
        let mut d_transl = [[[V::zero(); P]; 3]; N];
        for (tile, d_rest) in d_rest[..count].iter_mut().enumerate() {
            let tile = first + tile;
            let rest: [Registers<V, P>; N] = self.rest(start, tile, block);
            for i in 0..N {
                let (d, rigid, transforms) = (upstream.of(i, tile), &mut sums.rigid[i], &block.bodies[i].transforms);
                self.weights.backward(tile, &rest[i], &d, &mut rigid.transforms);
                d_transl[i] = plus(d_transl[i], d);
                if blends {
                    d_rest[i] = self.weights.backward_rest(tile, transforms, &d);
                }
            }
        }
        for (rigid, d_transl) in sums.rigid.iter_mut().zip(&d_transl) {
            for axis in 0..3 {
                rigid.transl[axis] = rigid.transl[axis] + fold::<_, W>(spread(&d_transl[axis]));
            }
        }
        self.betas.surface.backward(first, &d_rest[..count], &mut sums.betas);
        self.expression.surface.backward(first, &d_rest[..count], &mut sums.expression);
        self.pose.backward(first, &d_rest[..count], &mut sums.features);
    }

    /// The sums over all tiles of one of the bodies.
    #[inline(always)]
    pub fn totals<V: Real, const P: usize, const N: usize>(
        &self,
        sums: &Sums<V, P, N>,
        body: usize,
    ) -> Totals<V::Scalar> {
        let Rigid { transforms, transl } = &sums.rigid[body];
        let mut totals = Totals {
            transforms: Vec::with_capacity(transforms.len()),
            betas: Vec::with_capacity(sums.betas.len()),
            expression: Vec::with_capacity(sums.expression.len()),
            features: Vec::with_capacity(sums.features.len()),
            transl: *transl,
        };
        for transform in transforms {
            let mut total = [[Wide::<V>::zero(); 4]; 3];
            for row in 0..3 {
                for column in 0..4 {
                    total[row][column] = fold::<_, W>(spread(&transform[row][column]));
                }
            }
            totals.transforms.push(total);
        }
        for (totals, sums) in [
            (&mut totals.betas, &sums.betas),
            (&mut totals.expression, &sums.expression),
            (&mut totals.features, &sums.features),
        ] {
            for sums in sums {
                totals.push(fold::<_, W>(spread(&sums[body])));
            }
        }
        totals
    }

    /// From the totals, and the gradient `d_joints` (J, 3) by the posed joints, to the parameters.
    #[inline(always)]
    pub fn gradient<R: Real>(&self, body: &Body<R>, totals: &Totals<R>, d_joints: &[R]) -> Gradient<R> {
        let mut transl = totals.transl;
        let mut d_turned = Vec::with_capacity(self.num_joints());
        let mut d_offsets = Vec::with_capacity(self.num_joints());
        for rows in &totals.transforms {
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
        for (feature, &total) in totals.features.iter().enumerate() {
            let entry = &mut d_chain.local[1 + feature / 9][feature % 9 / 3][feature % 3];
            *entry = *entry + total;
        }

        let form = body.parameters.form;
        let mut d_pose = vec![R::Wide::zero(); body.pose.len()];
        for (j, d_local) in d_chain.local.iter().enumerate() {
            let range = j * form.width()..(j + 1) * form.width();
            form.backward(&body.pose[range.clone()], d_local, &mut d_pose[range]);
        }
        Gradient {
            pose: d_pose.into_iter().map(R::narrow).collect(),
            betas: self.betas.gradient(&totals.betas, &d_chain.rest_joints),
            expression: self.expression.gradient(&totals.expression, &d_chain.rest_joints),
            transl: narrow(transl),
        }
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
    fn gradient<R: Real>(&self, totals: &[R::Wide], d_joints: &[Vec3<R::Wide>]) -> Vec<R> {
        let mut d_amounts = Vec::with_capacity(totals.len());
        for (k, &total) in totals.iter().enumerate() {
            let mut d = total;
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
fn constants<V: Real, C: Scalar, const W: usize, const P: usize>(tile: &Tile<C, W>) -> Registers<V, P> {
    let mut numbers = [[V::zero(); P]; 3];
    for axis in 0..3 {
        for part in 0..P {
            numbers[axis][part] = load(&tile[axis], part);
        }
    }
    numbers
}

#[inline(always)]
fn plus<V: Real, const P: usize>(mut a: Registers<V, P>, b: Registers<V, P>) -> Registers<V, P> {
    for axis in 0..3 {
        for part in 0..P {
            a[axis][part] = a[axis][part] + b[axis][part];
        }
    }
    a
}

/// The lanes of P registers in double precision.
#[inline(always)]
fn spread<V: Real, const P: usize, const W: usize>(registers: &[V; P]) -> [Wide<V>; W] {
    let mut numbers = [Wide::<V>::zero(); W];
    for (number, i) in numbers.iter_mut().zip(0..) {
        *number = registers[i / V::LANES].lane(i % V::LANES).widen();
    }
    numbers
}

/// Their sum, in the same order for registers of any size.
#[inline(always)]
fn fold<R: Real, const W: usize>(mut numbers: [R; W]) -> R {
    let mut half = W / 2;
    while half > 0 {
        for i in 0..half {
            numbers[i] = numbers[i] + numbers[i + half];
        }
        half /= 2;
    }
    numbers[0]
}
