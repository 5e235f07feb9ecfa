//! A store behind HTTP: read by byte ranges from a local server. `cargo test --features remote --test remote_store`.
#![cfg(feature = "remote")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tessclip::clipmap::Rect;
use tessclip::pyramid::store::{BuildOptions, Remote};
use tessclip::pyramid::{LevelWish, MemoryPyramid, Prefilter, SampleSource, Streaming};
use tessclip::stream::{StreamOptions, TileSource};

/// Serves a folder: GET with and without ranges, and HEAD. Gives its port and counts the bytes it sent.
fn serve(root: PathBuf) -> (u16, Arc<AtomicU64>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let sent = Arc::new(AtomicU64::new(0));
    let count = sent.clone();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (root, count) = (root.clone(), count.clone());
            std::thread::spawn(move || while answer(&root, &stream, &count) {});
        }
    });
    (port, sent)
}

fn answer(root: &Path, stream: &TcpStream, count: &AtomicU64) -> bool {
    let mut reader = BufReader::new(stream.try_clone().unwrap());
    let mut line = String::new();
    if reader.read_line(&mut line).unwrap_or(0) == 0 {
        return false;
    }
    let mut parts = line.split_whitespace();
    let (method, target) = (parts.next().unwrap().to_string(), parts.next().unwrap().to_string());
    let mut range = None;
    loop {
        let mut header = String::new();
        if reader.read_line(&mut header).unwrap_or(0) == 0 || header.trim().is_empty() {
            break;
        }
        if let Some(bytes) = header.to_ascii_lowercase().strip_prefix("range: bytes=") {
            let (from, to) = bytes.trim().split_once('-').unwrap();
            range = Some((from.parse::<u64>().unwrap(), to.parse::<u64>().unwrap()));
        }
    }
    let mut out = stream;
    let path = root.join(target.trim_start_matches('/'));
    let Ok(mut file) = std::fs::File::open(&path) else {
        return write!(out, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n").is_ok();
    };
    let mut content = Vec::new();
    file.read_to_end(&mut content).unwrap();
    let total = content.len() as u64;
    let date = "Last-Modified: Wed, 25 Nov 2026 00:00:00 GMT";
    let head = match range {
        Some((from, to)) => {
            let to = to.min(total - 1);
            content = content[from as usize..=to as usize].to_vec();
            format!("HTTP/1.1 206 Partial Content\r\nContent-Range: bytes {from}-{to}/{total}")
        }
        None => "HTTP/1.1 200 OK".into(),
    };
    write!(out, "{head}\r\n{date}\r\nContent-Length: {}\r\n\r\n", content.len()).unwrap();
    if method == "GET" {
        count.fetch_add(content.len() as u64, Ordering::SeqCst);
        out.write_all(&content).unwrap();
    }
    true
}

#[test]
fn a_store_behind_http_is_read_by_ranges() {
    let dir = tempfile::tempdir().unwrap();
    let grid = common::terrain("procedural:mountains?size=1500");
    let summary = common::stores::built(&grid, &dir.path().join("t.zarr"), &BuildOptions::default());
    let (port, sent) = serve(dir.path().into());
    let store = Remote::open(&format!("http://127.0.0.1:{port}/t.zarr")).unwrap();
    let source = TileSource::new(Arc::new(store), StreamOptions::default()).unwrap();
    let area = Rect { lo: [100, 200], hi: [300, 350] };
    source.wish(&[LevelWish { level: 0, needed: area, ahead: [0.0; 2], now: true }]);
    let begin = std::time::Instant::now();
    while !source.is_ready(0, &[area]) {
        assert!(begin.elapsed().as_secs() < 60);
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let (mut got, mut wanted) = (Vec::new(), Vec::new());
    source.read(0, area, &mut got);
    MemoryPyramid::new(&grid, Prefilter::Subsample).read(0, area, &mut wanted);
    assert_eq!(got, wanted);
    let sent = sent.load(Ordering::SeqCst);
    eprintln!("{sent} of {} bytes were sent", summary.bytes);
    assert!(sent < summary.bytes / 2, "whole files were read");
    // What is not there is told in one line.
    let error = Remote::open(&format!("http://127.0.0.1:{port}/none.zarr")).unwrap_err().to_string();
    assert!(error.contains("not a tessclip store"), "{error}");
    assert!(Remote::open("gopher://x/y").is_err());
}
