//! Plots of a comparison, as SVG: one colour a method, ours in vermilion and thicker.

use std::collections::BTreeMap;

use kuva::prelude::{Layout, LegendPosition, LinePlot, Plot, ScatterPlot, render_to_svg};
use serde::Serialize;

use super::comparison::{Front, FrontPoint, PathComparison, SampleRow};
use super::comparison_uploads::UploadRow;
use super::comparison_words::OURS;
use super::html::MIB;
use super::plots::thinned;
use crate::measure::fronts::{Point, dominated};
use crate::measure::pairs::median;

/// A cost of a setting, where it is known.
type Cost = fn(&FrontPoint) -> Option<f64>;

/// Most points of a line; there is one for every method.
const LINE_POINTS: usize = 1_000;
/// Least value on an axis of times, errors and mebibytes, which are logarithmic: what is below is drawn here.
const LEAST: f64 = 1e-3;

/// A plot and what to say under it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Figure {
    /// The plot as an SVG element.
    pub(super) svg: String,
    /// How to read it.
    pub(super) caption: &'static str,
}

/// Colour of a method, the same in all plots (Okabe and Ito 2008, distinct for the colour-blind).
fn color(method: &str) -> &'static str {
    match method {
        OURS => "#d55e00",
        "tessellated-by-error" => "#a50026",
        "tessellated-vertex-stage" => "#cc79a7",
        "tessellated-all-patches" => "#888888",
        "classic" => "#0072b2",
        "footprint" => "#56b4e9",
        "geomipmap" => "#009e73",
        "chunked" => "#c0b000",
        "roam" => "#e69f00",
        _ => "#000000",
    }
}

fn line(method: &str, points: Vec<(f64, f64)>) -> Plot {
    let width = if method == OURS { 2.6 } else { 1.3 };
    let line = LinePlot::new().with_data(points).with_color(color(method)).with_stroke_width(width);
    line.with_legend(method).into()
}

fn marks(method: &str, points: Vec<(f64, f64)>) -> Option<Plot> {
    let size = if method == OURS { 4.5 } else { 3.2 };
    let marks = ScatterPlot::new().with_color(color(method)).with_size(size);
    (!points.is_empty()).then(|| marks.with_data(points).into())
}

/// Small and hollow.
fn dominated_marks(method: &str, points: Vec<(f64, f64)>) -> Option<Plot> {
    let marks = ScatterPlot::new().with_color(color(method)).with_size(2.4).with_marker_opacity(0.0);
    (!points.is_empty()).then(|| marks.with_data(points).with_marker_stroke_width(0.8).into())
}

/// The plots of one path that there is data for.
pub(super) fn path_figures(path: &PathComparison, samples: &[SampleRow]) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(frame_times(path, samples));
    // One tail for all: the 99th percentile where every setting has one.
    let timed = path.fronts.iter().flat_map(|f| &f.points).all(|p| p.p99_ms.is_some());
    let tail: (&str, Cost) =
        if timed { ("p99 frame time, ms", |p| p.p99_ms) } else { ("p95 frame time, ms", |p| p.p95_ms) };
    let costs: [(&str, Cost); 4] = [
        ("median frame time, ms", |p| Some(p.median_ms)),
        tail,
        ("triangles", |p| p.triangles),
        ("GPU buffers, MiB", |p| Some(p.gpu_bytes as f64 / MIB)),
    ];
    figures.extend(costs.into_iter().filter_map(|(label, cost)| errors(&path.fronts, label, cost)));
    figures
}

/// Frame times along the path at the default detail: the median over the rounds of each frame.
fn frame_times(path: &PathComparison, samples: &[SampleRow]) -> Option<Figure> {
    let mut times: BTreeMap<&str, BTreeMap<usize, Vec<f64>>> = BTreeMap::new();
    // Ours flown once more is in the samples, but no method.
    let known = |row: &&SampleRow| path.methods.iter().any(|m| m.method == row.method);
    let usual = |row: &&SampleRow| row.path == path.path && row.setting == 0;
    for row in samples.iter().filter(usual).filter(known) {
        times.entry(row.method).or_default().entry(row.frame).or_default().push(row.frame_ms);
    }
    let mut lines: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    for (method, frames) in times {
        let at = |(frame, ms): (usize, Vec<f64>)| Some((frame as f64, median(&ms)?.max(LEAST)));
        lines.push((method, thinned(frames.into_iter().filter_map(at).collect(), LINE_POINTS)));
    }
    lines.retain(|(_, points)| !points.is_empty());
    // Drawn last, ours is on top.
    lines.sort_by_key(|(method, _)| *method == OURS);
    let plots: Vec<Plot> = lines.into_iter().map(|(method, points)| line(method, points)).collect();
    Some(Figure {
        svg: drawn("Frame time along the path", ("frame", false), "ms", plots)?,
        caption: "Median over the rounds of each frame, at the details asked for; the scale of times is logarithmic.",
    })
}

