//! Meshes of every format, sound and odd.

mod kinds;

use super::*;

const TETRAHEDRON: &str = "solid t\n\
    facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 10 0\nvertex 10 0 0\nendloop\nendfacet\n\
    facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 0 10\nendloop\nendfacet\n\
    facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 10\nvertex 0 10 0\nendloop\nendfacet\n\
    facet normal 1 1 1\nouter loop\nvertex 10 0 0\nvertex 0 10 0\nvertex 0 0 10\nendloop\nendfacet\n\
    endsolid t\n";

fn tetrahedron() -> TriMesh {
    TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "STL", 1e-3).unwrap()
}

fn error(bytes: &[u8], extension: &str) -> String {
    TriMesh::from_file_bytes(bytes, extension, 1e-3).unwrap_err().to_string()
}

#[test]
fn ascii_and_binary_stl_and_obj_give_the_same_mesh() {
    let ascii = tetrahedron();
    assert_eq!(ascii.vertices_m().len(), 4, "shared corners are merged");
    assert!((ascii.signed_volume_m3() - 1e-6 / 6.0).abs() < 1e-20);
    let binary = write_binary_stl(&ascii, "t", 1e-3);
    assert_eq!(TriMesh::from_file_bytes(&binary, "stl", 1e-3).unwrap(), ascii);
    let obj = b"v 0 0 0\nv 0 10 0\nv 10 0 0\nv 0 0 10\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 3 2 4\n";
    let obj = TriMesh::from_file_bytes(obj, "obj", 1e-3).unwrap();
    assert_eq!(obj.signed_volume_m3(), ascii.signed_volume_m3());
}

