//! Files that were changed at random: whatever they say, readers answer with a result and never panic.
//!
//! Few of each here, ten times as many in the slow tests; `GRIPGEN_FUZZ=100000` sets how many, and `docs/reliability.md` has the counts of such a run.

use crate::common::{jobs, run, slow, small_project};
use gripgen::record::ShardReader;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Posterior, TriMesh, write_binary_stl};
use gripgen::{Location, Project, load_twin_document};
use gripgen_measured::read_campaign;
use nalgebra::Point3;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// How many files of each kind.
fn tries(few: u64) -> u64 {
    let asked = std::env::var("GRIPGEN_FUZZ").ok().and_then(|n| n.parse().ok());
    asked.unwrap_or(if slow() { 10 * few } else { few })
}

/// What is written in the place of a number or between two lines.
const HOSTILE: [&str; 24] = [
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "5e-324",
    "0",
    "-0.0",
    "-1",
    "9223372036854775807",
    "-9223372036854775808",
    "99999999999999999999",
    "\"\"",
    "[]",
    "{}",
    "[[]]",
    "true",
    "\"../../../../x\"",
    "\"/dev/zero\\u0000\"",
    "1979-05-27T07:32:00Z",
    "{ uniform = [1, 0] }",
    "{ uniform = [nan, inf] }",
    "[vary]",
];

fn below(stream: &mut Stream, n: usize) -> usize {
    ((stream.uniform() * n as f64) as usize).min(n.saturating_sub(1))
}

/// Bytes with one to four changes: of a bit, a byte, a stretch that goes or comes twice, an end that is missing.
fn changed_bytes(bytes: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=below(stream, 4) {
        if out.is_empty() {
            break;
        }
        let (at, long) = (below(stream, out.len()), 1 + below(stream, 64));
        let to = (at + long).min(out.len());
        match below(stream, 6) {
            0 => out[at] ^= 1 << below(stream, 8),
            1 => out[at] = stream.bits() as u8,
            2 => drop(out.drain(at..to)),
            3 => {
                let twice = out[at..to].to_vec();
                out.splice(at..at, twice);
            }
            4 => out[at..to].fill(if stream.uniform() < 0.5 { 0xff } else { 0 }),
            _ if stream.uniform() < 0.2 => out.truncate(at),
            _ => out.insert(at, stream.bits() as u8),
        }
    }
    out
}

/// A text with hostile values: numbers of it replaced, lines gone, doubled, exchanged, torn, or bytes changed.
fn changed_text(text: &str, stream: &mut Stream) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    for _ in 0..=below(stream, 3) {
        let (a, b) = (below(stream, lines.len()), below(stream, lines.len()));
        let hostile = HOSTILE[below(stream, HOSTILE.len())];
        match below(stream, 6) {
            0..=2 => {
                // The value behind the first equals sign of a line that has one.
                if let Some((key, _)) = lines[a].clone().split_once('=') {
                    lines[a] = format!("{key}= {hostile}");
                }
            }
            3 => lines.swap(a, b),
            4 => lines.insert(a, lines[b].clone()),
            _ => lines[a] = hostile.into(),
        }
    }
    let text = lines.join("\n").into_bytes();
    if stream.uniform() < 0.3 { changed_bytes(&text, stream) } else { text }
}

/// Runs `check` on `n` changed files; the numbers of those on which it panicked.
fn panics(n: u64, of: u64, mut check: impl FnMut(&mut Stream)) -> Vec<u64> {
    (0..n)
        .filter(|&i| {
            catch_unwind(AssertUnwindSafe(|| check(&mut Stream::new(of, i, Purpose::Draw)))).is_err()
        })
        .collect()
}

fn cube() -> TriMesh {
    let corner = |i: u32| Point3::from([0, 1, 2].map(|k| 0.02 * f64::from((i >> k) & 1)));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh::new((0..8).map(corner).collect(), triangles).unwrap()
}

