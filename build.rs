//! Tells the tests whether the folder of shared measured data lies beside the checkout, and whether `cargo xtask test`
//! found a Vulkan driver. The product needs neither.

use std::path::Path;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(shared_data)");
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/real");
    if shared.is_dir() {
        println!("cargo::rustc-cfg=shared_data");
    }
    println!("cargo::rustc-check-cfg=cfg(vulkan)");
    if std::env::var_os("GRIPGEN_VULKAN").is_some() {
        println!("cargo::rustc-cfg=vulkan");
    }
    println!("cargo::rerun-if-env-changed=GRIPGEN_VULKAN");
    println!("cargo::rerun-if-changed=build.rs");
}
