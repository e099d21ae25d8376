//! What a jaw holds: a friction limit on each cell of its contact patch.

/// What a cell of a jaw's contact patch can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionCell {
    /// Largest tangential force before the cell slips.
    pub limit_n: f64,
    /// Its area, which is its share of the gel's shear stiffness.
    pub area_m2: f64,
}

/// What one jaw can hold.
#[derive(Debug, Clone, PartialEq)]
pub struct JawFriction {
    /// The friction law on each cell of the contact patch.
    pub cells: Vec<FrictionCell>,
    /// Kinetic over static friction.
    pub kinetic_ratio: f64,
    /// Time constant with which friction falls to that once the jaws slide; 0: at once.
    pub kinetic_fall_s: f64,
    /// Share of the gel's shear stiffness that cells have by their area; the rest they have by their limit.
    pub shear_by_area: f64,
}

impl JawFriction {
    /// A jaw that slips as a whole.
    pub fn uniform(limit_n: f64, kinetic_ratio: f64) -> Self {
        Self {
            cells: vec![FrictionCell { limit_n, area_m2: 1.0 }],
            kinetic_ratio,
            kinetic_fall_s: 0.0,
            shear_by_area: 1.0,
        }
    }

    /// Share of its limit that a jaw keeps once it has slid for `slid_s`: `r + (1 - r) exp(-t / tau)` with the kinetic
    /// ratio r and the time constant tau.
    pub(crate) fn sliding_share(&self, slid_s: f64) -> f64 {
        if self.kinetic_fall_s == 0.0 {
            return self.kinetic_ratio;
        }
        self.kinetic_ratio + (1.0 - self.kinetic_ratio) * libm::exp(-slid_s / self.kinetic_fall_s)
    }

    /// Share of each cell in the gel's shear stiffness: that of its area, or of its limit, or between. By area is a bed of
    /// springs, whose rim slips first as that of a sphere on a half-space does (Mindlin 1949; a paraboloid of pressure moves by
    /// twice `limit / stiffness` before all of it slips, his sphere by 1.5 times). By limit all cells slip together.
    pub fn stiffness_shares(&self) -> impl Iterator<Item = f64> {
        let (area_m2, limit_n) = (self.cells.iter().map(|c| c.area_m2).sum::<f64>(), self.limit_n());
        let even = 1.0 / self.cells.len() as f64;
        let by_area = self.shear_by_area;
        self.cells.iter().map(move |c| {
            let area = if area_m2 > 0.0 { c.area_m2 / area_m2 } else { even };
            if limit_n > 0.0 { by_area * area + (1.0 - by_area) * c.limit_n / limit_n } else { area }
        })
    }

    /// Largest tangential force before the jaw slips: the sum over its cells.
    pub fn limit_n(&self) -> f64 {
        self.cells.iter().map(|c| c.limit_n).sum()
    }
}
