//! What the window does, one JSON line an event, for scripts that drive it (`--state`).

use std::cell::Cell;
use std::io::Write as _;

use serde_json::{Map, Value, json};

/// Prints events; nothing unless asked to.
#[derive(Debug)]
pub struct Status {
    on: Cell<bool>,
}

/// A line to standard output. Unlike the commands that print and end, a window outlives whoever listens.
pub fn print(line: &str) -> std::io::Result<()> {
    writeln!(std::io::stdout(), "{line}")
}

impl Status {
    pub fn new(on: bool) -> Self {
        Self { on: Cell::new(on) }
    }

    pub fn is_on(&self) -> bool {
        self.on.get()
    }

    /// One line: the event and what belongs to it.
    pub fn tell(&self, event: &str, more: Value) {
        if !self.on.get() {
            return;
        }
        let mut line = Map::new();
        line.insert("event".into(), json!(event));
        if let Value::Object(more) = more {
            line.extend(more);
        }
        // A script that stopped listening does not stop the window.
        if print(&Value::Object(line).to_string()).is_err() {
            self.on.set(false);
        }
    }
}
