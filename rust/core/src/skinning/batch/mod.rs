//! Skinning of many bodies of one model, over threads. A few bodies at a time share each pass over the model's tables;
//! a body's bits depend neither on the number of threads nor on the other bodies.

mod arguments;
mod passes;

use crate::error::{Error, Result};
use crate::memory;
use crate::number::simd_level::Level;
use crate::number::{Data, Dual, Real, Scalar, Work, all_finite};
use crate::skinning::blend::Tile;
use crate::skinning::rotation::Form;
use crate::skinning::{Body, Gradient, Parameters, Skin, Start, Wanted};
use crate::threads::{self, num_threads};
pub use arguments::{Bodies, Gradients, Rows, TILE, Upstream};
use arguments::{check, check_direction, check_rows, front, fronts, gradient_widths, read, rows, triple, used};
use passes::{Backward, Forward, PlaceJoints, Shape, run};
use std::ops::Range;

/// Bodies that share a pass over the model's tables.
const GROUP: usize = 16;

/// Bodies of one model in their poses.
pub struct PosedBatch<'a, T> {
    skin: &'a Skin<T, TILE>,
    num_bodies: usize,
    form: Form,
    level: Level,
    bodies: Bodies<'a, T>,
    /// Number of leading betas and of expressions in use: those after them are zero in every body and cost nothing.
    used: [usize; 2],
    /// Called now and then on the calling thread; if it returns true the call fails with [`Error::Interrupted`].
    interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
}

impl<'a, T: Data> PosedBatch<'a, T> {
    pub fn new(
        skin: &'a Skin<T, TILE>,
        num_bodies: usize,
        bodies: Bodies<'a, T>,
        interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
    ) -> Result<Self> {
        check_rows(skin, num_bodies, &bodies)?;
        let level = Level::current()?;
        let form = Form::of_width(bodies.pose.width / skin.num_joints()).expect("checked");
        let used = [bodies.betas, bodies.expression].map(used);
        Ok(PosedBatch { skin, num_bodies, form, level, bodies, used, interrupted })
    }

    /// Vertices (B, V, 3) and joints (B, J, 3).
    pub fn forward(&self, vertices: &mut [T], joints: &mut [T]) -> Result<()> {
        memory::guarded(|| T::run_on_registers(self.level, ForwardWork { batch: self, vertices, joints }))
    }

    /// Their derivatives along a direction.
    pub fn jvp(&self, along: &Bodies<T>, vertices: &mut [T], joints: &mut [T]) -> Result<()> {
        check_direction(&self.bodies, along, self.num_bodies)?;
        let slope = |x: Dual| if x.slope.is_finite() { T::of(x.slope) } else { T::zero() };
        memory::guarded(|| {
            self.write::<Dual>(self.skin.start(), |body| self.dual(body, along), slope, vertices, joints)
        })
    }

    /// The gradient of Σ d_vertices · vertices + Σ d_joints · joints.
    pub fn vjp(&self, upstream: Upstream<T>, gradients: Gradients<T>) -> Result<()> {
        memory::guarded(|| T::run_on_registers(self.level, BackwardWork { batch: self, upstream, gradients }))
    }

    /// The derivative of that gradient along a direction.
    pub fn vjp_jvp(&self, upstream: Upstream<T>, along: &Bodies<T>, gradients: Gradients<T>) -> Result<()> {
        check_direction(&self.bodies, along, self.num_bodies)?;
        let parameters = |body| self.dual(body, along);
        let (constant, number) = (|x: T| Dual::of(x.value()), |x: Dual| T::of(x.slope));
        memory::guarded(|| self.pull::<Dual>(self.skin.start(), parameters, constant, number, upstream, gradients))
    }

    /// Numbers per body of [`PosedBatch::jacobian`].
    pub fn jacobian_width(&self) -> usize {
        let parameters = 3 * self.skin.num_joints() + self.bodies.betas.width;
        parameters * (self.skin.num_vertices + self.skin.num_joints()) * 3
    }

