//! Batches: many bodies of one template, over threads. The only file that knows threads.
//!
//! Every body is computed from start to end by one thread, so its bits depend neither on the number of threads nor on
//! its neighbours. The pool belongs to the process that made it: after a fork the child makes its own.

use crate::error::{Error, Result, status};
use crate::ground::Ground;
use crate::mass::Method;
use crate::number::vector::{Vec3, sub};
use crate::number::{Dual, Real, Scalar};
use crate::quantity::Quantity;
use crate::scene::{self, Scene};
use crate::support::{BaseOfSupport, Contact};
use crate::template::Template;
use crate::volume::signed_volumes;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `num_bodies` poses of one template, each over its ground.
pub struct Batch<'a, T> {
    template: &'a Template,
    vertices: &'a [T],
    grounds: Vec<Ground<f64>>,
    /// Asked now and then from the calling thread; true gives up with [`Error::Interrupted`].
    interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
}

/// Work on one body costs at least this many vertices' worth before a second thread pays.
const INLINE_VERTICES: usize = 2_000;
/// Bodies between two questions for an interruption, for each thread.
const WAVE: usize = 8;

impl<'a, T: Scalar> Batch<'a, T> {
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
        let grounds = (0..num_bodies).map(ground).collect::<Result<Vec<_>>>()?;
        Ok(Batch { template, vertices, grounds, interrupted })
    }

    pub fn len(&self) -> usize {
        self.grounds.len()
    }

    pub fn is_empty(&self) -> bool {
        self.grounds.is_empty()
    }

    /// B·K numbers.
    pub fn value<Q: Quantity>(&self, quantity: &Q) -> Result<Vec<T>> {
        let size = quantity.len(self.template);
        let mut out = vec![T::zero(); self.len() * size];
        self.each([(&mut out, size)], |body, [out]| {
            self.run(body, out, |scene, out| drop(quantity.forward(scene, out)));
        })?;
        Ok(out)
    }

    /// The gradient of Σ d_out · value: B·V·3 numbers.
    pub fn vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<Vec<T>> {
        Ok(self.value_and_vjp(quantity, d_out)?.1)
    }

    /// Both in one pass.
    pub fn value_and_vjp<Q: Quantity>(&self, quantity: &Q, d_out: &[T]) -> Result<(Vec<T>, Vec<T>)> {
        let (size, row) = (quantity.len(self.template), 3 * self.template.mesh.num_vertices);
        let mut out = vec![T::zero(); self.len() * size];
        let mut d_vertices = vec![T::zero(); self.len() * row];
        self.each([(&mut out, size), (&mut d_vertices, row)], |body, [out, d_vertices]| {
            let d_out = &d_out[body * size..][..size];
            self.run(body, out, |scene, out| {
                let d_points = gradient(quantity, scene, d_out, out);
                hand_out(&d_points, d_out, d_vertices, |d| d);
            });
        })?;
        Ok((out, d_vertices))
    }

    /// The derivative of the value along `d_vertices`: B·K numbers.
    pub fn jvp<Q: Quantity>(&self, quantity: &Q, d_vertices: &[T]) -> Result<Vec<T>> {
        let size = quantity.len(self.template);
        let mut out = vec![T::zero(); self.len() * size];
        self.each([(&mut out, size)], |body, [out]| {
            self.run_dual(body, d_vertices, |scene| {
                let mut value = vec![Dual::zero(); size];
                quantity.forward(scene, &mut value);
                for (out, value) in out.iter_mut().zip(value) {
                    *out = finite_or_zero(T::of(value.slope));
                }
            });
        })?;
        Ok(out)
    }

    /// The derivative of `vjp(d_out)` along `d_vertices`, a Hessian-vector product: B·V·3 numbers.
    pub fn vjp_jvp<Q: Quantity>(&self, quantity: &Q, d_out: &[T], d_vertices: &[T]) -> Result<Vec<T>> {
        let (size, row) = (quantity.len(self.template), 3 * self.template.mesh.num_vertices);
        let mut out = vec![T::zero(); self.len() * row];
        self.each([(&mut out, row)], |body, [out]| {
            self.run_dual(body, d_vertices, |scene| {
                let d_out: Vec<_> = d_out[body * size..][..size].iter().map(|d| Dual::of(d.value())).collect();
                let d_points = gradient(quantity, scene, &d_out, &mut vec![Dual::zero(); size]);
                hand_out(&d_points, &d_out, out, |d| T::of(d.slope));
            });
        })?;
        Ok(out)
    }

    /// The base of support of each body.
    pub fn base_of_support(&self, contact: &Contact, method: Method) -> Result<Vec<BaseOfSupport>> {
        let nowhere = BaseOfSupport { polygon: Vec::new(), area: f64::NAN, margin: f64::NAN, num_contacts: 0 };
        self.map(nowhere, |scene| BaseOfSupport::new(scene, contact, method))
    }

    /// BoSE by the linear programme.
    #[cfg(feature = "lp")]
    pub fn is_supported_lp(&self, contact: &Contact, method: Method) -> Result<Vec<bool>> {
        self.map(false, |scene| crate::support::is_supported_lp(scene, contact, method))
    }

    /// The bits of [`status`].
    pub fn status(&self, contact: &Contact) -> Result<Vec<u32>> {
        self.map(status::NON_FINITE, |scene| {
            let volumes = signed_volumes(&scene.template.closing, scene.points);
            let support = BaseOfSupport::new(scene, contact, Method::VertexMean);
            let size = extent(&scene.points[..scene.template.mesh.num_vertices]);
            let bits = [
                (volumes.iter().any(|v| *v < 0.0), status::INVERTED_PART),
                (!support.has_contact(), status::NO_CONTACT),
                (volumes.iter().map(|v| v.abs()).sum::<f64>() <= 1e-12 * size.powi(3), status::NO_VOLUME),
                (!(0.2..=10.0).contains(&size), status::ODD_SIZE),
            ];
            bits.iter().filter(|(set, _)| *set).fold(0, |all, (_, bit)| all | bit)
        })
    }

    /// One result a body, in double precision; `bad` for a body that is not finite.
    fn map<O: Clone + Send + Sync>(&self, bad: O, f: impl Fn(&Scene<f64>) -> O + Sync) -> Result<Vec<O>> {
        let mut out = vec![bad; self.len()];
        self.each([(&mut out, 1)], |body, [out]| {
            if let Some(origin) = self.origin(body) {
                let points = self.points(body, |x, o| Real::of(x.value() - o), origin);
                out[0] = f(&Scene::new(self.template, &points, &self.grounds[body], origin));
            }
        })?;
        Ok(out)
    }

    /// Shows one body to `f`; a body that is not finite gets NaN, and its gradient stays zero.
    fn run(&self, body: usize, out: &mut [T], f: impl FnOnce(&Scene<T>, &mut [T])) {
        match self.origin(body) {
            Some(origin) => {
                let points = self.points(body, |x, o| x - T::of(o), origin);
                f(&Scene::new(self.template, &points, &self.grounds[body], origin), out);
            }
            None => out.fill(T::of(f64::NAN)),
        }
    }

    /// Shows one body to `f` as dual numbers along `d_vertices`.
    fn run_dual(&self, body: usize, d_vertices: &[T], f: impl FnOnce(&Scene<Dual>)) {
        let Some(origin) = self.origin(body) else { return };
        let row = 3 * self.template.mesh.num_vertices;
        let mut slopes = d_vertices[body * row..][..row].iter();
        let dual = |x: T, o: f64| Dual::new(x.value() - o, slopes.next().expect("as long as the vertices").value());
        let points = self.points(body, dual, origin);
        f(&Scene::new(self.template, &points, &self.grounds[body], origin));
    }

    /// The body's local origin, if all its vertices are finite.
    fn origin(&self, body: usize) -> Option<Vec3<f64>> {
        let vertices = self.vertices_of(body);
        let finite = vertices.iter().all(|x| x.value().is_finite());
        finite.then(|| scene::origin(std::array::from_fn(|k| vertices[k].value())))
    }

    fn vertices_of(&self, body: usize) -> &[T] {
        let row = 3 * self.template.mesh.num_vertices;
        &self.vertices[body * row..][..row]
    }

    /// The closed body in local coordinates.
    fn points<R: Real>(&self, body: usize, mut local: impl FnMut(T, f64) -> R, origin: Vec3<f64>) -> Vec<Vec3<R>> {
        let mut points = Vec::with_capacity(self.template.closing.num_points());
        for vertex in self.vertices_of(body).chunks_exact(3) {
            points.push([local(vertex[0], origin[0]), local(vertex[1], origin[1]), local(vertex[2], origin[2])]);
        }
        self.template.closing.forward(&mut points);
        points
    }

    /// Runs `f` on every body with its rows of the outputs.
    fn each<O: Send, const N: usize>(
        &self,
        outputs: [(&mut Vec<O>, usize); N],
        f: impl Fn(usize, [&mut [O]; N]) + Sync,
    ) -> Result<()> {
        let mut rows: Vec<[&mut [O]; N]> = Vec::with_capacity(self.len());
        let mut rest = outputs.map(|(data, size)| data.chunks_exact_mut(size));
        for _ in 0..self.len() {
            rows.push(rest.each_mut().map(|chunks| chunks.next().expect("one row a body")));
        }
        let rows = rows.into_iter().enumerate().collect();
        let threads = if self.len() * self.template.mesh.num_vertices < INLINE_VERTICES { 1 } else { num_threads() };
        in_waves(rows, threads, WAVE * threads, self.interrupted, |(body, rows)| f(body, rows))
    }
}

