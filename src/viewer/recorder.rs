//! Records the camera as a path file: `fly` and a replay take it.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};

/// The head of a path file.
const HEAD: [&str; 6] = ["t", "x", "y", "z", "yaw", "pitch"];
/// Seconds to the second line of a recording that has only one: a path needs two.
const SHORTEST_S: f64 = 1e-3;
/// No more than this of a recording is lost when the program is killed.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// A camera at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    /// Seconds from the begin.
    t_s: f64,
    /// In the terrain's own units.
    pose: [f64; 5],
}

/// A recording under way, written as it goes. Headings are recorded as they are: readers interpolate the short way
/// round.
pub struct Recorder {
    path: PathBuf,
    csv: csv::Writer<File>,
    flushed: Instant,
    /// Time of the first camera on the clock of the caller, seconds.
    begin_s: Option<f64>,
    /// The last two lines: the end of a rest is not known before it.
    recent: Vec<Line>,
    /// Lines before those.
    written: usize,
}

impl Recorder {
    /// Begins a recording in a new file of a directory.
    pub fn begin(dir: &Path) -> anyhow::Result<Self> {
        let failed = || format!("{}: no recording can be written there", dir.display());
        let (path, file) = take_name(dir, "tessclip-path", "csv").with_context(failed)?;
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(HEAD)?;
        csv.flush()?;
        Ok(Self { path, csv, flushed: Instant::now(), begin_s: None, recent: Vec::new(), written: 0 })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The camera at `t_s` seconds on any clock; the first one is at 0. A time that does not grow is left out.
    /// Of a camera that stands only the begin and the end of the rest are kept.
    pub fn add(&mut self, t_s: f64, pose: [f64; 5]) -> anyhow::Result<()> {
        if !t_s.is_finite() || pose.iter().any(|v| !v.is_finite()) {
            return Ok(());
        }
        let t_s = t_s - *self.begin_s.get_or_insert(t_s);
        if self.recent.last().is_some_and(|last| t_s <= last.t_s) {
            return Ok(());
        }
        if let [before, last] = &mut self.recent[..]
            && before.pose == pose
            && last.pose == pose
        {
            last.t_s = t_s;
            return Ok(());
        }
        self.recent.push(Line { t_s, pose });
        while self.recent.len() > 2 {
            let line = self.recent.remove(0);
            self.write(line)?;
        }
        Ok(())
    }

    /// Until `t_s` the camera stood where it was last, and nobody asked.
    pub fn stood_until(&mut self, t_s: f64) -> anyhow::Result<()> {
        match self.recent.last() {
            Some(last) => self.add(t_s, last.pose),
            None => Ok(()),
        }
    }

    /// The shortest decimals that read back as the very same numbers.
    fn write(&mut self, line: Line) -> anyhow::Result<()> {
        let Line { t_s, pose: [x, y, z, yaw, pitch] } = line;
        let failed = || format!("{}: cannot be written any further", self.path.display());
        self.csv.write_record([t_s, x, y, z, yaw, pitch].map(|v| v.to_string())).with_context(failed)?;
        self.written += 1;
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flushed = Instant::now();
            self.csv.flush().with_context(failed)?;
        }
        Ok(())
    }

    /// Writes what is left and gives the number of lines, the head left out.
    pub fn finish(mut self) -> anyhow::Result<usize> {
        let Some(last) = self.recent.last().copied() else {
            bail!("{}: nothing was recorded", self.path.display());
        };
        if self.written + self.recent.len() < 2 {
            self.recent.push(Line { t_s: last.t_s + SHORTEST_S, ..last });
        }
        for line in std::mem::take(&mut self.recent) {
            self.write(line)?;
        }
        self.csv.flush().with_context(|| format!("{}: cannot be written to its end", self.path.display()))?;
        Ok(self.written)
    }
}

/// Makes the first of `stem-1.ext`, `stem-2.ext`, ... in `dir` that is not there yet: whatever else runs takes
/// another name.
pub fn take_name(dir: &Path, stem: &str, ext: &str) -> io::Result<(PathBuf, File)> {
    let mut number = 1_u64;
    loop {
        let path = dir.join(format!("{stem}-{number}.{ext}"));
        match File::options().write(true).create_new(true).open(&path) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => number += 1,
            made => return made.map(|file| (path, file)),
        }
    }
}

