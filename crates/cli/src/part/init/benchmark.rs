//! A sweep over the parts of the benchmark, with grips that were tried.

use super::propose::Search;
use super::trial::{ANGLES_DEG, LOWEST_N};
use super::{IMPRINT_MM3_PER_N, InitError, MU, Proposal, StarterFile, Varied, baseline, text};
use gripgen::Library;
use gripgen::Location;
use gripgen::assets::{self, ASSET_PREFIX, BENCHMARK};
use gripgen::in_parallel;
use gripgen_twin::parts::benchmark::{BenchmarkPart, FAMILIES, all};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Part, Twin};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Grips of each part: a sweep draws them by number, so all parts have as many.
const GRIPS: usize = 2;

/// Relative standard deviation of the friction coefficient from part to part: ln mu is normal about that of [`MU`]. Of an
/// assumption, and drawn apart from every shape: an image does not tell it.
const MU_SPREAD: f64 = 0.2;

/// The same from grip to grip: repetitions of such pulls scatter by 3 to 7 %.
const SCATTER: f64 = 0.05;

/// Seed of the friction coefficients.
const SEED: u64 = 201;

/// A sweep over the benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchmarkStarter {
    /// `sweep.toml` and `twin.toml`.
    pub files: Vec<StarterFile>,
    /// Parts in it.
    pub parts: usize,
    /// Parts that were left out, and why.
    pub left_out: Vec<(String, String)>,
    /// What there is to say, for people.
    pub summary: String,
}

/// What every grip of the benchmark stands.
fn varied() -> Varied {
    Varied { grip_force_n: (LOWEST_N, 30.0), grip_offset_sd_mm: 0.5, grip_angle_deg: ANGLES_DEG.to_vec() }
}

/// Proposes and tries grips for the first `per_family` parts of each family, all of them where it is left out, with so many threads.
/// The result does not depend on their number.
///
/// # Errors
///
/// The shipped twin or sensor cannot be read.
pub fn benchmark_starter(per_family: Option<usize>, threads: usize) -> Result<BenchmarkStarter, InitError> {
    let mut of_family: BTreeMap<&str, usize> = BTreeMap::new();
    let wanted: Vec<&BenchmarkPart> = all()
        .iter()
        .filter(|part| {
            let found = of_family.entry(part.family).or_default();
            *found += 1;
            per_family.is_none_or(|most| *found <= most)
        })
        .collect();
    let twin = Twin { parts: wanted.iter().map(|p| (p.name.clone(), part_of(p))).collect(), ..baseline() };
    let library = Library::of_twin(&twin, &Location::Disk("twin.toml".into()))?;
    let found = in_parallel(wanted.len(), threads, |i| grips_of(wanted[i], &twin, &library));
    let (mut kept, mut left_out) = (Vec::new(), Vec::new());
    for (number, (part, grips)) in wanted.into_iter().zip(found).enumerate() {
        match grips? {
            Ok(grips) if grips.len() == GRIPS => kept.push((number, part, grips)),
            Ok(grips) => left_out.push((part.name.clone(), format!("{} of {GRIPS} grips work", grips.len()))),
            Err(why) => left_out.push((part.name.clone(), why)),
        }
    }
    let names: Vec<String> = kept.iter().map(|(_, part, _)| format!("{:?}", part.name)).collect();
    let varied = varied();
    let sweep = assets::text("templates/benchmark-sweep.toml")
        .replace("{{parts}}", &names.join(", "))
        .replace("{{n}}", &kept.len().to_string())
        .replace("{{grip_poses}}", &text::pose_list(GRIPS))
        .replace("{{grip_force_n}}", &text::numbers(&[varied.grip_force_n.0, varied.grip_force_n.1]))
        .replace("{{grip_offset_sd_mm}}", &format!("{:?}", varied.grip_offset_sd_mm))
        .replace("{{grip_angle_deg}}", &text::numbers(&varied.grip_angle_deg));
    let parts: String = kept.iter().map(|(number, part, grips)| section(*number, part, grips)).collect();
    let twin = assets::text("templates/benchmark-twin.toml")
        .replace("{{n}}", &kept.len().to_string())
        .replace("{{mu}}", &format!("{MU:?}"))
        .replace("{{mu_spread_pct}}", &format!("{:.0}", MU_SPREAD * 100.0))
        .replace("{{scatter_pct}}", &format!("{:.0}", SCATTER * 100.0))
        .replace("{{parts}}", parts.trim_end());
    let files = vec![
        StarterFile { name: "sweep.toml".into(), bytes: sweep.into_bytes() },
        StarterFile { name: "twin.toml".into(), bytes: twin.into_bytes() },
    ];
    let summary = summary(&kept.iter().map(|(_, part, _)| *part).collect::<Vec<_>>(), &left_out);
    Ok(BenchmarkStarter { files, parts: kept.len(), left_out, summary })
}

