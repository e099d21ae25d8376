use super::*;
use crate::picture::encode_png;
use gripgen_twin::TactileImage;

/// A folder of two measured pulls, one with images.
fn measured() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let table = "pull_id,part,grip_force_n,operator,max_pull_force_n\na,gear,20,ann,6.5\nb,gear,30,,9.25\n";
    std::fs::write(folder.path().join("pulls.csv"), table).unwrap();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    for (jaw, level) in [("left", 7), ("right", 9)] {
        let image = TactileImage { width_px: 4, height_px: 2, rgb: vec![level; 24] };
        let path = folder.path().join(format!("images/a_{jaw}.png"));
        std::fs::write(path, encode_png(&image).unwrap()).unwrap();
    }
    folder
}

#[test]
fn measured_pulls_are_rows_like_samples() {
    let folder = measured();
    let found = Dataset::open(folder.path()).unwrap();
    assert_eq!(found.table().rows(), 2);
    assert_eq!(found.table().numbers("max_pull_force_n").unwrap(), [6.5, 9.25]);
    assert_eq!(found.table().words("operator").unwrap(), ["ann", ""]);
    let mut out = vec![0; 48];
    found.images_with(0, NoiseMode::Stored, &mut out).unwrap();
    assert!(out[..24].iter().all(|&v| v == 7) && out[24..].iter().all(|&v| v == 9));
    let mut images = |row| found.images_with(row, NoiseMode::Stored, &mut out).unwrap_err();
    assert!(images(1).to_string().contains("row 1 has no images"));
    assert!(images(2).to_string().contains("no row 2, it has 2"));
}

#[test]
fn a_folder_of_something_else_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let e = Dataset::open(folder.path()).err().unwrap().to_string();
    assert!(e.contains(&folder.path().display().to_string()) && e.contains("run.json"), "{e}");
}
