//! A window under a virtual X server, driven as a person drives it: keys and mouse by xdotool, events as the
//! program tells them (`--state`).
#![allow(dead_code, reason = "each test file uses its own part")]

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// An X server without a screen.
pub struct Display {
    server: Child,
    pub name: String,
}

impl Display {
    /// Starts one with a screen of the given size on a number of its own choice.
    pub fn open(size: [u32; 2]) -> Self {
        let screen = format!("{}x{}x24", size[0], size[1]);
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb runs: apt-get install xvfb xdotool, or set TESSCLIP_NO_GPU=1");
        let mut number = String::new();
        let out = server.stdout.take().expect("piped");
        BufReader::new(out).read_line(&mut number).expect("a display number");
        Self { server, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The program in a window.
pub struct Viewer {
    program: Child,
    events: Receiver<Value>,
    /// All that was told, for the message of a failure.
    told: Vec<Value>,
    display: String,
    window: String,
    pub out: PathBuf,
}

impl Viewer {
    /// Starts it and waits for its first frame.
    pub fn open(display: &Display, out: &Path, args: &[&str]) -> Self {
        Self::run(display, out, Self::command(display, out, args))
    }

    /// As [`Viewer::open`], with a command of the test's own.
    pub fn run(display: &Display, out: &Path, mut command: Command) -> Self {
        let mut program = command.stdout(Stdio::piped()).spawn().expect("runs");
        let lines = BufReader::new(program.stdout.take().expect("piped")).lines();
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let event = serde_json::from_str(&line).unwrap_or(Value::String(line));
                if sender.send(event).is_err() {
                    break;
                }
            }
        });
        let mut viewer = Self {
            program,
            events,
            told: Vec::new(),
            display: display.name.clone(),
            window: String::new(),
            out: out.to_path_buf(),
        };
        viewer.wait("ready");
        let found = viewer.xdotool(&["search", "--sync", "--onlyvisible", "--name", "^tessclip"]);
        viewer.window = found.lines().next().expect("a window").to_string();
        let window = viewer.window.clone();
        viewer.xdotool(&["windowfocus", "--sync", &window]);
        viewer
    }

    pub fn command(display: &Display, out: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tessclip"));
        command.arg("view").args(args).args(["--state", "--out"]).arg(out).env("DISPLAY", &display.name);
        // The desktop's own window system must not be taken for the test's.
        command.env_remove("WAYLAND_DISPLAY").env_remove("WINIT_X11_SCALE_FACTOR").stdin(Stdio::null());
        command
    }

