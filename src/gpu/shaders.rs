//! Shader modules: each pass's file behind the shared files it imports.
//!
//! Composition is concatenation in a fixed order: what all share, then what a plane or a curved base
//! surface needs, then the pass. Smaller variants come from `override` constants, never from copies.
//! tests/shaders.rs validates every module with exactly the features we request.

/// What samples are and where their positions come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ground {
    /// Heights on a plane.
    Plane,
    /// Heights on a curved surface.
    Curved,
    /// Positions.
    Points,
}

/// A file under `shaders/`, without its extension, and what is in it.
#[derive(Clone, Copy, Debug)]
struct Part {
    name: &'static str,
    text: &'static str,
}

macro_rules! text {
    ($name:literal) => {
        Part { name: $name, text: include_str!(concat!("../../shaders/", $name, ".wgsl")) }
    };
}

const SHARED: [Part; 2] = [text!("shared/structs"), text!("shared/lattice")];
const PLANE: Part = text!("plane/lattice");
const CURVED: [Part; 2] = [text!("curved/space"), text!("curved/lattice")];

/// A composed module: its stem (shader, twin, pass and test prefix) and its parts in order.
#[derive(Clone, Copy, Debug)]
pub struct ShaderModuleSource {
    /// Stem of the pass.
    pub stem: &'static str,
    text: Part,
    plane: &'static [Part],
    curved: &'static [Part],
    points: &'static [Part],
    /// What every ground has besides.
    more: &'static [Part],
}

impl ShaderModuleSource {
    /// The whole WGSL text.
    #[must_use]
    pub fn text(&self, ground: Ground) -> String {
        let texts: Vec<&str> = self.parts(ground).iter().map(|p| p.text).collect();
        texts.join("\n")
    }

    /// Names of its parts in order.
    #[must_use]
    pub fn part_names(&self, ground: Ground) -> Vec<&'static str> {
        self.parts(ground).iter().map(|p| p.name).collect()
    }

    fn parts(&self, ground: Ground) -> Vec<Part> {
        let mut parts = SHARED.to_vec();
        match ground {
            Ground::Plane => {
                parts.push(PLANE);
                parts.extend(self.plane);
            }
            Ground::Curved => {
                parts.extend(CURVED);
                parts.extend(self.curved);
            }
            Ground::Points => {
                parts.extend(CURVED);
                parts.extend(self.points);
            }
        }
        parts.extend(self.more);
        parts.push(self.text);
        parts
    }
}

pub(crate) const DISPLACE_SAMPLES: ShaderModuleSource = ShaderModuleSource {
    stem: "displace_samples",
    text: text!("displace_samples"),
    plane: &[text!("plane/store")],
    curved: &[text!("curved/shade"), text!("curved/store_heights")],
    points: &[text!("curved/shade"), text!("curved/store_points")],
    more: &[],
};
pub(crate) const BOUND_BLOCKS: ShaderModuleSource = ShaderModuleSource {
    stem: "bound_blocks",
    text: text!("bound_blocks"),
    plane: &[text!("plane/bound")],
    curved: &[text!("curved/bound")],
    points: &[text!("curved/bound")],
    more: &[],
};
pub(crate) const CULL_QUADS: ShaderModuleSource = ShaderModuleSource {
    stem: "cull_quads",
    text: text!("cull_quads"),
    plane: &[text!("shared/boxes"), text!("plane/bounds")],
    curved: &[text!("shared/boxes"), text!("curved/bounds")],
    points: &[text!("shared/boxes"), text!("curved/bounds")],
    more: &[],
};
/// As [`CULL_QUADS`], where nothing is culled and no patch can be all void: no bounds are made or read.
pub(crate) const CULL_QUADS_UNBOUNDED: ShaderModuleSource = ShaderModuleSource {
    plane: &[text!("shared/unbounded")],
    curved: &[text!("shared/unbounded")],
    points: &[text!("shared/unbounded")],
    ..CULL_QUADS
};
pub(crate) const COMPACT_PATCHES: ShaderModuleSource = ShaderModuleSource {
    stem: "compact_patches",
    text: text!("compact_patches"),
    plane: &[text!("uniform/edges"), text!("uniform/places")],
    curved: &[text!("uniform/edges"), text!("uniform/places")],
    points: &[text!("uniform/edges"), text!("uniform/places")],
    more: &[],
};
pub(crate) const EXPAND_PATCHES: ShaderModuleSource = ShaderModuleSource {
    stem: "expand_patches",
    text: text!("expand_patches"),
    plane: &[
        text!("uniform/edges"),
        text!("plane/positions"),
        text!("plane/put_vertex"),
        text!("shared/put_triangle"),
    ],
    curved: &[text!("uniform/edges"), text!("curved/positions"), text!("shared/put_triangle")],
    points: &[text!("uniform/edges"), text!("curved/positions"), text!("shared/put_triangle")],
    more: &[text!("marks/block")],
};
pub(crate) const DRAW_TERRAIN: ShaderModuleSource = ShaderModuleSource {
    stem: "draw_terrain",
    text: text!("draw_terrain"),
    plane: &[text!("shared/shading"), text!("plane/relief")],
    curved: &[text!("shared/shading"), text!("curved/relief")],
    points: &[text!("shared/shading"), text!("curved/relief")],
    more: &[],
};

