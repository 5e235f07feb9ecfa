//! Statistics of frame times. Definitions stand beside the fields.

use serde::Serialize;

/// Percentile by linear interpolation at `p * (N - 1)` of the sorted samples; `None` when empty.
#[must_use]
pub fn percentile(sorted: &[f64], p: f64) -> Option<f64> {
    let at = p * (sorted.len().checked_sub(1)? as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 <= at <= N - 1")]
    let low = at.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    Some(sorted[low] + (sorted[high] - sorted[low]) * at.fract())
}

/// Statistics of a series of frame times in milliseconds. `None` is null in the report, never 0.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameStatistics {
    /// Median.
    pub p50: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// 99th percentile; null below 1,000 frames.
    pub p99: Option<f64>,
    /// 99.9th percentile; null below 10,000 frames.
    pub p999: Option<f64>,
    /// Longest frame.
    pub max: Option<f64>,
    /// Mean.
    pub mean: Option<f64>,
    /// Standard deviation / mean; best 0.
    pub cv: Option<f64>,
    /// p99 / p50; best 1.
    pub r99: Option<f64>,
    /// max / p50; best 1.
    pub rmax: Option<f64>,
    /// Share of frames longer than twice the median of the 19 frames around them; best 0, worst 1.
    pub stutter_share: Option<f64>,
    /// Sum of max(0, frame - 16.67 ms) in milliseconds; best 0.
    pub jank_sum: Option<f64>,
}

impl FrameStatistics {
    /// Statistics of frames in the order they were drawn.
    #[must_use]
    pub fn of(frames_ms: &[f64]) -> Self {
        if frames_ms.is_empty() {
            return Self::default();
        }
        let count = frames_ms.len();
        let mut sorted = frames_ms.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mean = frames_ms.iter().sum::<f64>() / count as f64;
        let variance = frames_ms.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / count as f64;
        let p50 = percentile(&sorted, 0.5);
        let from = |least: usize, p: f64| if count >= least { percentile(&sorted, p) } else { None };
        let p99 = from(1_000, 0.99);
        let max = sorted.last().copied();
        let ratio = |a: Option<f64>| Some(a? / p50?);
        let stutters = (0..count).filter(|&i| is_stutter(frames_ms, i)).count();
        Self {
            p50,
            p95: percentile(&sorted, 0.95),
            p99,
            p999: from(10_000, 0.999),
            max,
            mean: Some(mean),
            cv: Some(variance.sqrt() / mean),
            r99: ratio(p99),
            rmax: ratio(max),
            stutter_share: Some(stutters as f64 / count as f64),
            jank_sum: Some(frames_ms.iter().map(|f| (f - 16.67).max(0.0)).sum()),
        }
    }
}

fn is_stutter(frames: &[f64], ix: usize) -> bool {
    let mut around: Vec<f64> = frames[ix.saturating_sub(9)..(ix + 10).min(frames.len())].to_vec();
    around.sort_by(f64::total_cmp);
    percentile(&around, 0.5).is_some_and(|median| frames[ix] > 2.0 * median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate_linearly() {
        let sorted = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(percentile(&sorted, 0.5), Some(2.5));
        assert_eq!(percentile(&sorted, 1.0), Some(4.0));
        assert_eq!(percentile(&[], 0.5), None);
    }

    #[test]
    fn tails_are_null_until_there_are_enough_frames() {
        assert_eq!(FrameStatistics::of(&vec![1.0; 999]).p99, None);
        assert_eq!(FrameStatistics::of(&vec![1.0; 1_000]).p99, Some(1.0));
        assert_eq!(FrameStatistics::of(&vec![1.0; 9_999]).p999, None);
        assert_eq!(FrameStatistics::of(&[]).mean, None);
    }

    #[test]
    fn one_long_frame_is_a_stutter_and_jank() {
        let mut frames = vec![10.0; 100];
        frames[50] = 30.0;
        let s = FrameStatistics::of(&frames);
        assert_eq!(s.stutter_share, Some(0.01));
        assert!((s.jank_sum.unwrap_or_default() - 13.33).abs() < 1e-9);
        assert_eq!(s.rmax, Some(3.0));
    }
}