    fn xdotool(&self, args: &[&str]) -> String {
        let done = Command::new("xdotool").args(args).env("DISPLAY", &self.display).output();
        let done = done.expect("xdotool runs: apt-get install xdotool");
        assert!(done.status.success(), "xdotool {args:?}: {}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8_lossy(&done.stdout).into_owned()
    }

    /// The next event of this name.
    pub fn wait(&mut self, name: &str) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(event) => {
                    self.told.push(event.clone());
                    if event["event"] == name {
                        return event;
                    }
                }
                Err(_) => panic!(
                    "no '{name}' came; told: {:#?}",
                    self.told.iter().rev().take(12).collect::<Vec<_>>()
                ),
            }
        }
    }

    /// Forgets events that were not waited for.
    pub fn drain(&mut self) -> Vec<Value> {
        let new: Vec<Value> = self.events.try_iter().collect();
        self.told.extend(new.iter().cloned());
        new
    }

    /// Waits until nothing is drawn any more.
    pub fn rest(&mut self) -> Value {
        self.wait("idle")
    }

    pub fn key(&mut self, key: &str) {
        self.drain();
        self.xdotool(&["key", key]);
    }

    /// Holds a key down for a while.
    pub fn hold(&mut self, key: &str, time: Duration) {
        self.drain();
        self.xdotool(&["keydown", key]);
        std::thread::sleep(time);
        self.xdotool(&["keyup", key]);
    }

    /// Presses a key and gives the event that follows.
    pub fn ask(&mut self, key: &str, event: &str) -> Value {
        self.key(key);
        self.wait(event)
    }

    pub fn type_text(&mut self, text: &str) {
        self.xdotool(&["type", "--delay", "30", text]);
    }

    pub fn move_mouse(&mut self, x: u32, y: u32) {
        let window = self.window.clone();
        self.xdotool(&["mousemove", "--sync", "--window", &window, &x.to_string(), &y.to_string()]);
    }

    pub fn nudge_mouse(&mut self, dx: i32, dy: i32) {
        self.xdotool(&["mousemove_relative", "--", &dx.to_string(), &dy.to_string()]);
    }

    pub fn mouse(&mut self, what: &str, button: u32) {
        self.xdotool(&[what, &button.to_string()]);
    }

    pub fn resize(&mut self, width: u32, height: u32) -> Value {
        self.drain();
        let window = self.window.clone();
        self.xdotool(&["windowsize", &window, &width.to_string(), &height.to_string()]);
        self.wait("resized")
    }

    pub fn unmap(&mut self) {
        let window = self.window.clone();
        self.xdotool(&["windowunmap", "--sync", &window]);
    }

    pub fn map(&mut self) {
        let window = self.window.clone();
        self.xdotool(&["windowmap", "--sync", &window]);
        self.xdotool(&["windowfocus", "--sync", &window]);
    }

    /// Its number for the X server, and the server's name.
    pub fn handle(&self) -> (u32, &str) {
        (self.window.parse().expect("a number"), &self.display)
    }

    /// A picture without panels, or with them: its path.
    pub fn shoot(&mut self, with_panels: bool) -> PathBuf {
        let event = self.ask(if with_panels { "shift+F12" } else { "F12" }, "screenshot");
        let path = PathBuf::from(event["path"].as_str().expect("a path"));
        assert!(path.starts_with(&self.out), "{}", path.display());
        self.rest();
        path
    }

    /// Ends it as a user does; the exit code.
    pub fn quit(mut self) -> ExitStatus {
        self.key("F10");
        self.wait("quit");
        self.program.wait().expect("ended")
    }

    /// Stops listening, then ends it; the exit code.
    pub fn go_deaf_and_quit(mut self) -> ExitStatus {
        // The thread that reads ends with the next line, and with it the pipe.
        let (_, nothing) = channel();
        self.events = nothing;
        self.xdotool(&["key", "F2"]);
        std::thread::sleep(Duration::from_millis(500));
        self.xdotool(&["key", "F2"]);
        std::thread::sleep(Duration::from_millis(500));
        self.xdotool(&["key", "F10"]);
        self.program.wait().expect("ended")
    }

    pub fn ended(mut self) -> ExitStatus {
        self.program.wait().expect("ended")
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// A terrain that opens at once, and a place on it.
pub const TERRAIN: &str = "procedural:mountains?size=513";
pub const CAMERA: &str = "--camera=7000,2500,2600,10,-14";
pub const SMALL: &str = "--size=640x360";
pub const SOME: Duration = Duration::from_millis(400);

pub fn open(display: &Display, out: &tempfile::TempDir, more: &[&str]) -> Viewer {
    let args = [&[TERRAIN, CAMERA, "--n=127"], more].concat();
    Viewer::open(display, out.path(), &args)
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

pub fn numbers(event: &Value, key: &str) -> Vec<f64> {
    event[key].as_array().expect("numbers").iter().map(|v| v.as_f64().expect("a number")).collect()
}

/// Runs a line of the shell with our own program, its picture going to `to`.
pub fn run_line(line: &str, to: &Path) {
    let own = line.replacen("tessclip ", &format!("{} ", env!("CARGO_BIN_EXE_tessclip")), 1);
    let own = own.replace("-o view.png", &format!("-o {}", to.display()));
    let done = Command::new("sh").args(["-c", &own]).output().expect("a shell");
    assert!(done.status.success(), "{own}: {}", String::from_utf8_lossy(&done.stderr));
}
