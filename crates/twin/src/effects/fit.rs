//! How an effect is fitted: to pulls, to a table of a force sensor beside a reference, to presses.
//!
//! Data of the specs. What a fit does with them stands in `identify`.

/// Name of the time derivative of the reference force, a covariate of sensor tables.
pub const FORCE_RATE: &str = "force_rate_n_per_s";

/// Name of the reference force, a covariate of sensor tables.
pub const REFERENCE_FORCE: &str = "reference_force_n";

/// A parameter by its name, with a value or a scale.
pub type Named = (&'static str, f64);

/// What the fits need to know of a campaign of pulls.
pub struct PullSpan<'a> {
    /// Whether a column was recorded and has more than one value.
    pub varies: &'a dyn Fn(&str) -> bool,
    /// Largest reading of the wrist sensor.
    pub largest_reading_n: f64,
    /// Index of the last pull, at least 4.
    pub last_pull_index: f64,
    /// Pull indices at which something may have happened.
    pub splits: Vec<f64>,
    /// Whether pulls since the last rest were counted.
    pub rests: bool,
    /// Speed per newton at which tools creep below their limits, where displacements show that they do.
    pub creep_mm_per_n_s: Option<f64>,
}

/// Where a fit starts, and what is free in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Each start by its values; parameters that are left out are neutral. The best of the fits counts.
    pub starts: Vec<Vec<Named>>,
    /// Parameters that are fitted with the scale of a step. The first one says how large the effect is.
    pub free: Vec<Named>,
    /// Number of parameters that are tried at the starts only, which the data pay for too.
    pub searched: usize,
}

impl Fit {
    /// A fit from some starts.
    pub fn new(starts: &[&[Named]], free: &[Named]) -> Self {
        Self { starts: starts.iter().map(|s| s.to_vec()).collect(), free: free.to_vec(), searched: 0 }
    }

    /// A fit from some values of one parameter, each with the same value of another one.
    pub fn over(name: &'static str, values: &[f64], other: Named, free: &[Named]) -> Self {
        let starts = values.iter().map(|value| vec![(name, *value), other]).collect();
        Self { starts, free: free.to_vec(), searched: 0 }
    }

    /// The same with a number of parameters that are tried at the starts only.
    pub fn searching(self, searched: usize) -> Self {
        Self { searched, ..self }
    }
}

/// Smallest and largest value.
pub type Bounds = (f64, f64);

/// Values of one parameter on a grid, by its name.
pub type Grid = (&'static str, Vec<f64>);

/// What has to show an effect before it competes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// Labels may.
    InLabels,
    /// Displacements have to: labels alone say nothing that a law of friction would not say too.
    InDisplacements,
}

/// How an effect is fitted to pulls.
#[derive(Clone, Copy)]
pub struct PullFit {
    /// Columns that have to vary besides the covariates of the effect.
    pub spans: &'static [&'static str],
    /// What has to show it.
    pub seen: Seen,
    /// The fit in a campaign.
    pub fit: fn(&PullSpan<'_>) -> Fit,
    /// Bounds of a parameter in a fit, from its name, the values of a start and the bounds of the library.
    pub bounds: fn(&str, &[f64], Bounds) -> Bounds,
    /// The derivative by its size vanishes at the neutral value, so that no slope promises anything.
    pub flat_at_neutral: bool,
}

impl PullFit {
    /// No fit: what the specs fill in.
    pub(super) const PLAIN: PullFit = PullFit {
        spans: &[],
        seen: Seen::InLabels,
        fit: |_| Fit { starts: Vec::new(), free: Vec::new(), searched: 0 },
        bounds: |_, _, library| library,
        flat_at_neutral: false,
    };

    /// This fit, of an effect of which all else is plain.
    pub(super) const fn of(fit: fn(&PullSpan<'_>) -> Fit) -> Self {
        Self { fit, ..Self::PLAIN }
    }
}

/// What the fits need to know of a table of a force sensor beside a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableSpan {
    /// Smallest reference force.
    pub lowest_n: f64,
    /// Largest reference force.
    pub highest_n: f64,
    /// Median time between two rows.
    pub step_s: f64,
    /// Duration of the longest session.
    pub longest_s: f64,
    /// Time from the first row to the last.
    pub whole_s: f64,
}

impl TableSpan {
    /// Largest absolute value of the reference force.
    pub fn largest_n(&self) -> f64 {
        self.highest_n.abs().max(self.lowest_n.abs())
    }

    /// Time from the first row to the last, in hours.
    pub fn hours(&self) -> f64 {
        self.whole_s / 3600.0
    }
}

