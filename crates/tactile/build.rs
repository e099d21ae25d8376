//! Tells the tests whether `cargo xtask test` found a Vulkan driver; without its word, tests that need one read ignored.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(vulkan)");
    if std::env::var_os("GRIPGEN_VULKAN").is_some() {
        println!("cargo::rustc-cfg=vulkan");
    }
    println!("cargo::rerun-if-env-changed=GRIPGEN_VULKAN");
    println!("cargo::rerun-if-changed=build.rs");
}
