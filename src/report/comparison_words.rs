//! What a comparison came to, in plain words: who wins where, by how much, and how sure that is. A rival
//! that wins is said to win.

use std::collections::BTreeMap;

use super::comparison::{Comparison, Front, MethodRow, PathComparison};
use super::comparison_uploads::UploadRow;
use crate::measure::fronts::{Against, Point, against, share_won};
use crate::measure::pairs::{LEAST_PAIRS, NOISE_FACTOR, Noise, Ratio, Verdict};

/// The method this program is about; the names of its variants begin with it.
pub(super) const OURS: &str = "tessellated";

/// The method that draws every sample.
const TRUTH: &str = "brute-force";

/// Bound on the p99 error below which methods compete in steadiness, pixels.
const FINE_PX: f64 = 2.0;

/// The whole of it, a paragraph each.
#[must_use]
pub fn words(c: &Comparison) -> Vec<String> {
    let mut out = vec![opening(c)];
    for path in &c.paths {
        let paragraphs = [
            times(path, c.baseline),
            noise(&path.noise, c.baseline),
            errors(path),
            steadiness(path),
            fronts(path),
        ];
        let said = paragraphs.into_iter().filter(|p| !p.is_empty());
        out.extend(said.map(|text| format!("{}: {text}", path.path)));
    }
    out.extend(uploads(&c.uploads));
    if !c.cannot.is_empty() {
        let all: Vec<String> = c.cannot.iter().map(|x| format!("{} ({})", x.method, x.why)).collect();
        out.push(format!("Not measured: {}.", all.join("; ")));
    }
    out
}

fn opening(c: &Comparison) -> String {
    let quick = if c.quick { "A quick run: its figures only show that it works. " } else { "" };
    format!(
        "{quick}{} of {} frames for each method on each path, flown in turn, there and back. Two times \
         differ only where at least {LEAST_PAIRS} undisturbed rounds put them further apart than three times \
         what {} differs from itself.",
        counted(c.rounds as usize, "round"),
        c.frames_per_flight,
        c.baseline
    )
}

fn times(path: &PathComparison, baseline: &str) -> String {
    let timed = || path.methods.iter().filter_map(|row| Some((row, finite(row.frame_ms.p50)?)));
    let Some((fastest, least)) = timed().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return "no frame times were measured.".into();
    };
    let head = format!("{} has the shortest median frame time, {least:.2} ms", fastest.method);
    let base = timed().find(|(row, _)| row.method == baseline).map(|(_, p50)| p50);
    let mut text = match base {
        _ if fastest.method == baseline => format!("{head}."),
        None => format!("{head}; {baseline} was not measured here."),
        Some(base) => format!("{head} against {base:.2} ms of {baseline}: {}.", judged(fastest)),
    };
    let kinds: [(&str, Option<Verdict>); 5] = [
        ("faster", Some(Verdict::Faster)),
        ("no difference", Some(Verdict::NoDifference)),
        ("slower", Some(Verdict::Slower)),
        ("too few rounds to tell", Some(Verdict::TooFewPairs)),
        ("not compared", None),
    ];
    let mut parts = Vec::new();
    for (name, verdict) in kinds {
        let of_kind =
            |row: &&MethodRow| row.method != baseline && row.ratio.as_ref().map(|r| r.verdict) == verdict;
        let listed: Vec<String> = path
            .methods
            .iter()
            .filter(of_kind)
            .map(|row| match &row.ratio {
                Some(r) => format!("{} ({:.2}, {:.2} to {:.2})", row.method, r.ratio, r.low, r.high),
                None => row.method.to_string(),
            })
            .collect();
        if !listed.is_empty() {
            parts.push(format!("{name}: {}", listed.join(", ")));
        }
    }
    if !parts.is_empty() {
        let parts = parts.join("; ");
        text += &format!(" Time over that of {baseline}, with the range of the rounds: {parts}.");
    }
    for row in path.methods.iter().filter(|row| row.every > 1) {
        text += &format!(" {} flew only one frame in {}.", row.method, row.every);
    }
    text
}