/// The cube in every format, with the extension.
fn meshes() -> Vec<(&'static str, Vec<u8>)> {
    let mesh = cube();
    let (vertices, triangles) = (mesh.vertices_m(), mesh.triangles());
    let mm: Vec<[f32; 3]> = vertices.iter().map(|v| [v.x, v.y, v.z].map(|x| 1e3 * x as f32)).collect();
    let line = |head: &str, xs: &[String]| format!("{head}{}\n", xs.join(" "));
    let words = |xs: [f32; 3]| xs.map(|x| x.to_string());
    let mut ascii = String::from("solid cube\n");
    for t in triangles {
        ascii += "facet normal 0 0 0\nouter loop\n";
        t.iter().for_each(|&v| ascii += &line("vertex ", &words(mm[v as usize])));
        ascii += "endloop\nendfacet\n";
    }
    ascii += "endsolid cube\n";
    let mut obj = String::new();
    mm.iter().for_each(|&v| obj += &line("v ", &words(v)));
    triangles.iter().for_each(|t| obj += &line("f ", &t.map(|v| (v + 1).to_string())));
    let ply_head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
             element face 12\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut ply = ply_head("ascii");
    mm.iter().for_each(|&v| ply += &line("", &words(v)));
    triangles.iter().for_each(|t| ply += &line("3 ", &t.map(|v| v.to_string())));
    let floats: Vec<u8> = mm.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let mut binary_ply = ply_head("binary_little_endian").into_bytes();
    binary_ply.extend(&floats);
    for t in triangles {
        binary_ply.push(3);
        t.iter().for_each(|v| binary_ply.extend(v.to_le_bytes()));
    }
    let indices: Vec<u8> = triangles.iter().flatten().flat_map(|&v| (v as u16).to_le_bytes()).collect();
    vec![
        ("stl", write_binary_stl(&mesh, "cube", 1e-3)),
        ("stl", ascii.into_bytes()),
        ("obj", obj.into_bytes()),
        ("ply", ply.into_bytes()),
        ("ply", binary_ply),
        ("glb", glb(&floats, &indices)),
    ]
}

