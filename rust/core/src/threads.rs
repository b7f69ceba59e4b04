//! Threads: how many, and the pool.
//!
//! A pool belongs to one process: after a fork the child creates its own.

use crate::error::{Error, Result};
use crate::memory;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock};

/// Items per thread between two checks for an interruption.
const WAVE: usize = 4;

/// Address space that the system's allocator reserves per thread, bytes. Without it a thread would take a page for
/// every small vector, so then everything runs on the calling thread.
const ARENA_BYTES: usize = 64 << 20;

/// Upper bound of the small vectors of a wave, bytes; they are not checked one by one.
const WAVE_BYTES: usize = 1 << 20;

/// Runs `f` on every item, on the pool if `parallel`. Between waves the calling thread checks for an interruption.
pub fn each<I: Send>(
    items: Vec<I>,
    parallel: bool,
    interrupted: &(dyn Fn() -> bool + Sync),
    f: &(dyn Fn(I) + Sync),
) -> Result<()> {
    let threads = if parallel && items.len() > 1 { num_threads() } else { 1 };
    let pool = if threads > 1 && memory::has(ARENA_BYTES * threads.min(16)) { pool() } else { None };
    let length = WAVE * pool.map_or(1, ThreadPool::current_num_threads);
    let mut items = items.into_iter();
    memory::guarded(|| {
        while items.len() > 0 {
            if interrupted() {
                return Err(Error::Interrupted);
            }
            memory::ask(WAVE_BYTES);
            let wave = items.by_ref().take(length);
            match pool {
                None => wave.for_each(f),
                Some(pool) => {
                    let wave: Vec<I> = wave.collect();
                    pool.install(|| wave.into_par_iter().with_max_len(1).for_each(f));
                }
            }
        }
        Ok(())
    })
}

/// The number of threads set by the user, and that of another library in this process; 0 if unknown.
static ASKED: AtomicUsize = AtomicUsize::new(0);
static FOLLOWED: AtomicUsize = AtomicUsize::new(0);

/// The number of threads that batches use: of [`set_num_threads`], else `RAYON_NUM_THREADS`, else of [`follow`], else
/// the number of cores.
pub fn num_threads() -> usize {
    static ENVIRONMENT: OnceLock<usize> = OnceLock::new();
    static CORES: OnceLock<usize> = OnceLock::new();
    let environment = || {
        let text = std::env::var("RAYON_NUM_THREADS").unwrap_or_default();
        text.trim().parse().unwrap_or(0).min(MOST)
    };
    let cores = || std::thread::available_parallelism().map_or(1, |n| n.get());
    let known = [ASKED.load(Relaxed), *ENVIRONMENT.get_or_init(environment), FOLLOWED.load(Relaxed)];
    known.into_iter().find(|&threads| threads > 0).unwrap_or_else(|| *CORES.get_or_init(cores))
}

const MOST: usize = 1024;

/// None restores the default: the environment's or another library's number.
pub fn set_num_threads(threads: Option<usize>) {
    ASKED.store(threads.map_or(0, |threads| threads.clamp(1, MOST)), Relaxed);
}

/// Uses as many threads as another library of this process, so that the two share one setting.
pub fn follow(threads: usize) {
    FOLLOWED.store(threads.clamp(1, MOST), Relaxed);
}

/// This process's pool with the wanted number of threads; None if the system refuses new threads. Pools are leaked,
/// because a forked child must not even drop its parent's.
fn pool() -> Option<&'static ThreadPool> {
    static POOLS: Mutex<Vec<(u32, usize, &'static ThreadPool)>> = Mutex::new(Vec::new());
    let (process, wanted) = (std::process::id(), num_threads());
    let mut pools = POOLS.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some((.., pool)) = pools.iter().find(|(owner, threads, _)| (*owner, *threads) == (process, wanted)) {
        return Some(pool);
    }
    let made = ThreadPoolBuilder::new().num_threads(wanted).thread_name(|i| format!("ipman-{i}")).build();
    let made = Box::leak(Box::new(made.ok()?));
    pools.push((process, wanted, made));
    Some(made)
}