/// What may be said of the fastest method, which is not the baseline.
fn judged(fastest: &MethodRow) -> String {
    let Some(Ratio { ratio, low, high, noise, pairs, verdict }) = fastest.ratio else {
        return "no undisturbed round has both, so nothing can be said of the difference".into();
    };
    let figures = format!(
        "ratio {ratio:.2}, {low:.2} to {high:.2} over {}, noise {:.1} %",
        counted(pairs, "round"),
        100.0 * noise
    );
    match verdict {
        Verdict::Faster => format!("faster, beyond three times the noise ({figures})"),
        Verdict::NoDifference => format!("no difference, within three times the noise ({figures})"),
        Verdict::Slower => format!("yet slower when judged round by round ({figures})"),
        Verdict::TooFewPairs => format!("too few undisturbed rounds to call it a difference ({figures})"),
    }
}

fn noise(noise: &Noise, baseline: &str) -> String {
    if noise.rounds_kept == 0 && noise.disturbed.is_empty() {
        return format!("{baseline} was not measured against itself.");
    }
    let kept = format!(
        "{baseline} against itself differs by up to {:.1} % in {}",
        100.0 * noise.spread,
        counted(noise.rounds_kept, "round")
    );
    let numbers: Vec<String> = noise.disturbed.iter().map(ToString::to_string).collect();
    match numbers.len() {
        0 => format!("{kept}; no round was disturbed."),
        1 => format!("{kept}; 1 disturbed round is left out of all ratios (number {}).", numbers[0]),
        k => format!("{kept}; {k} disturbed rounds are left out of all ratios ({}).", numbers.join(", ")),
    }
}

fn errors(path: &PathComparison) -> String {
    // Brute force is what errors are measured against.
    let others = path.methods.iter().filter(|row| row.method != TRUTH);
    let known: Vec<(&'static str, f64)> = others.filter_map(|row| Some((row.method, p99_px(row)?))).collect();
    let Some(least) = known.iter().map(|(_, px)| *px).reduce(f64::min) else {
        let measured = || path.methods.iter().filter_map(|row| row.error.as_ref());
        return match measured().map(|e| e.pixels).max() {
            None => "No errors were measured.".into(),
            Some(0) => {
                "No terrain was in any view whose error was measured: these figures say nothing.".into()
            }
            Some(_) => "Too few samples were visible for a p99 error.".into(),
        };
    };
    let best: Vec<&str> = known.iter().filter(|(_, px)| *px <= least).map(|(name, _)| *name).collect();
    let mut text = format!("The lowest p99 error is {least:.2} px, of {}", best.join(" and "));
    match known.iter().find(|(name, _)| *name == OURS) {
        Some((_, px)) if !best.contains(&OURS) => text += &format!("; {OURS} has {px:.2} px"),
        _ => {}
    }
    text.push('.');
    let missing: Vec<&str> =
        path.methods.iter().filter(|row| p99_px(row).is_none()).map(|row| row.method).collect();
    if !missing.is_empty() {
        text += &format!(" No error is known of {}.", missing.join(", "));
    }
    for row in &path.methods {
        let cracks = row.error.as_ref().map_or(0, |e| e.crack_pixels);
        if cracks > 0 {
            text += &format!(" {} shows {}.", row.method, counted(cracks as usize, "crack pixel"));
        }
    }
    text
}

fn steadiness(path: &PathComparison) -> String {
    let fine: Vec<&MethodRow> =
        path.methods.iter().filter(|row| p99_px(row).is_some_and(|px| px < FINE_PX)).collect();
    if fine.is_empty() {
        return String::new();
    }
    let timed = || fine.iter().filter_map(|row| Some((row.method, finite(row.frame_ms.r99)?)));
    let Some((best, least)) = timed().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return "Too few frames for a p99 frame time.".into();
    };
    let ours = match timed().find(|(name, _)| *name == OURS) {
        Some((name, r99)) if best != OURS => format!("; {name} has {r99:.2}"),
        _ => String::new(),
    };
    format!(
        "Of the methods under {FINE_PX:.0} px, {best} has the least p99 frame time over the median, \
         {least:.2}{ours}.{}",
        judged_steadiness(&fine)
    )
}

