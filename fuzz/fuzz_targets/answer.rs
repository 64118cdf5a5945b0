//! Any text as the answer of a language model: it may be refused, but neither panic nor exceed its limits.
//!
//! A good corpus: prompts/recorded and tests/data/answers.

#![no_main]

use donut::llm::answer::stages_within;
use donut::stagecode::Limits;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let limits = Limits { operations: 200_000, elements: 20_000, depth: 200, seconds: 2.0, ..Limits::default() };
    let _ = stages_within(text, &limits);
});
