//! One bench per quantity: the value and its gradient in one pass, over a body of SMPL's size, float32 and float64, one body
//! and 64, on one thread.
//!
//! `cargo bench` runs all, `cargo bench -- volume` one; `IPMAN_SIMD=scalar|avx2|avx512|neon` chooses the lanes.
//! `python -m benchmarks.widths` compares the lanes quantity by quantity.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ipman::losses::balance::{BalanceCost, Wrap};
use ipman::losses::ground::{GroundLoss, Tanh};
use ipman::losses::stability::StabilityLoss;
use ipman::losses::terms::Terms;
use ipman::mass::{CenterOfMass, Method};
use ipman::mass_properties::MassProperties;
use ipman::number::Data;
use ipman::points::Points;
use ipman::pressure::{CenterOfPressure, Pressure, PressureCurve};
use ipman::quantity::Quantity;
use ipman::sample_surface::SampleSurface;
use ipman::support::{Contact, ContactRule, SupportMargin};
use ipman::threads::set_num_threads;
use ipman::volume::PartVolumes;
use ipman::{Batch, Template};
use std::hint::black_box;
use std::time::Duration;

type Vec3 = [f64; 3];

const RINGS: usize = 82;
const SIDES: usize = 84;
const SAMPLES: usize = 20_000;
const PARTS: i64 = 10;

/// A capsule-like person of 2 + 82 · 84 = 6,890 vertices and 13,776 faces, in ten slices from foot to head.
fn body() -> (Template, Vec<Vec3>) {
    let mut vertices = vec![[0.0, -0.01, 0.0]];
    for ring in 0..RINGS {
        let polar = std::f64::consts::PI * (ring + 1) as f64 / (RINGS + 1) as f64;
        for side in 0..SIDES {
            let around = std::f64::consts::TAU * side as f64 / SIDES as f64;
            let (across, height) = (polar.sin(), 0.84 - 0.85 * polar.cos());
            vertices.push([0.2 * across * around.cos(), height, 0.15 * across * around.sin()]);
        }
    }
    vertices.push([0.0, 1.69, 0.0]);

    let at = |ring: usize, side: usize| (1 + ring * SIDES + side % SIDES) as i64;
    let top = (vertices.len() - 1) as i64;
    let mut faces = vec![];
    for side in 0..SIDES {
        faces.push([0, at(0, side), at(0, side + 1)]);
        for ring in 0..RINGS - 1 {
            faces.push([at(ring, side), at(ring + 1, side), at(ring, side + 1)]);
            faces.push([at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)]);
        }
        faces.push([at(RINGS - 1, side), top, at(RINGS - 1, side + 1)]);
    }
    let ring_of = |vertex: i64| ((vertex - 1).max(0) as usize / SIDES).min(RINGS - 1);
    let lowest = |face: &[i64; 3]| face.iter().map(|&vertex| ring_of(vertex)).min().unwrap_or(0);
    let parts: Vec<i64> = faces.iter().map(|face| lowest(face) as i64 * PARTS / RINGS as i64).collect();
    let template = Template::new(&vertices, &faces, &parts, SAMPLES, 7).expect("a closed surface");
    (template, vertices)
}

/// `count` bodies, each leaning a little more than the one before.
fn leaning<T: Data>(vertices: &[Vec3], count: usize) -> Vec<T> {
    let lean = |body: usize, v: &Vec3| [v[0] + 0.002 * body as f64 * v[1], v[1], v[2]];
    (0..count).flat_map(|body| vertices.iter().flat_map(move |v| lean(body, v))).map(T::of).collect()
}

/// Times one quantity for both precisions and both batch sizes.
fn bench<Q: Quantity>(criterion: &mut Criterion, name: &str, quantity: &Q) {
    let (template, vertices) = body();
    let mut group = criterion.benchmark_group(name);
    for count in [1, 64] {
        group.throughput(Throughput::Elements(count as u64));
        let f32 = leaning::<f32>(&vertices, count);
        let f64 = leaning::<f64>(&vertices, count);
        group.bench_function(BenchmarkId::new("f32", count), |b| b.iter(|| once(&template, quantity, &f32, count)));
        group.bench_function(BenchmarkId::new("f64", count), |b| b.iter(|| once(&template, quantity, &f64, count)));
    }
    group.finish();
}

fn once<T: Data, Q: Quantity>(template: &Template, quantity: &Q, vertices: &[T], count: usize) {
    let d_out = vec![T::of(1.0); count * quantity.num_outputs(template)];
    let done = batch(template, vertices, count).value_and_vjp(quantity, &d_out);
    let _ = black_box(done.expect("finite bodies"));
}

fn batch<'a, T: Data>(template: &'a Template, vertices: &'a [T], count: usize) -> Batch<'a, T> {
    let normals = [0.0, 1.0, 0.0].repeat(count);
    Batch::new(template, vertices, &normals, &vec![0.0; count], &|| false).expect("as long as the template says")
}

const CURVE: PressureCurve = PressureCurve { alpha: 100.0, gamma: 10.0 };
const CONTACT: Contact = Contact { rule: ContactRule::Paper, threshold: 0.1 };

fn ground() -> GroundLoss {
    let (alpha1, alpha2, beta1, beta2) = (1.0, 0.15, 10.0, 0.15);
    GroundLoss { points: Points::Samples, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 }
}

fn stability() -> StabilityLoss {
    StabilityLoss { method: Method::Pcom, pressure: CenterOfPressure { curve: CURVE, epsilon: 0.0 } }
}

fn quantities(criterion: &mut Criterion) {
    set_num_threads(Some(1));
    bench(criterion, "volume", &PartVolumes);
    bench(criterion, "mass_properties", &MassProperties { densities: vec![985.0] });
    bench(criterion, "sampling", &SampleSurface);
    bench(criterion, "mass", &CenterOfMass { method: Method::Pcom });
    bench(criterion, "mass_exact", &CenterOfMass { method: Method::Exact });
    bench(criterion, "pressure", &Pressure { curve: CURVE });
    bench(criterion, "center_of_pressure", &CenterOfPressure { curve: CURVE, epsilon: 0.0 });
    bench(criterion, "support", &SupportMargin { contact: CONTACT, method: Method::Pcom });
    bench(criterion, "stability", &stability());
    bench(criterion, "ground", &ground());
    let balance = BalanceCost { method: Method::Pcom, wrap: Wrap::Log, curve: CURVE, sigma: 0.02 };
    bench(criterion, "balance", &balance);
    bench(criterion, "terms", &Terms(vec![stability().into(), ground().into()]));
    closing(criterion);
    hulls(criterion);
}

/// Closing has no quantity of its own: the virtual vertices of one body.
fn closing(criterion: &mut Criterion) {
    let (template, vertices) = body();
    let points: Vec<[f32; 3]> = vertices.iter().map(|v| v.map(|x| x as f32)).collect();
    criterion.bench_function("closing/f32/1", |b| {
        b.iter(|| {
            let mut points = points.clone();
            template.closing.forward(&mut points);
            black_box(points)
        })
    });
}

/// The whole base of support: contacts, hull, margin.
fn hulls(criterion: &mut Criterion) {
    let (template, vertices) = body();
    let mut group = criterion.benchmark_group("base_of_support");
    for count in [1, 64] {
        group.throughput(Throughput::Elements(count as u64));
        let bodies = leaning::<f32>(&vertices, count);
        group.bench_function(BenchmarkId::new("f32", count), |b| {
            b.iter(|| black_box(batch(&template, &bodies, count).base_of_support(&CONTACT, Method::Pcom)))
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = quantities
}
criterion_main!(benches);
