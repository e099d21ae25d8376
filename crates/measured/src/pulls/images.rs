//! Tactile images beside a table of pulls: `images/<pull_id>_left.png`, `_right.png`, and without contact `_rest.png`.

use gripgen_record::{PictureFileError, decode_picture as decode};
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder of the images.
const IMAGES_FOLDER: &str = "images";

/// The images of a pull.
#[derive(Debug, Clone, PartialEq)]
pub struct PullImages {
    /// While the part was gripped.
    pub grip: PerJaw<TactileImage>,
    /// Before: `<pull_id>_rest_left.png` and `_rest_right.png`, or `<pull_id>_rest.png` for both jaws.
    pub rest: PerJaw<Option<TactileImage>>,
}

/// Ids of the pulls that have the images of both jaws, sorted; none where there is no such folder.
///
/// # Errors
///
/// A folder that cannot be read.
pub fn pulls_with_images(folder: &Path) -> Result<BTreeSet<String>, PictureFileError> {
    let path = folder.join(IMAGES_FOLDER);
    let at = |e: std::io::Error| PictureFileError { path: path.clone(), problem: e.to_string() };
    if !path.is_dir() {
        return Ok(BTreeSet::new());
    }
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(&path).map_err(at)? {
        names.insert(entry.map_err(at)?.file_name().to_string_lossy().into_owned());
    }
    let ids = names.iter().filter_map(|name| name.strip_suffix("_left.png"));
    Ok(ids.filter(|id| names.contains(&format!("{id}_right.png"))).map(String::from).collect())
}

/// Reads the images of a pull.
///
/// # Errors
///
/// Images that are missing for one jaw, or cannot be read.
pub fn read_pull_images(folder: &Path, id: &str) -> Result<PullImages, PictureFileError> {
    let path = |kind: &str| folder.join(IMAGES_FOLDER).join(format!("{id}_{kind}.png"));
    let read = |path: PathBuf| {
        let bytes = std::fs::read(&path).map_err(|e| e.to_string());
        bytes
            .and_then(|b| decode(&b).map_err(|e| e.to_string()))
            .map_err(|problem| PictureFileError { path, problem })
    };
    let grip = PerJaw::try_from_fn(|jaw| read(path(&jaw.to_string())))?;
    let rest = PerJaw::try_from_fn(|jaw: Jaw| {
        let files = [path(&format!("rest_{jaw}")), path("rest")];
        files.into_iter().find(|p| p.is_file()).map(read).transpose()
    })?;
    Ok(PullImages { grip, rest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_record::encode_png;

    #[test]
    fn pulls_with_both_images_are_found_and_read() {
        let folder = tempfile::tempdir().unwrap();
        assert!(pulls_with_images(folder.path()).unwrap().is_empty());
        let images = folder.path().join(IMAGES_FOLDER);
        std::fs::create_dir(&images).unwrap();
        let grey = |level: u8| TactileImage { width_px: 3, height_px: 2, rgb: vec![level; 18] };
        let files = [("a_left", 1), ("a_right", 2), ("a_rest", 3), ("a_rest_right", 4), ("b_left", 5)];
        for (name, level) in files {
            std::fs::write(images.join(format!("{name}.png")), encode_png(&grey(level)).unwrap()).unwrap();
        }
        assert_eq!(pulls_with_images(folder.path()).unwrap().into_iter().collect::<Vec<_>>(), ["a"]);
        let found = read_pull_images(folder.path(), "a").unwrap();
        assert_eq!((found.grip.left, found.grip.right), (grey(1), grey(2)));
        assert_eq!((found.rest.left, found.rest.right), (Some(grey(3)), Some(grey(4))));
        std::fs::write(images.join("a_right.png"), b"no picture").unwrap();
        let e = read_pull_images(folder.path(), "a").unwrap_err();
        assert!(e.to_string().contains("a_right.png"), "{e}");
    }
}
