//! TESSCLIP_NO_GPU=1 marks the tests that need an adapter as ignored, so that their list shows it.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(tessclip_no_gpu)");
    println!("cargo::rerun-if-env-changed=TESSCLIP_NO_GPU");
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("TESSCLIP_NO_GPU").is_ok_and(|v| v == "1") {
        println!("cargo::rustc-cfg=tessclip_no_gpu");
    }
}
