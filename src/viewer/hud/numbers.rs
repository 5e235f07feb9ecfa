//! The lines of the numbers panel: speed, work, and what is sent, ours beside the classic methods.

use super::format::{bytes, count, cut, known, milliseconds};
use super::graph;
use crate::viewer::facts::{Facts, Sent};

/// Characters a line.
pub const COLUMNS: usize = 33;
/// GPU passes that are listed; the shortest are summed.
const PASSES: usize = 6;

/// The lines above the graph.
pub fn above_graph(facts: &Facts) -> String {
    let percentile = |p: f64| known(facts.frame_percentile(p), milliseconds);
    lines(&[
        facts.terrain.clone(),
        frames_per_s(facts),
        format!("frame p50 {}  p99 {}", percentile(0.5), percentile(0.99)),
    ])
}

/// The lines below it.
pub fn below_graph(facts: &Facts) -> String {
    let mut out = vec![
        graph::caption(&facts.frame_ms),
        row("CPU", &known(measured(facts.cpu_ms), milliseconds)),
        row("panels", &known(measured(facts.hud_ms), milliseconds)),
    ];
    gpu(facts, &mut out);
    drawn(facts, &mut out);
    sent(facts, &mut out);
    streamed(facts, &mut out);
    lines(&out)
}

/// Three lines for windows without room for the graph.
pub fn few(facts: &Facts) -> String {
    let cpu = known(measured(facts.cpu_ms), milliseconds);
    let p99 = known(facts.frame_percentile(0.99), milliseconds);
    lines(&[
        format!("{}  p99 {p99}", frames_per_s(facts)),
        format!("CPU {cpu}  GPU {}", known(gpu_ms(facts), milliseconds)),
        triangles(facts),
    ])
}

/// What the smallest windows show, the most important first.
pub fn fewest(facts: &Facts) -> Vec<String> {
    let p50 = known(facts.frame_percentile(0.5), milliseconds);
    vec![frames_per_s(facts), format!("p50 {p50}"), triangles(facts)]
}

fn lines(lines: &[String]) -> String {
    lines.iter().map(|line| cut(line, COLUMNS)).collect::<Vec<_>>().join("\n")
}

/// A name at the left and a value at the right.
fn row(name: &str, value: &str) -> String {
    let width = COLUMNS.saturating_sub(value.chars().count() + 1);
    format!("{:<width$} {value}", cut(name, width))
}

/// No work takes no time: 0 means that it was not measured.
fn measured(ms: f64) -> Option<f64> {
    (ms > 0.0).then_some(ms)
}

/// Over the last second.
fn frames_per_s(facts: &Facts) -> String {
    let (mut frames, mut total_ms) = (0.0, 0.0);
    for ms in facts.frame_ms.iter().rev() {
        frames += 1.0;
        total_ms += f64::from(*ms);
        if total_ms >= 1000.0 {
            break;
        }
    }
    let rate = (frames > 1.0 && total_ms > 0.0).then(|| 1000.0 * frames / total_ms);
    format!("{} frames/s", known(rate, |v| format!("{v:.1}")))
}

fn triangles(facts: &Facts) -> String {
    let drawn = facts.counters.map(|c| u64::from(c.index_count / 3));
    format!("{} triangles", known(drawn, count))
}

fn gpu_ms(facts: &Facts) -> Option<f64> {
    (!facts.passes.is_empty()).then(|| facts.passes.iter().map(|pass| pass.1).sum())
}

fn gpu(facts: &Facts, out: &mut Vec<String>) {
    out.push(row("GPU", &known(gpu_ms(facts), milliseconds)));
    let mut passes: Vec<_> = facts.passes.iter().map(|(name, ms)| (name.as_str(), *ms)).collect();
    passes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (listed, rest) = passes.split_at(passes.len().min(PASSES));
    for (name, ms) in listed {
        out.push(row(&format!("  {name}"), &milliseconds(*ms)));
    }
    if !rest.is_empty() {
        let name = format!("  {} more", rest.len());
        out.push(row(&name, &milliseconds(rest.iter().map(|pass| pass.1).sum())));
    }
    if !facts.adapter.is_empty() {
        out.push(format!("  {}", facts.adapter));
    }
}

