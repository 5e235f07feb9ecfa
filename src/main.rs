//! The command line of tessclip.

mod cli;
#[cfg(feature = "viewer")]
mod viewer;

fn main() -> std::process::ExitCode {
    #[cfg(target_os = "linux")]
    quiet_driver();
    cli::run()
}

/// On a machine without a desktop, Mesa's device-selection layer prints "error: XDG_RUNTIME_DIR is invalid"
/// twice, which reads as if our command had failed. The layer can only be told to stay out by the
/// environment, before any thread runs: the program starts itself again with that variable set.
#[cfg(target_os = "linux")]
fn quiet_driver() {
    use std::os::unix::process::CommandExt as _;
    let set = |name: &str| std::env::var_os(name).is_some();
    if ["XDG_RUNTIME_DIR", "NODEVICE_SELECT", "MESA_VK_DEVICE_SELECT"].into_iter().any(set) {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        // Comes back only when it fails, and then the two lines do no harm.
        let _ = std::process::Command::new(program)
            .args(std::env::args_os().skip(1))
            .env("NODEVICE_SELECT", "1")
            .exec();
    }
}
