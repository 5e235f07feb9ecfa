//! Damage is always noticed and named; a build leaves the old store or the new one, whatever happens to it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use common::stores::{built, in_memory};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::Ordering;
use tessclip::heights::{GridSource, HeightGrid};
use tessclip::pyramid::store::{BuildOptions, Codec, InMemory, Progress, Store, StoreError, TileKey, build};
use tessclip::stream::{StreamOptions, TileSource};

fn try_open(files: InMemory) -> Result<Store, StoreError> {
    Store::open_from(std::sync::Arc::new(files), "memory")
}

fn small(codec: Codec) -> InMemory {
    let grid = common::terrain("procedural:mountains?width=700&height=400");
    in_memory(&grid, &BuildOptions { codec, ..BuildOptions::default() })
}

/// Deviations of blocks, read when a store is streamed.
fn is_deviations(file: &str) -> bool {
    file.contains("/deviations/c/")
}

/// Headers, and figures of tiles: whatever is read when a store is opened.
fn is_header(file: &str) -> bool {
    !file.contains("/elevation/c/") && !is_deviations(file)
}

#[test]
fn headers_cut_at_every_byte_are_refused() {
    let whole = small(Codec::Blosc);
    assert!(try_open(whole.clone()).is_ok());
    let mut cuts = 0;
    for (file, content) in whole.files.iter().filter(|(f, _)| is_header(f)) {
        for length in 0..content.len() {
            let mut files = whole.clone();
            files.files.get_mut(file).unwrap().truncate(length);
            let error = try_open(files).err().unwrap_or_else(|| panic!("{file} cut at {length} opens"));
            assert!(!error.to_string().contains('\n'));
            cuts += 1;
        }
        let mut files = whole.clone();
        files.files.remove(file);
        assert!(try_open(files).is_err(), "{file} is not missed");
    }
    eprintln!("{cuts} cuts");
}

#[test]
fn ten_thousand_flipped_bits_are_all_noticed_and_named() {
    for codec in [Codec::Blosc, Codec::Pcodec] {
        let whole = small(codec);
        let names: Vec<String> = whole.files.keys().cloned().collect();
        let total: usize = whole.files.values().map(Vec::len).sum();
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = |below: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % below as u64) as usize
        };
        // Headers are small: half of the flips go there.
        let flips: Vec<(String, usize)> = (0..5_000)
            .map(|k| {
                let mut at = next(total);
                let header = k % 2 == 0;
                let candidates: Vec<&String> = names.iter().filter(|n| is_header(n) == header).collect();
                let bytes: usize = candidates.iter().map(|n| whole.files[*n].len()).sum();
                at %= bytes;
                for name in candidates {
                    let length = whole.files[name].len();
                    if at < length {
                        return (name.clone(), at * 8 + next(8));
                    }
                    at -= length;
                }
                unreachable!()
            })
            .collect();
        let store = try_open(whole.clone()).unwrap();
        let keys: Vec<TileKey> = (0..=store.top())
            .flat_map(|level| {
                let [across, down] = store.tiles(level);
                (0..down).flat_map(move |row| (0..across).map(move |column| TileKey { level, column, row }))
            })
            .collect();
        let mut named = 0;
        for (file, bit) in flips {
            let mut files = whole.clone();
            files.files.get_mut(&file).unwrap()[bit / 8] ^= 1 << (bit % 8);
            let opened = try_open(files);
            if is_header(&file) {
                let error = opened.err().unwrap_or_else(|| panic!("{file} bit {bit} goes unnoticed"));
                let text = error.to_string();
                assert!(text.contains(&file) || text.contains("manifest.json"), "{text}");
                continue;
            }
            let store = opened.unwrap();
            if is_deviations(&file) {
                let report = store.verify(1, &|_, _| {});
                assert!(report.damage.len() == 1 && report.damage[0].file == file, "{report:?}");
                let source = TileSource::new(store.into(), StreamOptions::default()).unwrap();
                let error = source.load_deviations().err().unwrap();
                assert!(error.to_string().contains(&file), "{error}");
                continue;
            }
            let faults: Vec<_> = keys.iter().filter_map(|k| store.read_tile(*k).err()).collect();
            assert!(!faults.is_empty(), "{file} bit {bit} goes unnoticed");
            assert!(faults.iter().all(|f| f.file == file && f.damaged), "{faults:?}");
            named += usize::from(faults.iter().all(|f| f.offset.is_some()));
            let report = store.verify(1, &|_, _| {});
            assert!(!report.whole() && report.damage.iter().all(|d| d.file == file), "{report:?}");
        }
        eprintln!("{codec}: 5,000 flips noticed, {named} of those in shards with the tile's own offset");
    }
}

