//! Shader modules: each pass's file behind the shared files it imports.
//!
//! Composition is concatenation in a fixed order; variants come from `override` constants, never
//! from copies. tests/shaders.rs validates every module with exactly the features we request.

const STRUCTS: &str = include_str!("../../shaders/shared/structs.wgsl");
const LATTICE: &str = include_str!("../../shaders/shared/lattice.wgsl");
const POSITIONS: &str = include_str!("../../shaders/shared/positions.wgsl");
const SHADING: &str = include_str!("../../shaders/shared/shading.wgsl");

/// A composed module: its stem (shader, twin, pass and test prefix) and its parts in order.
#[derive(Clone, Copy, Debug)]
pub struct ShaderModuleSource {
    /// Stem of the pass.
    pub stem: &'static str,
    parts: &'static [&'static str],
}

impl ShaderModuleSource {
    /// The whole WGSL text.
    #[must_use]
    pub fn text(&self) -> String {
        self.parts.join("\n")
    }
}

macro_rules! module {
    ($stem:literal, $($part:ident),*) => {
        ShaderModuleSource {
            stem: $stem,
            parts: &[STRUCTS, LATTICE, $($part,)* include_str!(concat!("../../shaders/", $stem, ".wgsl"))],
        }
    };
}

pub(crate) const DISPLACE_SAMPLES: ShaderModuleSource = module!("displace_samples",);
pub(crate) const BOUND_BLOCKS: ShaderModuleSource = module!("bound_blocks",);
pub(crate) const CULL_QUADS: ShaderModuleSource = module!("cull_quads",);
pub(crate) const COMPACT_PATCHES: ShaderModuleSource = module!("compact_patches",);
pub(crate) const EXPAND_PATCHES: ShaderModuleSource = module!("expand_patches", POSITIONS);
pub(crate) const DRAW_TERRAIN: ShaderModuleSource = module!("draw_terrain", SHADING);

/// Every module of the renderer, in the order of the frame.
#[must_use]
pub fn shader_sources() -> [ShaderModuleSource; 6] {
    [DISPLACE_SAMPLES, BOUND_BLOCKS, CULL_QUADS, COMPACT_PATCHES, EXPAND_PATCHES, DRAW_TERRAIN]
}