/// Writes a new file under the first free name; where that fails nothing is left.
pub fn write_new(
    dir: &Path,
    stem: &str,
    ext: &str,
    write: impl FnOnce(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<PathBuf> {
    let failed = || format!("{}: no file can be made there", dir.display());
    let (path, _) = take_name(dir, stem, ext).with_context(failed)?;
    if let Err(error) = write(&path) {
        // It was only made to hold its name.
        let _ = std::fs::remove_file(&path);
        return Err(error);
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: [f64; 5] = [1.0, -2.5, 1e-7, 30.0, -12.0];
    const THERE: [f64; 5] = [0.1 + 0.2, 1e15, 3.0, -179.5, 90.0];

    fn read(path: &Path) -> Vec<Line> {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("t,x,y,z,yaw,pitch"));
        let line = |line: &str| {
            let v: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            Line { t_s: v[0], pose: v[1..].try_into().unwrap() }
        };
        lines.map(line).collect()
    }

    fn recorded(cameras: &[(f64, [f64; 5])]) -> Vec<Line> {
        let dir = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::begin(dir.path()).unwrap();
        cameras.iter().for_each(|(t_s, pose)| recorder.add(*t_s, *pose).unwrap());
        let path = recorder.path().to_path_buf();
        let count = recorder.finish().unwrap();
        let lines = read(&path);
        assert_eq!(lines.len(), count);
        lines
    }

    #[test]
    fn times_begin_at_zero_and_grow() {
        let nan = [f64::NAN, 0.0, 0.0, 0.0, 0.0];
        let cameras = [
            (f64::NAN, HERE),
            (5.0, HERE),
            (5.0, THERE),
            (4.0, THERE),
            (5.5, nan),
            (6.0, THERE),
            (7.5, HERE),
        ];
        let times: Vec<f64> = recorded(&cameras).iter().map(|l| l.t_s).collect();
        assert_eq!(times, [0.0, 1.0, 2.5]);
    }

    #[test]
    fn a_rest_is_kept_by_its_ends() {
        let mut cameras: Vec<(f64, [f64; 5])> = (0..100).map(|k| (f64::from(k), HERE)).collect();
        cameras.push((100.0, THERE));
        cameras.extend((101..200).map(|k| (f64::from(k), HERE)));
        let lines = recorded(&cameras);
        let found: Vec<(f64, bool)> = lines.iter().map(|l| (l.t_s, l.pose == HERE)).collect();
        assert_eq!(found, [(0.0, true), (99.0, true), (100.0, false), (101.0, true), (199.0, true)]);
    }

    #[test]
    fn a_rest_that_nobody_asked_about_is_no_drift() {
        let dir = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::begin(dir.path()).unwrap();
        recorder.stood_until(3.0).unwrap();
        recorder.add(10.0, HERE).unwrap();
        recorder.stood_until(19.0).unwrap();
        recorder.add(19.5, THERE).unwrap();
        let path = recorder.path().to_path_buf();
        recorder.finish().unwrap();
        let found: Vec<(f64, bool)> = read(&path).iter().map(|l| (l.t_s, l.pose == HERE)).collect();
        assert_eq!(found, [(0.0, true), (9.0, true), (9.5, false)]);
    }

    #[test]
    fn numbers_read_back_as_they_were() {
        let lines = recorded(&[(0.0, HERE), (1.0 / 3.0, THERE)]);
        assert_eq!(lines, [Line { t_s: 0.0, pose: HERE }, Line { t_s: 1.0 / 3.0, pose: THERE }]);
    }

    #[test]
    fn one_camera_makes_a_path_and_none_does_not() {
        let lines = recorded(&[(12.0, HERE)]);
        assert_eq!(lines, [Line { t_s: 0.0, pose: HERE }, Line { t_s: SHORTEST_S, pose: HERE }]);
        let dir = tempfile::tempdir().unwrap();
        let error = Recorder::begin(dir.path()).unwrap().finish().unwrap_err();
        assert!(error.to_string().contains("nothing was recorded"));
        let nowhere = Recorder::begin(&dir.path().join("no such")).map(|_| ()).unwrap_err();
        assert!(nowhere.to_string().contains("no recording can be written there"), "{nowhere}");
    }

    #[test]
    fn a_killed_program_loses_little() {
        let dir = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::begin(dir.path()).unwrap();
        for k in 0..50 {
            recorder.flushed = Instant::now().checked_sub(FLUSH_EVERY).unwrap();
            recorder.add(f64::from(k), if k % 2 == 0 { HERE } else { THERE }).unwrap();
        }
        assert_eq!(read(recorder.path()).len(), 48);
    }

    #[test]
    fn names_are_never_taken_twice() {
        let dir = tempfile::tempdir().unwrap();
        let taken = |ext| {
            let (path, _) = take_name(dir.path(), "tessclip-path", ext).unwrap();
            path.file_name().unwrap().to_string_lossy().into_owned()
        };
        assert_eq!(taken("csv"), "tessclip-path-1.csv");
        assert_eq!(taken("csv"), "tessclip-path-2.csv");
        std::fs::remove_file(dir.path().join("tessclip-path-1.csv")).unwrap();
        assert_eq!(taken("csv"), "tessclip-path-1.csv");
        // Directories take names too.
        std::fs::create_dir(dir.path().join("tessclip-path-1.png")).unwrap();
        assert_eq!(taken("png"), "tessclip-path-2.png");
        let failed = write_new(dir.path(), "a", "txt", |_| bail!("full"));
        assert!(failed.is_err() && !dir.path().join("a-1.txt").exists());
    }
}
