//! Images of measured pulls beside those that a twin expects.

use crate::common::{jobs, overrides, run, small_project, twin_at, twin_with_sets};
use gripgen::record::{Dataset, encode_png};
use gripgen::twin::{Jaw, TactileImage};
use gripgen::{Library, Location};
use gripgen_cli::{ImageComparison, compare_images};
use gripgen_measured::write_pull_folder;
use gripgen_measured::{Suspects, load_pulls_with};
use std::path::Path;

/// The twin that makes the sweeps here.
const TWIN: &str = "asset:configs/twin.toml";

fn compare(folders: &[&Path], sets: &[(&str, &str)]) -> ImageComparison {
    let twin = twin_with_sets(&Location::parse(TWIN), &overrides(sets));
    let library = Library::of_twin(&twin, &Location::parse(TWIN)).unwrap();
    let loaded = load_pulls_with(folders, Suspects::Include).unwrap();
    compare_images(folders, &loaded, Suspects::Include, &twin, &library, 2).unwrap()
}

/// Mean square of the noise of the sensors in [`TWIN`].
fn noise_square() -> f64 {
    let twin = twin_at(&Location::parse(TWIN));
    let library = Library::of_twin(&twin, &Location::parse(TWIN)).unwrap();
    let noise_rgb = library.sensor(&twin.optics[Jaw::Left]).unwrap().noise_rgb;
    noise_rgb.iter().map(|&sd| f64::from(sd).powi(2)).sum::<f64>() / 3.0
}

#[test]
fn the_twin_that_made_images_differs_from_them_by_their_noise() {
    let out = tempfile::tempdir().unwrap();
    run(&small_project(&["mechanics=reduced"]), out.path(), jobs(2));
    let same = compare(&[out.path()], &[]);
    assert!(same.each.len() >= 16 && same.notes.is_empty(), "{} {:?}", same.each.len(), same.notes);
    // Rounding the image to whole levels adds 1/12, and so does rounding what is expected where that is no whole level before: the
    // frame at rest of this sensor file has whole levels, the contacts have not.
    let noise = noise_square();
    assert!(noise > 0.8, "{noise}");
    for image in &same.each {
        let rounding = image.score.mse - noise;
        assert!((1.0 / 12.0 - 0.02..1.0 / 6.0 + 0.02).contains(&rounding), "{image:?} {noise}");
        assert!(image.score.psnr_db > 45.0 && image.score.ssim > 0.97, "{image:?}");
    }
    let by_part = same.by_part();
    assert_eq!(by_part.values().map(|(n, _)| n).sum::<usize>(), same.each.len());
    assert_eq!(by_part.len(), 4);

    // A constant of 5 levels is 25 more, and sensor noise of the twin changes nothing.
    let offset = "[{ name = \"rest_offset\", red = 5, green = 5, blue = 5 }]";
    let shifted = compare(&[out.path()], &[("effects", offset), ("optics.left.image_noise", "off")]);
    let rise = shifted.mean().unwrap().mse - same.mean().unwrap().mse;
    assert!((rise - 25.0).abs() < 0.05, "{rise}");
    // Gains that scatter from grip to grip are 1 on the average.
    let scatter = "[{ name = \"press_gain\", red_sd = 0.1, green_sd = 0.1, blue_sd = 0.1 }]";
    assert_eq!(compare(&[out.path()], &[("effects", scatter)]), same);
}

/// The same images as files, and of one pull images of another size.
#[test]
fn images_beside_a_table_are_compared_like_those_of_a_run() {
    let out = tempfile::tempdir().unwrap();
    run(&small_project(&["mechanics=reduced", "vary.grip_pose=[1]"]), out.path(), jobs(2));
    let of_run = compare(&[out.path()], &[]);
    let folder = tempfile::tempdir().unwrap();
    let pulls = load_pulls_with(&[out.path()], Suspects::Include).unwrap().pulls;
    write_pull_folder(folder.path(), &pulls).unwrap();
    assert_eq!(compare(&[folder.path()], &[]), ImageComparison::default(), "without images");

    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    let rows = Dataset::open(out.path()).unwrap();
    for pull in &pulls.pulls {
        let both = rows.images_png(rows.row_of(&pull.id).unwrap()).unwrap().unwrap();
        for (jaw, png) in Jaw::BOTH.iter().zip(both) {
            std::fs::write(images.join(format!("{}_{jaw}.png", pull.id)), png).unwrap();
        }
    }
    // Nobody wrote down which grip it was: the one that is most alike is found.
    let of_table = compare(&[folder.path()], &[]);
    assert_eq!(of_table.each.len(), of_run.each.len());
    for (a, b) in of_table.each.iter().zip(&of_run.each) {
        assert_eq!((&a.pull, a.jaw), (&b.pull, b.jaw));
        assert!((a.score.mse - b.score.mse).abs() < 1e-3, "{a:?} {b:?}");
    }

    let small = encode_png(&TactileImage { width_px: 8, height_px: 9, rgb: vec![9; 216] }).unwrap();
    let id = &pulls.pulls[0].id;
    for jaw in Jaw::BOTH {
        std::fs::write(images.join(format!("{id}_{jaw}.png")), &small).unwrap();
    }
    let both = compare(&[out.path(), folder.path()], &[]);
    assert_eq!(both.each.len(), 2 * of_run.each.len() - 2);
    let name = folder.path().file_name().unwrap().to_string_lossy().into_owned();
    assert_eq!(both.each.last().unwrap().pull, format!("{name}/{}", pulls.pulls.last().unwrap().id));
    let [note] = &both.notes[..] else { panic!("{:?}", both.notes) };
    assert!(note.contains("images of 1 pulls") && note.contains("320x240 against 8x9"), "{note}");
}
