//! Bodies on lanes: a group of bodies is read, one a lane, computed, and written to the bodies' rows.

use super::{Batch, Group};
use crate::analysis::{Analysis, Polygon};
use crate::losses::terms::Terms;
use crate::memory;
use crate::number::vector::Vec3;
use crate::number::{Data, Real, Scalar, Work, all_finite};
use crate::quantity::Quantity;
use crate::scene::Scene;
use crate::template::Template;
use std::mem::MaybeUninit;

/// What is done with bodies on lanes.
pub(super) trait OnLanes<T> {
    fn run<R: Real<Data = T>>(self, scene: &Scene<R>);
}

/// Turns the bodies of a group into lanes.
pub(super) struct ReadBodies<'a, T, W> {
    pub batch: &'a Batch<'a, T>,
    pub group: &'a Group,
    pub work: W,
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
        work.run(&Scene::new(template, &points, &grounds, &origins));
    }
}

pub(super) struct Forward<'a, T, Q> {
    pub quantity: &'a Q,
    pub size: usize,
    pub out: Vec<&'a mut [T]>,
}

impl<T: Data, Q: Quantity> OnLanes<T> for Forward<'_, T, Q> {
    fn run<R: Real<Data = T>>(mut self, scene: &Scene<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        self.quantity.forward(scene, &mut out);
        R::write_rows(&out, &mut self.out);
    }
}

pub(super) struct Figures<'a, T> {
    pub analysis: &'a Analysis,
    pub size: usize,
    pub out: Vec<&'a mut [T]>,
    pub polygons: Vec<&'a mut Polygon>,
}

impl<T: Data> OnLanes<T> for Figures<'_, T> {
    fn run<R: Real<Data = T>>(mut self, scene: &Scene<R>) {
        let mut out = memory::filled(R::zero(), self.size);
        let polygons = self.analysis.forward(scene, &mut out);
        self.polygons.into_iter().zip(polygons).for_each(|(own, polygon)| *own = polygon);
        R::write_rows(&out, &mut self.out);
    }
}

pub(super) struct ForwardAndBackward<'a, T, Q> {
    pub template: &'a Template,
    pub quantity: &'a Q,
    pub size: usize,
    pub d_out: Vec<&'a [T]>,
    pub out: Vec<&'a mut [T]>,
    pub d_vertices: Vec<&'a mut [T]>,
}

impl<T: Data, Q: Quantity> OnLanes<T> for ForwardAndBackward<'_, T, Q> {
    fn run<R: Real<Data = T>>(mut self, scene: &Scene<R>) {
        let last = self.d_out.len() - 1;
        let mut d_out = memory::with_capacity(self.size);
        for k in 0..self.size {
            d_out.push(R::from_lanes(|lane| R::Scalar::read(self.d_out[lane.min(last)][k])));
        }
        let mut out = memory::filled(R::zero(), self.size);
        let mut d_points = memory::filled([R::zero(); 3], scene.points.len());
        self.quantity.forward_and_backward(scene, &d_out, &mut out, &mut d_points);
        self.template.closing.backward(&mut d_points);
        R::write_rows(&out, &mut self.out);
        let d_vertices = &d_points[..self.template.mesh.num_vertices];
        R::write_rows(d_vertices.as_flattened(), &mut self.d_vertices);
        for (row, d_out) in self.d_vertices.iter_mut().zip(&self.d_out) {
            zero_if_undefined(row, all_finite(d_out));
        }
    }
}

pub(super) struct ForwardAndJacobian<'a, T, Q> {
    pub template: &'a Template,
    pub quantity: &'a Q,
    pub size: usize,
    pub out: Vec<&'a mut [T]>,
    pub jacobian: Vec<&'a mut [T]>,
}

impl<T: Data, Q: Terms> OnLanes<T> for ForwardAndJacobian<'_, T, Q> {
    fn run<R: Real<Data = T>>(mut self, scene: &Scene<R>) {
        let count = self.template.mesh.num_vertices;
        let mut out = memory::filled(R::zero(), self.size);
        let mut d_first = memory::filled([R::zero(); 3], scene.points.len());
        let (mut d_pull, mut d_push) = (memory::filled(R::zero(), count), memory::filled(R::zero(), count));
        self.quantity.forward_and_jacobian(scene, &mut out, &mut d_first, [&mut d_pull, &mut d_push]);
        self.template.closing.backward(&mut d_first);
        R::write_rows(&out, &mut self.out);
        let mut start = 0;
        for numbers in [d_first[..count].as_flattened(), &d_pull, &d_push] {
            let rows = self.jacobian.iter_mut().map(|row| &mut row[start..start + numbers.len()]);
            R::write_rows(numbers, &mut rows.collect::<Vec<_>>());
            start += numbers.len();
        }
        self.jacobian.into_iter().for_each(|row| zero_if_undefined(row, true));
    }
}

/// A gradient that is not finite, though the upstream gradient is, belongs to a body on which the quantity is undefined
/// (no volume, coordinates out of range): it becomes zero.
pub(super) fn zero_if_undefined<T: Scalar>(gradient: &mut [T], upstream_is_finite: bool) {
    if upstream_is_finite && !all_finite(gradient) {
        gradient.fill(T::zero());
    }
}