/// Whose p99 / p50 differs from ours, round by round, by more than the noise of that.
fn judged_steadiness(fine: &[&MethodRow]) -> String {
    if !fine.iter().any(|row| row.method == OURS) {
        return String::new();
    }
    let with = |verdict: Verdict| -> Vec<String> {
        let of_kind = fine.iter().filter_map(|row| Some((row.method, row.r99_ratio.as_ref()?)));
        let listed = of_kind.filter(|(_, r)| r.verdict == verdict);
        listed.map(|(name, r)| format!("{name} ({:.2} of ours)", r.ratio)).collect()
    };
    let mut parts = Vec::new();
    for (name, verdict) in [
        ("steadier than ours", Verdict::Faster),
        ("as steady within the noise", Verdict::NoDifference),
        ("less steady", Verdict::Slower),
        ("too few rounds to tell", Verdict::TooFewPairs),
    ] {
        let listed = with(verdict);
        if !listed.is_empty() {
            parts.push(format!("{name}: {}", listed.join(", ")));
        }
    }
    if parts.is_empty() { String::new() } else { format!(" Round by round: {}.", parts.join("; ")) }
}

fn fronts(path: &PathComparison) -> String {
    if path.fronts.is_empty() {
        return String::new();
    }
    let points = |front: &Front| -> Vec<Point> {
        front.points.iter().filter_map(|p| p.at(Some(p.median_ms))).collect()
    };
    let ours: Vec<Point> = path.fronts.iter().find(|f| f.method == OURS).map(points).unwrap_or_default();
    if ours.is_empty() {
        return format!("No setting of {OURS} has both an error and a time.");
    }
    let noise = NOISE_FACTOR * path.noise.spread;
    let mut parts = Vec::new();
    for rival in path.fronts.iter().filter(|f| !f.method.starts_with(OURS) && f.method != TRUTH) {
        let Some(share) = share_won(&ours, &points(rival), noise) else {
            parts.push(format!("{}: not known", rival.method));
            continue;
        };
        let mut part = format!("{}: {} of {}", rival.method, share.won, share.of);
        let lost: Vec<&str> = rival
            .points
            .iter()
            .filter(|p| p.at(Some(p.median_ms)).is_some_and(|p| is_lost(&ours, p, noise)))
            .map(|p| p.detail_words.as_str())
            .collect();
        let mut notes = Vec::new();
        if share.undecided > 0 {
            notes.push(format!("{} undecided within three times the noise", share.undecided));
        }
        if !lost.is_empty() {
            notes.push(format!("not at {}", listed(&lost)));
        }
        if share.out_of_reach > 0 {
            notes.push(format!("{} faster than any setting of {OURS}", share.out_of_reach));
        }
        if !notes.is_empty() {
            part += &format!(" ({})", notes.join("; "));
        }
        parts.push(part);
    }
    let mut text = String::new();
    if !parts.is_empty() {
        text = format!(
            "At no more time than a rival's setting, {OURS} has the lower p99 error at so many of them: {}.",
            parts.join("; ")
        );
    }
    let mut outer: BTreeMap<&str, usize> = BTreeMap::new();
    for point in &path.outer_front {
        *outer.entry(point.method).or_default() += 1;
    }
    if !outer.is_empty() {
        let shares: Vec<String> = outer.iter().map(|(name, count)| format!("{count} of {name}")).collect();
        text += &format!(" By raw figures no other setting beats {}.", shares.join(", "));
    }
    text.trim_start().to_string()
}

fn is_lost(ours: &[Point], rival: Point, noise: f64) -> bool {
    matches!(against(ours, rival, noise), Against::Lost | Against::OutOfReach)
}

