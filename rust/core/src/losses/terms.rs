//! The terms of a training or fitting step together: any of the list in [`super`], in one pass over the body.

use super::AnyTerm;
use super::term::{OwnGradient, Term, forward, forward_and_backward, forward_and_jacobian};
use crate::error::{Result, unknown_choice};
use crate::memory;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::template::Template;

/// Terms that share one pass; their numbers stand side by side and are those of the separate losses.
///
/// ```
/// use ipman::Batch;
/// use ipman::losses::ground::{GroundLoss, Tanh};
/// use ipman::losses::stability::StabilityLoss;
/// use ipman::losses::terms::Terms;
/// use ipman::mass::Method;
/// use ipman::points::Points;
/// use ipman::pressure::{CenterOfPressure, PressureCurve};
///
/// let (template, vertices) = ipman::example::cube();
/// let batch = Batch::new(&template, &vertices, &[0.0, 1.0, 0.0], &[0.0], &|| false)?;
/// let pressure = CenterOfPressure { curve: PressureCurve { alpha: 100.0, gamma: 10.0 }, epsilon: 0.0 };
/// let stability = StabilityLoss { method: Method::Pcom, pressure };
/// let (alpha1, alpha2, beta1, beta2) = (1.0, 0.15, 10.0, 0.15);
/// let ground = GroundLoss { points: Points::Samples, tanh: Tanh::Squared, alpha1, alpha2, beta1, beta2 };
/// let alone = [batch.value(&stability)?, batch.value(&ground)?].concat();
/// assert_eq!(batch.value(&Terms(vec![stability.into(), ground.into()]))?, alone);
/// # Ok::<(), ipman::Error>(())
/// ```
pub struct Terms(pub Vec<AnyTerm>);

impl Terms {
    /// From each term's name followed by its modes, and the options of all.
    pub fn named(mut words: &[&str], mut options: &[f64]) -> Result<Self> {
        let mut terms = Vec::new();
        while let [name, rest @ ..] = words {
            let Some(known) = AnyTerm::DESCRIPTIONS.iter().find(|known| known.name == *name) else {
                let names: Vec<_> = AnyTerm::DESCRIPTIONS.iter().map(|known| format!("{:?}", known.name)).collect();
                return Err(unknown_choice("terms", &names.join(", "), name));
            };
            let (Some((modes, rest)), Some((own, others))) =
                (rest.split_at_checked(known.modes.len()), options.split_at_checked(known.options.len()))
            else {
                return Err(unknown_choice("terms", &format!("{:?} and {:?}", known.modes, known.options), name));
            };
            terms.push(AnyTerm::named(known.name, modes, own)?);
            (words, options) = (rest, others);
        }
        match (terms.is_empty(), options) {
            (false, []) => Ok(Terms(terms)),
            _ => Err(unknown_choice("terms", "terms and their options", &format!("{} more options", options.len()))),
        }
    }

    /// For each number of a row, how many numbers per vertex the Jacobian has: 1 for a gradient along the ground's
    /// normal, else 3.
    pub fn widths(&self) -> Vec<usize> {
        let of_term = |term: &AnyTerm| {
            let known = term.description();
            std::iter::repeat_n(if known.along_normal { 1 } else { 3 }, known.numbers.len())
        };
        self.0.iter().flat_map(of_term).collect()
    }

    /// Length of a body's Jacobian.
    pub fn jacobian_row(&self, template: &Template) -> usize {
        self.widths().iter().sum::<usize>() * template.mesh.num_vertices
    }

    /// The numbers, and the gradient of each.
    pub fn forward_and_jacobian<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) -> Vec<OwnGradient<R>> {
        forward_and_jacobian(&self.0, posed, out)
    }
}

impl Quantity for Terms {
    type Saved<R: Real> = ();

    fn num_outputs(&self, _: &Template) -> usize {
        self.widths().len()
    }

    fn check(&self, template: &Template) -> Result<()> {
        self.0.iter().try_for_each(|term| Term::check(term, template))
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) {
        forward(&self.0, posed, out);
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        let mut out = memory::filled(R::zero(), d_out.len());
        forward_and_backward(&self.0, posed, d_out, &mut out, d_points);
    }

    fn forward_and_backward<R: Real>(
        &self,
        posed: &PosedBody<R>,
        d_out: &[R],
        out: &mut [R],
        d_points: &mut [Vec3<R>],
    ) {
        forward_and_backward(&self.0, posed, d_out, out, d_points);
    }
}
