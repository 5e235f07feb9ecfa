//! `tessclip plan`: what a scene is turned into, without a GPU.

use serde::Serialize;
use tessclip::plan::{DEFAULT_MOST_BYTES, Plan, PlannedPass};

use super::Outcome;
use super::args::{LookArgs, ShapeArgs, TerrainArgs};
use super::scene_file::SceneFile;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip plan procedural:mountains --color elevation --no-cull")]
pub struct Args {
    #[command(flatten)]
    terrain: TerrainArgs,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    look: LookArgs,
    /// Machine-readable
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Planned<'a> {
    terrain: &'a str,
    base: String,
    n: u32,
    levels: u32,
    charts: u32,
    #[serde(flatten)]
    plan: &'a Plan,
}

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let file = SceneFile::of(&args.terrain.terrain)?;
    let scene = args.look.apply(args.shape.scene(&file)?, &file);
    let terrain = args.terrain.over(&file).open()?;
    let shape = scene.shape(&terrain)?;
    let plan = Plan::new(&scene, &terrain, shape, DEFAULT_MOST_BYTES, None);
    if let Some(large) = plan.buffers.iter().find(|b| b.bytes > DEFAULT_MOST_BYTES) {
        anyhow::bail!(
            "{} needs {} bytes, more than the {DEFAULT_MOST_BYTES} every device allows; lower --n",
            large.name,
            large.bytes
        );
    }
    let planned = Planned {
        terrain: &args.terrain.terrain,
        base: terrain.base().to_string(),
        n: shape.n(),
        levels: shape.levels(),
        charts: plan.variant.charts,
        plan: &plan,
    };
    if args.json {
        super::print(&serde_json::to_string_pretty(&planned)?)?;
    } else {
        print_table(&planned)?;
    }
    Ok(Outcome::Done)
}

fn print_table(planned: &Planned<'_>) -> anyhow::Result<()> {
    let Planned { terrain, base, n, levels, charts, plan } = planned;
    super::print(&format!("{terrain}: base {base}, {charts} chart(s), {levels} levels of n = {n}"))?;
    super::print(&format!("\npasses ({}, {} bindings)", plan.totals.passes, plan.totals.bindings))?;
    for pass in &plan.passes {
        print_pass(pass)?;
    }
    super::print(&format!("\nbuffers ({} bytes)", grouped(plan.totals.buffer_bytes)))?;
    for buffer in &plan.buffers {
        super::print(&format!("  {:<16} {:>14}", buffer.name, grouped(buffer.bytes)))?;
    }
    super::print("\ntextures (0 bytes)\n  none; colour and depth targets are the host's")?;
    super::print("\nleft out")?;
    for item in &plan.left_out {
        super::print(&format!("  {:<24} {}", item.feature, item.because))?;
    }
    Ok(())
}

fn print_pass(pass: &PlannedPass) -> anyhow::Result<()> {
    super::print(&format!("  {:<16} {}", pass.pass, pass.runs))?;
    super::print(&format!("    modules   {}", pass.modules.join(" + ")))?;
    let constants: Vec<String> = pass.constants.iter().map(|c| format!("{} = {}", c.name, c.value)).collect();
    if !constants.is_empty() {
        super::print(&format!("    constants {}", constants.join(", ")))?;
    }
    super::print(&format!("    bindings  {}", pass.bindings.join(", ")))?;
    if !pass.inputs.is_empty() {
        super::print(&format!("    draws     {}", pass.inputs.join(", ")))?;
    }
    Ok(())
}

/// Digits in groups of three.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (ix, digit) in digits.chars().enumerate() {
        if ix > 0 && (digits.len() - ix).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}
