//! The Jacobian of all vertices and joints by pose and shape, for bodies reduced to the few points that a fit uses.
//!
//! A small rotation φ of joint j about its position c_j moves its descendants:
//!
//! ```text
//! δ vertex = φ × Σ_i w_i (y_i − c_j) over the joints i that j carries, y_i = turned_i · rest + offset_i
//! δ joint  = φ × (c − c_j)
//! ```
//!
//! and φ = (world rotation of j's parent) · vee(dR Rᵀ) for a change dR of j's own rotation R. Double precision.

use super::matrix::{Mat3, apply};
use super::rotation::Form;
use super::{Body, Skin};
use crate::memory;
use crate::number::vector::{Vec3, add, add_scaled, cross, scale, sub, zero};
use crate::number::{Dual, Scalar};

/// A vertex, as needed for its derivatives.
struct Held {
    /// Σ w turned
    turned: Mat3<f64>,
    /// Σ w y and Σ w over what each joint carries.
    carried: Vec<(Vec3<f64>, f64)>,
    weights: Vec<(usize, f64)>,
}

impl<C: Scalar, const W: usize> Skin<C, W> {
    /// (P, V + J) derivatives, P = 3 J + the number of betas: by the rotation vectors, then by the betas. That by the
    /// translation is the identity for every point. The rotations must be vectors.
    pub fn jacobian(&self, body: &Body<f64>) -> Vec<Vec3<f64>> {
        let (points, joints) = (self.num_vertices + self.num_joints(), self.num_joints());
        // Checked once, because the vertices' sums are allocated in small pieces.
        memory::ask(self.num_vertices * joints * size_of::<(Vec3<f64>, f64)>());
        let vertices = memory::collect((0..self.num_vertices).map(|vertex| self.held(vertex, body)));
        let mut rows = memory::with_capacity((3 * joints + body.parameters.betas.len()) * points);
        for joint in 0..self.num_joints() {
            for axis in 0..3 {
                self.by_rotation(body, &vertices, joint, axis, &mut rows);
            }
        }
        for k in 0..body.parameters.betas.len() {
            self.by_shape(body, &vertices, k, &mut rows);
        }
        rows
    }

    fn held(&self, vertex: usize, body: &Body<f64>) -> Held {
        let (tile, place) = (vertex / W, vertex % W);
        let mut rest = std::array::from_fn(|axis| self.template[tile][axis].0[place].value());
        for (directions, amounts) in
            [(&self.betas, &body.parameters.betas), (&self.expression, &body.parameters.expression)]
        {
            for (k, &amount) in amounts.iter().enumerate() {
                add_scaled(&mut rest, amount, directions.surface.direction(vertex, k));
            }
        }
        for (k, &feature) in body.features.iter().enumerate() {
            add_scaled(&mut rest, feature, self.pose.direction(vertex, k));
        }
        let weights: Vec<_> = self.weights.of_vertex(vertex).collect();
        let mut held = Held { turned: [zero(); 3], carried: vec![(zero(), 0.0); self.num_joints()], weights };
        for &(joint, weight) in &held.weights {
            let turned = &body.chain.turned[joint];
            let offset = sub(body.chain.joints[joint], apply(turned, body.rest_joints[joint]));
            let place = scale(weight, add(apply(turned, rest), offset));
            for row in 0..3 {
                add_scaled(&mut held.turned[row], weight, turned[row]);
            }
            let mut carrier = Some(joint);
            while let Some(j) = carrier {
                held.carried[j] = (add(held.carried[j].0, place), held.carried[j].1 + weight);
                carrier = self.skeleton.parent(j);
            }
        }
        held
    }

    /// The derivatives by one number of a joint's rotation vector.
    fn by_rotation(&self, body: &Body<f64>, vertices: &[Held], joint: usize, axis: usize, rows: &mut Vec<Vec3<f64>>) {
        let number = |k: usize| Dual::new(body.pose[3 * joint + k], (k == axis) as i32 as f64);
        let slope = Form::AxisAngle.forward(&[number(0), number(1), number(2)]).map(|row| row.map(|x| x.slope));
        let local = &body.local[joint];
        let spin = |row: usize, column: usize| (0..3).map(|k| slope[row][k] * local[column][k]).sum::<f64>();
        let own = [spin(2, 1), spin(0, 2), spin(1, 0)];
        let turn = self.skeleton.parent(joint).map_or(own, |parent| apply(&body.chain.world[parent], own));
        let centre = body.chain.joints[joint];
        for (vertex, held) in vertices.iter().enumerate() {
            let (place, weight) = held.carried[joint];
            let mut moved = cross(turn, sub(place, scale(weight, centre)));
            if joint > 0 && self.pose.count() > 0 {
                let mut rest = zero();
                for k in 0..9 {
                    add_scaled(&mut rest, slope[k / 3][k % 3], self.pose.direction(vertex, 9 * (joint - 1) + k));
                }
                moved = add(moved, apply(&held.turned, rest));
            }
            rows.push(moved);
        }
        for other in 0..self.num_joints() {
            let carried = other != joint && self.skeleton.carries(joint, other);
            rows.push(if carried { cross(turn, sub(body.chain.joints[other], centre)) } else { zero() });
        }
    }

    /// The derivatives by one beta.
    fn by_shape(&self, body: &Body<f64>, vertices: &[Held], k: usize, rows: &mut Vec<Vec3<f64>>) {
        let rest: Vec<Vec3<f64>> = (0..self.num_joints()).map(|joint| self.betas.joint(joint, k)).collect();
        let mut joints: Vec<Vec3<f64>> = Vec::with_capacity(rest.len());
        for joint in 0..rest.len() {
            joints.push(match self.skeleton.parent(joint) {
                None => rest[joint],
                Some(p) => add(joints[p], apply(&body.chain.turned[p], sub(rest[joint], rest[p]))),
            });
        }
        for (vertex, held) in vertices.iter().enumerate() {
            let mut moved = apply(&held.turned, self.betas.surface.direction(vertex, k));
            for &(joint, weight) in &held.weights {
                add_scaled(&mut moved, weight, sub(joints[joint], apply(&body.chain.turned[joint], rest[joint])));
            }
            rows.push(moved);
        }
        rows.extend(joints);
    }
}
