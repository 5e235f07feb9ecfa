//! Streaming: tiles of a store on their way to the windows, loaded by threads of their own.
//!
//! ```text
//! prepare(camera)  -> wishes: the tiles each window needs, then those ahead      render thread, no waiting
//! TileCache        -> slots with generations, bytes bounded exactly, LRU         one short lock, no I/O under it
//! loaders          -> read, verify, decode; a damaged tile becomes its parent    own threads
//! TileSource       -> what is there; where nothing is, the nearest coarser level render thread, no waiting
//! ```
//!
//! A level is drawn only when every sample of its window is there; until then the next coarser one fills in,
//! as Losasso and Hoppe (2004) crop their active regions, so the mesh conforms at every moment. The coarsest
//! level is always drawn: what it lacks is interpolated from the top of the pyramid, which never leaves memory.
//! Fruehstueck (2008, section 5) measured 222 frames a second falling to 20 when loading ran in the render
//! thread: nothing here waits for a disk, a decoder, or a lock held by one.

mod account;
mod cache;
mod fallback;
mod loader;
mod source;
mod wishes;

pub use crate::pyramid::{LevelWish, StreamCounters, Streaming};
pub use loader::StreamOptions;
pub use source::TileSource;