// Where factors go by error.
const CURVED_GRADE: &[Part] = &[text!("factors/blocks"), text!("curved/deviate"), text!("curved/grade")];
pub(crate) const GRADE_NODES: ShaderModuleSource = ShaderModuleSource {
    stem: "grade_nodes",
    text: text!("grade_nodes"),
    plane: &[text!("factors/blocks"), text!("plane/deviate"), text!("plane/grade")],
    curved: CURVED_GRADE,
    points: CURVED_GRADE,
    more: &[
        text!("factors/words"),
        text!("factors/deviations"),
        text!("factors/ranks"),
        text!("factors/diamonds"),
    ],
};
const CURVED_WISH: &[Part] =
    &[text!("shared/boxes"), text!("curved/bounds"), text!("factors/blocks"), text!("curved/deviate")];
pub(crate) const WISH_FACTORS: ShaderModuleSource = ShaderModuleSource {
    stem: "wish_factors",
    text: text!("wish_factors"),
    plane: &[text!("shared/boxes"), text!("plane/bounds"), text!("factors/blocks"), text!("plane/deviate")],
    curved: CURVED_WISH,
    points: CURVED_WISH,
    more: &[text!("factors/words"), text!("factors/deviations"), text!("factors/screen")],
};
pub(crate) const WEIGH_FACTORS: ShaderModuleSource = ShaderModuleSource {
    stem: "weigh_factors",
    text: text!("weigh_factors"),
    plane: &[],
    curved: &[],
    points: &[],
    more: &[text!("factors/words"), text!("factors/blocks"), text!("factors/codes"), text!("factors/ranks")],
};
pub(crate) const SET_FACTORS: ShaderModuleSource =
    ShaderModuleSource { stem: "set_factors", text: text!("set_factors"), ..WEIGH_FACTORS };
pub(crate) const COMPACT_PATCHES_BY_ERROR: ShaderModuleSource = ShaderModuleSource {
    plane: &[text!("factors/words"), text!("factors/places")],
    curved: &[text!("factors/words"), text!("factors/places")],
    points: &[text!("factors/words"), text!("factors/places")],
    ..COMPACT_PATCHES
};
const CURVED_LEAVES: &[Part] = &[
    text!("curved/positions"),
    text!("shared/put_triangle"),
    text!("factors/words"),
    text!("factors/ranks"),
    text!("factors/leaves"),
];
pub(crate) const EXPAND_LEAVES: ShaderModuleSource = ShaderModuleSource {
    stem: "expand_leaves",
    text: text!("expand_leaves"),
    plane: &[
        text!("plane/positions"),
        text!("plane/put_vertex"),
        text!("shared/put_triangle"),
        text!("factors/words"),
        text!("factors/ranks"),
        text!("factors/leaves"),
    ],
    curved: CURVED_LEAVES,
    points: CURVED_LEAVES,
    more: &[text!("marks/block")],
};

