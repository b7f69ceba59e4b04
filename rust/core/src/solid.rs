//! A posed body as one stiff solid: its mass, its centre, its inertia, and how high it hovers over its ground.

use crate::error::status;
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::moments::part_moments;
use crate::number::vector::{Vec3, add, sub};
use crate::number::{Real, Scalar};
use crate::posed::{self, PosedBody};

/// m/s²
pub const GRAVITY: f64 = 9.81;

/// Heights and bounds of the bodies, one per lane.
pub struct Extent<R: Real> {
    /// h of each vertex.
    pub heights: Vec<R>,
    pub lowest: R,
    bounds: [Vec3<R>; 2],
}

impl<R: Real> Extent<R> {
    pub fn of(posed: &PosedBody<R>) -> Self {
        let heights = posed.heights();
        Extent { lowest: posed::lowest(&heights), heights, bounds: posed.bounds() }
    }

    /// The lowest and the highest coordinates of one body.
    pub fn bounds_of(&self, lane: usize) -> [Vec3<f64>; 2] {
        self.bounds.map(|corner| corner.map(|x| x.lane(lane).value()))
    }
}

#[derive(Clone, Debug)]
pub struct Solid {
    /// The bits of [`status`]. A body in the air has [`status::NO_CONTACT`].
    pub status: u32,
    /// kg
    pub mass: f64,
    /// Of mass, in the world.
    pub centre: Vec3<f64>,
    /// About the centre, kg m².
    pub inertia: [Vec3<f64>; 3],
    /// Height of the lowest vertex above the ground, m; negative below it.
    pub lowest: f64,
}

impl Solid {
    /// A body that is not finite.
    pub fn nowhere() -> Self {
        let nan = [f64::NAN; 3];
        Solid { status: status::NON_FINITE, mass: f64::NAN, centre: nan, inertia: [nan; 3], lowest: f64::NAN }
    }

    /// Whether it has mass properties: it is finite and has a volume.
    pub fn is_solid(&self) -> bool {
        self.status & (status::NON_FINITE | status::NO_VOLUME) == 0
    }

    /// Whether it has mass properties and touches its ground.
    pub fn is_grounded(&self) -> bool {
        self.is_solid() && self.status & status::NO_CONTACT == 0
    }

    /// The solid of each lane, in local coordinates. A body whose lowest vertex is higher than `contact` metres counts
    /// as in the air.
    pub fn of_lanes<R: Real>(
        posed: &PosedBody<R>,
        extent: &Extent<R>,
        densities: &MassProperties,
        contact: f64,
    ) -> Vec<Self> {
        let parts = part_moments(&posed.template.closing, posed.points);
        let row = densities.whole(&parts);
        let of_lane = |lane: usize| {
            let number = |k: usize| row[k].lane(lane).value();
            let lowest = extent.lowest.lane(lane).value();
            let volumes = memory::collect(parts.iter().map(|part| part.volume.lane(lane).value()));
            let [low, high] = extent.bounds_of(lane);
            let sides = sub(high, low);
            let inertia = [5, 8, 11].map(|k| [number(k), number(k + 1), number(k + 2)]);
            let mut status = status::bits(&volumes, sides, lowest <= contact);
            if !(number(0) > 0.0 && is_of_matter(inertia)) {
                status |= status::NO_VOLUME;
            }
            Solid { status, mass: number(1), centre: [number(2), number(3), number(4)], inertia, lowest }
        };
        (0..R::LANES).map(of_lane).collect()
    }

    /// The same solid in coordinates in which the present origin lies at `origin`.
    pub fn moved(mut self, origin: Vec3<f64>) -> Self {
        self.centre = add(self.centre, origin);
        self
    }

    /// status, mass, centre, inertia row by row, lowest.
    pub fn row(&self) -> [f64; 15] {
        let [x, y, z] = self.centre;
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = self.inertia;
        [f64::from(self.status), self.mass, x, y, z, xx, xy, xz, yx, yy, yz, zx, zy, zz, self.lowest]
    }

    /// NaN for all but status and lowest height unless it is a solid.
    pub fn or_nowhere(self) -> Self {
        if self.is_solid() { self } else { Solid { status: self.status, lowest: self.lowest, ..Solid::nowhere() } }
    }
}

/// Whether the second moments of an inertia tensor are positive in every direction, as those of real matter are. Signed
/// volumes of a self-intersecting surface can violate this.
fn is_of_matter(inertia: [Vec3<f64>; 3]) -> bool {
    let half = (inertia[0][0] + inertia[1][1] + inertia[2][2]) / 2.0;
    let [xx, yy, zz] = [half - inertia[0][0], half - inertia[1][1], half - inertia[2][2]];
    let [xy, xz, yz] = [-inertia[0][1], -inertia[0][2], -inertia[1][2]];
    let minor = xx * yy - xy * xy;
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    xx > 0.0 && minor > 0.0 && determinant > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matter_has_inertia_that_fulfils_the_triangle_inequality() {
        assert!(is_of_matter([[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]]));
        assert!(!is_of_matter([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]));
        assert!(!is_of_matter([[2.0, 0.0, 0.0], [0.0, f64::NAN, 0.0], [0.0, 0.0, 2.0]]));
    }
}
