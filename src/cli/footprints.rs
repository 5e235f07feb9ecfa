//! `tessclip footprints`: Table 1 of Song et al. 2016 and its neighbours, by counting buffers.

use tessclip::clipmap::{ClipmapShape, Lattice};
use tessclip::rivals::{Footprint, footprints};

use super::Outcome;

#[derive(clap::Args)]
#[command(after_help = "Example: tessclip footprints --n 63,255 --levels 7")]
pub struct Args {
    /// Window sizes
    #[arg(long, value_delimiter = ',', default_value = "63,127,255,511")]
    n: Vec<u32>,
    /// Level counts
    #[arg(long, value_delimiter = ',', default_value = "7,9")]
    levels: Vec<u32>,
    /// Machine-readable
    #[arg(long)]
    json: bool,
}

const NOTE: &str = "control points: as Song et al. 2016 count them in Table 1 (43 a level) / as built (44 a level: \
their Fig. 1 numbers n0 to n43). bytes/frame: a frame in which the finest level shifts by one step on both axes; \
heights are left out, every method needs them.";

pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    // Any terrain large enough for all the levels: the footprints do not depend on it.
    let lattice = Lattice { last: [1 << 24; 2] };
    let mut rows: Vec<Footprint> = Vec::new();
    for &levels in &args.levels {
        for &n in &args.n {
            rows.extend(footprints(ClipmapShape::new(n, levels, lattice)?));
        }
    }
    if args.json {
        super::print(&serde_json::to_string_pretty(&serde_json::json!({ "rows": rows, "note": NOTE }))?)?;
        return Ok(Outcome::Done);
    }
    super::print("    n  levels  method        control points    vertices   bytes at start   bytes/frame")?;
    for r in &rows {
        let points = match (r.control_points, r.control_points_built) {
            (Some(a), Some(b)) => format!("{a} / {b}"),
            _ => "-".into(),
        };
        super::print(&format!(
            "{:>5}  {:>6}  {:<12}  {:>14}  {:>10}  {:>15}  {:>12}",
            r.n, r.levels, r.method, points, r.vertices, r.bytes_start, r.bytes_per_frame
        ))?;
    }
    super::print(NOTE)?;
    Ok(Outcome::Done)
}
