//! Every shader variant validates with exactly the features we request, and every shared struct lies in
//! memory as Rust's does.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

use std::path::{Path, PathBuf};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use tessclip::gpu::{
    Counters, GpuChoice, GpuControlQuad, GpuFrame, Ground, PatchNodes, PatchRecord, by_error_sources,
    rival_sources, shader_sources, view_sources,
};
use tessclip::reference::Vertex;

fn validate(text: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text))?;
    // We request timestamp queries only, which add nothing to the language.
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|e| e.emit_to_string(text))?;
    Ok(module)
}

/// The module with its overrides set, as the pipeline compiles it.
fn variants(text: &str) -> Vec<String> {
    let mut out = vec![text.to_string()];
    for name in ["MORPH", "HAS_VOIDS", "FOG", "SHORT", "CULL", "HORIZON", "NORMALS"] {
        if !text.contains(&format!("override {name}:")) {
            continue;
        }
        out = out
            .iter()
            .flat_map(|t| {
                ["true", "false"].map(|value| {
                    let mut made = t.clone();
                    for default in ["true", "false"] {
                        let from = format!("override {name}: bool = {default};");
                        made = made.replace(&from, &format!("const {name}: bool = {value};"));
                    }
                    made
                })
            })
            .collect();
    }
    if !text.contains("override COLOR_MODE:") {
        return out;
    }
    out.iter()
        .flat_map(|t| {
            (0..7).map(|mode| {
                t.replace("override COLOR_MODE: u32 = 0u;", &format!("const COLOR_MODE: u32 = {mode}u;"))
            })
        })
        .collect()
}

#[test]
fn every_variant_of_every_shader_is_valid() {
    let mut count = 0;
    for source in shader_sources() {
        for ground in [Ground::Plane, Ground::Curved, Ground::Points] {
            let text = source.text(ground);
            validate(&text).unwrap_or_else(|e| panic!("{} {ground:?}: {e}", source.stem));
            for variant in variants(&text) {
                validate(&variant).unwrap_or_else(|e| panic!("{} {ground:?}: {e}", source.stem));
                count += 1;
            }
        }
    }
    // By pass: SHORT; none; MORPH, CULL and on a curved surface HORIZON; none; HAS_VOIDS, MORPH and on a
    // plane NORMALS; FOG and seven colourings; and without bounds MORPH and CULL.
    assert_eq!(count, 3 * (2 + 1 + 1 + 14 + 4) + (4 + 8 + 8) + (8 + 4 + 4));
}

#[test]
fn the_vertex_stages_of_rivals_are_valid() {
    for source in rival_sources() {
        let text = source.text(Ground::Plane);
        for variant in variants(&text) {
            validate(&variant).unwrap_or_else(|e| panic!("{}: {e}", source.stem));
        }
    }
}

#[test]
fn the_validation_can_fail() {
    assert!(validate("@compute @workgroup_size(1) fn main() { let x: u32 = 1.0; }").is_err());
    // f64 is a native extra that we do not request.
    assert!(validate("fn f(x: f64) -> f64 { return x; }").is_err());
}

/// Name and offset of each member in order, then the size.
type Layout = (Vec<(String, u32)>, u32);

fn wgsl_layout(module: &naga::Module, name: &str) -> Option<Layout> {
    let ty = module.types.iter().map(|(_, t)| t).find(|t| t.name.as_deref() == Some(name))?;
    let naga::TypeInner::Struct { members, span } = &ty.inner else { return None };
    let members = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
    Some((members, *span))
}

macro_rules! rust_layout {
    ($ty:ty, $($member:ident),*) => {
        (
            vec![$((stringify!($member).to_string(), std::mem::offset_of!($ty, $member) as u32)),*],
            size_of::<$ty>() as u32,
        )
    };
}

#[test]
fn shared_structs_have_the_same_members_offsets_and_sizes() {
    let text = shader_sources()[4].text(Ground::Plane);
    let module = validate(&text).expect("valid");
    let pairs: [(&str, Layout); 4] = [
        (
            "Frame",
            rust_layout!(
                GpuFrame,
                clip_from_near,
                planes,
                eye_from_anchor_m,
                fog_per_m,
                sun_direction,
                ambient,
                fog_color,
                anchor_height_m,
                height_range_m,
                sample_step_m,
                sea_level,
                spacing_m,
                eye_samples,
                anchor,
                last,
                level_count,
                finest,
                n,
                slots_per_level,
                window_cells,
                vertex_capacity,
                index_capacity,
                shifted_levels,
                origins
            ),
        ),
        ("ControlQuad", rust_layout!(GpuControlQuad, kind, first_patch, patches_east)),
        (
            "PatchRecord",
            rust_layout!(PatchRecord, cell, shape, outer_sn, outer_we, first_vertex, first_index, visible),
        ),
        (
            "Counters",
            rust_layout!(
                Counters,
                index_count,
                instance_count,
                first_index,
                base_vertex,
                first_instance,
                wire_vertex_count,
                wire_instance_count,
                wire_first_vertex,
                wire_first_instance,
                expand_x,
                expand_y,
                expand_z,
                vertices_needed,
                indices_needed,
                patches_visible,
                patches_dropped,
                threshold_px
            ),
        ),
    ];
    for (name, rust) in pairs {
        assert_eq!(wgsl_layout(&module, name).as_ref(), Some(&rust), "{name}");
    }
    // Position is one field in Rust and three in WGSL (a vec3 there would be padded to 16 bytes).
    let (members, span) = wgsl_layout(&module, "Vertex").expect("present");
    let offsets: Vec<u32> = members.iter().map(|m| m.1).collect();
    assert_eq!((offsets, span as usize), (vec![0, 4, 8, 12], size_of::<Vertex>()));
    assert_eq!(std::mem::offset_of!(Vertex, packed), 12);
}

