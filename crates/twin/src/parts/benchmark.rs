//! Two hundred parts in twelve families, made on demand: the same name gives the same mesh everywhere.
//!
//! Each family is a file with one function from random sizes to a body. Sizes are those of parts that a WSG 50 (opening 110 mm) with
//! pads of 28 x 21 mm can hold. Nothing is taken from a catalogue or a data set; proportions are ordinary ones.
//!
//! Parts that are the same shape but for rounding (see [`Fingerprint`]) are left out before families are split, so no part for training
//! has a twin among those for tests.

mod bearing;
mod bracket;
mod cam;
mod connector;
mod fingerprint;
mod gear;
mod knob;
mod lattice;
mod nut;
mod plate;
mod screw;
mod shaft;
mod tube;

pub use fingerprint::Fingerprint;

use super::grid::Grid;
use super::numbers::Numbers;
use super::outline::{Edge, Point, circle, cornered, polygon, rectangle, slot};
use super::prism::Prism;
use super::turned::{Section, Turned};
use super::{BallBearing, Builder, InvoluteGear, RollerBearing, sin_cos_turn};
use crate::TriMesh;
use std::sync::OnceLock;

/// Parts of the benchmark.
pub const PARTS: usize = 200;

/// Seed of the benchmark's sizes.
const SEED: u64 = 200;

/// What a family is for: what is learnt, or what is tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// For training, and for setting intervals by families that are left out in turn.
    Train,
    /// Shown to nobody before the last test.
    Test,
}

impl Split {
    /// As it stands in a twin.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Test => "test",
        }
    }
}

/// A kind of part.
#[derive(Clone, Copy)]
pub struct Family {
    /// Its name.
    pub name: &'static str,
    /// What it is for.
    pub split: Split,
    make: fn(&mut Numbers, &mut Builder),
}

/// All families. The three for tests were chosen by hand, before anything was trained.
pub const FAMILIES: [Family; 12] = [
    Family { name: "shaft", split: Split::Train, make: shaft::make },
    Family { name: "bearing", split: Split::Test, make: bearing::make },
    Family { name: "gear", split: Split::Train, make: gear::make },
    Family { name: "screw", split: Split::Train, make: screw::make },
    Family { name: "nut", split: Split::Train, make: nut::make },
    Family { name: "bracket", split: Split::Train, make: bracket::make },
    Family { name: "plate", split: Split::Train, make: plate::make },
    Family { name: "connector", split: Split::Test, make: connector::make },
    Family { name: "tube", split: Split::Train, make: tube::make },
    Family { name: "cam", split: Split::Test, make: cam::make },
    Family { name: "knob", split: Split::Train, make: knob::make },
    Family { name: "lattice", split: Split::Train, make: lattice::make },
];

/// A part of the benchmark.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BenchmarkPart {
    /// `shaft_007`.
    pub name: String,
    /// Its family.
    pub family: &'static str,
    /// What its family is for.
    pub split: Split,
    /// Number of the family, and of the variant in it.
    variant: (usize, u64),
}

impl BenchmarkPart {
    /// The mesh, in metres.
    pub fn mesh(&self) -> TriMesh {
        variant(SEED, self.variant.0, self.variant.1)
    }
}

/// All parts, family by family. The first call makes every mesh once, to leave out what is the same.
pub fn all() -> &'static [BenchmarkPart] {
    static ALL: OnceLock<Vec<BenchmarkPart>> = OnceLock::new();
    ALL.get_or_init(|| {
        let mut seen: Vec<Fingerprint> = Vec::new();
        let mut parts = Vec::with_capacity(PARTS);
        for (number, family) in FAMILIES.iter().enumerate() {
            // 200 = 12 x 16 + 8: the first eight families have one more.
            let wanted = PARTS / FAMILIES.len() + usize::from(number < PARTS % FAMILIES.len());
            let mut found = 0;
            for index in 0.. {
                if found == wanted {
                    break;
                }
                let print = Fingerprint::of(&variant(SEED, number, index));
                if seen.iter().any(|other| other.same(&print)) {
                    continue;
                }
                seen.push(print);
                let name = format!("{}_{found:03}", family.name);
                parts.push(BenchmarkPart {
                    name,
                    family: family.name,
                    split: family.split,
                    variant: (number, index),
                });
                found += 1;
            }
        }
        parts
    })
}

/// The part of a name.
pub fn part(name: &str) -> Option<&'static BenchmarkPart> {
    all().iter().find(|part| part.name == name)
}

/// Variant `index` of a family under any seed, in metres: more parts than those of the benchmark.
pub fn variant(seed: u64, family: usize, index: u64) -> TriMesh {
    let mut b = Builder::default();
    (FAMILIES[family % FAMILIES.len()].make)(&mut Numbers::new(seed, family as u64, index), &mut b);
    b.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed, faces outwards, of a size that the gripper opens for, light enough for a laptop; and written and read again still so.
    #[test]
    fn all_parts_are_sound() {
        assert_eq!(all().len(), PARTS);
        let mut most = 0;
        for part in all() {
            let mesh = part.mesh();
            let file = crate::write_binary_stl(&mesh, &part.name, 1e-3);
            for look in [mesh.look(), TriMesh::from_file_bytes(&file, "stl", 1e-3).unwrap().look()] {
                assert!(look.is_closed(), "{}: {look:?}", part.name);
                assert_eq!(look.crowded_edges + look.turned_edges, 0, "{}: {look:?}", part.name);
                assert!(look.volume_m3 > 0.0, "{}: {look:?}", part.name);
            }
            let size = mesh.extent_m().map(|s| s * 1e3);
            let smallest = size.iter().fold(f64::INFINITY, |a, &b| a.min(b));
            let largest = size.iter().fold(0.0_f64, |a, &b| a.max(b));
            assert!((1.5..100.0).contains(&smallest) && largest < 130.0, "{}: {size:?}", part.name);
            most = most.max(mesh.triangles().len());
        }
        assert!(most < 60_000, "{most} triangles");
    }

    /// No two are the same, nor is one a turned copy of another; and the same name is the same mesh.
    #[test]
    fn no_two_parts_are_the_same() {
        let prints: Vec<Fingerprint> = all().iter().map(|part| Fingerprint::of(&part.mesh())).collect();
        for i in 0..prints.len() {
            let same: Vec<&str> =
                (0..i).filter(|&j| prints[i].same(&prints[j])).map(|j| all()[j].name.as_str()).collect();
            assert!(same.is_empty(), "{} is {same:?}", all()[i].name);
        }
        let [a, b] = ["gear_003", "lattice_015"].map(|name| part(name).unwrap());
        assert_eq!(a.mesh(), a.mesh());
        assert_ne!(a.mesh(), b.mesh());
        assert!(part("gear_017").is_none() && part("spoon_000").is_none());
        let tests = FAMILIES.iter().filter(|f| f.split == Split::Test).count();
        assert_eq!(tests, 3);
    }
}
