//! Placing one body's joints: rotations, shape, kinematic chain.

use super::matrix::{Mat3, apply};
use super::rotation::Form;
use super::{Body, Directions, Parameters, Skin};
use crate::number::vector::{Vec3, add, add_scaled, narrow, of, sub};
use crate::number::{Real, Scalar};

impl<C: Scalar, const W: usize> Skin<C, W> {
    /// Places the joints of one body.
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
