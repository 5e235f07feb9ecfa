//! The command line as a user meets it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

fn tessclip() -> Command {
    Command::cargo_bin("tessclip").expect("built")
}

fn stdout(args: &[&str]) -> String {
    let out = tessclip().args(args).assert().success();
    String::from_utf8(out.get_output().stdout.clone()).expect("text")
}

/// Exit code 2 and one line that holds all the words.
fn refused(args: &[&str], words: &[&str]) {
    let out = tessclip().args(args).assert().code(2);
    let text = String::from_utf8_lossy(&out.get_output().stderr).to_string();
    let lines: Vec<_> = text.lines().filter(|l| l.starts_with("tessclip: error")).collect();
    assert_eq!(lines.len(), 1, "{text}");
    for word in words {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
}

fn shared(path: &str) -> Option<PathBuf> {
    common::data(path).map(PathBuf::from)
}

#[test]
fn footprints_print_the_papers_table() {
    let json: serde_json::Value =
        serde_json::from_str(&stdout(&["footprints", "--n", "63,511", "--levels", "7,9", "--json"]))
            .expect("json");
    let rows = json["rows"].as_array().expect("rows");
    let find = |method: &str, n: u64, levels: u64| {
        rows.iter().find(|r| r["method"] == method && r["n"] == n && r["levels"] == levels).expect("present")
    };
    assert_eq!(find("tessellated", 63, 7)["control_points"], 301);
    assert_eq!(find("tessellated", 511, 9)["control_points"], 387);
    assert_eq!(find("classic", 511, 9)["vertices"], 2_350_089);
    assert!(find("classic", 63, 7)["control_points"].is_null());
    assert!(stdout(&["footprints"]).contains("n0 to n43"));
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let dir = TempDir::new().expect("a folder");
    let out = dir.path().join("x.png");
    let out = out.to_str().expect("text");
    refused(&["info", "/nowhere/at/all.tif"], &["/nowhere/at/all.tif"]);
    refused(&["info", "procedural:nothing"], &["nothing", "mountains"]);
    refused(&["render", "procedural:plain", "--n", "100", "-o", out], &["100", "2^k - 1"]);
    refused(&["render", "procedural:plain", "--levels", "30", "-o", out], &["30 levels", "supports"]);
    refused(&["render", "procedural:plain", "--camera", "1,2,NaN,0,0", "-o", out], &["NaN"]);
    refused(&["render", "procedural:plain", "--camera", "1,2,3", "-o", out], &["3 numbers"]);
    refused(&["render", "procedural:plain", "--fov", "180", "-o", out], &["180"]);
    refused(
        &["render", "procedural:plain", "--pixel-error", "0", "-o", out],
        &["--pixel-error", "0.05 to 100"],
    );
    refused(&["plan", "procedural:plain", "--n", "63", "--budget", "5000"], &["--n 63", "127 samples"]);
    refused(
        &["plan", "procedural:plain", "--factors", "uniform", "--budget", "5000"],
        &["--budget", "uniform"],
    );
    refused(&["render", "procedural:plain", "-o", "/no/such/folder/x.png"], &["/no/such/folder"]);
    refused(&["footprints", "--n", "64"], &["64"]);
    assert!(!Path::new(out).exists());
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn rendering_twice_gives_the_same_bytes_and_mesh_is_valid_ply() {
    common::gpu();
    let dir = TempDir::new().expect("a folder");
    let file = |name: &str| dir.path().join(name).to_str().expect("text").to_string();
    for name in ["a.png", "b.png"] {
        stdout(&[
            "render",
            "procedural:mountains?size=300",
            "--size",
            "160x90",
            "--n",
            "63",
            "-o",
            &file(name),
        ]);
    }
    let read = |name: &str| std::fs::read(dir.path().join(name)).expect("readable");
    assert_eq!(read("a.png"), read("b.png"));
    stdout(&[
        "mesh",
        "procedural:mountains?width=120&height=77",
        "--n",
        "31",
        "--no-cull",
        "-o",
        &file("m.ply"),
    ]);
    let ply = read("m.ply");
    let end = ply.windows(11).position(|w| w == b"end_header\n").expect("header") + 11;
    let header = String::from_utf8_lossy(&ply[..end]).to_string();
    let count = |what: &str| -> usize {
        let line = header.lines().find(|l| l.starts_with(what)).expect("present");
        line.rsplit(' ').next().and_then(|v| v.parse().ok()).expect("a number")
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    assert_eq!(ply.len(), end + vertices * 25 + faces * 13);
    // The mesh covers the data: 119 x 76 cells of 30 m.
    let at = |ix: usize, axis: usize| {
        let from = end + ix * 25 + axis * 8;
        f64::from_le_bytes(ply[from..from + 8].try_into().expect("8 bytes"))
    };
    let mut area = 0.0;
    for f in 0..faces {
        let from = end + vertices * 25 + f * 13 + 1;
        let v = [0, 4, 8]
            .map(|o| u32::from_le_bytes(ply[from + o..from + o + 4].try_into().expect("4 bytes")) as usize);
        let [a, b, c] = v.map(|ix| [at(ix, 0), at(ix, 1)]);
        area += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    }
    assert!((area / (119.0 * 30.0 * 76.0 * 30.0) - 1.0).abs() < 1e-6);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_flight_writes_a_report_that_says_what_it_is() {
    common::gpu();
    let dir = TempDir::new().expect("a folder");
    let path = dir.path().join("path.csv");
    std::fs::write(&path, "t,x,y,z,yaw,pitch\n0,100,100,900,0,-10\n1,3000,3000,900,350,-10\n")
        .expect("written");
    let report = dir.path().join("report");
    let args = ["fly", "procedural:dunes?size=200", "--n", "31", "--size", "64x36", "--frames", "12"];
    tessclip().args(args).arg("--path").arg(&path).arg("--report").arg(&report).assert().success();
    let text = std::fs::read_to_string(report.join("report.json")).expect("written");
    let json: serde_json::Value = serde_json::from_str(&text).expect("json");
    assert_eq!(json["schema"], "tessclip-report/1");
    let run = &json["runs"][0];
    assert_eq!(run["frames"], 12);
    assert_eq!(run["upload"]["vertex_bytes"], 0);
    assert!(run["frame_ms"]["p99"].is_null(), "p99 needs 1,000 frames");
    assert!(run["frame_ms"]["p50"].as_f64().is_some_and(|v| v > 0.0));
    assert!(run["upload"]["shifts"].as_u64().is_some_and(|v| v > 0));
    let csv = std::fs::read_to_string(report.join("frames.csv")).expect("written");
    assert_eq!(csv.lines().count(), 13);
    assert!(std::fs::read_to_string(report.join("report.html")).expect("written").contains("<svg"));
    std::fs::write(&path, "t,x,y,z,yaw,pitch\n0,0,0,0,0,0\n0,1,1,1,1,1\n").expect("written");
    refused(
        &["fly", "procedural:dunes?size=200", "--path", path.to_str().expect("text"), "--report", "unused"],
        &["line 3", "t must grow"],
    );
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore)]
fn a_comparison_writes_a_report_that_says_what_it_is() {
    let dir = TempDir::new().expect("a folder");
    let to = dir.path().to_str().expect("text");
    let tiny = ["--frames", "10", "--rounds", "5", "--views", "2", "--size", "160x90", "--n", "31"];
    let mut args = vec!["compare", "procedural:mountains?size=129", "--report", to, "--path", "straight"];
    args.extend(tiny);
    stdout(&args);
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("report.json")).expect("written"))
            .expect("json");
    assert_eq!(json["schema"], "tessclip-report/1");
    let rows = json["comparison"]["paths"][0]["methods"].as_array().expect("methods");
    assert_eq!(rows.len(), tessclip::rivals::Method::ALL.len());
    for row in rows {
        let method = row["method"].as_str().expect("a name");
        assert_eq!(row["frames"], 50, "{method}");
        // 50 frames have no 99th percentile; nothing that is missing is 0.
        assert!(row["frame_ms"]["p99"].is_null() && row["frame_ms"]["p50"].as_f64() > Some(0.0), "{method}");
        assert_eq!(row["error"]["crack_pixels"], 0, "{method}");
        assert_eq!(row["error"]["uncovered_samples"], 0, "{method}");
        let sent = |kind: &str| row["upload"][kind].as_u64().expect("a number");
        if method.starts_with("tessellated") {
            assert_eq!((sent("vertex_bytes"), sent("index_bytes"), sent("vertices")), (0, 0, 0), "{method}");
        }
        assert_eq!(row["ratio"].is_null(), method == "tessellated");
        let clipmap = method.starts_with("tessellated") || ["classic", "footprint"].contains(&method);
        assert_eq!(row["upload"]["vertices_if_full"].is_null(), !clipmap, "{method}");
        match method {
            "classic" | "roam" => assert!(sent("vertex_bytes") > 0, "{method}: {row}"),
            "footprint" | "brute-force" => assert_eq!(sent("vertex_bytes"), 0, "{method}: {row}"),
            _ => {} // geomipmaps and chunks send what comes into view and is not there
        }
        // All clipmaps but ours have their morph; brute force has no error at all.
        let px = row["error"]["px"]["max"].as_f64().expect("a number");
        assert_eq!(px < 0.01, method == "brute-force", "{method}: {px}");
    }
    assert_eq!(json["runs"].as_array().map(Vec::len), Some(tessclip::rivals::Method::ALL.len()));
    let html = std::fs::read_to_string(dir.path().join("report.html")).expect("written");
    assert!(html.contains("<svg") && !html.contains("http") && !html.contains("<script"));
    let samples = std::fs::read_to_string(dir.path().join("samples.csv")).expect("written");
    // Eleven cases, ours twice, in five rounds of ten frames, and a head.
    assert_eq!(samples.lines().count(), 1 + 11 * 5 * 10);
    // The ledger of a flight is the sum of its frames.
    let heads: Vec<&str> = samples.lines().next().expect("a head").split(',').collect();
    let column = |name: &str| heads.iter().position(|h| *h == name).expect("a column");
    for row in rows {
        let of_flight = samples.lines().skip(1).map(|l| l.split(',').collect::<Vec<_>>());
        let of_flight =
            of_flight.filter(|l| l[column("method")] == row["method"] && l[column("round")] == "0");
        let lines: Vec<Vec<&str>> = of_flight.collect();
        for kind in ["control_bytes", "height_bytes", "vertex_bytes", "index_bytes"] {
            let sum: u64 = lines.iter().map(|l| l[column(kind)].parse::<u64>().expect("a number")).sum();
            assert_eq!(row["upload"][kind], sum, "{kind} of {}", row["method"]);
        }
    }
    assert!(dir.path().join("fronts.csv").is_file() && dir.path().join("uploads.csv").is_file());
}

#[test]
fn comparisons_that_cannot_be_are_refused_in_one_line() {
    let dir = TempDir::new().expect("a folder");
    let to = dir.path().to_str().expect("text");
    let with = |more: &[&str], words: &[&str]| {
        let mut args = vec!["compare", "procedural:mountains?size=65", "--report", to];
        args.extend(more);
        refused(&args, words);
    };
    with(&["--methods", "raom"], &["raom", "roam"]);
    with(&["--methods", ""], &["no such method"]);
    with(&["--path", "nope"], &["nope"]);
    with(&["--path", "straight,,still"], &["empty name"]);
    with(&["--wireframe"], &["--wireframe"]);
    with(&["--n", "255", "--levels", "99"], &["99 levels"]);
    tessclip().args(["compare", "procedural:plain", "--patch-cells", "12", "--report", to]).assert().code(2);
}

#[test]
fn info_tells_what_the_catalogue_says() {
    let Some(file) = shared("srtm/N46E008.tif") else { return };
    let json: serde_json::Value =
        serde_json::from_str(&stdout(&["info", file.to_str().expect("text"), "--json"])).expect("json");
    assert_eq!(json["void_count"], 103_743);
    assert_eq!(json["min"], 187.0);
    assert_eq!(json["max"], 4173.0);
    assert_eq!(json["width"], 1201);
    assert_eq!(json["unit"], "degree");
    assert!(json["notes"][0].as_str().is_some_and(|n| n.contains("WGS84")));
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "TESSCLIP_NO_GPU=1")]
fn a_brief_check_holds_and_prints_its_table() {
    common::gpu();
    let json: serde_json::Value = serde_json::from_str(&stdout(&[
        "check",
        "procedural:spikes?width=97&height=150",
        "--brief",
        "--json",
    ]))
    .expect("json");
    assert_eq!(json["pass"], true);
    assert!(json["rows"].as_array().is_some_and(|r| r.len() >= 8));
}

