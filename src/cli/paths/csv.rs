//! Paths from CSV files.

use anyhow::{Context as _, anyhow, bail};
use tessclip::{Camera, Terrain};

use super::Key;
use super::named::NAMES;

pub(super) fn read_csv(file: &str, terrain: &Terrain) -> anyhow::Result<Vec<Key>> {
    let mut builder = ::csv::ReaderBuilder::new();
    builder.trim(::csv::Trim::All).comment(Some(b'#'));
    let mut reader = builder.from_path(file).with_context(|| {
        format!("{file}: neither a path file that can be read nor one of {}", NAMES.join(", "))
    })?;
    let mut keys: Vec<Key> = Vec::new();
    let headers = reader.headers().with_context(|| format!("{file}: line 1"))?.clone();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, ::csv::Position::line);
            anyhow!("{file}: line {line}: not as many fields as the header: a path has six numbers a line")
        })?;
        let line = record.position().map_or(0, ::csv::Position::line);
        let Ok(mut key) = record.deserialize::<Key>(Some(&headers)) else {
            bail!("{file}: line {line}: expected six numbers under the header t,x,y,z,yaw,pitch");
        };
        let numbers = [key.t, key.x, key.y, key.z, key.yaw, key.pitch];
        if numbers.iter().any(|v| v.is_nan() || v.abs() > Camera::FARTHEST_M) {
            bail!("{file}: line {line}: every number must be finite and at most 1e15");
        }
        if keys.last().is_some_and(|last| key.t <= last.t) {
            bail!("{file}: line {line}: t must grow from line to line");
        }
        if let Some(wrong) = terrain.curved.as_ref().and_then(|c| c.bad_place([key.x, key.y])) {
            bail!("{file}: line {line}: {wrong}");
        }
        if terrain.curved.is_none() {
            [key.x, key.y] = terrain.world_from_native([key.x, key.y]);
        }
        keys.push(key);
    }
    if keys.len() < 2 {
        bail!("{file}: a path needs at least two lines after its header");
    }
    Ok(keys)
}