// Where the colouring shows more than level and kind.
pub(crate) const MARK_PATCHES: ShaderModuleSource = ShaderModuleSource {
    stem: "mark_patches",
    text: text!("mark_patches"),
    more: &[text!("factors/deviations"), text!("factors/screen"), text!("marks/whole")],
    ..WISH_FACTORS
};
/// As [`MARK_PATCHES`], where patches leave nodes out.
pub(crate) const MARK_PATCHES_BY_ERROR: ShaderModuleSource = ShaderModuleSource {
    more: &[
        text!("factors/words"),
        text!("factors/deviations"),
        text!("factors/screen"),
        text!("factors/codes"),
        text!("factors/ranks"),
        text!("factors/marked"),
    ],
    ..MARK_PATCHES
};
const MARKS_ERROR: &[Part] = &[text!("marks/error")];
const MARKS_REFILL: &[Part] = &[text!("marks/refill")];
/// The expansion whose vertices carry their patch's mark.
pub(crate) const EXPAND_PATCHES_MARKED: ShaderModuleSource =
    ShaderModuleSource { more: MARKS_ERROR, ..EXPAND_PATCHES };
/// The same where factors go by error.
pub(crate) const EXPAND_LEAVES_MARKED: ShaderModuleSource =
    ShaderModuleSource { more: MARKS_ERROR, ..EXPAND_LEAVES };
/// The expansion whose vertices tell whether this frame brought them.
pub(crate) const EXPAND_PATCHES_REFILL: ShaderModuleSource =
    ShaderModuleSource { more: MARKS_REFILL, ..EXPAND_PATCHES };
/// The same where factors go by error.
pub(crate) const EXPAND_LEAVES_REFILL: ShaderModuleSource =
    ShaderModuleSource { more: MARKS_REFILL, ..EXPAND_LEAVES };
pub(crate) const DRAW_BOUNDS: ShaderModuleSource = ShaderModuleSource {
    stem: "draw_bounds",
    text: text!("draw_bounds"),
    plane: &[text!("shared/boxes"), text!("plane/bounds"), text!("shared/shading")],
    curved: &[text!("shared/boxes"), text!("curved/bounds"), text!("shared/shading")],
    points: &[text!("shared/boxes"), text!("curved/bounds"), text!("shared/shading")],
    more: &[],
};

/// Modules of what can be looked at besides the terrain itself.
#[must_use]
pub fn view_sources() -> [ShaderModuleSource; 7] {
    [
        MARK_PATCHES,
        MARK_PATCHES_BY_ERROR,
        EXPAND_PATCHES_MARKED,
        EXPAND_LEAVES_MARKED,
        EXPAND_PATCHES_REFILL,
        EXPAND_LEAVES_REFILL,
        DRAW_BOUNDS,
    ]
}

/// Modules of scenes whose factors go by error, in the order of the frame.
#[must_use]
pub fn by_error_sources() -> [ShaderModuleSource; 6] {
    [GRADE_NODES, WISH_FACTORS, WEIGH_FACTORS, SET_FACTORS, COMPACT_PATCHES_BY_ERROR, EXPAND_LEAVES]
}

/// Vertex stages of rivals before the draw's own fragments; planes only.
pub(crate) const RIVAL_MESH: ShaderModuleSource = ShaderModuleSource {
    stem: "rivals/mesh",
    text: text!("rivals/mesh"),
    plane: &[text!("shared/shading"), text!("plane/relief"), text!("draw_terrain"), text!("plane/positions")],
    curved: &[],
    points: &[],
    more: &[],
};
/// As [`RIVAL_MESH`], for clipmaps.
pub(crate) const RIVAL_CLIPMAPS: ShaderModuleSource =
    ShaderModuleSource { stem: "rivals/clipmaps", text: text!("rivals/clipmaps"), ..RIVAL_MESH };

/// Modules of the rivals' vertex stages.
#[must_use]
pub fn rival_sources() -> [ShaderModuleSource; 2] {
    [RIVAL_MESH, RIVAL_CLIPMAPS]
}
/// Every module of the renderer: those of a full frame in its order, then smaller ones in their place.
#[must_use]
pub fn shader_sources() -> [ShaderModuleSource; 7] {
    [
        DISPLACE_SAMPLES,
        BOUND_BLOCKS,
        CULL_QUADS,
        COMPACT_PATCHES,
        EXPAND_PATCHES,
        DRAW_TERRAIN,
        CULL_QUADS_UNBOUNDED,
    ]
}
