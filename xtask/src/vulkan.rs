//! Software Vulkan for the GPU tests.

use crate::{apt_install, can_install};
use std::path::Path;

/// Looks for a Vulkan driver and installs Mesa's software one where that is possible. The error says why there is none.
pub fn set_up() -> Result<(), String> {
    if driver_found() {
        return Ok(());
    }
    if !can_install() {
        return Err("none is installed, and this is not root with apt-get".into());
    }
    apt_install("mesa-vulkan-drivers", "no Vulkan driver was found, GPU tests need one")?;
    if driver_found() { Ok(()) } else { Err("mesa-vulkan-drivers brought none".into()) }
}

/// Whether a driver manifest lies where the Vulkan loader looks.
fn driver_found() -> bool {
    let named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].iter().any(|name| std::env::var_os(name).is_some());
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"];
    named
        || folders.iter().any(|folder| {
            std::fs::read_dir(Path::new(folder)).is_ok_and(|mut entries| {
                entries.any(|e| e.is_ok_and(|e| e.path().extension().is_some_and(|x| x == "json")))
            })
        })
}
