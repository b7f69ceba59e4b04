//! The ground: a plane with unit normal n at a height along n. h(u) = n·u − height, g(u) = u − h(u) n.

use crate::error::{Error, Result};
use crate::number::Real;
use crate::number::vector::{Vec3, add, add_scaled, cross, dot, scale, sub};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground<R> {
    /// Unit length, pointing up from the ground.
    pub normal: Vec3<R>,
    /// Metres along the normal.
    pub height: R,
}

impl Ground<f64> {
    /// The plane through `height`·n. Any non-zero `normal` will do: it is normalised.
    pub fn new(normal: Vec3<f64>, height: f64) -> Result<Self> {
        // Scaled first, so that the squares of tiny or huge normals neither underflow nor overflow.
        let largest = normal.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if !(largest > 0.0 && normal.iter().all(|x| x.is_finite())) {
            return Err(Error::GroundNormal { body: 0 });
        }
        if !height.is_finite() {
            return Err(Error::Argument {
                name: "height",
                expected: "a finite number".into(),
                got: height.to_string(),
            });
        }
        let scaled = scale(1.0 / largest, normal);
        Ok(Ground { normal: scale(1.0 / dot(scaled, scaled).sqrt(), scaled), height })
    }

    pub fn y_up(height: f64) -> Self {
        Ground { normal: [0.0, 1.0, 0.0], height }
    }

    pub fn z_up(height: f64) -> Self {
        Ground { normal: [0.0, 0.0, 1.0], height }
    }

    /// The same plane in coordinates with origin `origin`.
    pub fn seen_from(&self, origin: Vec3<f64>) -> Self {
        Ground { normal: self.normal, height: self.height - dot(self.normal, origin) }
    }

    /// Two unit vectors in the plane; (e1, e2, n) is right-handed. e1 lies along x unless the normal does.
    pub fn axes(&self) -> [Vec3<f64>; 2] {
        let n = self.normal;
        let along = if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let e1 = sub(along, scale(dot(along, n), n));
        let e1 = scale(1.0 / dot(e1, e1).sqrt(), e1);
        [e1, cross(n, e1)]
    }
}

impl<R: Real> Ground<R> {
    /// h(u), metres above the ground.
    #[inline(always)]
    pub fn signed_height(&self, point: Vec3<R>) -> R {
        dot(self.normal, point) - self.height
    }

    /// g(u), the point's foot on the ground.
    #[inline(always)]
    pub fn project(&self, point: Vec3<R>) -> Vec3<R> {
        let mut foot = point;
        add_scaled(&mut foot, -self.signed_height(point), self.normal);
        foot
    }

    /// The part of a vector that lies in the plane.
    #[inline(always)]
    pub fn along(&self, vector: Vec3<R>) -> Vec3<R> {
        sub(vector, scale(dot(self.normal, vector), self.normal))
    }
}

/// Coordinates within the plane: x = (e1·u, e2·u).
#[derive(Clone, Copy)]
pub struct Plane<R> {
    pub axes: [Vec3<R>; 2],
}

impl<R: Real> Plane<R> {
    #[inline(always)]
    pub fn flatten(&self, point: Vec3<R>) -> [R; 2] {
        [dot(self.axes[0], point), dot(self.axes[1], point)]
    }

    /// The vector in space whose plane coordinates are `flat`: also the adjoint of [`Plane::flatten`].
    #[inline(always)]
    pub fn raise(&self, flat: [R; 2]) -> Vec3<R> {
        add(scale(flat[0], self.axes[0]), scale(flat[1], self.axes[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_is_normalised_and_axes_are_right_handed() {
        for normal in [[0.0, 3.0, 0.0], [1e-200, 2e-200, -1e-200], [0.99, 0.1, -0.1], [-1e200, 0.0, 0.0]] {
            let ground = Ground::new(normal, 0.3).unwrap();
            let [e1, e2] = ground.axes();
            assert!((dot(ground.normal, ground.normal) - 1.0).abs() < 1e-15);
            assert!(dot(e1, ground.normal).abs() < 1e-15);
            let back = cross(e1, e2);
            assert!((0..3).all(|k| (back[k] - ground.normal[k]).abs() < 1e-14));
            let foot = ground.project([0.4, -0.2, 0.7]);
            assert!(ground.signed_height(foot).abs() < 1e-15);
        }
    }

    #[test]
    fn zero_and_non_finite_grounds_are_refused() {
        assert!(Ground::new([0.0; 3], 0.0).is_err());
        assert!(Ground::new([0.0, f64::NAN, 1.0], 0.0).is_err());
        assert!(Ground::new([0.0, 1.0, 0.0], f64::INFINITY).is_err());
    }
}
