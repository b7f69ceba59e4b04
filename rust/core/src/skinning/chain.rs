//! The kinematic chain: from rotations relative to the parent to each joint's place in the world.

use super::matrix::{Mat3, accumulate, add_outer, apply, apply_transposed, times, times_transposed, transposed_times};
use crate::error::{Error, Result};
use crate::number::Real;
use crate::number::vector::{Vec3, add, sub, zero};

/// The joints' parents, and the rest pose of the mesh.
pub struct Skeleton {
    /// A parent comes before its children.
    parents: Vec<Option<usize>>,
    /// World rotation of each joint from the resting mesh to the zero pose.
    rest_rotation: Vec<Mat3<f64>>,
}

/// The posed chain.
pub struct Chain<R> {
    pub world: Vec<Mat3<R>>,
    /// Rotates a resting bone to the world: world · rest_rotation.
    pub turned: Vec<Mat3<R>>,
    pub joints: Vec<Vec3<R>>,
}

/// The gradient by the local rotations and the resting joints.
pub struct ChainGradient<R> {
    pub local: Vec<Mat3<R>>,
    pub rest_joints: Vec<Vec3<R>>,
}

impl Skeleton {
    pub fn new(parents: &[i64], rest_rotation: Vec<Mat3<f64>>) -> Result<Self> {
        let checked = |(joint, &parent): (usize, &i64)| match usize::try_from(parent) {
            Ok(parent) if parent < joint => Ok(Some(parent)),
            Err(_) => Ok(None),
            Ok(_) => Err(Error::Argument {
                name: "parents",
                expected: "every parent before its children, −1 at a root".into(),
                got: format!("parent {parent} of joint {joint}"),
            }),
        };
        Ok(Skeleton { parents: parents.iter().enumerate().map(checked).collect::<Result<_>>()?, rest_rotation })
    }

    pub fn num_joints(&self) -> usize {
        self.parents.len()
    }

    pub fn parent(&self, joint: usize) -> Option<usize> {
        self.parents[joint]
    }

    /// Whether `other` is the joint or one of its descendants.
    pub fn carries(&self, joint: usize, other: usize) -> bool {
        let mut carrier = Some(other);
        while carrier.is_some_and(|carrier| carrier > joint) {
            carrier = carrier.and_then(|carrier| self.parents[carrier]);
        }
        carrier == Some(joint)
    }

    #[inline(always)]
    pub fn forward<R: Real>(&self, local: &[Mat3<R>], rest_joints: &[Vec3<R>]) -> Chain<R> {
        let count = self.num_joints();
        let mut chain = Chain {
            world: Vec::with_capacity(count),
            turned: Vec::with_capacity(count),
            joints: Vec::with_capacity(count),
        };
        for (j, parent) in self.parents.iter().enumerate() {
            let (world, joint) = match *parent {
                None => (local[j], rest_joints[j]),
                Some(p) => {
                    let bone = sub(rest_joints[j], rest_joints[p]);
                    (times(&chain.world[p], &local[j]), add(chain.joints[p], apply(&chain.turned[p], bone)))
                }
            };
            chain.turned.push(times(&world, &self.rest(j)));
            chain.world.push(world);
            chain.joints.push(joint);
        }
        chain
    }

    /// From the gradient by the turned rotations and the posed joints.
    #[inline(always)]
    pub fn backward<R: Real>(
        &self,
        local: &[Mat3<R>],
        rest_joints: &[Vec3<R>],
        chain: &Chain<R>,
        mut d_turned: Vec<Mat3<R>>,
        mut d_joints: Vec<Vec3<R>>,
    ) -> ChainGradient<R> {
        let mut d_world = vec![[zero(); 3]; self.num_joints()];
        let mut d_local = vec![[zero(); 3]; self.num_joints()];
        let mut d_rest_joints = vec![zero(); self.num_joints()];
        for (j, parent) in self.parents.iter().enumerate().rev() {
            accumulate(&mut d_world[j], &times_transposed(&d_turned[j], &self.rest(j)));
            let Some(p) = *parent else {
                d_local[j] = d_world[j];
                d_rest_joints[j] = add(d_rest_joints[j], d_joints[j]);
                continue;
            };
            let d_joint = d_joints[j];
            let bone = sub(rest_joints[j], rest_joints[p]);
            d_joints[p] = add(d_joints[p], d_joint);
            add_outer(&mut d_turned[p], d_joint, bone);
            let d_bone = apply_transposed(&chain.turned[p], d_joint);
            d_rest_joints[j] = add(d_rest_joints[j], d_bone);
            d_rest_joints[p] = sub(d_rest_joints[p], d_bone);
            let d_world_j = d_world[j];
            accumulate(&mut d_world[p], &times_transposed(&d_world_j, &local[j]));
            d_local[j] = transposed_times(&chain.world[p], &d_world_j);
        }
        ChainGradient { local: d_local, rest_joints: d_rest_joints }
    }

    #[inline(always)]
    fn rest<R: Real>(&self, joint: usize) -> Mat3<R> {
        self.rest_rotation[joint].map(|row| row.map(R::of))
    }
}
