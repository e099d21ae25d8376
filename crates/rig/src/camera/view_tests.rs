use super::{CameraView, FrameLimits, SHIPPED_FRAME_LIMITS, ViewError, decode_jpeg};
use gripgen_twin::TactileImage;

/// Each pixel tells where it was.
fn frame(width_px: u32, height_px: u32) -> TactileImage {
    let rgb = (0..height_px)
        .flat_map(|y| (0..width_px).flat_map(move |x| [x as u8, y as u8, (x ^ y) as u8]))
        .collect();
    TactileImage { width_px, height_px, rgb }
}

fn view(rotate_deg: u32, mirror: bool, size_px: [u32; 2]) -> CameraView {
    CameraView { rotate_deg, mirror, crop_px: None, size_px }
}

#[test]
fn nothing_to_do_gives_the_same_bytes() {
    let plain = frame(7, 5);
    assert_eq!(view(0, false, [7, 5]).apply(&plain).unwrap(), plain);
    let whole = CameraView { crop_px: Some([0, 0, 7, 5]), ..view(0, false, [7, 5]) };
    assert_eq!(whole.apply(&plain).unwrap(), plain);
}

/// Where the corners go, clockwise; mirrored after the turn.
#[test]
fn turns_are_clockwise_and_the_mirror_comes_after_them() {
    let portrait = frame(3, 4);
    let corners = |image: &TactileImage| {
        let (x, y) = (image.width_px - 1, image.height_px - 1);
        [(0, 0), (x, 0), (x, y), (0, y)].map(|(x, y)| (image.pixel(x, y)[0], image.pixel(x, y)[1]))
    };
    // Columns and rows of the frame, at the corners top left, top right, bottom right, bottom left.
    for (rotate_deg, mirror, size_px, wanted) in [
        (0, true, [3, 4], [(2, 0), (0, 0), (0, 3), (2, 3)]),
        (90, false, [4, 3], [(0, 3), (0, 0), (2, 0), (2, 3)]),
        (180, false, [3, 4], [(2, 3), (0, 3), (0, 0), (2, 0)]),
        (270, false, [4, 3], [(2, 0), (2, 3), (0, 3), (0, 0)]),
        (90, true, [4, 3], [(0, 0), (0, 3), (2, 3), (2, 0)]),
    ] {
        let seen = view(rotate_deg, mirror, size_px).apply(&portrait).unwrap();
        assert_eq!([seen.width_px, seen.height_px], size_px);
        assert_eq!(corners(&seen), wanted, "{rotate_deg} {mirror}");
    }
}

/// The virtual camera sends what the client turns back: 320 x 240 from a frame of 240 x 320.
#[test]
fn unapply_then_apply_is_nothing() {
    for (rotate_deg, mirror) in [0, 90, 180, 270].into_iter().flat_map(|r| [(r, false), (r, true)]) {
        for size_px in [[320, 240], [240, 320], [5, 1], [1, 1]] {
            let image = frame(size_px[0], size_px[1]);
            let view = view(rotate_deg, mirror, size_px);
            let sent = view.unapply(&image).unwrap();
            if rotate_deg % 180 == 90 {
                assert_eq!([sent.height_px, sent.width_px], size_px);
            }
            assert_eq!(view.apply(&sent).unwrap(), image, "{rotate_deg} {mirror}");
        }
    }
}

#[test]
fn a_cut_out_is_that_of_the_turned_frame() {
    let cut = CameraView { crop_px: Some([2, 1, 3, 2]), ..view(0, false, [3, 2]) };
    let seen = cut.apply(&frame(8, 6)).unwrap();
    assert_eq!((seen.pixel(0, 0), seen.pixel(2, 1)), ([2, 1, 3], [4, 2, 6]));
    let turned = CameraView { crop_px: Some([7, 0, 1, 1]), ..view(90, false, [1, 1]) };
    assert_eq!(turned.apply(&frame(6, 8)).unwrap().pixel(0, 0), [0, 0, 0]);
}

