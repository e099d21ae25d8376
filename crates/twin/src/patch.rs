//! What a grip looks like once the jaws have settled, and its contacts as a few pressure cells.

/// One cell of a contact patch, in the `gel` frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureCell {
    /// Where the cell's force acts.
    pub x_m: f64,
    /// Where the cell's force acts.
    pub y_m: f64,
    /// Area in contact.
    pub area_m2: f64,
    /// Normal force on it.
    pub force_n: f64,
}

impl PressureCell {
    /// Mean pressure.
    pub fn pressure_pa(&self) -> f64 {
        self.force_n / self.area_m2
    }
}

/// The pressure field of one jaw as at most [`ContactPatch::MAX_CELLS`] cells.
///
/// The sum of the cells' forces is the jaw's normal force; force, first and second moments equal those of the
/// full field. Friction uses this patch and the image uses the field it was made from: what the camera sees is
/// what the friction feels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactPatch {
    /// The cells, none without contact.
    pub cells: Vec<PressureCell>,
    /// Slopes of the contact, where they were asked for; those of a flat face otherwise.
    pub slopes: ContactSlopes,
}

/// How the slopes of a contact add to its friction (interlock): moments of them, weighted with pressure.
///
/// A point with slope q along the pull and s across, under a pressure p along the jaw axis, resists with
/// `p (q + mu w) / (1 - mu q / w)`, w = sqrt(1 + s^2): statics of Coulomb friction on an inclined face. Less the push `p q` that it has without
/// friction and that the other flank takes back, this is `mu p w (1 + a^2) / (1 - mu a)` with a = q / w. The moments are the means
/// over the contact of `w (1 + a^2) - 1` and of `w (1 + a^2) a^k`, k = 1, 2, 3: the series of `1 / (1 - mu a)` to third order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactSlopes {
    /// The moments; zeros of a flat face.
    pub moments: [f64; 4],
}

impl ContactSlopes {
    /// The coefficient of a face with these slopes whose points have `mu`. `share` of what they add counts: 0 gives `mu` bit for bit.
    pub fn coefficient(&self, mu: f64, share: f64) -> f64 {
        let [even, first, second, third] = self.moments;
        let excess = even + mu * (first + mu * (second + mu * third));
        mu * (1.0 + share * excess)
    }
}

impl ContactPatch {
    /// Most cells of a patch.
    pub const MAX_CELLS: usize = 64;

    /// A contact of which only force and area are known: 8 x 8 cells of one pressure on a square.
    pub fn uniform(force_n: f64, area_m2: f64) -> Self {
        let side_m = area_m2.max(0.0).sqrt();
        let at = |k: usize| ((k as f64 + 0.5) / 8.0 - 0.5) * side_m;
        let cell = |i: usize| PressureCell {
            x_m: at(i % 8),
            y_m: at(i / 8),
            area_m2: area_m2 / 64.0,
            force_n: force_n / 64.0,
        };
        Self { cells: (0..64).map(cell).collect(), slopes: ContactSlopes::default() }
    }

    /// Normal force of the jaw.
    pub fn normal_force_n(&self) -> f64 {
        self.cells.iter().map(|c| c.force_n).sum()
    }

    /// Area in contact.
    pub fn area_m2(&self) -> f64 {
        self.cells.iter().map(|c| c.area_m2).sum()
    }

    /// Centre of pressure (x, y); the origin without contact.
    pub fn centre_m(&self) -> (f64, f64) {
        let f = self.normal_force_n();
        if f == 0.0 {
            return (0.0, 0.0);
        }
        let (sx, sy) = self
            .cells
            .iter()
            .fold((0.0, 0.0), |(sx, sy), c| (sx + c.force_n * c.x_m, sy + c.force_n * c.y_m));
        (sx / f, sy / f)
    }
}
