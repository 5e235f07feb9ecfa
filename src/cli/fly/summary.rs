//! What a flight comes to: the run of the report, and one line of it.

use tessclip::measure::FrameStatistics;
use tessclip::report::{FrameRow, Geometry, Memory, Quantiles, Run, StreamReport, TeleportWaits};
use tessclip::{Factors, Renderer};

use super::flight::{Flight, Log};
use super::{memory, window_m};

impl Flight<'_> {
    pub(super) fn summarise(&self, renderer: &Renderer, log: &Log) -> Run {
        let rows = &log.rows[..];
        let of = |f: fn(&FrameRow) -> f64| rows.iter().map(f).collect::<Vec<_>>();
        let counted = |f: fn(&FrameRow) -> Option<u32>| {
            FrameStatistics::of(&rows.iter().filter_map(f).map(f64::from).collect::<Vec<_>>())
        };
        let triangles = counted(|r| r.triangles);
        let shape = renderer.shape();
        let (path, tempo) = (&self.course.path, self.course.tempo);
        let window_m = window_m(shape.n(), self.terrain);
        let (factors, pixel_error, budget) = factors_told(self.scene.factors);
        let mut invalid_because = Vec::new();
        if log.dropped_patches > 0 {
            invalid_because.push(format!("{} patches were dropped for want of room", log.dropped_patches));
        }
        let late_frames = rows.iter().filter(|r| r.levels_missing > 0).count() as u64;
        let streams = log.stream_before.zip(renderer.stream_counters());
        Run {
            method: "tessellated",
            params: serde_json::json!({
                "n": shape.n(), "levels": shape.levels(), "morph": self.scene.morph, "cull": self.scene.cull,
                "speed": tempo.speed_m_s.map(|v| v / window_m), "hz": tempo.hz, "wait": self.wait,
                "factors": factors, "pixel_error": pixel_error, "budget": budget,
            }),
            frames: rows.len(),
            devices_lost: log.devices_lost,
            path: path.name.clone(),
            speed_windows_per_s: Some(path.length_m() / path.seconds() / window_m),
            frame_ms: FrameStatistics::of(&of(|r| r.frame_ms)),
            cpu_ms: Quantiles::of(&of(|r| r.cpu_ms)),
            gpu_ms: (!log.passes.is_empty())
                .then(|| log.passes.iter().map(|(k, v)| (k.clone(), Quantiles::of(v))).collect()),
            upload: log.ledger,
            geometry: Geometry {
                control_points: log.control_points,
                patches_p50: counted(|r| r.patches).p50,
                vertices_p50: counted(|r| r.vertices).p50,
                triangles_p50: triangles.p50,
                triangles_max: triangles.max,
                dropped_patches: log.dropped_patches,
            },
            memory: Memory {
                gpu_bytes: renderer.gpu_bytes(),
                peak_rss_bytes: memory::peak_resident_bytes(),
                rss_bytes_start: log.rss_bytes_start,
                rss_bytes_end: memory::resident_bytes(),
            },
            error: None,
            cracks: log.cracks,
            stream: streams.map(|(before, after)| {
                StreamReport::between(&before, &after, late_frames, &log.need_to_drawn_ms)
            }),
            open_loop: log.open_loop.as_ref().map(|schedule| schedule.report()),
            teleport_to_complete_ms: path.has_jumps().then(|| {
                let waits = FrameStatistics::of(&log.teleports.waits_ms);
                TeleportWaits {
                    p50: waits.p50,
                    max: waits.max,
                    count: log.teleports.waits_ms.len() as u64,
                    unfinished: log.teleports.unfinished,
                }
            }),
            valid: invalid_because.is_empty(),
            invalid_because,
        }
    }
}

/// Kind, pixels and triangles of the factors.
fn factors_told(factors: Factors) -> (&'static str, Option<f64>, Option<u32>) {
    match factors {
        Factors::Uniform => ("uniform", None, None),
        // By way of its shortest digits: 0.1 as a wider float would be reported as 0.10000000149011612.
        Factors::ByError { pixel_error, budget } => {
            ("error", pixel_error.and_then(|p| p.to_string().parse().ok()), budget)
        }
    }
}

/// A run in one line.
pub fn one_line(run: &Run) -> String {
    let figure = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
    let mut line = format!(
        "{}: {} frames, median {} ms, max {} ms, r99 {}, rmax {}, {} shifts, \
         {} control bytes in the worst frame",
        run.path,
        run.frames,
        figure(run.frame_ms.p50),
        figure(run.frame_ms.max),
        figure(run.frame_ms.r99),
        figure(run.frame_ms.rmax),
        run.upload.shifts,
        run.upload.control_bytes_max_frame,
    );
    if let Some(stream) = &run.stream {
        line += &format!(", {} late frames", stream.late_frames);
    }
    if let Some(open) = &run.open_loop {
        line += &format!(", {} deadline misses at {} Hz", open.deadline_misses, open.hz);
    }
    if let Some(cracks) = &run.cracks {
        let known = |v: Option<u64>| v.map_or("-".into(), |v: u64| v.to_string());
        line += &format!(
            ", {} crack pixels and {} mesh faults in {} frames",
            known(cracks.crack_pixels),
            known(cracks.faults),
            cracks.frames
        );
    }
    if !run.valid {
        line += " (NOT VALID)";
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_told_as_they_were_given() {
        assert_eq!(factors_told(Factors::Uniform), ("uniform", None, None));
        let by_error = Factors::ByError { pixel_error: Some(0.1), budget: None };
        assert_eq!(factors_told(by_error), ("error", Some(0.1), None));
        let by_budget = Factors::ByError { pixel_error: None, budget: Some(200_000) };
        assert_eq!(factors_told(by_budget), ("error", None, Some(200_000)));
    }
}
