//! From the gradient by the posed vertices and joints to that by the parameters.

use super::blend::{Registers, plus};
use super::matrix::{add_outer, apply_transposed};
use super::{Block, Body, Directions, Gradient, Rigid, Skin, Start, Sums, Totals, VertexGradient, Wanted, Wide};
use crate::number::vector::{Vec3, add, narrow, sub, widen};
use crate::number::{Real, Scalar};

impl<C: Scalar, const W: usize> Skin<C, W> {
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

    /// Adds the contribution of up to T tiles from `first` on; `upstream` gives ∂loss/∂vertices of a body's tile.
    #[inline(always)]
    pub fn backward<V: Real, const P: usize, const N: usize, const T: usize>(
        &self,
        start: Start<C, W>,
        first: usize,
        block: &Block<V::Scalar, N>,
        upstream: &impl VertexGradient<V, P>,
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

impl<C: Scalar, const W: usize> Directions<C, W> {
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

/// The sum of W numbers, in the same order for registers of any size.
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