/// The p99 errors of all settings against a cost.
fn errors(fronts: &[Front], label: &str, cost: fn(&FrontPoint) -> Option<f64>) -> Option<Figure> {
    let mut order: Vec<&Front> = fronts.iter().collect();
    order.sort_by_key(|front| front.method == OURS);
    let mut plots = Vec::new();
    for front in order {
        let mut points: Vec<Point> = front.points.iter().filter_map(|p| p.at(cost(p))).collect();
        if points.is_empty() {
            continue;
        }
        points.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let out = dominated(&points);
        let those = |which: bool| -> Vec<(f64, f64)> {
            let chosen = points.iter().zip(&out).filter(|(_, out)| **out == which);
            chosen.map(|(p, _)| (p.cost.max(LEAST), p.error.max(LEAST))).collect()
        };
        plots.push(line(front.method, those(false)));
        plots.extend(marks(front.method, those(false)));
        plots.extend(dominated_marks(front.method, those(true)));
    }
    Some(Figure {
        svg: drawn(&format!("Error against {label}"), (label, true), "p99 error, px", plots)?,
        caption: "Lower left is better. Small hollow marks: another setting of the same method is no worse \
                  in both and better in one. Both scales are logarithmic; less than 0.001 is drawn there.",
    })
}

/// Bytes of vertices, indices and control data per frame in motion against the window size.
pub(super) fn upload_figure(rows: &[UploadRow]) -> Option<Figure> {
    let mut lines: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.bytes_per_frame.is_finite()) {
        lines.entry(row.method).or_default().push((f64::from(row.n), row.bytes_per_frame.max(1.0)));
    }
    let mut plots = Vec::new();
    for (method, mut points) in lines {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        plots.push(line(method, points.clone()));
        plots.extend(marks(method, points));
    }
    let title = "Upload per frame in motion, heights apart";
    Some(Figure {
        svg: drawn(title, ("samples per side of a window, n", false), "bytes", plots)?,
        caption: "Vertices, indices and control data, mean; the scale of bytes is logarithmic, from 1.",
    })
}

/// The plots over an axis (its label, whether it is logarithmic), errors or times upwards on a logarithmic
/// one; `None` where there is nothing to draw.
fn drawn(title: &str, x: (&str, bool), y_label: &str, plots: Vec<Plot>) -> Option<String> {
    let bounds = plots.iter().filter_map(Plot::bounds).reduce(|a, b| {
        let wider = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        (wider(a.0, b.0), wider(a.1, b.1))
    })?;
    let (x_range, y_range) = (round_range(bounds.0), round_range(bounds.1));
    let mut layout = Layout::auto_from_plots(&plots)
        .with_title(title)
        .with_x_label(x.0)
        .with_y_label(y_label)
        .with_legend_position(LegendPosition::OutsideRightTop)
        .with_log_y()
        .with_y_axis_min(y_range.0)
        .with_y_axis_max(y_range.1);
    if x.1 {
        layout = layout.with_log_x().with_x_axis_min(x_range.0).with_x_axis_max(x_range.1);
    }
    // Inside of HTML an SVG needs no name space, and the page is to have no address in it.
    Some(render_to_svg(plots, layout).replace(" xmlns=\"http://www.w3.org/2000/svg\"", ""))
}

/// The range widened to 1, 2 or 5 times a power of ten at both ends, so that a logarithmic axis has a mark
/// there; the bounds are above zero.
fn round_range((low, high): (f64, f64)) -> (f64, f64) {
    let (low, high) = (low.max(1e-9), high.max(1e-9));
    let decade = |v: f64| 10.0_f64.powf(v.log10().floor());
    let steps = |v: f64| [0.5, 1.0, 2.0, 5.0, 10.0, 20.0].map(|k| k * decade(v));
    let below = steps(low).into_iter().filter(|s| *s < low).fold(0.1 * low, f64::max);
    let above = steps(high).into_iter().find(|s| *s > high).unwrap_or(10.0 * high);
    (below, above)
}