/// Runs `work` on every piece over the pool's threads. Between two waves of `wave` pieces the calling thread asks for an
/// interruption.
pub(crate) fn in_waves<P: Send>(
    mut pieces: Vec<P>,
    threads: usize,
    wave: usize,
    interrupted: &(dyn Fn() -> bool + Sync),
    work: impl Fn(P) + Sync,
) -> Result<()> {
    while !pieces.is_empty() {
        if interrupted() {
            return Err(Error::Interrupted);
        }
        let wave: Vec<_> = pieces.drain(..pieces.len().min(wave)).collect();
        if threads == 1 || wave.len() == 1 {
            wave.into_iter().for_each(&work);
        } else {
            pool().install(|| wave.into_par_iter().for_each(&work));
        }
    }
    Ok(())
}

/// Forward and backward of one body; the gradient by all points, then folded onto the mesh's vertices.
fn gradient<R: Real, Q: Quantity>(quantity: &Q, scene: &Scene<R>, d_out: &[R], out: &mut [R]) -> Vec<Vec3<R>> {
    let saved = quantity.forward(scene, out);
    let mut d_points = vec![[R::zero(); 3]; scene.points.len()];
    quantity.backward(scene, &saved, d_out, &mut d_points);
    scene.template.closing.backward(&mut d_points);
    d_points
}