#[test]
fn the_modules_of_factors_by_error_are_valid() {
    for source in by_error_sources() {
        for ground in [Ground::Plane, Ground::Curved, Ground::Points] {
            for variant in variants(&source.text(ground)) {
                validate(&variant).unwrap_or_else(|e| panic!("{} {ground:?}: {e}", source.stem));
            }
        }
    }
    let module = validate(&by_error_sources()[0].text(Ground::Plane)).expect("valid");
    let rust = rust_layout!(GpuChoice, half_px, reference_px, reference_bin, budget, bend_m, spare);
    let (members, size) = wgsl_layout(&module, "Choice").expect("present");
    // What is left at the end is two words there and one array here.
    assert_eq!((&members[..5], size), (&rust.0[..5], rust.1));
}

/// They lie in a plain array of words there, which the shaders count themselves.
#[test]
fn the_words_of_a_patchs_nodes_stand_where_the_shaders_look() {
    let texts = by_error_sources().map(|source| source.text(Ground::Plane));
    let counting: Vec<_> =
        texts.iter().filter(|text| text.contains("NODE_WORDS * ") || text.contains("* NODE_WORDS")).collect();
    assert_eq!(counting.len(), 3, "set_factors writes them, compact_patches and expand_leaves go on");
    let words = format!("const NODE_WORDS = {}u;", size_of::<PatchNodes>() / 4);
    assert!(counting.iter().all(|text| text.contains(&words)), "{words}");
    let bytes = rust_layout!(
        PatchNodes,
        cell,
        shape,
        visible,
        first_vertex,
        first_index,
        vertices,
        triangles,
        rows,
        extras,
        spare
    );
    let offsets: Vec<u32> = bytes.0.iter().map(|member| member.1 / 4).collect();
    assert_eq!(offsets, [0, 2, 3, 4, 5, 6, 7, 8, 25, 29]);
}

/// Values that a shader's text gives a constant.
fn declared(text: &str, name: &str) -> Vec<u64> {
    let begin = format!("const {name} = ");
    let values = text.lines().filter_map(|line| line.trim_start().strip_prefix(&begin));
    values.map(|rest| rest.split_once("u;").unwrap().0.parse().unwrap()).collect()
}

/// Every WGSL file of a folder and those within it, with its text.
fn wgsl_files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut out = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            out.extend(wgsl_files(&path));
        } else if path.extension().is_some_and(|end| end == "wgsl") {
            let text = std::fs::read_to_string(&path).unwrap();
            out.push((path, text));
        }
    }
    out
}

/// How far blocks and patches lie apart in plain arrays of words: one file says it to all shaders.
#[test]
fn every_shader_counts_the_same_words() {
    let files = wgsl_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"));
    // Private to src/gpu/sizes.rs: three words, and five of codes for each of 17 rows and the west and the
    // east column; four masks of leaves for each of 17 rows, what lies before each row, four sides, and
    // seven spare.
    let grades = 3 + (17 + 2) * 5;
    let leaves = 4 * 17 + 17 + 4 + 7;
    let nodes = size_of::<PatchNodes>() as u64 / 4;
    assert_eq!([grades, leaves, nodes], [98, 96, 32]);
    for (name, words) in [("GRADE_WORDS", grades), ("LEAF_WORDS", leaves), ("NODE_WORDS", nodes)] {
        let mut found = 0;
        for (path, text) in &files {
            for value in declared(text, name) {
                assert_eq!(value, words, "{name} in {}", path.display());
                found += 1;
            }
        }
        assert_eq!(found, 1, "declarations of {name}");
    }
    assert_eq!(declared("const GRADE_WORDS = 88u;\nconst LEAF_WORDS = 96u;", "GRADE_WORDS"), [88]);
}

#[test]
fn the_modules_of_other_views_are_valid() {
    for source in view_sources() {
        for ground in [Ground::Plane, Ground::Curved, Ground::Points] {
            for variant in variants(&source.text(ground)) {
                validate(&variant).unwrap_or_else(|e| panic!("{} {ground:?}: {e}", source.stem));
            }
        }
    }
}

#[test]
fn a_struct_that_drifted_is_noticed() {
    let text = shader_sources()[4].text(Ground::Plane).replace("    fog_per_m: f32,\n", "");
    let module = naga::front::wgsl::parse_str(&text).expect("parses");
    let (members, _) = wgsl_layout(&module, "Frame").expect("present");
    let rust = rust_layout!(GpuFrame, clip_from_near, planes, eye_from_anchor_m, fog_per_m);
    assert_ne!(members[..4], rust.0[..4]);
}
