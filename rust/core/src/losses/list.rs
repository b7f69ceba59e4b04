//! From the list of all terms in [`super`] to a type that is any of them.

/// Makes [`AnyTerm`] from the list of all terms: an enum, for the methods of [`Term`] are generic.
macro_rules! list_of_terms {
    ($($Name:ident($Type:ty)),* $(,)?) => {
        /// A term of the list.
        pub enum AnyTerm {
            $($Name($Type)),*
        }

        /// Its running sums.
        pub enum AnySums<R: $crate::number::Real> {
            $($Name(<$Type as $crate::losses::term::Term>::Sums<R>)),*
        }

        /// What it saves for its backward.
        pub enum AnySaved<R: $crate::number::Real> {
            $($Name(<$Type as $crate::losses::term::Term>::Saved<R>)),*
        }

        const _: () = {
            use $crate::error::{Error, Result};
            use $crate::losses::term::{ByHeights, Description, Gradient, Named, Shared, Term, TermVisitor};
            use $crate::number::Real;
            use $crate::points::PointChunk;
            use $crate::sampling::Row;
            use $crate::template::Template;

            impl AnyTerm {
                /// All terms of the list, in their order.
                pub const DESCRIPTIONS: &'static [&'static Description] = &[$(<$Type>::DESCRIPTION),*];

                /// A term by its name, with the modes and options that its description lists.
                pub fn named(name: &str, modes: &[&str], options: &[f64]) -> Result<Self> {
                    $(
                        if name == <$Type>::DESCRIPTION.name {
                            return Ok(AnyTerm::$Name(<$Type>::named(modes, options)?));
                        }
                    )*
                    Err(Error::UnknownQuantity(name.into()))
                }

                /// Calls `visitor` with the term that is this quantity, with as many modes and options; None for others.
                pub fn visit_alone<V: TermVisitor>(
                    quantity: &str,
                    modes: &[&str],
                    options: &[f64],
                    visitor: V,
                ) -> Option<Result<V::Output>> {
                    $(
                        let known = <$Type>::DESCRIPTION;
                        let counts = (known.modes.len(), known.options.len());
                        if quantity == known.quantity && (modes.len(), options.len()) == counts {
                            return Some(<$Type>::named(modes, options).map(|term| visitor.visit(term)));
                        }
                    )*
                    None
                }
            }

            $(
                impl From<$Type> for AnyTerm {
                    fn from(term: $Type) -> Self {
                        AnyTerm::$Name(term)
                    }
                }
            )*

            impl Term for AnyTerm {
                type Sums<R: Real> = AnySums<R>;
                type Saved<R: Real> = AnySaved<R>;

                fn description(&self) -> &'static Description {
                    match self {
                        $(AnyTerm::$Name(term) => term.description()),*
                    }
                }

                fn check(&self, template: &Template) -> Result<()> {
                    match self {
                        $(AnyTerm::$Name(term) => Term::check(term, template)),*
                    }
                }

                fn reads_samples(&self) -> bool {
                    match self {
                        $(AnyTerm::$Name(term) => term.reads_samples()),*
                    }
                }

                fn begin<R: Real>(&self, shared: &Shared<R>, d_out: &[R], d_heights: &mut ByHeights<R>) -> AnySums<R> {
                    match self {
                        $(AnyTerm::$Name(term) => AnySums::$Name(term.begin(shared, d_out, d_heights))),*
                    }
                }

                fn add<R: Real>(
                    &self,
                    sums: &mut AnySums<R>,
                    chunk: &PointChunk,
                    heights: &Row<R>,
                    d_heights: &mut ByHeights<R>,
                ) {
                    match (self, sums) {
                        $((AnyTerm::$Name(term), AnySums::$Name(sums)) => term.add(sums, chunk, heights, d_heights),)*
                        _ => unreachable!("sums of another term"),
                    }
                }

                fn finish<R: Real>(&self, shared: &Shared<R>, sums: AnySums<R>, out: &mut [R]) -> AnySaved<R> {
                    match (self, sums) {
                        $((AnyTerm::$Name(term), AnySums::$Name(sums)) => {
                            AnySaved::$Name(term.finish(shared, sums, out))
                        })*
                        _ => unreachable!("sums of another term"),
                    }
                }

                fn backward<R: Real>(
                    &self,
                    shared: &Shared<R>,
                    saved: &AnySaved<R>,
                    d_out: &[R],
                    gradient: &mut Gradient<R>,
                ) {
                    match (self, saved) {
                        $((AnyTerm::$Name(term), AnySaved::$Name(saved)) => {
                            term.backward(shared, saved, d_out, gradient)
                        })*
                        _ => unreachable!("results of another term"),
                    }
                }
            }
        };
    };
}

pub(super) use list_of_terms;