/// What is sent at the largest window size, and at how many sizes ours is the least.
fn uploads(rows: &[UploadRow]) -> Option<String> {
    let ours = || rows.iter().filter(|row| row.method == OURS);
    let largest = ours().max_by_key(|row| (row.n, row.levels))?;
    let same = |a: &UploadRow, b: &UploadRow| (a.n, a.levels) == (b.n, b.levels) && a.method != b.method;
    let mut text = format!(
        "Vertices, indices and control data of a frame in motion (straight) at n = {} with {} levels: {OURS} {}",
        largest.n,
        largest.levels,
        bytes(largest.bytes_per_frame)
    );
    for rival in rows.iter().filter(|row| same(row, largest)) {
        text += &format!(", {} {}", rival.method, bytes(rival.bytes_per_frame));
    }
    let all = |row: &UploadRow| row.bytes_per_frame + row.height_bytes_per_frame.unwrap_or(0.0);
    text += &format!(". With heights, which classic has in its vertices: {OURS} {}", bytes(all(largest)));
    for rival in rows.iter().filter(|row| same(row, largest)) {
        text += &format!(", {} {}", rival.method, bytes(all(rival)));
        if all(largest) > 0.0 {
            text += &format!(" ({} times as much)", factor(all(rival) / all(largest)));
        }
    }
    text += &format!(
        ". Of the {} of the classic full grids {OURS} sends {:.4} % before the first frame ({}) and {:.4} % \
         in a frame in motion, heights apart.",
        bytes(largest.full_grid_bytes as f64),
        100.0 * largest.start_share(),
        bytes(largest.bytes_start as f64),
        100.0 * largest.frame_share(),
    );
    let contested: Vec<&UploadRow> = ours().filter(|row| rows.iter().any(|b| same(row, b))).collect();
    if !contested.is_empty() {
        let least = |row: &&&UploadRow| {
            rows.iter().filter(|b| same(row, b)).all(|b| row.bytes_per_frame < b.bytes_per_frame)
        };
        let won = contested.iter().filter(least).count();
        text += &format!(" {OURS} sends the least at {won} of {} sizes.", contested.len());
    }
    Some(text)
}

fn p99_px(row: &MethodRow) -> Option<f64> {
    finite(row.error.as_ref()?.px.p99)
}

