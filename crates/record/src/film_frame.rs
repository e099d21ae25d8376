//! A frame of a film as messages, and where they go.

use gripgen_twin::{Jaw, PerJaw};

/// Topic of the images of a jaw's film.
pub(crate) fn film_topic(jaw: Jaw) -> &'static str {
    match jaw {
        Jaw::Left => "/tactile/left/film",
        Jaw::Right => "/tactile/right/film",
    }
}

/// Topic of what is known beside them.
pub(crate) fn label_topic(jaw: Jaw) -> &'static str {
    match jaw {
        Jaw::Left => "/tactile/left/film_labels",
        Jaw::Right => "/tactile/right/film_labels",
    }
}

/// A frame of both jaws as the messages of a shard.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedFrame {
    /// Time in the file.
    pub time_ns: u64,
    /// Images.
    pub image: PerJaw<Vec<u8>>,
    /// What is known beside them.
    pub labels: PerJaw<Vec<u8>>,
}

impl EncodedFrame {
    /// Size of its messages.
    pub fn bytes(&self) -> usize {
        self.image.iter().chain(self.labels.iter()).map(|(_, message)| message.len()).sum()
    }
}
