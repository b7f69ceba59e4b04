//! The batch, and its distribution: groups of bodies, one body per lane, over the threads.

use crate::error::{Error, Result};
use crate::ground::Ground;
use crate::memory;
use crate::number::simd_level::Level;
use crate::number::vector::Vec3;
use crate::number::{Data, Dual, Real, Work, all_finite};
use crate::posed::{self, PosedBody};
use crate::template::Template;
use crate::threads::{self, num_threads};
use std::mem::MaybeUninit;

/// `num_bodies` poses of one template, each over its ground.
pub struct Batch<'a, T> {
    pub(super) template: &'a Template,
    vertices: &'a [T],
    grounds: Vec<Ground<f64>>,
    level: Level,
    /// Called now and then on the calling thread; if it returns true the call fails with [`Error::Interrupted`].
    interrupted: &'a (dyn Fn() -> bool + Sync + 'a),
}

/// Total number of vertices from which on a second thread pays.
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

    pub(super) fn rows(&self, size: usize) -> Result<Vec<T>> {
        memory::guarded(|| Ok(memory::filled(T::zero(), self.len() * size)))
    }

    /// Coordinates of one body.
    pub(super) fn row(&self) -> usize {
        3 * self.template.mesh.num_vertices
    }

    /// Calls `f` with one body as dual numbers along `d_vertices`, if it is finite.
    pub(super) fn on_dual(&self, body: usize, d_vertices: &[T], f: impl FnOnce(&PosedBody<Dual>)) {
        let Some(origin) = self.origin(body) else { return };
        let row = 3 * self.template.mesh.num_vertices;
        let mut slopes = d_vertices[body * row..][..row].iter();
        let dual = |x: T, o: f64| Dual::new(x.value() - o, slopes.next().expect("as long as the vertices").value());
        let points = self.points(body, dual, origin);
        f(&PosedBody::new(self.template, &points, &[self.grounds[body]], &[origin]));
    }

    /// The body's local origin, if all its vertices are finite.
    pub(super) fn origin(&self, body: usize) -> Option<Vec3<f64>> {
        let vertices = self.vertices_of(body);
        all_finite(vertices).then(|| posed::origin(std::array::from_fn(|k| vertices[k].value())))
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

    /// Runs what `work` makes of each group of finite bodies and their items, one body per lane, over the threads. There is
    /// one item per body; `not_finite` gets those of the others.
    pub(super) fn each_group<P: Send, W: OnLanes<T>>(
        &self,
        mut items: impl Iterator<Item = P>,
        not_finite: impl Fn(P),
        work: impl Fn(&Group, Vec<P>) -> W + Sync,
    ) -> Result<()> {
        memory::guarded(|| {
            let mut bodies = memory::with_capacity(self.len());
            for body in 0..self.len() {
                let item = items.next().expect("one item per body");
                match self.origin(body) {
                    Some(origin) => bodies.push((body, origin, item)),
                    None => not_finite(item),
                }
            }
            let widths = self.widths(bodies.len());
            // Each body is listed once more in its group's vectors.
            memory::ask(bodies.len() * (size_of::<P>() + size_of::<(usize, Vec3<f64>)>()));
            let mut groups = Vec::new();
            let mut rest = bodies.into_iter();
            for &width in widths {
                // A half-empty group takes as long as a full one, so such a rest goes to narrower lanes.
                while 2 * rest.len() > width {
                    let mut group = Group { width, bodies: Vec::new(), origins: Vec::new() };
                    let mut own = Vec::with_capacity(width);
                    for (body, origin, item) in rest.by_ref().take(width) {
                        group.bodies.push(body);
                        group.origins.push(origin);
                        own.push(item);
                    }
                    memory::push(&mut groups, (group, own));
                }
            }
            threads::each(groups, self.pays_threads(), self.interrupted, &|(group, own)| {
                let work = work(&group, own);
                T::run_on_lanes(self.level, group.width, ReadBodies { batch: self, group: &group, work })
            })
        })
    }

    /// Runs `f` on every body with its row of the output.
    pub(super) fn each_body<O: Send>(
        &self,
        output: (&mut [O], usize),
        f: impl Fn(usize, &mut [O]) + Sync,
    ) -> Result<()> {
        let rows = memory::guarded(|| Ok(memory::collect(output.0.chunks_exact_mut(output.1).enumerate())))?;
        threads::each(rows, self.pays_threads(), self.interrupted, &|(body, row)| f(body, row))
    }

    /// The lane widths to use for this many bodies. Two threads with half the lanes are faster than one with all.
    fn widths(&self, bodies: usize) -> &'static [usize] {
        let widths = T::widths(self.level);
        let (widest, half) = (widths[0], *widths.get(1).unwrap_or(&1));
        let splits = num_threads() > 1 && half > 1 && half < bodies && bodies <= widest;
        if splits { &widths[1..] } else { widths }
    }

    fn pays_threads(&self) -> bool {
        self.len() * self.template.mesh.num_vertices >= INLINE_VERTICES
    }
}

/// Indices and local origins of finite bodies that are computed together, one per lane.
pub(super) struct Group {
    width: usize,
    pub bodies: Vec<usize>,
    origins: Vec<Vec3<f64>>,
}

impl Group {
    /// The body of each lane, as an index into `bodies`; spare lanes repeat the last body.
    fn lanes(&self) -> impl Iterator<Item = usize> {
        (0..self.width).map(|lane| lane.min(self.bodies.len() - 1))
    }
}

/// A computation on a group of bodies, one per lane.
pub(super) trait OnLanes<T> {
    fn run<R: Real<Data = T>>(self, posed: &PosedBody<R>);
}

/// Reads the bodies of a group into lanes and runs `work` on them.
struct ReadBodies<'a, T, W> {
    batch: &'a Batch<'a, T>,
    group: &'a Group,
    work: W,
}

impl<T: Data, W: OnLanes<T>> Work<T> for ReadBodies<'_, T, W> {
    type Output = ();

    fn run<R: Real<Data = T>>(self) {
        let ReadBodies { batch, group, work } = self;
        let template = batch.template;
        let (mut rows, mut local, mut grounds, mut origins) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for lane in group.lanes() {
            let origin = group.origins[lane];
            rows.push(batch.vertices_of(group.bodies[lane]));
            local.push(origin.map(T::of));
            grounds.push(batch.grounds[group.bodies[lane]]);
            origins.push(origin);
        }
        let mut points: Vec<Vec3<R>> = memory::with_capacity(template.closing.num_points());
        let count = template.mesh.num_vertices;
        // SAFETY: as many points as are written, each three numbers in a row, and `read_rows` writes all that it is given.
        unsafe {
            let numbers = points.as_mut_ptr().cast::<MaybeUninit<R>>();
            R::read_rows(&rows, &local, std::slice::from_raw_parts_mut(numbers, 3 * count));
            points.set_len(count);
        }
        template.closing.forward(&mut points);
        work.run(&PosedBody::new(template, &points, &grounds, &origins));
    }
}