/// Writes the vertices' gradient. One that is not finite, though the upstream gradient is, belongs to a body on which
/// the quantity is undefined (no volume, coordinates out of range): it becomes zero.
fn hand_out<S: Scalar, T: Scalar>(d_points: &[Vec3<S>], d_out: &[S], d_vertices: &mut [T], number: impl Fn(S) -> T) {
    for (out, d) in d_vertices.iter_mut().zip(d_points.iter().flatten()) {
        *out = number(*d);
    }
    if d_out.iter().all(|d| d.value().is_finite()) && !d_vertices.iter().all(|d| d.value().is_finite()) {
        d_vertices.fill(T::zero());
    }
}

fn finite_or_zero<T: Scalar>(x: T) -> T {
    if x.value().is_finite() { x } else { T::zero() }
}

/// The longest side of the bounding box.
fn extent(vertices: &[Vec3<f64>]) -> f64 {
    let bound = |pick: fn(f64, f64) -> f64| {
        vertices.iter().fold(vertices[0], |best, v| std::array::from_fn(|k| pick(best[k], v[k])))
    };
    sub(bound(f64::max), bound(f64::min)).into_iter().fold(0.0, f64::max)
}

static NUM_THREADS: AtomicUsize = AtomicUsize::new(0);

/// The threads that batches use: [`set_num_threads`], else `RAYON_NUM_THREADS`, else the machine's cores.
pub fn num_threads() -> usize {
    match NUM_THREADS.load(Ordering::Relaxed) {
        0 => {
            let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.trim().parse().ok());
            let cores = || std::thread::available_parallelism().map_or(1, |n| n.get());
            let threads = asked.filter(|&n: &usize| n > 0).unwrap_or_else(cores);
            NUM_THREADS.store(threads, Ordering::Relaxed);
            threads
        }
        threads => threads,
    }
}

pub fn set_num_threads(threads: usize) {
    NUM_THREADS.store(threads.clamp(1, 1024), Ordering::Relaxed);
}

/// The pool of this process with the wanted number of threads. Pools are leaked: a forked child must not even drop its
/// parent's.
fn pool() -> &'static ThreadPool {
    static POOL: Mutex<Option<(u32, usize, &'static ThreadPool)>> = Mutex::new(None);
    let wanted = (std::process::id(), num_threads());
    let mut pool = POOL.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    match *pool {
        Some((process, threads, pool)) if (process, threads) == wanted => pool,
        _ => {
            let made = ThreadPoolBuilder::new().num_threads(wanted.1).thread_name(|i| format!("ipman-{i}")).build();
            let made = Box::leak(Box::new(made.expect("the system refuses new threads")));
            *pool = Some((wanted.0, wanted.1, made));
            made
        }
    }
}