    /// The derivatives of vertices and joints by pose (rotation vectors) and betas: (B, P, V + J, 3). For bodies of few
    /// vertices.
    pub fn jacobian(&self, out: &mut [T]) -> Result<()> {
        if self.form != Form::AxisAngle {
            let (expected, got) = ("rotation vectors".into(), "another form".into());
            return Err(Error::Argument { name: "pose", expected, got });
        }
        check("jacobian", out.len(), self.num_bodies * self.jacobian_width())?;
        let numbers = |rows: Rows<T>, body: usize| rows.of(body).iter().map(|x| x.value()).collect::<Vec<f64>>();
        let rows = out.chunks_exact_mut(self.jacobian_width().max(1)).enumerate();
        let rows = memory::guarded(|| Ok(memory::collect(rows)))?;
        threads::each(rows, true, self.interrupted, &|(body, row)| {
            let placed = self.skin.place(Parameters {
                form: self.form,
                pose: numbers(self.bodies.pose, body),
                betas: numbers(self.bodies.betas, body),
                expression: numbers(self.bodies.expression, body),
                transl: [0.0; 3],
            });
            for (out, &number) in row.iter_mut().zip(self.skin.jacobian(&placed).as_flattened()) {
                *out = T::of(number);
            }
        })
    }

    fn write<V: Real>(
        &self,
        start: Start<T, TILE>,
        parameters: impl Fn(usize) -> Parameters<V::Scalar> + Sync,
        number: impl Fn(V::Scalar) -> T + Copy + Sync,
        mut vertices: &mut [T],
        mut joints: &mut [T],
    ) -> Result<()> {
        let (points, count) = (3 * self.skin.num_vertices, 3 * self.skin.num_joints());
        check("vertices", vertices.len(), self.num_bodies * points)?;
        check("joints", joints.len(), self.num_bodies * count)?;
        let groups = self.groups(|bodies| {
            let n = bodies.len();
            (bodies, front(&mut vertices, n * points), front(&mut joints, n * count))
        });
        self.run(groups, |(bodies, vertices, joints)| {
            let bodies: Vec<_> =
                bodies.map(|body| V::Scalar::dispatch::<PlaceJoints, _>((self.skin, parameters(body)))).collect();
            let places = bodies.iter().flat_map(Body::joints).flatten();
            joints.iter_mut().zip(places).for_each(|(out, x)| *out = number(x));
            run::<V, _>(Forward { skin: self.skin, start, bodies: &bodies, vertices, number });
        })
    }

    fn pull<V: Real>(
        &self,
        start: Start<T, TILE>,
        parameters: impl Fn(usize) -> Parameters<V::Scalar> + Sync,
        constant: impl Fn(T) -> V::Scalar + Copy + Sync,
        number: impl Fn(V::Scalar) -> T + Copy + Sync,
        upstream: Upstream<T>,
        gradients: Gradients<T>,
    ) -> Result<()> {
        let (points, count) = (3 * self.skin.num_vertices, 3 * self.skin.num_joints());
        for (name, d, row) in [("d_vertices", upstream.vertices, points), ("d_joints", upstream.joints, count)] {
            check(name, d.len(), if d.is_empty() { 0 } else { self.num_bodies * row })?;
        }
        let given = [self.bodies.pose.width, self.skin.num_betas(), self.skin.num_expressions(), 3];
        let widths = gradient_widths(&gradients, given, self.num_bodies)?;
        let wanted = Wanted { pose: widths[0] > 0, betas: widths[1], expression: widths[2] };
        let mut gradients = gradients;
        let groups = self.groups(|bodies| {
            let gradients = fronts(&mut gradients, widths.map(|width| bodies.len() * width));
            (bodies, gradients)
        });
        self.run(groups, |(range, mut gradients)| {
            let bodies: Vec<_> = range
                .clone()
                .map(|body| V::Scalar::dispatch::<PlaceJoints, _>((self.skin, parameters(body))))
                .collect();
            let d_vertices = rows(upstream.vertices, range.clone(), points);
            let d_joints = rows(upstream.joints, range, count);
            let write_gradient = |i: usize, body: &Body<V::Scalar>, gradient: Gradient<V::Scalar>| {
                let finite =
                    || all_finite(rows(d_vertices, i..i + 1, points)) && all_finite(rows(d_joints, i..i + 1, count));
                write_gradient(body, &gradient, fronts(&mut gradients, widths), number, finite);
            };
            run::<V, _>(Backward {
                skin: self.skin,
                start,
                bodies: &bodies,
                d_vertices,
                d_joints,
                constant,
                wanted,
                take: write_gradient,
            });
        })
    }

    fn parameters<R: Scalar<Data = T>>(&self, body: usize) -> Parameters<R> {
        let [betas, expression] = self.used;
        Parameters {
            form: self.form,
            pose: read(self.bodies.pose.of(body)),
            betas: read(&self.bodies.betas.of(body)[..betas]),
            expression: read(&self.bodies.expression.of(body)[..expression]),
            transl: triple(&read::<R>(self.bodies.transl.of(body))),
        }
    }

