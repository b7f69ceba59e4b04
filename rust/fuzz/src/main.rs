//! The targets in a plain loop: `soak [TARGET|all] [SECONDS] [SEED]`, or `soak corpus FOLDER` for cargo-fuzz's seeds.
//!
//! Inputs are the seeds, mutated, and random bytes. The first one that fails is written to `soak-TARGET.bin`.

use ipman_fuzz::{TARGETS, Target, seeds};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::panic::catch_unwind;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

const LONGEST: usize = 600;
/// An input that takes longer hangs.
const SLOW: Duration = Duration::from_secs(5);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |at: usize, otherwise: &'static str| arguments.get(at).map_or(otherwise, String::as_str);
    if argument(0, "all") == "corpus" {
        return write_corpus(Path::new(argument(1, "corpus")));
    }
    let wanted = |target: &&Target| [target.0, "all"].contains(&argument(0, "all"));
    let (Ok(seconds), Ok(seed)) = (argument(1, "60").parse(), argument(2, "1").parse()) else {
        eprintln!("soak [TARGET|all] [SECONDS] [SEED]");
        return ExitCode::from(2);
    };
    let results: Vec<bool> = TARGETS.iter().filter(wanted).map(|target| soak(target, seconds, seed)).collect();
    if !results.is_empty() && results.into_iter().all(|held| held) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Whether the target held for so many seconds.
fn soak((name, run): &Target, seconds: u64, seed: u64) -> bool {
    let (mut random, corpus, begin) = (ChaCha8Rng::seed_from_u64(seed), seeds(), Instant::now());
    let mut inputs: u64 = 0;
    while begin.elapsed() < Duration::from_secs(seconds) {
        let data = input(&mut random, &corpus);
        let started = Instant::now();
        let held = catch_unwind(|| run(&data)).is_ok();
        if !held || started.elapsed() > SLOW {
            let file = format!("soak-{name}.bin");
            std::fs::write(&file, &data).expect("the folder can be written to");
            println!("{name}: {} after {inputs} inputs, seed {seed}: {file}", if held { "slow" } else { "failed" });
            return false;
        }
        inputs += 1;
    }
    println!("{name}: {inputs} inputs in {seconds} s, seed {seed}: held");
    true
}

/// A seed with some bytes changed and more behind it, or nothing but random bytes.
fn input(random: &mut ChaCha8Rng, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut below = |limit: usize| (random.next_u64() % limit as u64) as usize;
    let (seed, changes, length) = (below(2 * corpus.len()), below(4), below(LONGEST));
    let mut data = corpus.get(seed).cloned().unwrap_or_default();
    for _ in 0..if data.is_empty() { 0 } else { changes } {
        let at = below(data.len());
        data[at] = below(256) as u8;
    }
    data.extend((0..length).map(|_| below(256) as u8));
    data
}

fn write_corpus(folder: &Path) -> ExitCode {
    for (name, _) in TARGETS {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        for (number, data) in seeds().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), data).expect("the folder can be written to");
        }
    }
    ExitCode::SUCCESS
}