#[test]
fn shards_missing_cut_or_swapped_are_never_silent() {
    let whole = small(Codec::Blosc);
    let shard = "0/elevation/c/0/0";
    let key = TileKey { level: 0, column: 0, row: 0 };
    // Missing: Zarr alone would say that nothing was ever there.
    let mut files = whole.clone();
    files.files.remove(shard);
    let store = try_open(files).unwrap();
    assert_eq!(store.missing(), [shard]);
    let fault = store.read_tile(key).unwrap_err();
    assert!(fault.to_string().contains("missing") && fault.to_string().contains("level 0"), "{fault}");
    assert!(!store.verify(2, &|_, _| {}).whole());
    // Cut.
    let mut files = whole.clone();
    files.files.get_mut(shard).unwrap().pop();
    let store = try_open(files).unwrap();
    assert!(store.read_tile(key).unwrap_err().damaged);
    // Another store's shard of the same shape: its own checksums fit, its heights do not.
    let other =
        in_memory(&common::terrain("procedural:plain?width=700&height=400"), &BuildOptions::default());
    let mut files = whole.clone();
    files.files.insert(shard.into(), other.files[shard].clone());
    let store = try_open(files).unwrap();
    assert!(store.read_tile(key).is_err());
    // A tile of the same store in another's place, in a shard of the right length.
    let mut swapped = whole.clone();
    let content = swapped.files.get_mut(shard).unwrap();
    let index = content.len() - 260;
    let (a, b) = (content[index..index + 16].to_vec(), content[index + 16..index + 32].to_vec());
    content[index..index + 16].copy_from_slice(&b);
    content[index + 16..index + 32].copy_from_slice(&a);
    let sum = crc32c::crc32c(&content[index..index + 256]).to_le_bytes();
    content[index + 256..].copy_from_slice(&sum);
    let store = try_open(swapped).unwrap();
    let fault = store.read_tile(key).unwrap_err();
    assert!(fault.to_string().contains("the store says"), "{fault}");
}

#[test]
fn only_stores_are_replaced_and_only_when_asked() {
    let dir = tempfile::tempdir().unwrap();
    let grid = common::terrain("procedural:dunes?size=64");
    let at = dir.path().join("t.zarr");
    let source = GridSource::new(grid);
    let run = |at: &Path, overwrite| {
        let options = BuildOptions { overwrite, ..BuildOptions::default() };
        build(&source, at, &options, &Progress::default())
    };
    run(&at, false).unwrap();
    assert!(matches!(run(&at, false), Err(StoreError::Exists { .. })));
    run(&at, true).unwrap();
    let folder = dir.path().join("precious");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("letter"), "dear").unwrap();
    assert!(matches!(run(&folder, true), Err(StoreError::NotOurs { .. })));
    assert!(folder.join("letter").exists());
    let left: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
    // Stopped half-way: the old one stays, nothing is left beside it.
    let progress = Progress::default();
    progress.stop.store(true, Ordering::Relaxed);
    let options = BuildOptions { overwrite: true, ..BuildOptions::default() };
    assert!(matches!(build(&source, &at, &options, &progress), Err(StoreError::Stopped { .. })));
    assert!(Store::open(&at).unwrap().verify(1, &|_, _| {}).whole());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn killed_at_a_hundred_moments_the_store_is_the_old_one_or_the_new_one() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("t.zarr");
    let old = common::terrain("procedural:plain?size=700");
    built(&old, &at, &BuildOptions::default());
    let is_flat = |at: &Path| {
        let store = Store::open(at).expect("a store at every moment");
        assert!(store.verify(2, &|_, _| {}).whole());
        store.manifest().range_m == Some([0.0, 0.0])
    };
    let mut flat = true;
    let (mut olds, mut news, mut cut) = (0, 0, 0);
    let program = assert_cmd::cargo::cargo_bin("tessclip");
    // How long a whole build takes here and now.
    let begin = std::time::Instant::now();
    let whole = ["-q", "build", "procedural:dunes?size=700", "-o"];
    assert!(Command::new(&program).args(whole).arg(dir.path().join("x.zarr")).status().unwrap().success());
    let whole = begin.elapsed();
    std::fs::remove_dir_all(dir.path().join("x.zarr")).unwrap();
    for k in 0..100_u32 {
        let wanted = if flat { "procedural:dunes?size=700" } else { "procedural:plain?size=700" };
        let mut child = Command::new(&program)
            .args(["-q", "build", wanted, "--overwrite", "-o"])
            .arg(&at)
            .spawn()
            .unwrap();
        // From before it has begun to after it is done.
        std::thread::sleep(whole.mul_f64(f64::from(k * 79 % 100) / 75.0));
        cut += usize::from(child.try_wait().unwrap().is_none());
        let _ = child.kill();
        child.wait().unwrap();
        let now = is_flat(&at);
        if now == flat {
            olds += 1
        } else {
            news += 1
        }
        flat = now;
    }
    eprintln!("{cut} builds were cut off; old store {olds} times, new one {news} times");
    assert!(cut > 20 && olds > 0 && news > 0);
    // It can be run again, and clears up after those that were killed.
    let grid = common::terrain("procedural:dunes?size=300");
    built(&grid, &at, &BuildOptions { overwrite: true, ..BuildOptions::default() });
    let left: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["t.zarr"]);
}