#[test]
fn stores_are_built_described_and_verified() {
    let dir = TempDir::new().expect("a folder");
    let at = dir.path().join("t.zarr");
    let store = at.to_str().expect("text");
    let json: serde_json::Value = serde_json::from_str(&stdout(&[
        "build",
        "procedural:mountains?width=700&height=500",
        "-o",
        store,
        "--max-error",
        "0.5",
        "--json",
    ]))
    .expect("json");
    assert_eq!((json["width"].as_u64(), json["levels"].as_u64()), (Some(700), Some(3)));
    let info: serde_json::Value = serde_json::from_str(&stdout(&["info", store, "--json"])).expect("json");
    assert_eq!(info["format"], "tessclip store");
    assert_eq!((info["width"].as_u64(), info["height"].as_u64()), (Some(700), Some(500)));
    assert!(stdout(&["info", store]).contains("within 0.5 m"));
    assert!(stdout(&["verify", store]).contains(" 0 damaged"));
    refused(&["build", "procedural:plain", "-o", store], &["exists already", "--overwrite"]);
    refused(&["build", store, "-o", store, "--overwrite"], &["is one of the sources"]);
    refused(&["build", "none.tif", "-o", "x.zarr"], &["none.tif", "no such file"]);
    refused(&["build", "procedural:plain", "-o", "none/x.zarr"], &["no folder none", "make that first"]);
    refused(&["verify", dir.path().to_str().expect("text")], &["not a tessclip store"]);
    refused(&["info", "http://localhost/t.zarr"], &["--features remote"]);
    refused(&["render", store, "--spacing", "3", "-o", "x.png"], &["settled when it was built"]);
    refused(&["render", store, "--prefilter", "low-pass", "-o", "x.png"], &["--prefilter subsample"]);
    refused(&["build", "procedural:plain?size=1000000000", "-o", "x.zarr"], &["more than a store may have"]);
    // One byte, anywhere in a shard.
    let shard = at.join("0/elevation/c/0/0");
    let mut bytes = std::fs::read(&shard).expect("a shard");
    bytes[777] ^= 1;
    std::fs::write(&shard, bytes).expect("written");
    let out = tessclip().args(["verify", store]).assert().code(1);
    let text = String::from_utf8_lossy(&out.get_output().stdout).to_string();
    assert!(text.contains("0/elevation/c/0/0, level 0, tile column 0 row 0, byte 0"), "{text}");
    // And a header.
    std::fs::write(at.join("1/zarr.json"), "{}").expect("written");
    refused(&["verify", store], &["1/zarr.json", "not as it was written"]);
}