fn finite(v: Option<f64>) -> Option<f64> {
    v.filter(|v| v.is_finite())
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// At most four of them, and how many more.
fn listed(names: &[&str]) -> String {
    match names.len() {
        0..=4 => names.join(", "),
        k => format!("{} and {} more", names[..4].join(", "), k - 4),
    }
}

fn factor(v: f64) -> String {
    if v >= 10.0 { format!("{v:.0}") } else { format!("{v:.2}") }
}

fn bytes(v: f64) -> String {
    match v {
        _ if v < 1024.0 => format!("{v:.0} B"),
        _ if v < 1_048_576.0 => format!("{:.1} KiB", v / 1024.0),
        _ => format!("{:.1} MiB", v / 1_048_576.0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::comparison_plots::made_up::{comparison, row};
    use super::*;
    use crate::measure::error::ErrorReport;

    fn said(methods: Vec<MethodRow>) -> String {
        words(&comparison(methods)).join("\n")
    }

    fn rival(p50: f64, ratio: f64, verdict: Verdict) -> Vec<MethodRow> {
        vec![row(OURS, 5.0, Some(0.63), None), row("classic", p50, Some(0.7), Some((ratio, verdict)))]
    }

    #[track_caller]
    fn holds(text: &str, parts: &[&str]) {
        for part in parts {
            assert!(text.contains(part), "{part:?} is missing in:\n{text}");
        }
    }

    #[test]
    fn ours_wins_where_it_does() {
        let text = said(rival(6.0, 1.2, Verdict::Slower));
        holds(
            &text,
            &[
                "straight: tessellated has the shortest median frame time, 5.00 ms.",
                "slower: classic (1.20, 1.18 to 1.22)",
                "The lowest p99 error is 0.63 px, of tessellated.",
                "tessellated has the least p99 frame time over the median, 1.50.",
                "classic: 1 of 2 (not at n 31; 1 faster than any setting of tessellated)",
                "By raw figures no other setting beats 1 of classic, 2 of tessellated.",
                // 1,024 + 4,096 bytes against 102,400, whose heights are in it.
                "tessellated 5.0 KiB, classic 100.0 KiB (20 times as much)",
                "Of the 1.0 MiB of the classic full grids tessellated sends 0.1953 % before the first frame (2.0 KiB) \
                 and 0.0977 % in a frame in motion",
                "tessellated sends the least at 1 of 1 sizes",
                "Not measured: roam (No reason <given>).",
                "differs by up to 1.2 % in 6 rounds; no round was disturbed.",
            ],
        );
        assert!(!text.contains("faster: "), "{text}");
    }

    #[test]
    fn a_rival_that_wins_is_said_to_win() {
        let mut c = comparison(vec![
            row(OURS, 5.0, Some(0.8), None),
            row("classic", 4.0, Some(0.7), Some((0.8, Verdict::Faster))),
        ]);
        c.uploads[2].bytes_per_frame = 512.0;
        let ratio = c.paths[0].methods[1].ratio;
        c.paths[0].methods[1].r99_ratio = ratio.map(|r| Ratio { ratio: 0.9, ..r });
        c.paths[0].noise.disturbed = vec![2];
        let text = words(&c).join("\n");
        holds(
            &text,
            &[
                "classic has the shortest median frame time, 4.00 ms against 5.00 ms of tessellated: faster,",
                "(ratio 0.80, 0.78 to 0.82 over 6 rounds, noise 1.2 %)",
                "The lowest p99 error is 0.70 px, of classic; tessellated has 0.80 px.",
                "classic has the least p99 frame time over the median, 1.40; tessellated has 1.50. Round by round: \
                 steadier than ours: classic (0.90 of ours).",
                "classic 512 B (0.10 times as much)",
                "the least at 0 of 1 sizes",
                "1 disturbed round is left out of all ratios (number 2)",
            ],
        );
    }

    #[test]
    fn noise_hides_a_difference() {
        let text = said(rival(4.9, 0.98, Verdict::NoDifference));
        holds(&text, &["classic has the shortest", "no difference, within three times the noise"]);
        assert!(!text.contains("faster,"), "{text}");
    }

    #[test]
    fn too_few_rounds_say_nothing() {
        let text = said(rival(2.0, 0.4, Verdict::TooFewPairs));
        holds(&text, &["too few undisturbed rounds", "over 3 rounds", "too few rounds to tell: classic"]);
        assert!(!text.contains("faster,"), "{text}");
    }

    #[test]
    fn missing_figures_are_said_to_be_missing() {
        let mut c = comparison(vec![row(OURS, 5.0, None, None), row("classic", 6.0, None, None)]);
        c.paths[0].fronts[0].points.clear();
        let text = words(&c).join("\n");
        holds(
            &text,
            &["No errors were measured.", "not compared: classic", "No setting of tessellated has both"],
        );
        let unseen = ErrorReport { pixels: 0, ..ErrorReport::default() };
        c.paths[0].methods[0].error = Some(unseen);
        holds(&words(&c).join("\n"), &["No terrain was in any view"]);
        c.paths[0].methods[0].error = Some(ErrorReport { pixels: 9, ..ErrorReport::default() });
        holds(&words(&c).join("\n"), &["Too few samples were visible"]);
        let half = said(vec![row(OURS, 5.0, None, None), row("classic", 6.0, Some(0.5), None)]);
        holds(&half, &["No error is known of tessellated."]);
        c.paths[0].methods.clear();
        c.uploads.clear();
        c.quick = true;
        holds(&words(&c).join("\n"), &["A quick run", "no frame times were measured"]);
    }
}