/// A made-up comparison for tests of the words, the plots and the page.
#[cfg(test)]
pub(super) mod made_up {
    use super::super::SceneFacts;
    use super::super::comparison::*;
    use super::super::comparison_uploads::UploadRow;
    use crate::measure::error::ErrorReport;
    use crate::measure::pairs::{Noise, Ratio, Verdict};
    use crate::measure::{Environment, FrameStatistics, FrameUpload, UploadLedger};
    use crate::report::Quantiles;

    /// Six rounds of 1,000 frames, with a ratio to the baseline but for the baseline.
    pub(in crate::report) fn row(
        method: &'static str,
        p50: f64,
        p99_px: Option<f64>,
        ratio: Option<(f64, Verdict)>,
    ) -> MethodRow {
        let error = p99_px.map(|px| {
            let mut error = ErrorReport::default();
            error.px.p99 = Some(px);
            error.pixels = 1_000;
            error
        });
        let mut upload = UploadLedger::default();
        upload.add(&FrameUpload::default());
        upload.add(&FrameUpload { control_bytes: 999_000, height_bytes: 5_000, ..Default::default() });
        let ratio = ratio.map(|(ratio, verdict)| {
            let pairs = if verdict == Verdict::TooFewPairs { 3 } else { 6 };
            Ratio { ratio, low: ratio - 0.02, high: ratio + 0.02, noise: 0.012, pairs, verdict }
        });
        MethodRow {
            method,
            detail: serde_json::json!({ "n": 127 }),
            frames: 6_000,
            every: 1,
            frame_ms: FrameStatistics { p50: Some(p50), r99: Some(1.0 + p50 / 10.0), ..Default::default() },
            cpu_ms: Quantiles { p50: Some(0.2), p99: None },
            ratio,
            r99_ratio: None,
            rounds_ms: vec![p50; 6],
            upload,
            triangles_p50: Some(100_000.0),
            draw_calls_p50: None,
            gpu_bytes: 3 << 20,
            cpu_bytes: 0,
            error,
        }
    }

    fn front(method: &'static str, points: &[(f64, Option<f64>)]) -> Front {
        let point = |(n, &(median_ms, p99_px)): (usize, &(f64, Option<f64>))| FrontPoint {
            detail: serde_json::json!({ "n": 31 << n }),
            detail_words: format!("n {}", (32 << n) - 1),
            p99_px,
            median_ms,
            p95_ms: Some(1.2 * median_ms),
            p99_ms: None,
            triangles: Some(1e4),
            gpu_bytes: 1 << 20,
            dominated: false,
            on_outer_front: false,
        };
        Front { method, points: points.iter().enumerate().map(point).collect() }
    }

    pub(in crate::report) fn upload(n: u32, method: &'static str, bytes_per_frame: f64) -> UploadRow {
        UploadRow {
            n,
            levels: 7,
            method,
            vertices_start: 0,
            bytes_start: 2_048,
            vertices_per_frame: 0.0,
            bytes_per_frame,
            height_bytes_per_frame: (method == super::OURS).then_some(4_096.0),
            full_grid_bytes: 1 << 20,
        }
    }

    pub(in crate::report) fn path(methods: Vec<MethodRow>) -> PathComparison {
        let mut fronts = vec![
            front(super::OURS, &[(3.0, Some(2.0)), (5.0, Some(0.63)), (6.0, Some(1.0))]),
            front("classic", &[(2.0, Some(4.0)), (5.5, Some(0.7)), (9.0, None)]),
        ];
        let outer_front = mark_fronts(&mut fronts);
        let noise = Noise { spread: 0.012, rounds_kept: 6, disturbed: vec![] };
        PathComparison { path: "straight".into(), noise, methods, fronts, outer_front }
    }

    pub(in crate::report) fn comparison(methods: Vec<MethodRow>) -> Comparison {
        Comparison {
            quick: false,
            baseline: super::OURS,
            frames_per_flight: 1_000,
            rounds: 6,
            paths: vec![path(methods)],
            uploads: vec![
                upload(63, super::OURS, 512.0),
                upload(127, super::OURS, 1_024.0),
                upload(127, "classic", 102_400.0),
            ],
            cannot: vec![Cannot { method: "roam", why: "No reason <given>".into() }],
            words: Vec::new(),
        }
    }

