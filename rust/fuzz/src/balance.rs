//! Balance: the cost is a divergence, a body has the same bits alone and beside others, and the gradient is finite.

use crate::body::{Surface, poses};
use crate::source::Source;
use ipman::losses::balance::{BalanceCost, Wrap};
use ipman::mass::Method;
use ipman::number::Data;
use ipman::pressure::PressureCurve;
use ipman::{Batch, Template};

pub fn run(data: &[u8]) {
    let mut source = Source(data);
    let surface = Surface::consistent(&mut source);
    let Ok(template) = Template::new(&surface.points, &surface.faces, &surface.parts, 60, 1) else { return };
    let count = 1 + source.below(9);
    let vertices = poses(&surface, &mut source, count);
    let curve = PressureCurve { alpha: source.number(), gamma: source.number() };
    let wrap = [Wrap::Log, Wrap::Saturate, Wrap::None][source.below(3)];
    let cost = BalanceCost { method: Method::Exact, wrap, curve, sigma: source.number() };
    check::<f64>(&template, &vertices, &cost);
    let vertices: Vec<f32> = vertices.into_iter().map(|x| x as f32).collect();
    check::<f32>(&template, &vertices, &cost);
}

fn check<T: Data>(template: &Template, vertices: &[T], cost: &BalanceCost) {
    let row = 3 * template.mesh.num_vertices;
    let of = |vertices: &[T]| {
        let count = vertices.len() / row;
        let (normals, heights, d_out) = ([0.0, 1.0, 0.0].repeat(count), vec![0.0; count], vec![T::of(1.0); count]);
        let batch = Batch::new(template, vertices, &normals, &heights, &|| false).expect("of the template's shape");
        batch.value_and_vjp(cost, &d_out).ok()
    };
    let Some((values, gradient)) = of(vertices) else { return };
    let bits = |numbers: &[T]| numbers.iter().map(|x| x.value().to_bits()).collect::<Vec<_>>();
    for (body, vertices) in vertices.chunks_exact(row).enumerate() {
        let (value, own) = of(vertices).expect("the same options");
        assert!(value[0].value().is_nan() || value[0].value() >= 0.0, "{}", value[0].value());
        assert!(own.iter().all(|d| d.value().is_finite()));
        assert_eq!(value[0].value().is_nan(), values[body].value().is_nan());
        if !value[0].value().is_nan() {
            assert_eq!(bits(&value), bits(&values[body..][..1]));
            assert_eq!(bits(&own), bits(&gradient[body * row..][..row]));
        }
    }
}
