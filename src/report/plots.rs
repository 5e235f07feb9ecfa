//! The plots people look at first, as SVG.

use kuva::prelude::{Histogram, Layout, LegendPosition, LinePlot, Plot, ScatterPlot, render_to_svg};

use super::html::MIB;
use super::{FrameRow, Report};

/// Most points of a line: what a page on a phone still scrolls with.
const LINE_POINTS: usize = 4_000;
/// Most marks on a line.
const MARKS: usize = 1_000;
/// Most bars of a histogram.
const BARS: f64 = 50.0;

const BLUE: &str = "#0072b2";
const ORANGE: &str = "#d55e00";
const GREEN: &str = "#009e73";

/// All plots that the rows have data for.
pub(super) fn plots(report: &Report) -> Vec<String> {
    let rows = &report.rows[..];
    if rows.is_empty() {
        return Vec::new();
    }
    let mut out = vec![frame_times(rows)];
    let times: Vec<f64> = rows.iter().map(|r| r.frame_ms).collect();
    out.push(histogram("Frame times", "ms, CPU start to GPU done", &times));
    let responses: Vec<f64> = rows.iter().filter_map(|r| r.response_ms).collect();
    if !responses.is_empty() {
        out.push(histogram("Response times, late-corrected", "ms, due to GPU done", &responses));
    }
    out.push(over_time(
        "Heights uploaded per frame",
        "KiB",
        vec![
            line("sent", BLUE, series(rows, |r| Some(r.height_bytes as f64 / 1024.0))),
            line("least possible", ORANGE, series(rows, |r| Some(r.height_bytes_bound as f64 / 1024.0))),
        ],
    ));
    if rows.iter().any(|r| r.cache_bytes.is_some()) {
        let missing = series(rows, |r| Some(f64::from(r.levels_missing)));
        out.push(over_time("Missing data", "levels missing", vec![line("", ORANGE, missing)]));
    }
    out.extend(memory(rows));
    out
}

fn frame_times(rows: &[FrameRow]) -> String {
    let shifted = thinned(series(rows, |r| (r.shifts > 0).then_some(r.frame_ms)), MARKS);
    let mut plots = vec![line("frame", BLUE, series(rows, |r| Some(r.frame_ms)))];
    if !shifted.is_empty() {
        let marks = ScatterPlot::new().with_data(shifted).with_color(ORANGE).with_size(2.0);
        plots.push(marks.with_legend("frame with level shifts").into());
    }
    over_time("Frame time along the path", "ms", plots)
}

fn memory(rows: &[FrameRow]) -> Option<String> {
    let resident = series(rows, |r| r.rss_bytes.map(|b| b as f64 / MIB));
    let cache = series(rows, |r| r.cache_bytes.map(|b| b as f64 / MIB));
    let mut plots = Vec::new();
    if !resident.is_empty() {
        plots.push(line("process, resident", BLUE, resident));
    }
    if !cache.is_empty() {
        plots.push(line("tile cache", GREEN, cache));
    }
    (!plots.is_empty()).then(|| over_time("Memory", "MiB", plots))
}

fn series(rows: &[FrameRow], of: impl Fn(&FrameRow) -> Option<f64>) -> Vec<(f64, f64)> {
    rows.iter().filter_map(|r| Some((r.t_s, of(r)?))).collect()
}

fn line(label: &str, color: &str, points: Vec<(f64, f64)>) -> Plot {
    let line =
        LinePlot::new().with_data(thinned(points, LINE_POINTS)).with_color(color).with_stroke_width(1.2);
    if label.is_empty() { line.into() } else { line.with_legend(label).into() }
}

fn over_time(title: &str, y_label: &str, plots: Vec<Plot>) -> String {
    drawn(title, "path time, s", y_label, plots)
}

fn drawn(title: &str, x_label: &str, y_label: &str, plots: Vec<Plot>) -> String {
    let layout = Layout::auto_from_plots(&plots)
        .with_title(title)
        .with_x_label(x_label)
        .with_y_label(y_label)
        .with_legend_position(LegendPosition::OutsideBottomColumns);
    render_to_svg(plots, layout)
}

/// Counts in bars of a round width, up to four medians; what is longer is in the last bar.
fn histogram(title: &str, x_label: &str, samples: &[f64]) -> String {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let longest = sorted.last().copied().unwrap_or(1.0);
    let median = crate::measure::percentile(&sorted, 0.5).unwrap_or(1.0);
    let top = longest.min(4.0 * median).max(1e-3);
    let width = round_width(top / BARS);
    let bars = (top / width).ceil().max(1.0);
    // The last bar's middle, so that rounding cannot put a sample beyond it.
    let last = (bars - 0.5) * width;
    let data: Vec<f64> = sorted.iter().map(|v| v.min(last)).collect();
    let plot = Histogram::new()
        .with_data(data)
        .with_bins(bars as usize)
        .with_range((0.0, bars * width))
        .with_color(BLUE);
    let x_label =
        if longest > bars * width { format!("{x_label}; last bar: longer ones") } else { x_label.into() };
    drawn(title, &x_label, "frames", vec![plot.into()])
}

/// The least of 1, 2 and 5 times a power of ten that is not below `width`.
fn round_width(width: f64) -> f64 {
    let ten = 10.0_f64.powf(width.log10().floor());
    [1.0, 2.0, 5.0].map(|k| k * ten).into_iter().find(|w| *w >= width).unwrap_or(10.0 * ten)
}

/// At most `most` points: the least and the greatest of as many stretches as it takes, in their order, so
/// that no peak is lost.
pub(super) fn thinned(points: Vec<(f64, f64)>, most: usize) -> Vec<(f64, f64)> {
    if points.len() <= most {
        return points;
    }
    let stretch = points.len().div_ceil(most / 2);
    let mut out = Vec::with_capacity(most);
    for part in points.chunks(stretch) {
        let by = |a: &usize, b: &usize| part[*a].1.total_cmp(&part[*b].1);
        let low = (0..part.len()).min_by(by).unwrap_or(0);
        let high = (0..part.len()).max_by(by).unwrap_or(0);
        out.push(part[low.min(high)]);
        if low != high {
            out.push(part[low.max(high)]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_the_order() {
        let points: Vec<(f64, f64)> =
            (0..100_000).map(|k| (f64::from(k), f64::from(k * 7_919 % 101))).collect();
        let mut spiked = points.clone();
        spiked[54_321].1 = 1e6;
        let thin = thinned(spiked, LINE_POINTS);
        assert!(thin.len() <= LINE_POINTS && thin.len() > LINE_POINTS / 4);
        assert!(thin.contains(&(54_321.0, 1e6)));
        assert!(thin.windows(2).all(|p| p[0].0 < p[1].0));
        assert_eq!(thinned(points[..10].to_vec(), LINE_POINTS), points[..10]);
    }

    #[test]
    fn bars_have_round_widths() {
        assert_eq!([0.7, 1.0, 1.1, 3.0, 6.0].map(round_width), [1.0, 1.0, 2.0, 5.0, 10.0]);
    }

    #[test]
    fn a_histogram_of_equal_samples_can_be_drawn() {
        for samples in [vec![0.0; 3], vec![16.0; 100], vec![1.0, 1.0, 1.0, 500.0]] {
            assert!(histogram("t", "ms", &samples).contains("<svg"));
        }
    }
}