/// Files that `tobj` reads right too: it is the independent judge of vertices, their numbers in either direction, and convex faces.
#[test]
fn obj_is_read_as_by_another_program() {
    for seed in 0..20_u64 {
        let random = |k: u64| {
            let mixed = (seed * 1000 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            (mixed % 2000) as f64 / 10_000.0
        };
        let (rows, columns) = (3 + seed % 4, 4 + seed % 3);
        let mut text = String::from("# a field of heights\nmtllib none.mtl\no field\n");
        let height = |k| random(k);
        for k in 0..rows * columns {
            text += &format!("v {} {} {:.3}\nvt 0.5 0.5\nvn 0 0 1\n", k % columns, k / columns, height(k));
        }
        let count = (rows * columns) as i64;
        for (i, j) in (0..rows - 1).flat_map(|i| (0..columns - 1).map(move |j| (i, j))) {
            let corners =
                [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| (i * columns + j + 1) as i64);
            let word = |v: &i64| match (i + j + seed) % 4 {
                0 => format!("{v}"),
                1 => format!("{v}/{v}"),
                2 => format!("{v}//{v}"),
                _ => format!("{0}/{0}/{0}", v - count - 1),
            };
            text += &format!("g row{i}\nf {}\n", corners.iter().map(word).collect::<Vec<_>>().join(" "));
        }
        let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
        let (models, _) =
            tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
        let mut theirs: Vec<[[f32; 3]; 3]> = Vec::new();
        for mesh in models.iter().map(|m| &m.mesh) {
            let at = |i: u32| [0, 1, 2].map(|k| mesh.positions[3 * i as usize + k]);
            theirs.extend(mesh.indices.as_chunks::<3>().0.iter().map(|t| t.map(at)));
        }
        let area = |t: &[[f32; 3]; 3]| {
            let [a, b, c] = t.map(|p| p.map(f64::from));
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        let ours = obj::read(text.as_bytes()).unwrap();
        assert_eq!(ours.len(), theirs.len());
        // A quadrilateral that is not flat may be cut along either diagonal: its corners and its shadow are the same.
        for (own, other) in ours.chunks(2).zip(theirs.chunks(2)) {
            let corners = |faces: &[[[f32; 3]; 3]]| {
                let mut all: Vec<[u32; 3]> = faces.iter().flatten().map(|p| p.map(f32::to_bits)).collect();
                all.sort_unstable();
                all.dedup();
                all
            };
            assert_eq!(corners(own), corners(other), "seed {seed}");
            let shadow = |faces: &[[[f32; 3]; 3]]| faces.iter().map(area).sum::<f64>();
            assert!((shadow(own) - 1.0).abs() < 1e-9 && (shadow(other) - 1.0).abs() < 1e-9);
        }
    }
}

/// The tetrahedron as text and binary PLY, and as GLB in metres behind a node that turns and moves it.
fn other_formats() -> Vec<(&'static str, Vec<u8>, f64)> {
    let points = [[0.0_f32, 0.0, 0.0], [0.0, 10.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]];
    let faces = [[0_u16, 1, 2], [0, 2, 3], [0, 3, 1], [2, 1, 3]];
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nelement face 4\nproperty list uchar int vertex_index\nend_header\n"
        )
    };
    let mut text = header("ascii");
    let mut binary = header("binary_little_endian").into_bytes();
    for p in points {
        text += &format!("{} {} {} 7\n", p[0], p[1], p[2]);
        binary.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        binary.push(7);
    }
    for f in faces {
        text += &format!("3 {} {} {}\n", f[0], f[1], f[2]);
        binary.push(3);
        binary.extend(f.iter().flat_map(|i| i32::from(*i).to_le_bytes()));
    }
    // Turned by a quarter about z and moved back: x = -y' , so the points are stored the other way round.
    let mut data: Vec<u8> = Vec::new();
    for [x, y, z] in points {
        data.extend([y, -x, z].iter().flat_map(|v| (v * 1e-3 + 1.0).to_le_bytes()));
    }
    data.extend(faces.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"children":[1],"rotation":[0,0,0.70710678,0.70710678]},{"mesh":0,"translation":[-1,-1,-1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "buffers":[{"byteLength":72}],
        "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[2,2,2]},
                     {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]}"#;
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend(((12 + 8 + json.len() + 8 + data.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    vec![("ply", text.into_bytes(), 1.0), ("ply", binary, 1.0), ("glb", glb, 1000.0)]
}

#[test]
fn ply_and_glb_give_the_same_mesh() {
    let stl = tetrahedron();
    for (extension, bytes, mm_per_unit) in other_formats() {
        assert_eq!(usual_scale_mm_per_unit(extension), mm_per_unit);
        let mesh = TriMesh::from_file_bytes(&bytes, extension, mm_per_unit * 1e-3).unwrap();
        assert_eq!((mesh.vertices_m().len(), mesh.triangles().len()), (4, 4), "{extension}");
        assert!((mesh.signed_volume_m3() - stl.signed_volume_m3()).abs() < 1e-12, "{extension}");
        let (size, wanted) = (mesh.extent_m(), stl.extent_m());
        assert!((0..3).all(|i| (size[i] - wanted[i]).abs() < 1e-6), "{extension}: {size:?}");
    }
}

/// Damaged in every byte, cut off anywhere: an error or a mesh, never a panic, and never more than the file can hold.
#[test]
fn damaged_ply_and_glb_never_panic() {
    for (extension, bytes, mm_per_unit) in other_formats() {
        let read = |bytes: &[u8]| TriMesh::from_file_bytes(bytes, extension, mm_per_unit * 1e-3);
        // The line break after the last word of a text may be missing.
        for at in 0..bytes.len() - 1 {
            assert!(read(&bytes[..at]).is_err(), "{extension} of {at} bytes");
            for value in [0, 1, b'0', b'9', b'-', b'"', 127, 255] {
                let mut damaged = bytes.clone();
                damaged[at] = value;
                let _ = read(&damaged);
            }
        }
    }
    let many = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n0\n";
    assert!(error(many.as_bytes(), "ply").contains("promises 4000000000 of `vertex`, and has"));
    let out = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 1 2\n";
    assert!(error(out.as_bytes(), "ply").contains("face 0 (from 0) has vertex 1 of 1"));
    assert!(error(b"glTF", "glb").contains("not a GLB file"));
}

#[test]
fn an_ascii_header_does_not_fool_a_binary_file() {
    let mut binary = write_binary_stl(&tetrahedron(), "t", 1e-3);
    binary[..6].copy_from_slice(b"solid ");
    assert_eq!(TriMesh::from_file_bytes(&binary, "stl", 1e-3).unwrap(), tetrahedron());
}

#[test]
fn broken_files_say_what_and_where() {
    assert!(error(b"", "stl").contains("empty"));
    assert!(error(b"hello", "stl").contains("5 bytes, text whose line 1 begins with `hello`"));
    assert!(error(TETRAHEDRON.as_bytes(), "step").contains("`step`"));
    let cut = &TETRAHEDRON[..TETRAHEDRON.len() - 60];
    assert!(error(cut.as_bytes(), "stl").contains("line"), "{}", error(cut.as_bytes(), "stl"));
    let nan = TETRAHEDRON.replacen("10 0 0", "10 nan 0", 1);
    assert_eq!(error(nan.as_bytes(), "stl"), "line 6: `nan` is not a finite number");
    let word = TETRAHEDRON.replacen("10 0 0", "10 zero 0", 1);
    assert_eq!(error(word.as_bytes(), "stl"), "line 6: `zero` is not a finite number");
    let mut binary = write_binary_stl(&tetrahedron(), "t", 1e-3);
    binary.truncate(150);
    assert!(
        error(&binary, "stl").contains("promises 4 triangles (284 bytes), it has room for 1 (150 bytes)")
    );
    binary[80..84].copy_from_slice(&3_000_000u32.to_le_bytes());
    assert!(error(&binary, "stl").contains("3000000 triangles"));
    assert!(error(b"solid nothing\nendsolid nothing\n", "stl").contains("no triangles"));
    assert!(error(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "obj").contains("9"));
}

#[test]
fn a_wrong_unit_is_noticed() {
    let small = TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "stl", 1e-6).unwrap_err();
    assert!(small.to_string().contains("0.0100 x 0.0100 x 0.0100 mm"), "{small}");
    assert!(TriMesh::from_file_bytes(TETRAHEDRON.as_bytes(), "stl", 1.0).is_err());
}

/// Outline of an L of 20 x 12 mm with arms of 5 mm: 135 mm2.
const OUTLINE: [[f32; 2]; 6] = [[0., 0.], [20., 0.], [20., 5.], [5., 5.], [5., 12.], [0., 12.]];

/// A prism of the outline, 8 mm high, as vertices and faces from 0, the two L-shaped ones first, which begin at corner `start`.
fn prism(start: usize) -> (Vec<[f32; 3]>, Vec<Vec<usize>>) {
    let n = OUTLINE.len();
    let at = |z: f32| OUTLINE.iter().map(move |[x, y]| [*x, *y, z]);
    let turned = |i: usize| (i + start) % n;
    let mut faces = vec![(0..n).rev().map(turned).collect(), (0..n).map(|i| n + turned(i)).collect()];
    faces.extend((0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]));
    (at(0.0).chain(at(8.0)).collect(), faces)
}

fn prism_obj(start: usize) -> String {
    let (vertices, faces) = prism(start);
    let mut text: String = vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    for face in faces {
        let corners: Vec<String> = face.iter().map(|i| (i + 1).to_string()).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

fn prism_ply() -> String {
    let (vertices, faces) = prism(2);
    let mut text =
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 8\nproperty list uchar int vertex_indices\nend_header\n"
            .to_string();
    vertices.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    for face in faces {
        let corners: Vec<String> = face.iter().map(ToString::to_string).collect();
        text += &format!("{} {}\n", face.len(), corners.join(" "));
    }
    text
}

/// Read, and the L-prism: closed, of the volume of its outline, with its top face covered once.
fn is_the_prism(bytes: &[u8], extension: &str, what: &str) {
    let mesh = TriMesh::from_file_bytes(bytes, extension, 1e-3).unwrap_or_else(|e| panic!("{what}: {e}"));
    let look = mesh.look();
    assert!(look.is_closed() && look.faces_outwards() && look.bodies == 1, "{what}: {look:?}");
    assert!((look.volume_m3 * 1e9 - 135.0 * 8.0).abs() < 1e-3, "{what}: {look:?}");
    let top_mm2: f64 = (0..mesh.triangles().len())
        .map(|t| mesh.corners(t))
        .filter(|corners| corners.iter().all(|p| p.z == 8e-3))
        .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0 * 1e6)
        .sum();
    assert!((top_mm2 - 135.0).abs() < 1e-3, "{what}: the top measures {top_mm2} mm2");
}

#[test]
fn concave_faces_are_not_covered_beyond_their_outline() {
    for start in 0..6 {
        is_the_prism(prism_obj(start).as_bytes(), "obj", &format!("from corner {start}"));
    }
    is_the_prism(prism_ply().as_bytes(), "ply", "ply");
}

#[test]
fn what_has_nothing_to_do_with_the_shape_of_an_obj_is_passed_over() {
    let plain = prism_obj(0);
    let vertices_end = plain.find("f ").unwrap();
    let before_faces = |text: &str| [&plain[..vertices_end], text, &plain[vertices_end..]].concat();
    let each_line = |f: &dyn Fn(&str) -> String| plain.lines().map(f).collect::<String>();
    let faces_first = [&plain[vertices_end..], &plain[..vertices_end]].concat();
    let odd: Vec<(&str, Vec<u8>)> = vec![
        ("a byte order mark", [b"\xef\xbb\xbf", plain.as_bytes()].concat()),
        ("a vertex that no face has", before_faces("v 900 0 0\n").into()),
        ("polylines and points", (plain.clone() + "l 7 8 9 10 11 12 7\np 1 2\nl 1/1 2/2\n").into()),
        ("comments in Latin-1", [b"# f\xfcr 5 \xb5m\n", plain.as_bytes()].concat()),
        ("comments behind lines", each_line(&|line| format!("{line} # \u{e4}\n")).into()),
        ("a comment that ends with \\", before_faces("# C:\\parts\\\n").into()),
        ("a material that ends with \\", before_faces("usemtl C:\\parts\\\n").into()),
        ("names without a name", before_faces("g\no\ns off\nusemtl \nmtllib\n").into()),
        ("lines of Windows", plain.replace('\n', "\r\n").into()),
        ("lines of old Macs", plain.replace('\n', "\r").into()),
        ("lines that go on", each_line(&|line| line.replace(' ', " \\\n") + "\n").into()),
        ("lines of Windows that go on", each_line(&|line| line.replace(' ', " \\\r\n") + "\r\n").into()),
        (
            "weights",
            each_line(&|line| {
                if line.starts_with('v') { format!("{line} 0.25\n") } else { format!("{line}\n") }
            })
            .into(),
        ),
        (
            "colours",
            each_line(&|line| {
                if line.starts_with('v') { format!("{line} 1 .5 0\n") } else { format!("{line}\n") }
            })
            .into(),
        ),
        ("vertices that follow", faces_first.into()),
        ("tabs and blanks", plain.replace(' ', " \t ").into()),
        ("zero bytes at the end", [plain.as_bytes(), &[0; 40]].concat()),
        (
            "a face without area far away",
            (plain.clone() + "v 5000 0 0\nf 13 13 13\nf 13 13 1\nf 13 -1 -1\n").into(),
        ),
    ];
    for (what, bytes) in odd {
        is_the_prism(&bytes, "obj", what);
    }
    let counted_back = each_line(&|line| match line.strip_prefix("f ") {
        None => format!("{line}\n"),
        Some(corners) => {
            let back = corners.split(' ').map(|i| format!("{}//1 ", i.parse::<i64>().unwrap() - 13));
            format!("f {}\n", back.collect::<String>())
        }
    });
    is_the_prism(counted_back.as_bytes(), "obj", "numbers that count back");
}

#[test]
fn a_broken_obj_says_where() {
    let plain = prism_obj(0);
    for (end, wanted) in [
        ("f 1 2\n", "line 21: a face has 3 corners or more, found 2"),
        ("f 1 2 0\n", "line 21: vertex 0 of 12 read so far does not exist"),
        ("f 1 2 -13\n", "line 21: vertex -13 of 12 read so far does not exist"),
        ("f 1 2 13\n", "line 21: vertex 13 of 12 does not exist"),
        ("f 1 2 x/1\n", "line 21: `x` is not a vertex number"),
        ("v 1,5 2 3\n", "line 21: `1,5` is not a finite number"),
        ("v 1 2\n", "line 21: a vertex has 3 coordinates, found 2"),
        ("f 1 2 \\", "line 21: the file ends where a line goes on"),
        ("f 1 3 2 4\n", "crosses itself"),
        ("surf 0 1 0 1 1 2 3\n", "line 21: a free-form surface"),
    ] {
        let found = error((plain.clone() + end).as_bytes(), "obj");
        assert!(found.contains(wanted), "{end:?}: {found}");
    }
    let hostile = [b"v ", &[b'9'; 5000][..], b"\x1b[2J 0 0\n"].concat();
    let found = error(&hostile, "obj");
    assert!(found.len() < 120 && !found.contains('\u{1b}'), "{found}");
}

#[test]
fn a_ply_of_another_hand_is_read() {
    let plain = prism_ply();
    let header_end = plain.find("end_header").unwrap();
    let (header, data) = plain.split_at(header_end);
    let odd: Vec<(&str, Vec<u8>)> = vec![
        (
            "a comment in Latin-1",
            plain
                .replacen("element", "comment f\u{1}r\nobj_info 2\nelement", 1)
                .into_bytes()
                .iter()
                .map(|&b| if b == 1 { 0xfc } else { b })
                .collect(),
        ),
        ("lines of Windows", plain.replace('\n', "\r\n").into()),
        ("lines of old Macs", plain.replace('\n', "\r").into()),
        (
            "numbers without a digit before or behind the point",
            plain.replace("\n20 ", "\n20. ").replace("\n0 ", "\n.0 ").into(),
        ),
        ("new names of types", plain.replace("uchar int", "uint8 int32").replace("float", "float64").into()),
        ("empty lines", plain.replace("end_header\n", "end_header\n\n \n").into()),
        (
            "edges",
            (header.replace("end_header", "")
                + "element edge 1\nproperty int a\nproperty list uchar float b\n"
                + data
                + "7 2 0.5 nan\n")
                .into(),
        ),
    ];
    for (what, bytes) in odd {
        is_the_prism(&bytes, "ply", what);
    }
    for (from, to, wanted) in [
        ("property float z\n", "", "`vertex` has no property `z`"),
        ("vertex_indices", "corners", "`face` has no list `vertex_indices`"),
        ("element face 8", "element face 9", "it is cut off in row 8 (from 0) of 9 of `face`"),
        (
            "\n20 0 0\n",
            "\n20 0 0 5\n",
            "line 11: `5` is left over at the end of row 1 (from 0) of 12 of `vertex`",
        ),
        ("\n20 0 0\n", "\n20 0\n", "line 11: row 1 (from 0) of 12 of `vertex` ends too soon"),
        ("\n20 0 0\n", "\n20 zero 0\n", "line 11: `zero` is not a number"),
        ("\n4 0 1 7 6\n", "\n4 0 1 7 12\n", "face 2 (from 0) has vertex 12 of 12"),
        (
            "\n4 0 1 7 6\n",
            "\n4 0 7 1 6\n",
            "face 2 (from 0): the outline of a face of 4 corners crosses itself",
        ),
        ("element face 8", "element tristrips 8", "strips of triangles"),
    ] {
        assert!(plain.contains(from), "{from}");
        let found = error(plain.replacen(from, to, 1).as_bytes(), "ply");
        assert!(found.contains(wanted), "{to:?}: {found}");
    }
}

#[test]
fn stl_is_read_by_words_and_what_is_left_over_is_refused() {
    let one_line = TETRAHEDRON.replace('\n', " ");
    for (what, text) in [
        ("one line", one_line.clone()),
        ("a name of words of the grammar", TETRAHEDRON.replace("solid t\n", "solid facet of a loop\n")),
        ("comments and blanks", format!("\n\n; exported\n# by hand\n{TETRAHEDRON}\n\n")),
        ("capitals", TETRAHEDRON.to_uppercase()),
        ("old Macs", TETRAHEDRON.replace('\n', "\r")),
        (
            "no normals",
            TETRAHEDRON.replace("normal 0 0 -1", "").replace("normal 1 1 1", "normal nan nan -nan(ind)"),
        ),
        ("zero bytes at the end", format!("{TETRAHEDRON}\0\0\0")),
        ("a byte order mark", format!("\u{feff}{TETRAHEDRON}")),
    ] {
        let read = TriMesh::from_file_bytes(text.as_bytes(), "stl", 1e-3);
        assert_eq!(read.unwrap_or_else(|e| panic!("{what}: {e}")), tetrahedron(), "{what}");
    }
    let two = format!("{TETRAHEDRON}{}", TETRAHEDRON.replace("10", "4"));
    let two = TriMesh::from_file_bytes(two.as_bytes(), "stl", 1e-3).unwrap();
    assert_eq!(two.triangles().len(), 8, "two solids are both read");
    for (from, to, wanted) in [
        ("vertex 0 10 0\n", "vertex 0 10 0 5\n", "line 5: `5` stands where `vertex` is expected"),
        ("vertex 0 10 0\n", "", "line 6: `endloop` stands where `vertex` is expected"),
        ("endloop\n", "vertex 1 1 1\nendloop\n", "line 7: `vertex` stands where `endloop` is expected"),
        ("endsolid t\n", "", "the file ends where `facet` or `endsolid` is expected"),
        ("endsolid t\n", "endsolid t\n7 8\n", "`7` stands where `solid` is expected"),
    ] {
        let found = error(TETRAHEDRON.replacen(from, to, 1).as_bytes(), "stl");
        assert!(found.contains(wanted), "{to:?}: {found}");
    }
    assert!(
        error(format!("{one_line} {one_line}").as_bytes(), "stl")
            .contains("stands where `solid` is expected")
    );
}

#[test]
fn a_binary_stl_is_its_promised_triangles() {
    let whole = write_binary_stl(&tetrahedron(), "t", 1e-3);
    for title in ["t", "solid t"] {
        let mut bytes = whole.clone();
        bytes[..title.len()].copy_from_slice(title.as_bytes());
        for rest in [&b"\0\0"[..], b"0", &[0; 100], b"made by hand, with some words behind the triangles"] {
            let longer = [&bytes, rest].concat();
            if rest.len() == 50 {
                assert!(error(&longer, "stl").contains("promises 4 triangles, the file has 5"));
            } else {
                assert_eq!(
                    TriMesh::from_file_bytes(&longer, "stl", 1e-3).unwrap(),
                    tetrahedron(),
                    "{rest:?}"
                );
            }
        }
        let cut = error(&bytes[..bytes.len() - 30], "stl");
        assert!(
            cut.contains("cut off")
                && cut.contains("promises 4 triangles (284 bytes)")
                && cut.contains("(254 bytes)"),
            "{cut}"
        );
        let mut none = bytes.clone();
        none[80] = 0;
        assert!(error(&none, "stl").contains("promises 0 triangles, the file has 4"));
        assert!(error(&[bytes.clone(), bytes.clone()].concat(), "stl").contains("second STL file"));
    }
    let swapped: Vec<u8> = whole[80..84].iter().rev().copied().collect();
    let swapped = [&whole[..80], &swapped, &whole[84..]].concat();
    assert!(error(&swapped, "stl").contains("big-endian"));
}
