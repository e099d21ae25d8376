//! What a module for Python needs from the linker.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
