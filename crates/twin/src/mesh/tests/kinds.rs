//! Files of other kinds, and GLB of other programs.

use super::*;

#[test]
fn a_file_of_another_kind_is_named() {
    let ply = prism_ply();
    let obj = prism_obj(0);
    let utf16: Vec<u8> = "\u{feff}solid t".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let glb = other_formats().pop().unwrap().1;
    let cases: Vec<(&str, Vec<u8>, &str, &str)> = vec![
        (
            "stl",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345678\n".to_vec(),
            "Git LFS pointer",
            "git lfs pull",
        ),
        (
            "obj",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345678\n".to_vec(),
            "Git LFS pointer",
            "git lfs pull",
        ),
        ("stl", [b"PK\x03\x04".as_slice(), &[7; 300]].concat(), "zip archive", "trimesh"),
        ("glb", b"\x1f\x8b\x08\0 rest".to_vec(), "gzip", "unpack"),
        ("stl", ply.into_bytes(), "a PLY mesh, and its name says STL", ".ply"),
        ("stl", obj.clone().into_bytes(), "an OBJ mesh, and its name says STL", ".obj"),
        ("ply", obj.into_bytes(), "an OBJ mesh, and its name says PLY", ".obj"),
        ("obj", TETRAHEDRON.into(), "an STL mesh, and its name says OBJ", ".stl"),
        ("obj", write_binary_stl(&tetrahedron(), "# v 1", 1e-3), "an STL mesh", ".stl"),
        ("stl", glb, "a GLB mesh", ".glb"),
        ("glb", b"{\"asset\": {\"version\": \"2.0\"}}".to_vec(), "JSON", "GLB"),
        ("stl", utf16, "UTF-16", "UTF-8"),
        ("stl", b"\n<!DOCTYPE html><html>".to_vec(), "web page", "Raw"),
        ("stl", b"<!doctype html>".to_vec(), "web page", "Raw"),
        ("stl", b"ISO-10303-21;\nHEADER;".to_vec(), "STEP", "STL"),
        ("stl", vec![0; 5000], "zero bytes only", "again"),
        ("obj", vec![3; 5000], "5000 bytes, not text", "export"),
        ("stl", b" \n \n".to_vec(), "without a word", "export"),
        ("ply", b"  0\nSECTION\n  2\n".to_vec(), "line 1 begins with `0`", "export"),
    ];
    for (extension, bytes, wanted, hint) in cases {
        let e = TriMesh::from_file_bytes(&bytes, extension, 1e-3).unwrap_err();
        assert!(e.to_string().contains(wanted) && e.hint().contains(hint), "{extension}: {e}, {}", e.hint());
        assert!(e.to_string().len() < 200 && !e.to_string().chars().any(char::is_control), "{e}");
    }
}

/// A GLB of `json`, in which `#` is the length of `data`.
fn glb(json: &str, data: &[u8]) -> Vec<u8> {
    let mut json = json.replace('#', &data.len().to_string()).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut data = data.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(((12 + 8 + json.len() + 8 + data.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// The tetrahedron in whole millimetres of 16 bits behind a node that brings them to metres: quantized, mirrored, without a scene.
#[test]
fn a_glb_may_be_quantized_mirrored_and_without_a_scene() {
    let points: [[i16; 4]; 4] = [[0, 0, 0, 0], [0, 10, 0, 0], [10, 0, 0, 0], [0, 0, 10, 0]];
    let faces = [0_u8, 1, 2, 0, 2, 3, 0, 3, 1, 2, 1, 3];
    let mut data: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    data.extend(faces);
    let json = |extensions: &str, scale: &str| {
        format!(
            r##"{{"asset":{{"version":"2.0"}},"extensionsRequired":[{extensions}],
            "nodes":[{{"children":[1],"scale":{scale}}},{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}},{{"attributes":{{"NORMAL":0}}}}]}}],
            "buffers":[{{"byteLength":#}}],
            "bufferViews":[{{"buffer":0,"byteLength":32,"byteStride":8}},{{"buffer":0,"byteOffset":32,"byteLength":12}}],
            "accessors":[{{"bufferView":0,"componentType":5122,"count":4,"type":"VEC3"}},
                         {{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}}]}}"##
        )
    };
    let harmless = r#""KHR_mesh_quantization","KHR_materials_unlit","KHR_texture_transform""#;
    for scale in ["[0.001,0.001,0.001]", "[-0.001,0.001,0.001]"] {
        let mesh = TriMesh::from_file_bytes(&glb(&json(harmless, scale), &data), "glb", 1.0).unwrap();
        let volume_mm3 = mesh.signed_volume_m3() * 1e9;
        assert!((volume_mm3 - 1000.0 / 6.0).abs() < 1e-3, "{scale}: {volume_mm3} mm3");
    }
    let packed = glb(&json(r#""KHR_draco_mesh_compression""#, "[1,1,1]"), &data);
    let e = TriMesh::from_file_bytes(&packed, "glb", 1.0).unwrap_err();
    assert!(e.to_string().contains("KHR_draco_mesh_compression") && e.hint().contains("compression"), "{e}");
}

/// Nodes that all have two ways to the next: 2^60 ways to walk.
#[test]
fn nodes_with_two_parents_are_refused_at_once() {
    let nodes: Vec<String> = (1..=60).map(|i| format!("{{\"children\":[{i},{i}]}}")).collect();
    let json =
        format!("{{\"asset\":{{}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{},{{}}]}}", nodes.join(","));
    assert!(error(&glb(&json, &[]), "glb").contains("two parents"));
}
