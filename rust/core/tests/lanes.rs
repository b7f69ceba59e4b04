//! The rooms on a lane type: two bodies side by side in one number give each body's own bits, whatever its neighbour is.

mod common;

use ipman::Template;
use ipman::ground::Ground;
use ipman::number::Real;
use ipman::number::vector::Vec3;
use ipman::quantity::{Quantity, Visitor, named};
use ipman::scene::Scene;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy)]
struct Pair([f64; 2]);

impl Pair {
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Pair(self.0.map(f))
    }
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Pair([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl $trait for Pair {
            type Output = Pair;
            fn $name(self, other: Pair) -> Pair {
                self.zip(other, f64::$name)
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Neg for Pair {
    type Output = Pair;
    fn neg(self) -> Pair {
        self.map(f64::neg)
    }
}

impl Real for Pair {
    type Scalar = f64;
    type Wide = Pair;
    const LANES: usize = 2;
    fn of(value: f64) -> Self {
        Pair([value; 2])
    }
    fn if_negative(self, below: Self, otherwise: Self) -> Self {
        Pair(std::array::from_fn(|i| self.0[i].if_negative(below.0[i], otherwise.0[i])))
    }
    fn at_least(self, floor: Self) -> Self {
        self.zip(floor, Real::at_least)
    }
    fn at_most(self, ceiling: Self) -> Self {
        self.zip(ceiling, Real::at_most)
    }
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    fn ln(self) -> Self {
        self.map(f64::ln)
    }
    fn exp2(self) -> Self {
        self.map(Real::exp2)
    }
    fn tanh(self) -> Self {
        self.map(Real::tanh)
    }
    fn nearest(self) -> Self {
        self.map(Real::nearest)
    }
    fn widen(self) -> Self {
        self
    }
    fn narrow(wide: Self) -> Self {
        wide
    }
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Pair([lane(0), lane(1)])
    }
}

/// Value and gradient of a closed body at the origin's scene.
struct Run<'a, R: Real>(&'a Template, &'a [Vec3<R>]);

impl<R: Real> Visitor for Run<'_, R> {
    type Output = (Vec<R>, Vec<Vec3<R>>);
    fn visit<Q: Quantity>(self, quantity: Q) -> Self::Output {
        let ground = Ground::new([0.1, 1.0, 0.0], 0.0).unwrap();
        let scene = Scene::new(self.0, self.1, &ground, [0.0; 3]);
        let mut out = vec![R::zero(); quantity.len(self.0)];
        let saved = quantity.forward(&scene, &mut out);
        let mut d_points = vec![[R::zero(); 3]; self.1.len()];
        quantity.backward(&scene, &saved, &vec![R::of(0.7); out.len()], &mut d_points);
        (out, d_points)
    }
}

#[test]
fn two_lanes_are_two_bodies() {
    let (template, vertices) = common::template(2, 300);
    let close = |vertices: &[Vec3<f64>]| {
        let mut points = vertices.to_vec();
        template.closing.forward(&mut points);
        points
    };
    // The second body leans far, so that branches and Newton's path differ between the lanes.
    let bodies =
        [close(&vertices), close(&vertices.iter().map(|v| [v[0] + 0.6 * v[1], v[1] - 0.03, v[2]]).collect::<Vec<_>>())];
    let pairs: Vec<Vec3<Pair>> =
        (0..bodies[0].len()).map(|i| std::array::from_fn(|k| Pair([bodies[0][i][k], bodies[1][i][k]]))).collect();
    for (name, options) in common::quantities() {
        let together = named(&template, &name, &options, Run(&template, &pairs)).unwrap();
        for lane in 0..2 {
            let alone = named(&template, &name, &options, Run(&template, &bodies[lane])).unwrap();
            let values: Vec<u64> = together.0.iter().map(|x| x.0[lane].to_bits()).collect();
            let alone_values: Vec<u64> = alone.0.iter().map(|x| x.to_bits()).collect();
            assert!(values == alone_values, "the value of {name} differs in lane {lane}");
            let gradient: Vec<f64> = together.1.iter().flatten().map(|x| x.0[lane]).collect();
            // Equal as numbers: a lane without a part of the support adds a zero, whose sign is free.
            assert!(gradient == alone.1.as_flattened(), "the gradient of {name} differs in lane {lane}");
        }
    }
}
