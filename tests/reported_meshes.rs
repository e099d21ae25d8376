//! Mesh files that were reported: each is the part that its twin in plain triangles is, or an error that names what it is.

use gripgen_twin::TriMesh;

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn reported_meshes_are_what_they_are() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reports");
    let read = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        TriMesh::from_file_bytes(&bytes, name.rsplit('.').next().unwrap(), 1e-3)
            .unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let same = |name: &str, truth: &str| {
        let (volume, truth) = (read(name).look(), read(truth).look());
        assert!(
            volume.is_closed() && (volume.volume_m3 / truth.volume_m3 - 1.0).abs() < 1e-6,
            "{name}: {volume:?}"
        );
    };
    let concave = "03-concave-polygons";
    for name in ["o05_concave_ngon_start1.obj", "o05_concave_ngon_start4.obj", "p05_concave_ngon_start0.ply"]
    {
        same(&format!("{concave}/{name}"), &format!("{concave}/o05_truth.obj"));
    }
    same(&format!("{concave}/o05u_ngon.obj"), &format!("{concave}/o05u_truth.obj"));
    same(
        "04-obj-lines-become-faces/o14b_plate_hole_rims.obj",
        "04-obj-lines-become-faces/o14a_plate_hole.obj",
    );
    let plain = "05-obj-byte-order-mark/o01_plain.obj";
    for name in [
        "04-obj-lines-become-faces/o14_lines_points.obj",
        "05-obj-byte-order-mark/o08_bom.obj",
        "05-obj-byte-order-mark/o08c_bom_unused_last.obj",
        "16-valid-obj-refused/o04_continuation.obj",
        "16-valid-obj-refused/o09_latin1_comment.obj",
        "16-valid-obj-refused/o10_cr_only.obj",
        "16-valid-obj-refused/o11_trailing_comment.obj",
        "16-valid-obj-refused/o13c_usemtl_empty.obj",
        "16-valid-obj-refused/p07b_latin1_comment.ply",
        "17-binary-stl-that-begins-with-solid/s02_solid_header_2_extra_bytes.stl",
        "17-binary-stl-that-begins-with-solid/s03_extra_bytes.stl",
        "18-wrong-kind-of-file/a12_bom.stl",
        "18-wrong-kind-of-file/a13_blank_and_comment.stl",
    ] {
        same(name, plain);
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn reported_files_of_another_kind_are_named() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reports");
    for (name, wanted) in [
        ("17-binary-stl-that-begins-with-solid/s09_solid_truncated.stl", "cut off"),
        ("18-wrong-kind-of-file/a14_utf16.stl", "UTF-16"),
        ("18-wrong-kind-of-file/s13_bigendian.stl", "big-endian"),
        ("18-wrong-kind-of-file/x01_lfs_pointer.stl", "Git LFS pointer"),
        ("18-wrong-kind-of-file/x03_zip.stl", "zip archive"),
        ("18-wrong-kind-of-file/x09_obj_named.stl", "an OBJ mesh"),
        ("18-wrong-kind-of-file/x11_ply_named.stl", "a PLY mesh"),
    ] {
        let bytes = std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let found = TriMesh::from_file_bytes(&bytes, "stl", 1e-3).unwrap_err().to_string();
        assert!(found.contains(wanted), "{name}: {found}");
    }
}