    pub(in crate::report) fn report() -> ComparisonReport {
        let mut comparison = comparison(vec![
            row(super::OURS, 5.0, Some(0.63), None),
            row("classic", 5.5, Some(0.7), Some((1.1, Verdict::Slower))),
            row("brute-force", 80.0, None, Some((16.0, Verdict::TooFewPairs))),
        ]);
        comparison.words = super::super::comparison_words::words(&comparison);
        let sample = |round: usize, frame: usize| SampleRow {
            path: "straight".into(),
            method: super::OURS,
            setting: 0,
            round,
            frame,
            frame_ms: 5.0 + frame as f64,
            cpu_ms: 0.2,
            control_bytes: 0,
            height_bytes: 0,
            vertex_bytes: 0,
            index_bytes: 0,
            triangles: None,
            draw_calls: Some(3),
        };
        let samples = (0..2).flat_map(|round| (0..10).map(move |frame| (round, frame)));
        ComparisonReport {
            schema: "tessclip-report/1",
            environment: Environment::default(),
            scene: SceneFacts {
                terrain: "procedural:mountains".into(),
                base: "plane".into(),
                width_px: 640,
                height_px: 360,
                spacing_m: [1.0; 2],
                samples: [1_025; 2],
            },
            runs: runs(&comparison),
            samples: samples.map(|(round, frame)| sample(round, frame)).collect(),
            comparison,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::comparison_files::comparison_section;
    use super::*;

    #[test]
    fn ours_is_vermilion_and_every_method_has_its_own_colour() {
        let mut colors: Vec<&str> = crate::rivals::Method::ALL.iter().map(|m| color(m.name())).collect();
        assert_eq!(color(crate::rivals::Method::Tessellated.name()), "#d55e00");
        colors.sort_unstable();
        colors.dedup();
        assert_eq!(colors.len(), crate::rivals::Method::ALL.len());
    }

    #[test]
    fn a_figure_has_a_line_for_every_method_and_hollow_marks_for_dominated_settings() {
        let report = made_up::report();
        let figures = path_figures(&report.comparison.paths[0], &report.samples);
        // No point has a p99 frame time: the tail is the 95th percentile.
        assert_eq!(figures.len(), 5);
        assert!(figures[2].svg.contains("p95 frame time"));
        let errors = &figures[1].svg;
        assert!(errors.contains(color("classic")) && errors.contains(color(OURS)));
        assert!(errors.contains("fill-opacity=\"0\""));
        let all_good = path_figures(&only(vec![(1.0, 2.0), (2.0, 1.0)]), &[]);
        assert!(!all_good[0].svg.contains("fill-opacity=\"0\""));
    }

    fn only(points: Vec<(f64, f64)>) -> PathComparison {
        let mut path = made_up::path(Vec::new());
        let one = path.fronts[0].points[0].clone();
        path.fronts.truncate(1);
        path.fronts[0].points = points
            .into_iter()
            .map(|(median_ms, px)| FrontPoint { median_ms, p99_px: Some(px), ..one.clone() })
            .collect();
        path
    }

    #[test]
    fn empty_single_equal_and_zero_data_can_be_drawn() {
        assert!(path_figures(&only(vec![]), &[]).is_empty());
        // The tail, triangles and GPU bytes are known, the median is not.
        assert_eq!(path_figures(&only(vec![(f64::NAN, 1.0)]), &[]).len(), 3);
        let far = vec![(1.0, 0.0), (1e4, 1e9)];
        for points in [vec![(5.0, 0.3)], vec![(2.0, 1.0); 3], vec![(0.0, 0.0); 2], far] {
            let figures = path_figures(&only(points), &[]);
            assert_eq!(figures.len(), 4);
            for figure in figures {
                assert!(figure.svg.contains("<svg") && !figure.svg.contains("NaN"), "{}", figure.svg);
            }
        }
        assert!(upload_figure(&[]).is_none());
        assert!(upload_figure(&[made_up::upload(63, OURS, 0.0)]).is_some());
    }

    #[test]
    fn axes_end_at_round_numbers_outside_of_the_data() {
        let close = |a: (f64, f64), b: (f64, f64)| {
            assert!((a.0 / b.0 - 1.0).abs() < 1e-9 && (a.1 / b.1 - 1.0).abs() < 1e-9, "{a:?} {b:?}");
        };
        close(round_range((3.0, 30.0)), (2.0, 50.0));
        close(round_range((1.0, 1.0)), (0.5, 2.0));
        close(round_range((0.7, 60.0)), (0.5, 100.0));
    }

    #[test]
    fn an_empty_comparison_is_a_page_too() {
        let mut report = made_up::report();
        report.samples.clear();
        report.comparison.uploads.clear();
        for path in &mut report.comparison.paths {
            path.methods.clear();
            path.fronts.clear();
        }
        assert!(comparison_section(&report).unwrap().contains("<h2>"));
        report.comparison.paths.clear();
        assert!(comparison_section(&report).unwrap().contains("<h2>"));
    }
}
