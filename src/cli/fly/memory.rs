//! Resident memory of this process, where Linux tells it.

/// Bytes now.
pub(super) fn resident_bytes() -> Option<u64> {
    status_bytes("VmRSS:")
}

/// Most bytes so far.
pub(super) fn peak_resident_bytes() -> Option<u64> {
    status_bytes("VmHWM:")
}

/// A line of `/proc/self/status`, which counts in KiB; `statm` counts in pages, whose size it keeps to
/// itself.
fn status_bytes(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with(name))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn memory_is_told() {
        let (now, most) = (super::resident_bytes(), super::peak_resident_bytes());
        assert!(now.is_some_and(|b| b > 1 << 20) && most >= now.map(|b| b / 2));
    }
}
