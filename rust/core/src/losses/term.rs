//! A term of a loss: one number of each body, or two, with their gradient. Alone it is a [`Quantity`]; together with
//! others ([`super::terms`]) it shares the heights of the vertices, the centre of mass and one pass over the samples.

use crate::error::Result;
use crate::mass::{Centre, Method};
use crate::memory;
use crate::number::Real;
use crate::number::vector::Vec3;
use crate::points::{PointChunk, Points};
use crate::posed::PosedBody;
use crate::quantity::Quantity;
use crate::sampling::{CHUNK, Row};
use crate::template::Template;
use std::cell::OnceCell;
use std::slice::from_ref;

/// The names by which a term is asked for.
#[derive(Debug, PartialEq)]
pub struct Description {
    pub name: &'static str,
    /// The names of its numbers, in their order.
    pub numbers: &'static [&'static str],
    /// Whether the gradients of its numbers are along the ground's normal. Then they are given by the vertices' heights,
    /// and a Jacobian holds one number per vertex for them, not three.
    pub along_normal: bool,
    /// The words that choose its variant.
    pub modes: &'static [&'static str],
    /// Its constants, by their names in a preset.
    pub options: &'static [&'static str],
}

/// A term that can be made from its description's modes and options.
pub trait Named: Term + Sized {
    const DESCRIPTION: &'static Description;

    /// `modes` and `options` have the lengths of the description's.
    fn named(modes: &[&str], options: &[f64]) -> Result<Self>;
}

/// The order of the calls is `begin`, `add` for each chunk of samples, `finish`, `backward`.
pub trait Term: Send + Sync + 'static {
    /// Running sums over the samples; () for a term that reads none.
    type Sums<R: Real>;
    /// Intermediate results for the backward.
    type Saved<R: Real>;

    fn description(&self) -> &'static Description;

    /// The error names the option that is out of range.
    fn check(&self, template: &Template) -> Result<()>;

    /// Whether [`Term::add`] wants the samples.
    fn reads_samples(&self) -> bool {
        false
    }

    /// `d_out`, the upstream gradient, is for terms that have their gradient by the heights ready in the pass: they add
    /// it to `d_heights`, here or in `add`.
    fn begin<R: Real>(&self, shared: &Shared<R>, d_out: &[R], d_heights: &mut ByHeights<R>) -> Self::Sums<R>;

    /// Adds a chunk of samples, of which `heights` are the heights.
    fn add<R: Real>(
        &self,
        _sums: &mut Self::Sums<R>,
        _chunk: &PointChunk,
        _heights: &Row<R>,
        _d_heights: &mut ByHeights<R>,
    ) {
    }

    /// Writes the numbers.
    fn finish<R: Real>(&self, shared: &Shared<R>, sums: Self::Sums<R>, out: &mut [R]) -> Self::Saved<R>;

    /// Adds Σ d_out · ∂out/∂points, but for what the pass has added already.
    fn backward<R: Real>(
        &self,
        _shared: &Shared<R>,
        _saved: &Self::Saved<R>,
        _d_out: &[R],
        _gradient: &mut Gradient<R>,
    ) {
    }
}

/// What all terms share of a posed body.
pub struct Shared<'a, R: Real> {
    pub posed: &'a PosedBody<'a, R>,
    /// h of each vertex of the mesh.
    pub heights: Vec<R>,
    /// One per [`Method`].
    centres: [OnceCell<Centre<R>>; Method::COUNT],
}

impl<'a, R: Real> Shared<'a, R> {
    pub fn new(posed: &'a PosedBody<R>) -> Self {
        Shared { posed, heights: posed.heights(), centres: std::array::from_fn(|_| OnceCell::new()) }
    }

    pub fn template(&self) -> &'a Template {
        self.posed.template
    }

    /// The centre of mass, computed when it is first asked for.
    pub fn centre(&self, method: Method) -> &Centre<R> {
        self.centres[method as usize].get_or_init(|| method.forward(self.posed))
    }
}

