//! Batches: many bodies of one template, over the lanes of a number and over threads.
//!
//! Every body is computed from start to end in one lane by one thread, and all numbers of a CPU level round alike, so its
//! bits depend neither on the number of threads nor on its neighbours nor on its place.

mod findings;
mod lanes;

use crate::analysis::{Analysis, Polygon};
use crate::error::{Error, Result, status};
use crate::ground::Ground;
use crate::losses::terms::Terms;
use crate::mass::Method;
use crate::mass_properties::MassProperties;
use crate::memory;
use crate::number::simd_level::Level;
use crate::number::vector::Vec3;
use crate::number::{Data, Dual, Real, Scalar, all_finite};
use crate::options::positive;
use crate::quantity::Quantity;
use crate::scene::{self, Scene};
use crate::solid::Solid;
use crate::support::{BaseOfSupport, Contact};
use crate::template::Template;
use crate::threads::{self, num_threads};
use crate::tipping::{Footing, TipTest, Tipping};
#[cfg(feature = "lp")]
use findings::SupportedLp;
use findings::{Find, Finding, Solids, Status, Support};
use lanes::{Figures, Forward, ForwardAndBackward, ForwardAndJacobian, OnLanes, ReadBodies, zero_if_undefined};

/// `num_bodies` poses of one template, each over its ground.
pub struct Batch<'a, T> {
    template: &'a Template,
    vertices: &'a [T],
    grounds: Vec<Ground<f64>>,
    level: Level,
    /// Asked now and then from the calling thread; true gives up with [`Error::Interrupted`].
    interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
}

/// Work on one body costs at least this many vertices' worth before a second thread pays.
const INLINE_VERTICES: usize = 2_000;

impl<'a, T: Data> Batch<'a, T> {
    /// `vertices` holds B·V·3 coordinates, `normals` B·3, `heights` B.
    pub fn new(
        template: &'a Template,
        vertices: &'a [T],
        normals: &[f64],
        heights: &[f64],
        interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
    ) -> Result<Self> {
        let (num_bodies, row) = (heights.len(), 3 * template.mesh.num_vertices);
        let shape = |name, expected: usize, got: usize| Error::Argument {
            name,
            expected: format!("{expected} numbers for {num_bodies} bodies"),
            got: got.to_string(),
        };
        if vertices.len() != num_bodies * row {
            return Err(shape("vertices", num_bodies * row, vertices.len()));
        }
        if normals.len() != 3 * num_bodies {
            return Err(shape("normal", 3 * num_bodies, normals.len()));
        }
        let ground = |body: usize| {
            let normal = [normals[3 * body], normals[3 * body + 1], normals[3 * body + 2]];
            Ground::new(normal, heights[body]).map_err(|error| match error {
                Error::GroundNormal { .. } => Error::GroundNormal { body },
                other => other,
            })
        };
        let grounds = memory::guarded(|| {
            let mut grounds = memory::with_capacity(num_bodies);
            for body in 0..num_bodies {
                grounds.push(ground(body)?);
            }
            Ok(grounds)
        })?;
        Ok(Batch { template, vertices, grounds, level: Level::current()?, interrupted })
    }

    /// The same batch at another CPU level of this machine.
    pub fn at_level(self, level: Level) -> Self {
        level.expect_here();
        Batch { level, ..self }
    }

