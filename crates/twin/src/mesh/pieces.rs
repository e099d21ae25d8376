//! A mesh in small pieces, each of which has one box.

use super::TriMesh;

impl TriMesh {
    /// Numbers of the triangles in pieces of at most `most` that lie together: the mesh is halved along its longest side, by the
    /// middles of the triangles, until the pieces are small. Each piece is sorted.
    pub fn pieces(&self, most: usize) -> Vec<Vec<u32>> {
        let middles: Vec<[f64; 3]> = (0..self.triangles().len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                [0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0)
            })
            .collect();
        let mut order: Vec<u32> = (0..middles.len() as u32).collect();
        let (mut found, mut open) = (Vec::new(), vec![&mut order[..]]);
        while let Some(piece) = open.pop() {
            if piece.len() <= most.max(1) {
                piece.sort_unstable();
                found.push(piece.to_vec());
                continue;
            }
            let axis = longest_side(&middles, piece);
            let place = |t: &u32| middles[*t as usize][axis];
            let half = piece.len() / 2;
            piece.select_nth_unstable_by(half, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
            let (low, high) = piece.split_at_mut(half);
            open.push(high);
            open.push(low);
        }
        found
    }
}

fn longest_side(middles: &[[f64; 3]], piece: &[u32]) -> usize {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &t in piece {
        for i in 0..3 {
            low[i] = low[i].min(middles[t as usize][i]);
            high[i] = high[i].max(middles[t as usize][i]);
        }
    }
    (0..3).fold(0, |a, b| if high[b] - low[b] > high[a] - low[a] { b } else { a })
}

#[cfg(test)]
mod tests {
    use crate::parts::SteppedShaft;

    /// Every triangle is in one piece, pieces are small, and none reaches through the whole part.
    #[test]
    fn pieces_are_small_and_hold_every_triangle_once() {
        let mesh = SteppedShaft::default().mesh();
        let pieces = mesh.pieces(16);
        assert!(pieces.iter().all(|p| !p.is_empty() && p.len() <= 16 && p.is_sorted()));
        let mut all = pieces.concat();
        all.sort_unstable();
        assert!(all.iter().enumerate().all(|(i, t)| i as u32 == *t) && all.len() == mesh.triangles().len());
        assert!(pieces.len() < 3 * mesh.triangles().len() / 16 + 2, "{} pieces", pieces.len());
    }
}
