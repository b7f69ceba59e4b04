//! Memory that grows with the input: vertices, faces, samples, parts, bodies.
//!
//! Rust's vectors abort the process when an allocation fails. The functions here unwind to the entry of the call
//! ([`guarded`]), which returns [`Error::OutOfMemory`]. They unwind instead of returning a `Result` because the
//! numerical loops allocate many such vectors, over SIMD lanes and threads, and have nothing to add to the error.

use crate::error::{Error, Result};
use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Bytes that must remain free after every larger array, for the small vectors, which are allocated without a check.
const SPARE: usize = 256 << 10;

/// Payload of the panic that unwinds when an allocation fails.
struct Lack {
    bytes: usize,
}

/// Runs `work`; [`Error::OutOfMemory`] if an allocation in it fails.
pub fn guarded<O>(work: impl FnOnce() -> Result<O>) -> Result<O> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| match panic.downcast::<Lack>() {
        Ok(lack) => Err(Error::OutOfMemory { bytes: lack.bytes }),
        Err(panic) => resume_unwind(panic),
    })
}

/// Runs `work` of another library; None if it panics. A failed allocation keeps unwinding.
pub fn isolated<O>(work: impl FnOnce() -> O) -> Option<O> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(output) => Some(output),
        Err(panic) if panic.is::<Lack>() => resume_unwind(panic),
        Err(_) => None,
    }
}

/// Whether `bytes` bytes can be allocated.
pub fn has(bytes: usize) -> bool {
    let mut probe: Vec<u8> = Vec::new();
    let reserved = probe.try_reserve_exact(bytes.saturating_add(SPARE));
    // Keeps the compiler from removing an allocation that nothing uses.
    black_box(&probe);
    reserved.is_ok()
}

/// Unwinds unless `bytes` bytes can be allocated. To be called before code that allocates by itself, or in many small
/// pieces.
pub fn ask(bytes: usize) {
    if !has(bytes) {
        lack(bytes);
    }
}

/// Reserves space for `more` further elements.
#[inline]
pub fn reserve<T>(numbers: &mut Vec<T>, more: usize) {
    if numbers.capacity() - numbers.len() < more {
        grow(numbers, more);
    }
}

/// The slow path of [`reserve`]: doubles, so that pushes stay cheap.
#[cold]
#[inline(never)]
fn grow<T>(numbers: &mut Vec<T>, more: usize) {
    let bytes = size_of::<T>().saturating_mul(numbers.len().saturating_add(more));
    let grown = if numbers.is_empty() { numbers.try_reserve_exact(more) } else { numbers.try_reserve(more) };
    if grown.is_err() {
        lack(bytes);
    }
    if bytes >= SPARE {
        ask(0);
    }
}

/// An empty vector with space for `count` elements.
#[inline]
pub fn with_capacity<T>(count: usize) -> Vec<T> {
    let mut numbers = Vec::new();
    reserve(&mut numbers, count);
    numbers
}

/// A vector of `count` copies of `value`.
#[inline]
pub fn filled<T: Clone>(value: T, count: usize) -> Vec<T> {
    let mut numbers = with_capacity(count);
    numbers.resize(count, value);
    numbers
}

#[inline]
pub fn push<T>(numbers: &mut Vec<T>, number: T) {
    reserve(numbers, 1);
    numbers.push(number);
}

#[inline]
pub fn extend<T>(numbers: &mut Vec<T>, more: impl IntoIterator<Item = T>) {
    let more = more.into_iter();
    reserve(numbers, more.size_hint().0);
    for number in more {
        push(numbers, number);
    }
}

#[inline]
pub fn collect<T>(numbers: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    extend(&mut all, numbers);
    all
}

#[inline]
pub fn copied<T: Copy>(numbers: &[T]) -> Vec<T> {
    let mut all = with_capacity(numbers.len());
    all.extend_from_slice(numbers);
    all
}

#[cold]
fn lack(bytes: usize) -> ! {
    // `resume_unwind` prints no message: this is no bug, and printing would itself allocate.
    resume_unwind(Box::new(Lack { bytes }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOO_MANY: usize = usize::MAX / 16;

    #[test]
    fn what_does_not_fit_is_an_error() {
        let lacks: [fn() -> Vec<f64>; 4] = [
            || filled(0.0, TOO_MANY),
            || with_capacity(TOO_MANY),
            || collect((0..TOO_MANY).map(|x| x as f64)),
            || {
                ask(usize::MAX);
                Vec::new()
            },
        ];
        for work in lacks {
            assert!(matches!(guarded(|| Ok(work())), Err(Error::OutOfMemory { .. })));
        }
        assert_eq!(guarded(|| Ok(collect(0..3))), Ok(vec![0, 1, 2]));
    }

    #[test]
    fn only_another_panic_is_isolated() {
        assert_eq!(isolated(|| 3), Some(3));
        assert_eq!(isolated(|| std::panic::resume_unwind(Box::new("a bug"))), None::<()>);
        let lacking = guarded(|| Ok(isolated(|| ask(usize::MAX))));
        assert!(matches!(lacking, Err(Error::OutOfMemory { .. })));
    }
}
