//! The upload ledger: every byte the CPU sends, by purpose.

use serde::Serialize;

/// What one `prepare` sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameUpload {
    /// Control points sent (first frame only).
    pub control_points: u64,
    /// Bytes of control data: points, quads, corners of moved L blocks, strip descriptors.
    pub control_bytes: u64,
    /// Those of them that describe refill strips, bytes.
    pub strip_bytes: u64,
    /// Bytes of the frame uniform: camera, planes, window origins.
    pub uniform_bytes: u64,
    /// Bytes of samples: 4 each as heights, 2 where all are whole numbers of a step, 12 as positions.
    pub height_bytes: u64,
    /// Bytes of one sample on its way.
    pub sample_bytes: u64,
    /// Bytes of records of a curved base surface.
    pub surface_bytes: u64,
    /// Bytes of blocks' deviations, of the list of those to be graded, and of the limits factors go by.
    pub factor_bytes: u64,
    /// Vertices sent; ours sends none, ever.
    pub vertices: u64,
    /// Bytes of vertices sent.
    pub vertex_bytes: u64,
    /// Bytes of indices sent.
    pub index_bytes: u64,
    /// Least samples these shifts can need: `n (|dx| + |dy|) - |dx| |dy|` a level, data's border ignored.
    pub height_bound_samples: u64,
    /// Levels whose window moved.
    pub shifts: u64,
    /// Levels drawn.
    pub levels_drawn: u32,
    /// Levels wanted for this camera and not drawn: their samples are on their way, or wait for the upload
    /// budget, or for a coarser level to grow in; and the coarsest one while others' samples stand in for its.
    pub levels_missing: u32,
}

/// Sums over a run, as report.json has them (design: section 7).
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct UploadLedger {
    /// Control data after the first frame, bytes.
    pub control_bytes: u64,
    /// Most control data of one frame after the first, bytes.
    pub control_bytes_max_frame: u64,
    /// Frame uniforms, bytes.
    pub uniform_bytes: u64,
    /// Height samples after the first frame, bytes.
    pub height_bytes: u64,
    /// Least that could be sent for the same shifts, bytes, if there were data under all of every window.
    pub height_bytes_bound: u64,
    /// Records of a curved base surface after the first frame, bytes.
    pub surface_bytes: u64,
    /// Deviations and limits that factors by error need, after the first frame, bytes.
    pub factor_bytes: u64,
    /// Vertex data sent by the CPU after the first frame, bytes; of ours none, ever.
    pub vertex_bytes: u64,
    /// Index data sent by the CPU after the first frame, bytes; of ours none, ever.
    pub index_bytes: u64,
    /// Vertices sent by the CPU after the first frame; of ours none, ever.
    pub vertices: u64,
    /// Vertices the classic full grids have: n * n * levels; null for methods without windows.
    pub vertices_if_full: Option<u64>,
    /// Level shifts after the first frame.
    pub shifts: u64,
    /// Control data of the first frame, bytes.
    pub control_bytes_start: u64,
    /// Height samples of the first frame, bytes.
    pub height_bytes_start: u64,
    /// Vertex and index data of the first frame, bytes.
    pub mesh_bytes_start: u64,
    /// Vertices of the first frame.
    pub vertices_start: u64,
    #[serde(skip)]
    frames: u64,
}

impl UploadLedger {
    /// Adds a frame; the first one is the start.
    pub fn add(&mut self, frame: &FrameUpload) {
        self.uniform_bytes += frame.uniform_bytes;
        if self.frames == 0 {
            self.control_bytes_start = frame.control_bytes;
            self.height_bytes_start = frame.height_bytes;
            self.mesh_bytes_start = frame.vertex_bytes + frame.index_bytes;
            self.vertices_start = frame.vertices;
        } else {
            self.control_bytes += frame.control_bytes;
            self.control_bytes_max_frame = self.control_bytes_max_frame.max(frame.control_bytes);
            self.height_bytes += frame.height_bytes;
            self.height_bytes_bound += frame.height_bound_samples * frame.sample_bytes;
            self.surface_bytes += frame.surface_bytes;
            self.factor_bytes += frame.factor_bytes;
            self.vertices += frame.vertices;
            self.vertex_bytes += frame.vertex_bytes;
            self.index_bytes += frame.index_bytes;
            self.shifts += frame.shifts;
        }
        self.frames += 1;
    }
}