fn drawn(facts: &Facts, out: &mut Vec<String>) {
    let some = |n: u32| known((n > 0).then_some(u64::from(n)), count);
    let patches = facts.counters.map(|c| u64::from(c.patches_visible.saturating_sub(c.patches_dropped)));
    let upload = &facts.upload;
    let missing = if upload.levels_missing > 0 {
        format!(", {} to come", upload.levels_missing)
    } else {
        String::new()
    };
    out.push(triangles(facts));
    out.push(format!("{} of {} patches", known(patches, count), some(facts.patches_total)));
    out.push(format!("{} of {} levels{missing}", some(upload.levels_drawn), some(facts.levels)));
}

/// Ours, Losasso and Hoppe 2004, Asirvatham and Hoppe 2005 (GPU Gems 2), and the heights that all of them send.
fn sent(facts: &Facts, out: &mut Vec<String>) {
    out.push(table_line("sent", "frame", "second"));
    let methods: [(&str, Sent); 4] = [
        ("ours", facts.ours),
        ("classic 2004", facts.classic),
        ("GPU Gems 2005", facts.gpu_gems),
        ("heights, all", facts.heights),
    ];
    for (name, sent) in methods {
        let rate = format!("{}/s", bytes(sent.per_s));
        out.push(table_line(name, &bytes(sent.frame as f64), &rate));
    }
}

fn table_line(name: &str, frame: &str, second: &str) -> String {
    format!("{name:<14}{frame:>8} {second:>10}")
}

fn streamed(facts: &Facts, out: &mut Vec<String>) {
    let Some(stream) = &facts.stream else { return };
    let [resident, limit] = [stream.resident_bytes, stream.limit_bytes].map(|n| bytes(n as f64));
    out.push(format!("cache {resident} of {limit}"));
    out.push(format!("{} hits, {} misses", count(stream.cache_hits), count(stream.cache_misses)));
    out.push(format!("{:.1} tiles/s, {} damaged", facts.tiles_per_s, count(stream.damaged_tiles)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::hud::tests::full_facts;

    #[test]
    fn lines_keep_to_their_width() {
        let facts = full_facts();
        for text in [above_graph(&facts), below_graph(&facts), few(&facts)] {
            for line in text.lines() {
                assert!(line.chars().count() <= COLUMNS, "{line}");
            }
        }
        assert_eq!(few(&facts).lines().count(), 3);
    }

    #[test]
    fn nothing_is_known_before_the_first_frame() {
        let facts = Facts::default();
        let text = below_graph(&facts);
        for line in ["– triangles", "– of – patches", "– of – levels"] {
            assert!(text.lines().any(|l| l == line), "{line} in\n{text}");
        }
        for name in ["CPU", "GPU"] {
            assert!(text.lines().any(|l| l.starts_with(name) && l.ends_with(" –")), "{text}");
        }
        assert!(above_graph(&facts).contains("– frames/s\nframe p50 –  p99 –"));
        assert!(!text.contains("cache"));
    }

    #[test]
    fn passes_are_sorted_and_the_rest_is_summed() {
        let passes = (1..=8).map(|ix| (format!("pass {ix}"), f64::from(ix))).collect();
        let facts = Facts { passes, ..Facts::default() };
        let mut out = Vec::new();
        gpu(&facts, &mut out);
        assert_eq!(out.len(), 1 + PASSES + 1);
        assert!(out[0].ends_with("36.0 ms"), "{}", out[0]);
        assert!(out[1].contains("pass 8") && out[6].contains("pass 3"));
        assert!(out[7].contains("2 more") && out[7].ends_with("3.00 ms"), "{}", out[7]);
    }

    #[test]
    fn the_table_is_aligned_and_has_units() {
        let mut out = Vec::new();
        sent(&full_facts(), &mut out);
        assert!(out.iter().all(|line| line.chars().count() == COLUMNS), "{out:?}");
        assert!(out[1].starts_with("ours") && out[1].contains("1.23 kB") && out[1].ends_with("74.1 kB/s"));
        assert!(out[2].starts_with("classic 2004") && out[2].contains("45.7 kB"));
    }

    #[test]
    fn dropped_patches_were_not_drawn() {
        let mut out = Vec::new();
        drawn(&full_facts(), &mut out);
        assert_eq!(out[0], "411\u{2009}522 triangles");
        assert_eq!(out[1], "1\u{2009}198 of 5\u{2009}120 patches");
        assert_eq!(out[2], "11 of 12 levels, 1 to come");
    }

    #[test]
    fn frames_are_counted_over_the_last_second() {
        let frame_ms = std::iter::repeat_n(500.0, 10).chain(std::iter::repeat_n(10.0, 200)).collect();
        let facts = Facts { frame_ms, ..Facts::default() };
        assert_eq!(frames_per_s(&facts), "100.0 frames/s");
    }
}
