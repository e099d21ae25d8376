//! A measured pull in full: images before and in the grip, their difference, pull curve.

use super::canvas::MARGIN;
use super::canvas::{Canvas, Rgb};
use super::layout::{HEADER, IMAGE, ROW, fit, frame, framed, sample_sheet};
use gripgen_record::{Film, Record};
use gripgen_twin::{Jaw, PerJaw, TactileImage};

/// Difference of a pixel in grey levels to what is drawn of it: a press changes few levels.
const GAIN: i32 = 2;
/// Drawn where nothing changed.
const MIDDLE: i32 = 128;

/// A PNG of a measured pull: a row per jaw, then the curve.
pub(super) fn rig_picture(
    record: &Record,
    rest: Option<&PerJaw<TactileImage>>,
    film: Option<&Film>,
) -> Vec<u8> {
    sample_sheet(record, film, (3, 2), |canvas| {
        for (row, jaw) in (0..).zip(Jaw::BOTH) {
            let (grip, rest) = (record.images.as_ref().map(|i| &i[jaw]), rest.map(|i| &i[jaw]));
            draw_jaw(canvas, HEADER + row * ROW, jaw, grip, rest);
        }
    })
}

fn draw_jaw(
    canvas: &mut Canvas,
    top: u32,
    jaw: Jaw,
    grip: Option<&TactileImage>,
    rest: Option<&TactileImage>,
) {
    let place = |i: u32| (MARGIN + i * (IMAGE.0 + MARGIN), top);
    for (i, what, image) in [(0, "before the grip", rest), (1, "gripped", grip)] {
        match image {
            Some(image) => framed(canvas, place(i), &format!("{jaw} jaw, {what}"), image),
            None => frame(canvas, place(i), &format!("{jaw} jaw, {what}: no image")),
        }
    }
    let size = |image: &TactileImage| (image.width_px, image.height_px);
    match grip.zip(rest).filter(|(grip, rest)| size(grip) == size(rest)) {
        Some((grip, rest)) => {
            frame(canvas, place(2), &format!("{jaw} jaw, difference x {GAIN} (grey: none)"));
            fit(canvas, place(2), size(grip), |u, v| difference(grip.pixel(u, v), rest.pixel(u, v)));
        }
        None => frame(canvas, place(2), &format!("{jaw} jaw: no difference without two images of one size")),
    }
}

/// What is drawn of the change of a pixel.
fn difference(grip: [u8; 3], rest: [u8; 3]) -> Rgb {
    let of = |c: usize| (MIDDLE + GAIN * (i32::from(grip[c]) - i32::from(rest[c]))).clamp(0, 255) as u8;
    Rgb(of(0), of(1), of(2))
}

#[cfg(test)]
mod tests {
    use super::super::canvas::CAPTION;
    use super::*;
    use gripgen_record::decode_picture;
    use gripgen_record::proto::gripgen_v1::{Sample, Status};

    fn plain(level: u8) -> TactileImage {
        TactileImage { width_px: 4, height_px: 3, rgb: vec![level; 36] }
    }

    /// The middle of each of the six images holds what its place says.
    #[test]
    fn rest_grip_and_difference_stand_side_by_side() {
        let mut sample = Sample { part: "gear".into(), max_pull_force_n: Some(7.0), ..Sample::default() };
        sample.set_status(Status::Slipped);
        let images = Some(PerJaw { left: plain(90), right: plain(220) });
        let rest = PerJaw { left: plain(60), right: plain(80) };
        let record = Record { sample, images, trace: None };
        let found = decode_picture(&rig_picture(&record, Some(&rest), None)).unwrap();
        let middle = |column: u32, row: u32| {
            let x = MARGIN + column * (IMAGE.0 + MARGIN) + IMAGE.0 / 2;
            found.pixel(x, HEADER + row * ROW + CAPTION + IMAGE.1 / 2)
        };
        let grey = |level: u8| [level; 3];
        assert_eq!([0, 1, 2].map(|i| middle(i, 0)), [grey(60), grey(90), grey(128 + 60)]);
        assert_eq!([0, 1, 2].map(|i| middle(i, 1)), [grey(80), grey(220), grey(255)], "it ends at white");
        // Without the images before the grip there is an empty frame, and no difference.
        let found = decode_picture(&rig_picture(&record, None, None)).unwrap();
        let x = MARGIN + 2 * (IMAGE.0 + MARGIN) + IMAGE.0 / 2;
        let panel = found.pixel(x, HEADER + CAPTION + IMAGE.1 / 2);
        assert_eq!(panel, found.pixel(MARGIN + IMAGE.0 / 2, HEADER + CAPTION + IMAGE.1 / 2));
    }
}