/// Runs a command on a file system of 2 MB; `None` where none can be mounted.
#[cfg(target_os = "linux")]
fn on_a_small_disk(script: &str) -> Option<std::process::Output> {
    let mount = "d=$(mktemp -d) && mount -t tmpfs -o size=2m none $d && cd $d";
    let script = format!("{mount} || exit 77; {script}; r=$?; cd /; umount $d; rmdir $d; exit $r");
    let own = |args: &[&str]| Command::new("unshare").args(args).args(["sh", "-c", &script]).output();
    [own(&["-rm"]), own(&["-m"])].into_iter().flatten().find(|o| {
        o.status.code() != Some(77) && o.status.code() != Some(1)
            || String::from_utf8_lossy(&o.stderr).contains("tessclip")
    })
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_store_and_says_so() {
    let program = assert_cmd::cargo::cargo_bin("tessclip");
    let program = program.display();
    let script = format!(
        "{program} -q build 'procedural:dunes?size=300' -o t.zarr || exit 3; \
         {program} -q build 'procedural:mountains?size=2000' -o t.zarr --overwrite; echo code $?; ls -A; \
         {program} verify t.zarr"
    );
    let Some(out) = on_a_small_disk(&script) else {
        eprintln!("SKIPPED: no file system can be mounted here (unshare -rm)");
        return;
    };
    let (stdout, stderr) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(stdout.contains("code 2"), "{stdout} {stderr}");
    assert!(stderr.contains("the disk is full") && stderr.contains("untouched"), "{stderr}");
    let files: Vec<&str> = stdout.lines().skip(1).take_while(|l| !l.contains("tiles in")).collect();
    assert_eq!(files, ["t.zarr"], "{stdout}");
    assert!(stdout.contains(" 0 damaged"), "{stdout} {stderr}");
}

#[test]
fn memory_and_numbers_from_a_manifest_are_checked_before_use() {
    // A manifest that lies, with a checksum that fits.
    let whole = small(Codec::Blosc);
    let text = String::from_utf8(whole.files["manifest.json"].clone()).unwrap();
    let lies = [
        ("\"size\":[700,400]", "\"size\":[4000000000,400]"),
        ("\"size\":[700,400]", "\"size\":[70000,40000]"),
        ("\"size\":[700,400]", "\"size\":[0,400]"),
        ("\"tile\":256", "\"tile\":100000"),
        ("tessclip-store/3", "tessclip-store/9"),
        ("\"dtype\":\"float32\"", "\"dtype\":\"int16\""),
        ("\"codec\":\"blosc\"", "\"codec\":\"pcodec\""),
        ("\"spacing_m\":[30.0,30.0]", "\"spacing_m\":[0.0,30.0]"),
    ];
    for (from, to) in lies {
        assert!(text.contains(from), "{from} in {}", &text[..400]);
        let text = text.replacen(from, to, 1);
        let mut files = whole.clone();
        let hash = format!("{:016x}\n", xxhash_rust::xxh3::xxh3_64(text.as_bytes()));
        files.files.insert("manifest.json".into(), text.into_bytes());
        files.files.insert("manifest.json.xxh3".into(), hash.into_bytes());
        if let Ok(store) = try_open(files) {
            assert!(!store.verify(1, &|_, _| {}).whole(), "{to} goes unnoticed");
        }
    }
}

#[test]
fn all_void_and_tiny_grids_are_stores_too() {
    for grid in [
        HeightGrid::new(2, 3, vec![f32::NAN; 6]).unwrap(),
        HeightGrid::new(300, 2, vec![5.0; 600]).unwrap(),
        HeightGrid::new(2, 2, vec![1.0, f32::NAN, 3.0, 4.0]).unwrap(),
    ] {
        let store = try_open(in_memory(&grid, &BuildOptions::default())).unwrap();
        assert!(store.verify(1, &|_, _| {}).whole());
        let back = store.to_grid(1 << 20).unwrap();
        assert_eq!((back.width, back.height), (grid.width, grid.height));
        assert_eq!(back.valid, grid.valid);
    }
}
