//! Ctrl-C: the first ends what is under way in good order, the second stops at once.

use crate::failure::code;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static SAID: OnceLock<&'static str> = OnceLock::new();

/// Installs the handler and returns the flag that the first Ctrl-C sets, which says what happens now.
pub fn stop_flag(says: &'static str) -> &'static AtomicBool {
    let _ = SAID.set(says);
    // In a process that has a handler already (an embedding interpreter) the flag simply stays unset.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(code::INTERRUPTED));
        }
        eprintln!("\n{}; press Ctrl-C again to stop at once", SAID.get().copied().unwrap_or("stopping"));
    });
    &STOP
}
