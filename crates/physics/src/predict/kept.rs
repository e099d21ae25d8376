//! Memory of pulls that is used again.

use crate::StuckPull;
use std::cell::RefCell;

thread_local! {
    static SPARE: RefCell<Vec<StuckPull>> = const { RefCell::new(Vec::new()) };
}

/// A pull whose memory is used again: fits make thousands per second, and the system would clear every page of each.
pub(super) struct Kept(pub StuckPull);

impl Kept {
    pub fn spare() -> Self {
        Self(SPARE.with_borrow_mut(Vec::pop).unwrap_or_default())
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        let pull = std::mem::take(&mut self.0);
        // Threads that end have nowhere to keep it.
        let _ = SPARE.try_with(|spare| {
            let mut spare = spare.borrow_mut();
            if spare.len() < 64 {
                spare.push(pull);
            }
        });
    }
}

impl std::ops::Deref for Kept {
    type Target = StuckPull;

    fn deref(&self) -> &StuckPull {
        &self.0
    }
}
