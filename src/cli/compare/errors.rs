//! Error of every setting, over the same views along the path, from the triangles that were drawn.

use std::sync::Arc;

use tessclip::Camera;
use tessclip::measure::error::{DrawnHeights, ErrorReport, ErrorSums, TrueView};
use tessclip::rivals::{Detail, Ground, Method, Rival};

use super::super::paths::Course;
use super::flights::Range;
use super::settings::Setting;

/// The true pictures of some views of a path.
pub struct Truth {
    ground: Arc<Ground>,
    /// Each with the camera of the frame after it.
    views: Vec<(TrueView, Camera)>,
}

impl Truth {
    /// Draws every sample for `count` views, evenly along the path.
    ///
    /// # Errors
    /// When the data is too large for that, in words.
    pub fn of(range: &Range<'_>, course: &Course, count: u32, detail: Detail) -> anyhow::Result<Self> {
        let ground = range.lab.ground()?.clone();
        let mut rival = range.make(&Setting { method: Method::BruteForce, detail, usual: true })?;
        let mut views = Vec::new();
        for frame in view_frames(course.tempo.frames, count) {
            let (_, camera) = course.at(frame, range.fov_deg);
            range.draw(rival.as_mut(), &camera)?;
            let depth = range.target.read_depth(&range.gpu.device, &range.gpu.queue)?;
            let view = TrueView::of(&range.lab.terrain, &ground, &camera, range.target.size, &depth);
            views.push((view, course.at(frame + 1, range.fov_deg).1));
        }
        Ok(Self { ground, views })
    }

    /// What a setting shows instead.
    pub fn error_of(&self, range: &Range<'_>, setting: &Setting) -> anyhow::Result<ErrorReport> {
        let terrain = &range.lab.terrain;
        let mut rival = range.make(setting)?;
        let mut sums = ErrorSums::default();
        let heights = |rival: &dyn Rival| -> anyhow::Result<DrawnHeights> {
            Ok(DrawnHeights::of(terrain, &self.ground, &rival.read_mesh()?))
        };
        for (view, next) in &self.views {
            range.draw(rival.as_mut(), &view.camera)?;
            let depth = range.target.read_depth(&range.gpu.device, &range.gpu.queue)?;
            let drawn = heights(rival.as_ref())?;
            sums.add(&self.ground, terrain, view, &drawn);
            sums.add_picture(&self.ground, terrain, view, &drawn, &depth);
            range.draw(rival.as_mut(), next)?;
            sums.add_pop(&self.ground, terrain, view, &drawn, next, &heights(rival.as_ref())?);
        }
        Ok(sums.report())
    }
}

/// Frames in the middle of `count` equal parts of the path; never the last, which has none after it.
fn view_frames(frames: u32, count: u32) -> impl Iterator<Item = u32> {
    (0..count).map(move |k| {
        let at = (u64::from(frames) * u64::from(2 * k + 1) / u64::from(2 * count)) as u32;
        at.min(frames.saturating_sub(2))
    })
}

#[cfg(test)]
mod tests {
    use super::view_frames;

    #[test]
    fn views_lie_evenly_and_leave_room_for_the_next_frame() {
        assert_eq!(view_frames(100, 4).collect::<Vec<_>>(), [12, 37, 62, 87]);
        assert_eq!(view_frames(10, 10).last(), Some(8));
    }
}
