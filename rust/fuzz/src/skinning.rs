//! Skinning: arrays that do not fit are refused, and the zero pose of a model without a mean is its template.

use crate::source::Source;
use ipman::skinning::batch::{Bodies, PosedBatch, Rows, TILE, Upstream};
use ipman::skinning::{Model, Skin};

pub fn run(data: &[u8]) {
    let mut source = Source(data);
    let [vertices, joints] = [1 + source.below(40), 1 + source.below(5)];
    let [betas, expressions] = [source.below(4), source.below(3)];
    let poses = if source.byte().is_multiple_of(2) { 9 * (joints - 1) } else { 0 };
    let mut array = |count: usize| -> Vec<f64> { (0..count).map(|_| source.unit()).collect() };
    let mut arrays = [
        array(3 * vertices),
        array(3 * vertices * betas),
        array(3 * vertices * expressions),
        array(3 * vertices * poses),
        array(3 * joints),
        array(3 * joints * betas),
        array(3 * joints * expressions),
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].repeat(joints),
        vec![0.0; 3 * joints],
        (0..vertices * joints).map(|at| f64::from((at / joints) % joints == at % joints)).collect(),
    ];
    let mut parents: Vec<i64> = (0..joints as i64).map(|joint| source.below(joint as usize + 1) as i64 - 1).collect();
    let spoilt = source.byte() % 4;
    for _ in 0..spoilt {
        let array = &mut arrays[source.below(10)];
        match source.byte() % 3 {
            0 => array.truncate(source.below(array.len() + 1)),
            1 => array.push(source.number()),
            _ if array.is_empty() => {}
            _ => {
                let at = source.below(array.len());
                array[at] = source.number();
            }
        }
        let joint = source.below(joints);
        parents[joint] = source.below(8) as i64 - 2;
    }
    let [v, shapes, expression, posedirs, places, joint_shapes, joint_expressions, rest, mean, weights] = &arrays;
    let model = Model {
        v_template: v,
        shapedirs: shapes,
        expressiondirs: expression,
        posedirs,
        joints: places,
        joint_shapes,
        joint_expressions,
        rest_rotation: rest,
        pose_mean: mean,
        weights,
        parents: &parents,
    };
    let Ok(skin) = Skin::<f64, TILE>::new(&model) else { return };
    pose(&skin, &mut source);
    if spoilt == 0 {
        let mut there = vec![f64::NAN; v.len()];
        let pose = vec![0.0; 3 * joints];
        let batch = PosedBatch::new(&skin, 1, bodies([&pose, &[], &[], &[]], 1), &|| false).expect("shapes that fit");
        batch.forward(&mut there, &mut vec![0.0; 3 * joints]).expect("shapes that fit");
        assert!(there.iter().zip(v).all(|(there, v)| (there - v).abs() < 1e-12));
    }
}

fn bodies<'a>(arrays: [&'a [f64]; 4], count: usize) -> Bodies<'a, f64> {
    let [pose, betas, expression, transl] =
        arrays.map(|numbers| Rows { numbers, width: numbers.len() / count, shared: false });
    Bodies { pose, betas, expression, transl }
}

/// Bodies with any parameters, their gradient, and that of a body alone: a body that is not finite is all NaN, and the
/// others do not notice.
fn pose(skin: &Skin<f64, TILE>, source: &mut Source) {
    let count = 1 + source.below(5);
    let width = [3, 6, 4][source.below(3)] * skin.num_joints();
    let mut numbers = |width: usize| -> Vec<f64> { (0..count * width).map(|_| source.number()).collect() };
    let [pose, betas, expression, transl] =
        [numbers(width), numbers(skin.num_betas()), numbers(skin.num_expressions()), numbers(3)];
    let given = [&pose[..], &betas, &expression, &transl];
    let Ok(batch) = PosedBatch::new(skin, count, bodies(given, count), &|| false) else { return };
    let (row, joints) = (3 * skin.num_vertices, 3 * skin.num_joints());
    let (mut vertices, mut places) = (vec![0.0; count * row], vec![0.0; count * joints]);
    batch.forward(&mut vertices, &mut places).expect("shapes that fit");
    let (d_vertices, mut d_pose, mut d_transl) = (vec![1.0; count * row], vec![0.0; pose.len()], vec![0.0; 3 * count]);
    let upstream = Upstream { vertices: &d_vertices, joints: &[] };
    batch.vjp(upstream, [&mut d_pose, &mut [], &mut [], &mut d_transl]).expect("shapes that fit");
    assert!(d_transl.iter().all(|d| d.is_finite()));
    for body in 0..count {
        let part = |numbers: &[f64]| numbers[body * numbers.len() / count..(body + 1) * numbers.len() / count].to_vec();
        let own = given.map(part);
        let own = bodies([&own[0], &own[1], &own[2], &own[3]], 1);
        let (mut alone, mut places) = (vec![0.0; row], vec![0.0; joints]);
        let batch = PosedBatch::new(skin, 1, own, &|| false).expect("shapes that fit");
        batch.forward(&mut alone, &mut places).expect("shapes that fit");
        for (alone, there) in alone.iter().zip(&vertices[body * row..]) {
            assert!(alone.to_bits() == there.to_bits() || (alone.is_nan() && there.is_nan()), "{alone} {there}");
        }
    }
}