fn part_of(part: &BenchmarkPart) -> Part {
    Part {
        mesh: format!("{ASSET_PREFIX}{BENCHMARK}{}.stl", part.name),
        metres_per_unit: 1e-3,
        grips: vec![],
        mu: MU,
        kinetic_ratio: 1.0,
        kinetic_fall_s: 0.0,
        scatter: 0.0,
        imprint_m3_per_n: IMPRINT_MM3_PER_N * 1e-9,
        edge_radius_m: 0.0,
        relief_m: 0.0,
    }
}

/// Grips that stand the sweep, or why there is none.
fn grips_of(
    part: &BenchmarkPart,
    twin: &Twin,
    library: &Library,
) -> Result<Result<Vec<Proposal>, String>, InitError> {
    let part = &twin.parts[&part.name];
    let search = Search {
        twin,
        library,
        surface: library.surface(part)?,
        mesh: library.clustered_mesh(part)?,
        part: part.clone(),
        closed: true,
        threads: 1,
    };
    Ok(search.run_over(&varied(), GRIPS).map_err(|why| why.to_string()))
}

/// The friction coefficient of a part, by its number and nothing else.
fn mu_of(number: usize) -> f64 {
    let mu = MU * libm::exp(MU_SPREAD * Stream::new(SEED, number as u64, Purpose::Draw).normal());
    (mu * 1e4).round() / 1e4
}

fn section(number: usize, part: &BenchmarkPart, grips: &[Proposal]) -> String {
    let name = &part.name;
    let mut text = format!(
        "[parts.{name}]\nmesh = \"{ASSET_PREFIX}{BENCHMARK}{name}.stl\"\nfamily = {:?}\nsplit = {:?}\nmu = {:?}\n\
         scatter = {SCATTER:?}\nimprint_mm3_per_n = {IMPRINT_MM3_PER_N:?}\n",
        part.family,
        part.split.name(),
        mu_of(number)
    );
    for grip in grips {
        let _ = write!(
            text,
            "[[parts.{name}.grips]]\norigin_mm = {:?}\norientation_deg = {:?}\n",
            grip.origin_mm, grip.orientation_deg
        );
    }
    text + "\n"
}

fn summary(kept: &[&BenchmarkPart], left_out: &[(String, String)]) -> String {
    let mut text = format!("{} parts with {GRIPS} grips each that were tried\n", kept.len());
    for family in FAMILIES {
        let n = kept.iter().filter(|part| part.family == family.name).count();
        let _ = writeln!(text, "{} ({}): {n}", family.name, family.split.name());
    }
    for (name, why) in left_out {
        let _ = writeln!(text, "left out: {name}: {why}");
    }
    text + "friction is drawn from part to part, apart from shape; look at twin.toml\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scatter that is stated is the scatter that is there, and it does not go with the order of the parts.
    #[test]
    fn friction_is_spread_as_stated() {
        let ln: Vec<f64> = (0..200).map(|i| (mu_of(i) / MU).ln()).collect();
        let mean = ln.iter().sum::<f64>() / 200.0;
        let sd = (ln.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 199.0).sqrt();
        assert!(mean.abs() < 0.05 && (sd - MU_SPREAD).abs() < 0.03, "{mean} {sd}");
        let next = ln.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / 199.0 / (sd * sd);
        assert!(next.abs() < 0.2, "{next}");
    }
}
