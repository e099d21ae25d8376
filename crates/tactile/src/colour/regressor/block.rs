//! Pixels that are drawn together.

/// Pixels or cells that are computed together: the widest vector.
pub(super) const BLOCK: usize = 16;

pub(super) const CHANNELS: usize = 3;

/// Coefficients by monomial, then feature and channel, out of channel, feature, monomial.
#[inline(always)]
pub(super) fn by_monomial<const FIELD: usize>(coefficients: &[f32], features: usize) -> Vec<f32> {
    let mut out = vec![0.0; coefficients.len()];
    for (i, of_feature) in coefficients.as_chunks::<FIELD>().0.iter().enumerate() {
        let to = CHANNELS * (i % features) + i / features;
        for (monomial, c) in of_feature.iter().enumerate() {
            out[monomial * CHANNELS * features + to] = *c;
        }
    }
    out
}

#[inline(always)]
pub(super) fn block_of(row: &[f32], start: usize) -> &[f32; BLOCK] {
    row[start..].first_chunk().expect("rows are padded to whole blocks")
}
