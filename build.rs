//! Tells the tests whether the folder of shared measured data lies beside the checkout. The product never needs it.

use std::path::Path;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(shared_data)");
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/real");
    if shared.is_dir() {
        println!("cargo::rustc-cfg=shared_data");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