#[test]
fn another_size_keeps_means_and_slopes() {
    let flat = TactileImage { width_px: 480, height_px: 640, rgb: vec![77; 480 * 640 * 3] };
    let small = view(90, false, [320, 240]).apply(&flat).unwrap();
    assert!(small.rgb.iter().all(|&b| b == 77) && small.rgb.len() == 320 * 240 * 3);
    // A slope of one grey value per pixel is one of two at half the size, and its middle stays.
    let half = view(0, false, [50, 20]).apply(&frame(100, 40)).unwrap();
    for x in 2..48_u32 {
        assert!((f64::from(half.pixel(x, 10)[0]) - (2.0 * f64::from(x) + 0.5)).abs() <= 0.51, "{x}");
    }
    // What was not seen is not made up, in either direction.
    for size_px in [[200, 80], [101, 40], [100, 41]] {
        let larger = view(0, false, size_px).apply(&frame(100, 40));
        assert_eq!(larger, Err(ViewError::Enlarged { found_px: [100, 40], size_px }));
    }
}

#[test]
fn views_that_a_frame_does_not_have_are_refused_with_their_numbers() {
    let plain = frame(8, 6);
    let error = |view: CameraView, image: &TactileImage| view.apply(image).unwrap_err().to_string();
    assert!(error(view(45, false, [8, 6]), &plain).contains("45 degrees"));
    assert!(error(view(0, false, [0, 6]), &plain).contains("0 x 6 px"));
    assert!(
        error(view(0, false, [8, 5000]), &plain).contains("8 x 5000 px, each side must be from 1 to 4096")
    );
    for crop_px in [[6, 0, 3, 2], [0, 5, 1, 2], [0, 0, 0, 1], [u32::MAX, 0, 1, 1], [1, 0, u32::MAX, 1]] {
        let cut = CameraView { crop_px: Some(crop_px), ..view(0, false, [3, 2]) };
        let text = error(cut, &plain);
        assert!(
            text.contains(&format!("({}, {})", crop_px[0], crop_px[1])) && text.ends_with("8 x 6 px"),
            "{text}"
        );
    }
    let short = TactileImage { width_px: 8, height_px: 6, rgb: vec![0; 100] };
    assert!(error(view(0, false, [8, 6]), &short).contains("100 bytes for an image that needs 144"));
    let back = |view: CameraView| view.unapply(&plain).unwrap_err().to_string();
    assert!(back(CameraView { crop_px: Some([0, 0, 4, 5]), ..view(0, false, [8, 6]) }).contains("4 x 5 px"));
    assert!(back(view(90, false, [6, 8])).contains("8 x 6 px is not of this view, which gives 6 x 8 px"));
    assert!(back(view(360, false, [8, 6])).contains("360 degrees"));
}

/// A JPEG of 8 x 8 pixels of grey 77, bit by bit from ITU-T T.81: quantisation 1, one code `0` in each Huffman table. The
/// only coefficient is 8 (77 - 128) = -408, which takes nine bits: 103.
fn grey_jpeg() -> Vec<u8> {
    let table = |class: u8, symbol: u8| [&[0xff, 0xc4, 0, 20, class, 1][..], &[0; 15], &[symbol]].concat();
    [
        vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0],
        vec![1; 64],
        vec![0xff, 0xc0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0],
        table(0x00, 9),
        table(0x10, 0),
        // 0 for nine bits, 001100111, 0 for the end of the block, and ones.
        vec![0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0b0001_1001, 0b1101_1111, 0xff, 0xd9],
    ]
    .concat()
}

#[test]
fn frames_are_decoded_within_limits() {
    let jpeg = grey_jpeg();
    let image = decode_jpeg(&jpeg, &SHIPPED_FRAME_LIMITS).unwrap();
    assert_eq!((image.width_px, image.height_px), (8, 8));
    assert!(image.rgb == [77; 192]);
    let small = FrameLimits { width_px: 8, height_px: 7 };
    let text = decode_jpeg(&jpeg, &small).unwrap_err().to_string();
    assert_eq!(text, "a frame of 8 x 8 px, at most 8 x 7 px are decoded");
    let error = |bytes: &[u8]| decode_jpeg(bytes, &SHIPPED_FRAME_LIMITS).unwrap_err().to_string();
    assert!(error(b"").contains("0 bytes") && error(b"GIF89a").contains("no start"));
    assert!(error(&jpeg[..jpeg.len() - 1]).contains("no end"));
    assert!(error(b"\xff\xd8\xff\xd9").contains("no JPEG"));
    // Padding after the end is no harm.
    let padded = [jpeg.as_slice(), &[0; 9]].concat();
    assert_eq!(decode_jpeg(&padded, &SHIPPED_FRAME_LIMITS).unwrap(), image);
}