/// Gradients by the vertices' heights, which a pass over the samples adds to.
pub enum ByHeights<'a, R> {
    Unasked,
    /// One gradient, of Σ d_out · out.
    Sum(&'a mut [R]),
    /// One gradient for each number of a term along the normal.
    Each(&'a mut [Vec<R>]),
}

/// A gradient that several terms add to.
pub struct Gradient<'a, R: Real> {
    posed: &'a PosedBody<'a, R>,
    /// By the vertices' heights; not yet contained in `points`.
    heights: Option<Vec<R>>,
    points: &'a mut [Vec3<R>],
}

impl<R: Real> Gradient<'_, R> {
    /// The gradient by the body's points, the virtual vertices included, to add to.
    pub fn points(&mut self) -> &mut [Vec3<R>] {
        if let Some(heights) = self.heights.take() {
            self.posed.heights_backward(&heights, self.points);
        }
        self.points
    }

    /// For a backward that adds a gradient by the heights, too: it adds to the first, and then the first to the second.
    pub fn heights_and_points(&mut self) -> (Vec<R>, &mut [Vec3<R>]) {
        let zeros = || memory::filled(R::zero(), self.posed.template.mesh.num_vertices);
        (self.heights.take().unwrap_or_else(zeros), self.points)
    }
}

/// The gradient of one number, a part of a Jacobian.
pub enum OwnGradient<R> {
    /// By the body's points.
    Points(Vec<Vec3<R>>),
    /// By the vertices' heights.
    Heights(Vec<R>),
}

/// The gradients by heights that a pass collects.
enum Wanted<R> {
    Nothing,
    Sum(Vec<R>),
    /// Of each term, of each of its numbers.
    Each(Vec<Vec<Vec<R>>>),
}

impl<R> Wanted<R> {
    fn of(&mut self, term: usize) -> ByHeights<'_, R> {
        match self {
            Wanted::Nothing => ByHeights::Unasked,
            Wanted::Sum(heights) => ByHeights::Sum(heights),
            Wanted::Each(terms) => ByHeights::Each(&mut terms[term]),
        }
    }
}

/// Each term with its share of a row of numbers.
fn with_numbers<'a, T: Term, N>(terms: &'a [T], mut numbers: &'a [N]) -> impl Iterator<Item = (&'a T, &'a [N])> {
    terms.iter().map(move |term| {
        let (own, rest) = numbers.split_at(term.description().numbers.len());
        numbers = rest;
        (term, own)
    })
}

/// The pass: writes the numbers of all terms.
fn pass<T: Term, R: Real>(
    terms: &[T],
    shared: &Shared<R>,
    d_out: &[R],
    wanted: &mut Wanted<R>,
    mut out: &mut [R],
) -> Vec<T::Saved<R>> {
    let mut sums = Vec::with_capacity(terms.len());
    for (term, d_out) in with_numbers(terms, d_out) {
        sums.push(term.begin(shared, d_out, &mut wanted.of(sums.len())));
    }
    if terms.iter().any(Term::reads_samples) {
        let mut heights = [R::zero(); CHUNK];
        for chunk in Points::Samples.chunks(shared.template()) {
            chunk.gather(&shared.heights, &mut heights);
            for (k, (term, sums)) in terms.iter().zip(&mut sums).enumerate() {
                if term.reads_samples() {
                    term.add(sums, &chunk, &heights, &mut wanted.of(k));
                }
            }
        }
    }
    let mut saved = Vec::with_capacity(terms.len());
    for (term, sums) in terms.iter().zip(sums) {
        let (own, rest) = out.split_at_mut(term.description().numbers.len());
        saved.push(term.finish(shared, sums, own));
        out = rest;
    }
    saved
}