#[test]
fn foreign_folders_are_never_replaced() {
    let dir = TempDir::new().expect("a folder");
    for file in ["zarr.json", "manifest.json"] {
        let at = dir.path().join(format!("other-{file}"));
        std::fs::create_dir(&at).expect("made");
        std::fs::write(at.join(file), "{\"zarr_format\":3}").expect("written");
        let args = ["build", "procedural:plain?size=64", "--overwrite", "-o", at.to_str().expect("text")];
        refused(&args, &["not a tessclip store", "not replaced"]);
        assert!(at.join(file).exists());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn builds_take_little_memory_and_stop_in_order() {
    use std::process::Stdio;
    let dir = TempDir::new().expect("a folder");
    let spawn = |recipe: &str, name: &str| {
        std::process::Command::new(assert_cmd::cargo::cargo_bin("tessclip"))
            .args(["-q", "build", recipe, "-o"])
            .arg(dir.path().join(name))
            .stderr(Stdio::piped())
            .spawn()
            .expect("started")
    };
    // 650 MB of samples.
    let mut child = spawn("procedural:plain?size=12750", "a.zarr");
    let mut most = 0;
    while child.try_wait().expect("a child").is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        let kib = peak.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
        most = most.max(kib.unwrap_or(0));
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    eprintln!("peak resident memory {most} KiB");
    assert!((1..512 * 1024).contains(&most), "{most} KiB");
    // Ctrl-C: one line, nothing left.
    let child = spawn("procedural:mountains?size=8000", "b.zarr");
    std::thread::sleep(std::time::Duration::from_millis(700));
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill runs").success());
    let out = child.wait_with_output().expect("ended");
    let text = String::from_utf8_lossy(&out.stderr).to_string();
    assert_eq!(out.status.code(), Some(2), "{text}");
    assert!(text.contains("stopped") && text.lines().count() == 1, "{text}");
    let left: Vec<_> =
        std::fs::read_dir(dir.path()).expect("a folder").map(|e| e.expect("entry").file_name()).collect();
    assert_eq!(left, ["a.zarr"]);
}

#[test]
fn a_store_becomes_a_cog_that_reads_the_same_where_gdal_is() {
    let dir = TempDir::new().expect("a folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("text").to_string();
    let (store, cog) = (path("t.zarr"), path("a&b.tif"));
    stdout(&["-q", "build", "procedural:mountains?width=900&height=600", "-o", &store]);
    if std::process::Command::new("gdal_translate").arg("--version").output().is_err() {
        eprintln!("SKIPPED in part: gdal_translate is not installed");
        refused(&["build", &store, "--to", "cog", "-o", &cog], &["gdal-bin"]);
        return;
    }
    stdout(&["build", &store, "--to", "cog", "-o", &cog]);
    let [a, b] = [&store, &cog].map(|f| {
        let json: serde_json::Value = serde_json::from_str(&stdout(&["info", f, "--json"])).expect("json");
        ["width", "height", "min", "max", "bounds", "spacing_m"].map(|k| json[k].clone())
    });
    assert_eq!(a, b);
    assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 2);
}

#[test]
#[cfg_attr(tessclip_no_gpu, ignore = "needs a GPU")]
fn stores_are_drawn_and_flown_also_when_the_device_is_lost() {
    common::gpu();
    let dir = TempDir::new().expect("a folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("text").to_string();
    let store = path("t.zarr");
    stdout(&["-q", "build", "procedural:mountains?size=1025", "-o", &store]);
    // The same picture, streamed and from memory; so low that both draw all levels.
    let pose = ["--camera", "15000,9000,3500,20,-15", "--size", "320x180", "-o"];
    for (from, to) in [(store.as_str(), "s.png"), ("procedural:mountains?size=1025", "m.png")] {
        stdout(&[&["render", from][..], &pose[..], &[&path(to)]].concat());
    }
    let read = |name: &str| std::fs::read(path(name)).expect("a picture");
    assert!(read("s.png") == read("m.png"));
    let report = path("report");
    let more = ["--path", "random-walk", "--speed", "16", "--frames", "40", "--size", "160x90", "--n", "63"];
    let flown = |extra: &[&str]| {
        stdout(&[&["fly", &store, "--report", &report][..], &more[..], extra].concat());
        let text = std::fs::read_to_string(format!("{report}/report.json")).expect("a report");
        let json: serde_json::Value = serde_json::from_str(&text).expect("json");
        json["runs"][0].clone()
    };
    let run = flown(&["--cracks", "8", "--lose-device-at", "20"]);
    assert_eq!((run["devices_lost"].as_u64(), run["cracks"]["crack_pixels"].as_u64()), (Some(1), Some(0)));
    assert_eq!(run["cracks"]["faults"].as_u64(), Some(0));
    // Whether the first frame is late is for the scheduler to say; that nothing was there, is not.
    assert!(run["stream"]["cache_misses"].as_u64() >= Some(1), "a cold cache: {}", run["stream"]);
    assert!(run["upload"]["height_bytes"].as_u64() <= run["upload"]["height_bytes_bound"].as_u64());
    let run = flown(&["--hz", "30", "--wait"]);
    assert_eq!(run["open_loop"]["hz"].as_f64(), Some(30.0));
    assert_eq!(run["stream"]["cache_misses"].as_u64().map(|m| m < 40), Some(true));
    refused(&["fly", &store, "--speed", "100", "--report", &report], &["0.1 to 64"]);
    refused(&["fly", &store, "--hz", "30", "--cracks", "2", "--report", &report], &["--cracks"]);
}