/// A binary glTF with one mesh: eight positions, 36 indices.
fn glb(positions: &[u8], indices: &[u8]) -> Vec<u8> {
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[20,20,20]}},\
         {{\"bufferView\":1,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{0}}},{{\"buffer\":0,\"byteOffset\":{0},\"byteLength\":{1}}}],\
         \"buffers\":[{{\"byteLength\":{2}}}]}}",
        positions.len(),
        indices.len(),
        positions.len() + indices.len()
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let binary = [positions, indices].concat();
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut out = b"glTF".to_vec();
    out.extend([word(2), word(12 + 8 + json.len() + 8 + binary.len()), word(json.len())].concat());
    out.extend(b"JSON");
    out.extend(json.as_bytes());
    out.extend(word(binary.len()));
    out.extend(b"BIN\0");
    out.extend(binary);
    out
}

#[test]
fn changed_meshes_never_panic() {
    let meshes = meshes();
    for (extension, bytes) in &meshes {
        let mesh =
            TriMesh::from_file_bytes(bytes, extension, 1e-3).unwrap_or_else(|e| panic!("{extension}: {e}"));
        assert_eq!(mesh.triangles().len(), 12, "{extension}");
    }
    let mut read = 0;
    let bad = panics(tries(3000), 1, |stream| {
        let (extension, bytes) = &meshes[below(stream, meshes.len())];
        if let Ok(mesh) = TriMesh::from_file_bytes(&changed_bytes(bytes, stream), extension, 1e-3) {
            read += 1;
            mesh.look();
            assert!(mesh.extent_m().iter().all(|x| x.is_finite()));
        }
    });
    assert!(bad.is_empty(), "panics: {bad:?}");
    println!("{read} meshes were read");
    assert!(read > 0, "some changes do no harm");
}

/// Small files of each kind with which the product is told what to do.
fn configs(folder: &Path) -> Vec<(&'static str, String)> {
    std::fs::write(folder.join("cube.stl"), write_binary_stl(&cube(), "cube", 1e-3)).unwrap();
    let own = Location::parse("asset:configs/twin-contact.toml").read_text().unwrap();
    let effects = "\neffects = [{name = \"dwell_ageing\", beta = 0.05}, {name = \"load_offset\", a = 1.2, b_n = -2.0, \
                   fitted_grip_force_n = [2, 80]}, {name = \"wear\", depth = 0.3, n0 = 20}]\n";
    let twin = format!(
        "{effects}[robot]\nmodel = \"carriage\"\n[wrist]\nnoise_n = 0.1\n[parts.cube]\nmesh = \"cube.stl\"\nmu = 0.2\n\
         scatter = 0.03\nimprint_mm3_per_n = 1.5\n[[parts.cube.grips]]\norigin_mm = [10, 10, 10]\norientation_deg = [0, 0, 0]\n"
    );
    let sweep = "twin = \"twin.toml\"\nseed = 3\nsamples = 8\ndesign = \"sobol\"\nmechanics = \"reduced\"\nimages = \"png\"\n\
                 trace = \"full\"\nshard_samples = 4\n[vary]\ngrip_force_n = { uniform = [5, 40] }\ngrip_pose = [0]\n\
                 dwell_s = { log_uniform = [1, 60] }\n[pull]\nincrement_n = 1.0\nstep_s = 0.104\nstop_mm = 5.0\n"
        .to_string();
    let campaign = "label_tolerance_n = 3.0\nstop_mm = 5.0\ngrip_force_means = \"per_jaw\"\n[[pulls]]\npart = \"gear\"\ngrip_force_n = 20\n\
                    force_increment_n = 1.0\nstep_time_s = 0.104\ndwell_s = 1.0\n[[pulls]]\nkind = \"no_load\"\ndwell_s = 5\n"
        .to_string();
    let posterior = "weight,cause,parts.gear.mu\n0.4,none,0.2\n0.6,wear,0.21\n".to_string();
    vec![
        ("sweep", sweep),
        ("twin", twin),
        ("shipped twin", own),
        ("campaign", campaign),
        ("posterior", posterior),
    ]
}

#[test]
fn changed_configurations_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let configs = configs(folder.path());
    let plain = |name: &str| configs.iter().find(|(n, _)| *n == name).unwrap().1.clone();
    std::fs::write(at("twin-sweep.toml"), plain("sweep")).unwrap();
    std::fs::write(at("twin.toml"), plain("twin")).unwrap();
    let taken = |kind: &str, bytes: &[u8]| -> Result<(), String> {
        let file = at(match kind {
            "sweep" => "sweep.toml",
            "twin" => "twin.toml",
            _ => "other.toml",
        });
        std::fs::write(&file, bytes).unwrap();
        let said = |e: &dyn std::fmt::Display| e.to_string();
        match kind {
            "sweep" => Project::load(&Location::Disk(file), &[]).map(drop).map_err(|e| said(&e)),
            "twin" => {
                Project::load(&Location::Disk(at("twin-sweep.toml")), &[]).map(drop).map_err(|e| said(&e))
            }
            "shipped twin" => load_twin_document(&Location::Disk(file), &[])
                .map_err(|e| said(&e))
                .and_then(|document| document.read_twin().map(drop).map_err(|e| said(&e))),
            "campaign" => read_campaign(&file).map(drop).map_err(|e| said(&e)),
            _ => Posterior::parse(&String::from_utf8_lossy(bytes)).map(drop).map_err(|e| said(&e)),
        }
    };
    for (kind, text) in &configs {
        taken(kind, text.as_bytes()).unwrap_or_else(|e| panic!("{kind}: {e}"));
    }
    let mut refused = 0;
    let bad = panics(tries(1500), 2, |stream| {
        let (kind, text) = &configs[below(stream, configs.len())];
        std::fs::write(at("twin.toml"), plain("twin")).unwrap();
        if let Err(problem) = taken(kind, &changed_text(text, stream)) {
            refused += 1;
            assert!(!problem.is_empty());
        }
    });
    assert!(bad.is_empty(), "panics: {bad:?}");
    println!("{refused} configurations were refused");
    assert!(refused > 0);
}

#[test]
fn changed_shards_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&["mechanics=reduced"]), folder.path(), jobs(2));
    let shard = folder.path().join("shard-00000.mcap");
    let (bytes, changed) = (std::fs::read(&shard).unwrap(), folder.path().join("changed.mcap"));
    let indices = ShardReader::open(&shard).unwrap().indices();
    let mut read = 0;
    let bad = panics(tries(300), 3, |stream| {
        std::fs::write(&changed, changed_bytes(&bytes, stream)).unwrap();
        let Ok(reader) = ShardReader::open(&changed) else { return };
        for index in indices.clone() {
            read += usize::from(reader.record(index).is_ok());
            let _whether = reader.pull(index);
        }
        let _whether = reader.config_toml();
    });
    assert!(bad.is_empty(), "panics: {bad:?}");
    println!("{read} samples of changed shards were read");
    assert!(read > 0, "some samples are whole");
}