    pub fn template(&self) -> &'a Template {
        self.template
    }

    pub fn len(&self) -> usize {
        self.grounds.len()
    }

    pub fn is_empty(&self) -> bool {
        self.grounds.is_empty()
    }

    /// The quantity of each body: B·K numbers.
    pub fn value_into<Q: Quantity>(&self, quantity: &Q, out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let size = quantity.len(self.template);
        self.each([(out, size)], |group, [out]| {
            self.on_lanes(group, Forward { quantity, size, out });
        })
    }

    /// The quantity, and the gradient of Σ d_out · value by the vertices: B·V·3 numbers, in one pass.
    pub fn value_and_vjp_into<Q: Quantity>(
        &self,
        quantity: &Q,
        d_out: &[T],
        out: &mut [T],
        d_vertices: &mut [T],
    ) -> Result<()> {
        quantity.check(self.template)?;
        let (size, row) = (quantity.len(self.template), 3 * self.template.mesh.num_vertices);
        self.each([(out, size), (d_vertices, row)], |group, [out, d_vertices]| {
            let d_out = group.bodies.iter().map(|&body| &d_out[body * size..][..size]).collect();
            let work = ForwardAndBackward { template: self.template, quantity, size, d_out, out, d_vertices };
            self.on_lanes(group, work);
        })
    }

    /// The gradient of Σ d_out · value alone.
    pub fn vjp_into<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &mut [T]) -> Result<()> {
        let mut out = memory::guarded(|| Ok(memory::filled(T::zero(), d_out.len())))?;
        self.value_and_vjp_into(quantity, d_out, &mut out, d_vertices)
    }

    /// The terms, and their Jacobian: for each body the gradient of the first term by the vertices, V·3 numbers, then
    /// those of pull and of push by the vertices' heights, V each.
    pub fn value_and_jacobian_into<Q: Terms>(&self, quantity: &Q, out: &mut [T], jacobian: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let (size, row) = (quantity.len(self.template), 5 * self.template.mesh.num_vertices);
        self.each([(out, size), (jacobian, row)], |group, [out, jacobian]| {
            self.on_lanes(group, ForwardAndJacobian { template: self.template, quantity, size, out, jacobian });
        })
    }

    /// The derivative of the value along `d_vertices`: B·K numbers.
    pub fn jvp_into<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T], out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let size = quantity.len(self.template);
        self.each_body((out, size), |body, out| {
            out.fill(T::zero());
            self.on_dual(body, d_vertices, |scene| {
                let mut value = memory::filled(Dual::zero(), size);
                quantity.forward(scene, &mut value);
                for (out, value) in out.iter_mut().zip(value) {
                    *out = finite_or_zero(T::of(value.slope));
                }
            });
        })
    }

    /// The derivative of `vjp(d_out)` along `d_vertices`, a Hessian-vector product: B·V·3 numbers.
    pub fn vjp_jvp_into<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T], out: &mut [T]) -> Result<()> {
        quantity.check(self.template)?;
        let (size, row) = (quantity.len(self.template), 3 * self.template.mesh.num_vertices);
        self.each_body((out, row), |body, out| {
            out.fill(T::zero());
            self.on_dual(body, d_vertices, |scene| {
                let d_out = memory::collect(d_out[body * size..][..size].iter().map(|d| Dual::of(d.value())));
                let mut d_points = memory::filled([Dual::zero(); 3], scene.points.len());
                quantity.forward_and_backward(scene, &d_out, &mut memory::filled(Dual::zero(), size), &mut d_points);
                scene.template.closing.backward(&mut d_points);
                for (out, d) in out.iter_mut().zip(d_points.as_flattened()) {
                    *out = T::of(d.slope);
                }
                zero_if_undefined(out, all_finite(&d_out));
            });
        })
    }

    /// [`Batch::value_into`] a new vector.
    pub fn value<Q: Quantity>(&self, quantity: &Q) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.len(self.template))?;
        self.value_into(quantity, &mut out).map(|()| out)
    }

    /// [`Batch::value_and_vjp_into`] new vectors.
    pub fn value_and_vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<(Vec<T>, Vec<T>)> {
        let (mut out, mut d_vertices) = (self.rows(quantity.len(self.template))?, self.rows(self.row())?);
        self.value_and_vjp_into(quantity, d_out, &mut out, &mut d_vertices).map(|()| (out, d_vertices))
    }

    /// [`Batch::vjp_into`] a new vector.
    pub fn vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<Vec<T>> {
        let mut d_vertices = self.rows(self.row())?;
        self.vjp_into(quantity, d_out, &mut d_vertices).map(|()| d_vertices)
    }

    /// [`Batch::jvp_into`] a new vector.
    pub fn jvp<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(quantity.len(self.template))?;
        self.jvp_into(quantity, d_vertices, &mut out).map(|()| out)
    }

    /// [`Batch::vjp_jvp_into`] a new vector.
    pub fn vjp_jvp<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T]) -> Result<Vec<T>> {
        let mut out = self.rows(self.row())?;
        self.vjp_jvp_into(quantity, d_out, d_vertices, &mut out).map(|()| out)
    }

    fn rows(&self, size: usize) -> Result<Vec<T>> {
        memory::guarded(|| Ok(memory::filled(T::zero(), self.len() * size)))
    }

    /// Coordinates of one body.
    fn row(&self) -> usize {
        3 * self.template.mesh.num_vertices
    }

    /// The base of support of each body.
    pub fn base_of_support(&self, contact: &Contact, method: Method) -> Result<Vec<BaseOfSupport>> {
        contact.check()?;
        let nowhere = BaseOfSupport { polygon: Vec::new(), area: f64::NAN, margin: f64::NAN, num_contacts: 0 };
        self.find(nowhere, &Support { contact, method })
    }

    /// All figures of each body ([`Analysis`]): B·K numbers, and the corners of the base of support.
    pub fn analysis_into(&self, analysis: &Analysis, out: &mut [T]) -> Result<Vec<Polygon>> {
        let size = analysis.size(self.template);
        analysis.check(self.template)?;
        memory::guarded(|| {
            let mut polygons = memory::filled(Polygon::new(), self.len());
            let mut bodies = memory::with_capacity(self.len());
            for (body, (row, polygon)) in out.chunks_exact_mut(size).zip(&mut polygons).enumerate() {
                match self.origin(body) {
                    Some(origin) => bodies.push((body, origin, (row, polygon))),
                    None => row.fill(T::of(f64::NAN)),
                }
            }
            self.each_group(bodies, |group, rows| {
                let (out, polygons) = rows.into_iter().unzip();
                self.on_lanes(group, Figures { analysis, size, out, polygons });
            })?;
            Ok(polygons)
        })
    }

    /// BoSE by the linear programme.
    #[cfg(feature = "lp")]
    pub fn is_supported_lp(&self, contact: &Contact, method: Method) -> Result<Vec<bool>> {
        contact.check()?;
        self.find(false, &SupportedLp { contact, method })
    }

    /// The bits of [`status`].
    pub fn status(&self, contact: &Contact) -> Result<Vec<u32>> {
        contact.check()?;
        self.find(status::NON_FINITE, &Status { contact })
    }

    /// Each body as one solid. One with its lowest vertex higher than `contact` metres is in the air.
    pub fn solids(&self, densities: &MassProperties, contact: f64) -> Result<Vec<Solid>> {
        densities.check(self.template)?;
        positive("contact", contact)?;
        self.find(Solid::nowhere(), &Solids { densities, contact })
    }

    /// The tip test of each body.
    pub fn tip_test(&self, test: &TipTest) -> Result<Vec<Tipping>> {
        test.check(self.template)?;
        memory::guarded(|| {
            let mut out = memory::filled(Tipping::nowhere(), self.len());
            self.each_group(self.finite(&mut out), |group, out| {
                let mut footings = vec![Footing::nowhere(); out.len()];
                self.on_lanes(group, Find { finding: test, out: footings.iter_mut().collect() });
                for ((out, footing), &body) in out.into_iter().zip(footings).zip(&group.bodies) {
                    *out = test.of_body(footing, self.vertices_of(body));
                }
            })?;
            Ok(out)
        })
    }

    /// What is found of each body; `bad` for a body that is not finite.
    fn find<F: Finding>(&self, bad: F::Of, finding: &F) -> Result<Vec<F::Of>> {
        memory::guarded(|| {
            let mut out = memory::filled(bad, self.len());
            self.each_group(self.finite(&mut out), |group, out| self.on_lanes(group, Find { finding, out }))?;
            Ok(out)
        })
    }

    /// The bodies that are finite, with their local origins and their rows of `out`.
    fn finite<'o, O>(&self, out: &'o mut [O]) -> Vec<(usize, Vec3<f64>, &'o mut O)> {
        let mut bodies = memory::with_capacity(out.len());
        bodies.extend(out.iter_mut().enumerate().filter_map(|(body, row)| Some((body, self.origin(body)?, row))));
        bodies
    }

    /// Shows one body to `f` as dual numbers along `d_vertices`, if it is finite.
    fn on_dual(&self, body: usize, d_vertices: &[T], f: impl FnOnce(&Scene<Dual>)) {
        let Some(origin) = self.origin(body) else { return };
        let row = 3 * self.template.mesh.num_vertices;
        let mut slopes = d_vertices[body * row..][..row].iter();
        let dual = |x: T, o: f64| Dual::new(x.value() - o, slopes.next().expect("as long as the vertices").value());
        let points = self.points(body, dual, origin);
        f(&Scene::new(self.template, &points, &[self.grounds[body]], &[origin]));
    }

    /// The body's local origin, if all its vertices are finite.
    fn origin(&self, body: usize) -> Option<Vec3<f64>> {
        let vertices = self.vertices_of(body);
        all_finite(vertices).then(|| scene::origin(std::array::from_fn(|k| vertices[k].value())))
    }

    pub(crate) fn vertices_of(&self, body: usize) -> &[T] {
        let row = 3 * self.template.mesh.num_vertices;
        &self.vertices[body * row..][..row]
    }

    #[cfg(feature = "simulation")]
    pub(crate) fn ground_of(&self, body: usize) -> &Ground<f64> {
        &self.grounds[body]
    }

    #[cfg(feature = "simulation")]
    pub(crate) fn interrupted(&self) -> &(dyn Fn() -> bool + Sync) {
        self.interrupted
    }

    /// The closed body in local coordinates.
    fn points<R: Real>(&self, body: usize, mut local: impl FnMut(T, f64) -> R, origin: Vec3<f64>) -> Vec<Vec3<R>> {
        let mut points = memory::with_capacity(self.template.closing.num_points());
        for vertex in self.vertices_of(body).chunks_exact(3) {
            points.push([local(vertex[0], origin[0]), local(vertex[1], origin[1]), local(vertex[2], origin[2])]);
        }
        self.template.closing.forward(&mut points);
        points
    }

    /// Runs `f` on groups of finite bodies, with their rows of the outputs, which are NaN and then zero for the others.
    fn each<const N: usize>(
        &self,
        outputs: [(&mut [T], usize); N],
        f: impl Fn(&Group, [Vec<&mut [T]>; N]) + Sync,
    ) -> Result<()> {
        memory::guarded(|| {
            let mut rest = outputs.map(|(data, size)| data.chunks_exact_mut(size));
            let mut bodies = memory::with_capacity(self.len());
            for body in 0..self.len() {
                let mut row = rest.each_mut().map(|chunks| chunks.next().expect("one row a body"));
                match self.origin(body) {
                    Some(origin) => bodies.push((body, origin, row)),
                    None => row.iter_mut().enumerate().for_each(|(k, row)| row.fill(T::of([f64::NAN, 0.0][k]))),
                }
            }
            self.each_group(bodies, |group, rows| {
                let mut own: [Vec<&mut [T]>; N] = std::array::from_fn(|_| Vec::with_capacity(group.width));
                for row in rows {
                    own.iter_mut().zip(row).for_each(|(own, row)| own.push(row));
                }
                f(group, own);
            })
        })
    }

    /// Runs `f` on finite bodies side by side, over the threads: on each group with what belongs to its bodies.
    fn each_group<P: Send>(&self, bodies: Vec<(usize, Vec3<f64>, P)>, f: impl Fn(&Group, Vec<P>) + Sync) -> Result<()> {
        let widths = self.widths(bodies.len());
        // Each body once more, in its group's small vectors.
        memory::ask(bodies.len() * (size_of::<P>() + size_of::<(usize, Vec3<f64>)>()));
        let mut groups = Vec::new();
        let mut rest = bodies.into_iter();
        for &width in widths {
            // A group that is half empty takes as long as a full one.
            while 2 * rest.len() > width {
                let mut group = Group { level: self.level, width, bodies: Vec::new(), origins: Vec::new() };
                let mut own = Vec::with_capacity(width);
                for (body, origin, belonging) in rest.by_ref().take(width) {
                    group.bodies.push(body);
                    group.origins.push(origin);
                    own.push(belonging);
                }
                memory::push(&mut groups, (group, own));
            }
        }
        threads::each(groups, self.pays_threads(), self.interrupted, &|(group, own)| f(&group, own))
    }

    /// Runs `f` on every body with its row of the output.
    fn each_body<O: Send>(&self, output: (&mut [O], usize), f: impl Fn(usize, &mut [O]) + Sync) -> Result<()> {
        let rows = memory::guarded(|| Ok(memory::collect(output.0.chunks_exact_mut(output.1).enumerate())))?;
        threads::each(rows, self.pays_threads(), self.interrupted, &|(body, row)| f(body, row))
    }

    /// The lanes to use for so many bodies. Two threads with half the lanes are faster than one alone with all.
    fn widths(&self, bodies: usize) -> &'static [usize] {
        let widths = T::widths(self.level);
        let (widest, half) = (widths[0], *widths.get(1).unwrap_or(&1));
        let splits = num_threads() > 1 && half > 1 && half < bodies && bodies <= widest;
        if splits { &widths[1..] } else { widths }
    }

    fn pays_threads(&self) -> bool {
        self.len() * self.template.mesh.num_vertices >= INLINE_VERTICES
    }

    /// Shows a group of bodies, one a lane, to `work`.
    fn on_lanes<W: OnLanes<T>>(&self, group: &Group, work: W) {
        T::enter(group.level, group.width, ReadBodies { batch: self, group, work });
    }
}

/// Finite bodies that are computed side by side, by their index, and their local origins.
struct Group {
    level: Level,
    width: usize,
    bodies: Vec<usize>,
    origins: Vec<Vec3<f64>>,
}

impl Group {
    /// The body of each lane; lanes that are left over repeat the last body.
    fn lanes(&self) -> impl Iterator<Item = usize> {
        (0..self.width).map(|lane| lane.min(self.bodies.len() - 1))
    }
}

fn finite_or_zero<T: Scalar>(x: T) -> T {
    if x.value().is_finite() { x } else { T::zero() }
}
