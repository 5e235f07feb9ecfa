//! The command line of tessclip.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
