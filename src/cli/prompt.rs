//! `donut prompt`: what a language model would be sent.
//!
//! A task or a description comes in; the prompt goes to standard output, byte for byte. Imports llm.

use clap::Args;

use super::stdout;
use super::wanted::WantedArgs;
use crate::llm::prompt::{Variant, plan_prompt};

/// Prints what a language model would be sent for a task, byte for byte.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut prompt --task donut > prompt.md\n  \
    donut prompt --describe 'The dough is a ball with radius 1. Make a bagel.'")]
pub struct PromptArgs {
    #[command(flatten)]
    wanted: WantedArgs,
    /// The prompt without the parts on volume and chain reasoning.
    #[arg(long)]
    without_volume_reasoning: bool,
}

/// Prints the prompt.
pub fn run(args: &PromptArgs) -> anyhow::Result<()> {
    let wanted = args.wanted.find()?;
    let variant = if args.without_volume_reasoning { Variant::WithoutVolumeReasoning } else { Variant::Full };
    let prompt = plan_prompt(variant, wanted.line("`donut prompt`")?);
    Ok(stdout::text(prompt)?)
}
