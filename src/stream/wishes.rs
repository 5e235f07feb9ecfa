//! Which tiles a camera asks for, in the order in which they should come.

use std::collections::HashSet;

use crate::clipmap::Rect;
use crate::pyramid::LevelWish;
use crate::pyramid::store::{Store, TileKey};

/// Steps of half a window that are looked ahead, at most.
const MOST_STEPS: u32 = 256;

/// A tile to load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wish {
    pub key: TileKey,
    /// Needed for this very frame.
    pub now: bool,
}

/// Tiles of all wishes: those needed now, coarse before fine and near before far; then levels that are near
/// and tiles along the velocity, in the same order. At most `most` tiles, so that what is wanted fits the
/// cache and does not drive itself out.
pub(crate) fn ordered(store: &Store, levels: &[LevelWish], most: usize) -> Vec<Wish> {
    let mut out: Vec<Wish> = Vec::new();
    let mut known: HashSet<TileKey> = HashSet::new();
    let mut by_level: Vec<&LevelWish> =
        levels.iter().filter(|w| w.level < store.top() && !w.needed.is_empty()).collect();
    by_level.sort_by_key(|w| std::cmp::Reverse(w.level));
    let mut add = |wish: &LevelWish, rect: Rect, now: bool| {
        let mut tiles = tiles_of(store, wish, rect);
        tiles.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        out.extend(tiles.into_iter().filter(|t| known.insert(t.0)).map(|(key, _)| Wish { key, now }));
        out.len() < most
    };
    let room = by_level.iter().filter(|w| w.now).all(|wish| add(wish, wish.needed, true))
        && by_level.iter().filter(|w| !w.now).all(|wish| add(wish, wish.needed, false));
    if room {
        look_ahead(store, &by_level, add);
    }
    out.truncate(most);
    out
}

/// The windows moved on along the velocity, half a window at a time.
fn look_ahead(store: &Store, levels: &[&LevelWish], mut add: impl FnMut(&LevelWish, Rect, bool) -> bool) {
    for wish in levels {
        let side = f64::from(wish.needed.hi[0] - wish.needed.lo[0] + 1);
        let far = wish.ahead[0].hypot(wish.ahead[1]);
        if !(far.is_finite() && far >= 1.0) {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 256")]
        let steps = (far / (0.5 * side)).ceil().min(f64::from(MOST_STEPS)) as u32;
        let last = store.levels()[wish.level as usize].size.map(|s| i32::try_from(s - 1).unwrap_or(i32::MAX));
        for k in 1..=steps {
            let share = f64::from(k) / f64::from(steps);
            #[expect(clippy::cast_possible_truncation, reason = "saturates, and is cut to the level")]
            let by = wish.ahead.map(|v| (v * share).round() as i32);
            let moved = |p: [i32; 2]| [0, 1].map(|a| p[a].saturating_add(by[a]));
            let rect = Rect { lo: moved(wish.needed.lo), hi: moved(wish.needed.hi) };
            let rect = rect.intersect(Rect { lo: [0, 0], hi: last });
            if rect.is_empty() {
                break;
            }
            if !add(wish, rect, false) {
                return;
            }
        }
    }
}

/// Tiles of a rectangle of a level with their distance from the middle of its window, in nodes.
fn tiles_of(store: &Store, wish: &LevelWish, rect: Rect) -> Vec<(TileKey, f64)> {
    let level = store.levels()[wish.level as usize];
    let centre = [0, 1].map(|a| f64::midpoint(wish.needed.lo[a].into(), wish.needed.hi[a].into()));
    let (columns, rows) = level.tiles_of(rect);
    let mut out = Vec::new();
    for row in rows[0]..=rows[1] {
        for column in columns[0]..=columns[1] {
            let own = level.rect_of(column, row);
            let away =
                |a: usize| (f64::from(own.lo[a]) - centre[a]).max(centre[a] - f64::from(own.hi[a])).max(0.0);
            out.push((TileKey { level: wish.level, column, row }, away(0).hypot(away(1))));
        }
    }
    out
}