/// The numbers of all terms.
pub(super) fn forward<T: Term, R: Real>(terms: &[T], posed: &PosedBody<R>, out: &mut [R]) {
    let unasked = memory::filled(R::zero(), out.len());
    pass(terms, &Shared::new(posed), &unasked, &mut Wanted::Nothing, out);
}

/// The numbers, and Σ d_out · ∂out/∂points, added to `d_points`.
pub(super) fn forward_and_backward<T: Term, R: Real>(
    terms: &[T],
    posed: &PosedBody<R>,
    d_out: &[R],
    out: &mut [R],
    d_points: &mut [Vec3<R>],
) {
    let shared = Shared::new(posed);
    let zeros = || memory::filled(R::zero(), posed.template.mesh.num_vertices);
    let any_along_normal = terms.iter().any(|term| term.description().along_normal);
    let mut wanted = if any_along_normal { Wanted::Sum(zeros()) } else { Wanted::Nothing };
    let saved = pass(terms, &shared, d_out, &mut wanted, out);
    let heights = if let Wanted::Sum(heights) = wanted { Some(heights) } else { None };
    let mut gradient = Gradient { posed, heights, points: d_points };
    for ((term, d_out), saved) in with_numbers(terms, d_out).zip(&saved) {
        term.backward(&shared, saved, d_out, &mut gradient);
    }
    gradient.points();
}

/// The numbers, and the gradient of each.
pub(super) fn forward_and_jacobian<T: Term, R: Real>(
    terms: &[T],
    posed: &PosedBody<R>,
    out: &mut [R],
) -> Vec<OwnGradient<R>> {
    let shared = Shared::new(posed);
    let zeros = |term: &T| {
        let Description { numbers, along_normal, .. } = term.description();
        let count = if *along_normal { numbers.len() } else { 0 };
        (0..count).map(|_| memory::filled(R::zero(), posed.template.mesh.num_vertices)).collect()
    };
    let mut wanted = Wanted::Each(terms.iter().map(zeros).collect());
    let saved = pass(terms, &shared, &memory::filled(R::of(1.0), out.len()), &mut wanted, out);
    let Wanted::Each(by_heights) = wanted else { unreachable!("as it was made") };
    let mut gradients = Vec::with_capacity(out.len());
    for ((term, saved), by_heights) in terms.iter().zip(&saved).zip(by_heights) {
        let Description { numbers, along_normal, .. } = term.description();
        gradients.extend(by_heights.into_iter().map(OwnGradient::Heights));
        for k in 0..if *along_normal { 0 } else { numbers.len() } {
            let mut d_out = memory::filled(R::zero(), numbers.len());
            d_out[k] = R::of(1.0);
            let mut points = memory::filled([R::zero(); 3], posed.points.len());
            let mut gradient = Gradient { posed, heights: None, points: &mut points };
            term.backward(&shared, saved, &d_out, &mut gradient);
            gradient.points();
            gradients.push(OwnGradient::Points(points));
        }
    }
    gradients
}

/// A term alone.
impl<T: Term> Quantity for T {
    type Saved<R: Real> = ();

    fn num_outputs(&self, _: &Template) -> usize {
        self.description().numbers.len()
    }

    fn check(&self, template: &Template) -> Result<()> {
        Term::check(self, template)
    }

    fn forward<R: Real>(&self, posed: &PosedBody<R>, out: &mut [R]) {
        forward(from_ref(self), posed, out);
    }

    fn backward<R: Real>(&self, posed: &PosedBody<R>, _: &(), d_out: &[R], d_points: &mut [Vec3<R>]) {
        let mut out = memory::filled(R::zero(), d_out.len());
        forward_and_backward(from_ref(self), posed, d_out, &mut out, d_points);
    }

    fn forward_and_backward<R: Real>(
        &self,
        posed: &PosedBody<R>,
        d_out: &[R],
        out: &mut [R],
        d_points: &mut [Vec3<R>],
    ) {
        forward_and_backward(from_ref(self), posed, d_out, out, d_points);
    }
}
