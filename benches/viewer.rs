//! What the panels cost: the viewer with and without them in turns, the same view drawn over and over in a window
//! under a virtual X server. The HUD is to take 5 % of a frame at most at 1280 x 720 on the software driver.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a bench that fails stops")]

#[cfg(not(all(feature = "viewer", target_os = "linux")))]
fn main() {
    println!("needs Linux and the feature viewer");
}

#[cfg(all(feature = "viewer", target_os = "linux"))]
#[path = "../tests/common/display.rs"]
mod display;

#[cfg(all(feature = "viewer", target_os = "linux"))]
fn main() {
    use tessclip::measure::percentile;

    const ROUNDS: usize = 6;
    let server = display::Display::open([1400, 900]);
    let out = tempfile::tempdir().expect("a folder");
    let args = [
        "procedural:mountains?size=2049",
        "--size=1280x720",
        "--vsync=immediate",
        "--camera=15000,4000,4200,10,-16",
        "--frames=241",
    ];
    let run = |hud: bool| {
        let args: Vec<&str> = args.into_iter().chain((!hud).then_some("--no-hud")).collect();
        let mut viewer = display::Viewer::open(&server, out.path(), &args);
        let quit = viewer.wait("quit");
        assert!(viewer.ended().success());
        ["frame_ms_p50", "frame_ms_p99", "panels_ms", "frame_ms"].map(|key| quit[key].as_f64().unwrap_or(0.0))
    };
    let (mut shares, mut ratios) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        // Whoever flies first may find the machine warmer or colder.
        let (with, without) = if round % 2 == 0 {
            let with = run(true);
            (with, run(false))
        } else {
            let without = run(false);
            (run(true), without)
        };
        shares.push(with[2] / with[3]);
        ratios.push(with[0] / without[0] - 1.0);
        println!(
            "round {round}: p50 {:.2} ms with panels, {:.2} without; p99 {:.2} and {:.2}; panels alone {:.2} ms",
            with[0], without[0], with[1], without[1], with[2]
        );
    }
    // Presenting to a server that copies on the same two cores makes whole frames vary by more than panels cost:
    // what they take of the CPU and of the GPU is told apart from what frames take with and without them.
    for (what, mut all) in [("panels' own time", shares), ("frames with them over those without", ratios)] {
        all.sort_by(f64::total_cmp);
        let share = |p: f64| 100.0 * percentile(&all, p).expect("some");
        let (median, least, most) = (share(0.5), share(0.0), share(1.0));
        println!("{what}: {median:.1} % of a frame (median of {ROUNDS}, {least:.1} to {most:.1})");
    }
}
