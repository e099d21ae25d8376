//! Ctrl-C: the first finishes what is under way, the second stops at once.

use crate::failure::code;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Installs the handler and returns the flag that the first Ctrl-C sets.
pub fn stop_flag() -> &'static AtomicBool {
    // In a process that has a handler already (an embedding interpreter) the flag simply stays unset.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(code::INTERRUPTED));
        }
        eprintln!("\nfinishing the shards under way; press Ctrl-C again to stop at once");
    });
    &STOP
}
