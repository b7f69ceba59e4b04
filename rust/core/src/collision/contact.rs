//! The cost of a body's contact with itself: vertices inside another part are pushed out, nearby ones are pulled closer
//! (Müller et al., *On Self-Contact and Human Pose*, CVPR 2021).

use super::nearest::Nearest;
use crate::error::{Error, Result};
use crate::number::vector::{Vec3, add_scaled};

/// A vertex that is inside opposite surface, or near it.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    pub vertex: u32,
    pub inside: bool,
    pub nearest: Nearest,
}

/// push = ½ Σ tanh²(d / push_width) over the vertices inside, pull = ½ pull_weight Σ tanh²(d / pull_width) over those
/// outside that are less than `near` away; d the distance to the nearest opposite point. Metres.
#[derive(Clone, Copy, Debug)]
pub struct SelfContact {
    pub push_width: f64,
    pub pull_width: f64,
    pub pull_weight: f64,
    pub near: f64,
}

impl SelfContact {
    pub fn new([push_width, pull_width, pull_weight, near]: [f64; 4]) -> Result<Self> {
        let named = [("push_width", push_width), ("pull_width", pull_width)];
        if let Some((name, got)) = named.into_iter().find(|(_, width)| !(*width > 0.0 && width.is_finite())) {
            return Err(Error::Argument { name, expected: "positive metres".into(), got: got.to_string() });
        }
        let named = [("pull_weight", pull_weight), ("near", near)];
        if let Some((name, got)) = named.into_iter().find(|(_, number)| !(*number >= 0.0 && number.is_finite())) {
            return Err(Error::Argument { name, expected: "zero or more".into(), got: got.to_string() });
        }
        Ok(SelfContact { push_width, pull_width, pull_weight, near })
    }

    /// [push, pull]; adds their gradients by the vertices. The nearest point is held fixed on its face: sliding does
    /// not change the distance to first order.
    pub fn cost(&self, touches: &[Touch], faces: &[[u32; 3]], gradients: [&mut [Vec3<f64>]; 2]) -> [f64; 2] {
        let mut costs = [0.0; 2];
        for touch in touches {
            let (kind, weight, width) =
                if touch.inside { (0, 1.0, self.push_width) } else { (1, self.pull_weight, self.pull_width) };
            let (distance, offset) = (touch.nearest.squared_distance.sqrt(), touch.nearest.offset);
            let tanh = (distance / width).tanh();
            costs[kind] += 0.5 * weight * tanh * tanh;
            if distance > 0.0 {
                let factor = weight * tanh * (1.0 - tanh * tanh) / (width * distance);
                add_scaled(&mut gradients[kind][touch.vertex as usize], factor, offset);
                for (&corner, share) in faces[touch.nearest.face].iter().zip(touch.nearest.weights) {
                    add_scaled(&mut gradients[kind][corner as usize], -factor * share, offset);
                }
            }
        }
        costs
    }
}
