//! Any text as the code of a stage: it may fail, but neither panic nor exceed its limits.
//!
//! A good corpus: the files of tests/snippets and tests/programs.

#![no_main]

use donut::stagecode::{Limits, evaluate};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let limits = Limits { operations: 200_000, elements: 20_000, depth: 200, seconds: 2.0, ..Limits::default() };
    let start = "a = np.arange(6).reshape(2, 3)\nrng = np.random.default_rng(1)\n";
    let _ = evaluate(&limits, |session| session.run(&format!("{start}{text}"), 1, 0));
});