/// How an effect is fitted to a table of a force sensor. An effect with a grid in its first parameter has no other size.
#[derive(Clone, Copy)]
pub struct TableFit {
    /// Covariates through which it acts.
    pub acts_through: &'static [&'static str],
    /// The parameter that is tried on a grid, and its values.
    pub grid: Option<fn(&TableSpan) -> Grid>,
    /// Bounds of its parameters from those of the library, which are for campaigns of hours: in a table of seconds a
    /// change by the whole range is no more than that, whatever it would be in an hour.
    pub bounds: fn(&TableSpan, Bounds) -> Bounds,
}

impl TableFit {
    /// No covariate and no grid: what the specs fill in.
    pub(super) const PLAIN: TableFit =
        TableFit { acts_through: &[], grid: None, bounds: |_, library| library };
}

/// How an effect is fitted to presses.
#[derive(Clone, Copy)]
pub struct PressFit {
    /// The parameter that says how large it is.
    pub main: &'static str,
    /// Start and scale of a parameter, from its name and the side of a pixel in millimetres. Where the derivative
    /// vanishes at the neutral value (the width of a blur, the strength of a shadow) the fit starts beside it.
    pub start: fn(&str, f64) -> (f64, f64),
    /// The parameter whose value is found by trying, not by slopes.
    pub tried: Option<&'static str>,
    /// Numbers of leading parameters that are fitted one after the other, as long as more of them predict presses better that
    /// were held out; empty where all are fitted at once.
    pub orders: &'static [usize],
    /// It changes the picture of the contact, which has to be drawn anew, and not only light and camera.
    pub drawn: bool,
    /// What presses have to be known of, for it to show.
    pub needs: PressNeeds,
    /// How many of its last parameters say how much it differs from press to press by chance. Each press says its own share
    /// away from the contact, so these are not fitted: 3, of the gains of red, green and blue, or 0.
    pub scatters: usize,
}

impl PressFit {
    /// An effect that is drawn: what the specs fill in.
    pub(super) const DRAWN: PressFit = PressFit {
        main: "",
        start: |_, _| (0.0, 1.0),
        tried: None,
        orders: &[],
        drawn: true,
        needs: PressNeeds::Nothing,
        scatters: 0,
    };
}

/// What the fits need to know of a set of imprints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspSpan {
    /// Median force of the rows in contact.
    pub middle_n: f64,
    /// Median time between two rows of a grasp; infinite where no times are known.
    pub step_s: f64,
    /// Duration of the longest grasp; 0 where no times are known.
    pub longest_s: f64,
}

/// How an effect is fitted to imprints of grasps beside a load cell: `V = c F` with c free for each grasp, the effects of the
/// library in its order.
#[derive(Clone, Copy)]
pub struct ImprintFit {
    /// It needs the times of the rows.
    pub timed: bool,
    /// Where it starts and what is free; the first free one says how large it is.
    pub fit: fn(&GraspSpan) -> Fit,
    /// Parameters that have the value of the first free one: what a volume does not tell apart.
    pub alike: &'static [&'static str],
    /// Values of references.
    pub fixed: fn(&GraspSpan) -> Vec<Named>,
    /// Bounds of a parameter in a fit, from those of the library.
    pub bounds: fn(&GraspSpan, Bounds) -> Bounds,
    /// Factor on the volume at so many seconds after the start of the grasp, of effects that have no hook for a volume.
    pub factor: Option<fn(&[f64], f64) -> f64>,
}

impl ImprintFit {
    /// No fit: what the specs fill in.
    pub(super) const PLAIN: ImprintFit = ImprintFit {
        timed: false,
        fit: |_| Fit { starts: Vec::new(), free: Vec::new(), searched: 0 },
        alike: &[],
        fixed: |_| Vec::new(),
        bounds: |_, library| library,
        factor: None,
    };
}

/// What has to be known of presses for an effect to show in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressNeeds {
    /// Nothing beside the images.
    Nothing,
    /// Contacts that were marked by hand: a place that is found moves with the effect.
    Marks,
    /// How far something travelled into the gel: a depth that follows from the rim moves with the effect.
    Depths,
    /// Bodies with edges: balls have none.
    Edges,
}

/// `count` values from `low` to `high` in equal ratios.
pub(super) fn log_spaced(low: f64, high: f64, count: usize) -> Vec<f64> {
    let ratio = libm::log(high / low) / (count - 1) as f64;
    (0..count).map(|k| low * libm::exp(ratio * k as f64)).collect()
}

/// Bounds that reach to `to` on both sides of 0 at least.
pub(super) fn wider((low, high): (f64, f64), to: f64) -> (f64, f64) {
    (low.min(-to), high.max(to))
}
