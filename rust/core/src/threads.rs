//! Threads: how many, and the pool. The only file that knows them.
//!
//! The pool belongs to the process that made it: after a fork the child makes its own.

use crate::error::{Error, Result};
use crate::memory;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock};

/// Items a thread does between two questions for an interruption.
const WAVE: usize = 4;

/// What the system's allocator sets aside for a thread, bytes of addresses. One for which there is no room would take a page
/// for every small vector; then all is done on the calling thread.
const ARENA_BYTES: usize = 64 << 20;

/// What the small vectors of a wave take at most, bytes: they are not asked for one by one.
const WAVE_BYTES: usize = 1 << 20;

/// Runs `f` on every item, on the pool if `parallel`. Between waves the calling thread asks whether to give up.
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

/// What was asked for, and what another library of this process uses; 0 where nothing is known.
static ASKED: AtomicUsize = AtomicUsize::new(0);
static FOLLOWED: AtomicUsize = AtomicUsize::new(0);

/// The threads that batches use: [`set_num_threads`], else `RAYON_NUM_THREADS`, else as [`follow`] says, else the
/// machine's cores.
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

/// None goes back to what the environment or another library says.
pub fn set_num_threads(threads: Option<usize>) {
    ASKED.store(threads.map_or(0, |threads| threads.clamp(1, MOST)), Relaxed);
}

/// Uses as many threads as another library of this process, so that the two together do not ask for more than there are.
pub fn follow(threads: usize) {
    FOLLOWED.store(threads.clamp(1, MOST), Relaxed);
}

/// The pool of this process with the wanted number of threads; None where the system refuses new threads. Pools are
/// leaked: a forked child must not even drop its parent's.
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
