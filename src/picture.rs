//! Goes to the studies with `paper.rs`.

mod paper;

pub(crate) use paper::paper_picture;