    /// One body's parameters as dual numbers; a parameter that is missing, or without a direction, has slope zero.
    fn dual(&self, body: usize, along: &Bodies<T>) -> Parameters<Dual> {
        let pairs = |values: Rows<T>, slopes: Rows<T>| -> Vec<Dual> {
            let (values, slopes) = (values.of(body), slopes.of(body));
            let at = |numbers: &[T], k: usize| numbers.get(k).map_or(0.0, |x| x.value());
            (0..values.len().max(slopes.len())).map(|k| Dual::new(at(values, k), at(slopes, k))).collect()
        };
        Parameters {
            form: self.form,
            pose: pairs(self.bodies.pose, along.pose),
            betas: pairs(self.bodies.betas, along.betas),
            expression: pairs(self.bodies.expression, along.expression),
            transl: triple(&pairs(self.bodies.transl, along.transl)),
        }
    }

    /// The resting body, if several bodies share one shape.
    fn shaped<V: Real<Data = T>>(&self) -> Option<Vec<Tile<T, TILE>>> {
        let [betas, expression] = [(self.bodies.betas, self.used[0]), (self.bodies.expression, self.used[1])];
        let alike = |(rows, used): (Rows<T>, usize)| rows.shared || used == 0;
        let pays = self.num_bodies > 1 && betas.1 + expression.1 > 0 && alike(betas) && alike(expression);
        pays.then(|| {
            let (betas, expression): (Vec<V::Scalar>, Vec<V::Scalar>) =
                (read(&betas.0.of(0)[..betas.1]), read(&expression.0.of(0)[..expression.1]));
            let mut shaped = Vec::new();
            run::<V, _>(Shape { skin: self.skin, betas: &betas, expression: &expression, shaped: &mut shaped });
            shaped
        })
    }

    fn start<'s>(&'s self, shaped: &'s Option<Vec<Tile<T, TILE>>>) -> Start<'s, T, TILE> {
        shaped.as_ref().map_or(self.skin.start(), |tiles| Start { tiles, shaped: true })
    }

    /// The bodies in groups, each with its share of the outputs.
    fn groups<P>(&self, mut share: impl FnMut(Range<usize>) -> P) -> Vec<P> {
        let size = self.num_bodies.div_ceil(num_threads()).clamp(1, GROUP);
        let starts = (0..self.num_bodies).step_by(size);
        memory::collect(starts.map(|start| share(start..(start + size).min(self.num_bodies))))
    }

    fn run<P: Send>(&self, groups: Vec<P>, work: impl Fn(P) + Sync) -> Result<()> {
        threads::each(groups, true, self.interrupted, &work)
    }
}

struct ForwardWork<'a, T> {
    batch: &'a PosedBatch<'a, T>,
    vertices: &'a mut [T],
    joints: &'a mut [T],
}

impl<T: Data> Work<T> for ForwardWork<'_, T> {
    type Output = Result<()>;

    fn run<V: Real<Data = T>>(self) -> Result<()> {
        let ForwardWork { batch, vertices, joints } = self;
        let shaped = batch.shaped::<V>();
        let parameters = |body| batch.parameters::<V::Scalar>(body);
        batch.write::<V>(batch.start(&shaped), parameters, Scalar::data, vertices, joints)
    }
}

struct BackwardWork<'a, 'b, T> {
    batch: &'a PosedBatch<'a, T>,
    upstream: Upstream<'a, T>,
    gradients: Gradients<'b, T>,
}

impl<T: Data> Work<T> for BackwardWork<'_, '_, T> {
    type Output = Result<()>;

    fn run<V: Real<Data = T>>(self) -> Result<()> {
        let BackwardWork { batch, upstream, gradients } = self;
        let shaped = batch.shaped::<V>();
        let parameters = |body| batch.parameters::<V::Scalar>(body);
        batch.pull::<V>(batch.start(&shaped), parameters, V::Scalar::read, Scalar::data, upstream, gradients)
    }
}

/// Writes one body's gradient; zero for a body that is not finite, unless the upstream gradient is not finite.
fn write_gradient<R: Scalar, T: Scalar>(
    body: &Body<R>,
    gradient: &Gradient<R>,
    outs: Gradients<T>,
    number: impl Fn(R) -> T,
    finite_upstream: impl Fn() -> bool,
) {
    let parts = [&gradient.pose[..], &gradient.betas, &gradient.expression, &gradient.transl];
    let good = all_finite(&body.shift) && parts.iter().all(|part| all_finite(part));
    let good = good || !finite_upstream();
    for (out, part) in outs.into_iter().zip(parts) {
        for (out, &d) in out.iter_mut().zip(part) {
            *out = if good { number(d) } else { T::zero() };
        }
    }
}
