//! Threads: how many, and the pool. The only file that knows them.
//!
//! The pool belongs to the process that made it: after a fork the child makes its own.

use crate::error::{Error, Result};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Items a thread does between two questions for an interruption.
const WAVE: usize = 4;

/// Runs `f` on every item, on the pool if `parallel`. Between waves the calling thread asks whether to give up.
pub fn each<I: Send>(
    mut items: Vec<I>,
    parallel: bool,
    interrupted: &(dyn Fn() -> bool + Sync),
    f: &(dyn Fn(I) + Sync),
) -> Result<()> {
    let threads = if parallel && items.len() > 1 { num_threads() } else { 1 };
    while !items.is_empty() {
        if interrupted() {
            return Err(Error::Interrupted);
        }
        let wave = items.drain(..items.len().min(WAVE * threads));
        if threads == 1 {
            wave.for_each(f);
        } else {
            let wave: Vec<I> = wave.collect();
            pool().install(|| wave.into_par_iter().with_max_len(1).for_each(f));
        }
    }
    Ok(())
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
