//! Films of pulls: what they show is what the mechanics say, and they leave everything else as it is.

use crate::common::{assert_same, jobs, load, project, run, small_project};
use gripgen::record::{ShardReader, export_sample, verify};
use gripgen::tactile::SimdLevel;
use gripgen::twin::{FilmFrame, Outcome, PerJaw, Pulled, SlipState};
use gripgen::{Film, Project, generate, generate_filmed};

/// A pull without noise, filmed.
fn filmed(sets: &[&str]) -> (Project, Box<Pulled>, Film) {
    let quiet = [
        "twin=asset:configs/twin-baseline.toml",
        "images={storage=\"clean\", during_pull={frames=12}}",
        "vary.part=[\"roller_bearing\"]",
        "vary.grip_offset_mm=[0]",
        "vary.grip_pose=[0]",
        "vary.grip_angle_deg=[0]",
        "vary.grip_force_n=[30]",
        "wrist.noise_n=0",
        "parts.roller_bearing.scatter=0",
    ];
    let p = project("asset:configs/quickstart.toml", &[&quiet[..], sets].concat());
    let (sample, film) = generate_filmed(&p, 0, SimdLevel::best());
    let Outcome::Pulled(pulled) = sample.outcome else { panic!("{:?}", sample.outcome) };
    (p, pulled, film.unwrap())
}

fn frames(film: &Film) -> Vec<PerJaw<FilmFrame>> {
    (0..film.len()).map(|i| film.frame(i).unwrap()).collect()
}

fn force_n(both: &PerJaw<FilmFrame>) -> f64 {
    both.iter().flat_map(|(_, f)| &f.cells).map(|c| c.force_n).sum()
}

/// Whether a cell has pixels that lie beside no contact.
fn at_the_rim(frame: &FilmFrame, cell: usize) -> bool {
    let (w, h) = (frame.image.width_px as usize, frame.image.height_px as usize);
    let at = |x: usize, y: usize| frame.cell_of_px[y * w + x];
    (1..h - 1).any(|y| {
        (1..w - 1).any(|x| {
            let around = [at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)];
            usize::from(at(x, y)) == cell + 1 && around.contains(&0)
        })
    })
}

/// Hold: the gripper moves by force over stiffness, and so is every cell sheared. Then slip begins at the rim (Mindlin), and at the
/// label all of the contact slips.
#[test]
fn slip_runs_from_the_rim_inwards() {
    let (p, pulled, film) = filmed(&["mechanics=reduced"]);
    let all = frames(&film);
    assert_eq!(all.len(), 12);
    let stiffness = p.twin.gel.left.shear_stiffness_n_per_m + p.twin.gel.right.shear_stiffness_n_per_m;
    let (first, whole) = (film.incipient_slip_s.unwrap(), film.whole_slip_s.unwrap());
    // Those of the label come from the forces alone, these from every cell.
    assert_eq!((pulled.slip_onset_s, pulled.slip_s), (Some(first), Some(whole)));
    assert!(0.0 < first && first < whole && whole <= pulled.label.slip_time_s, "{first} {whole}");
    let (mut held, mut slipping, mut slid) = (0, 0, 0);
    for both in &all {
        let (time_s, carried_n) = (both.left.time_s, both.left.contact_force_n);
        assert!((force_n(both) - carried_n).abs() <= 1e-9 * carried_n.max(1.0), "{time_s} s");
        let cells = both.iter().flat_map(|(_, f)| &f.cells).collect::<Vec<_>>();
        if time_s < first {
            held += 1;
            let way_m = carried_n / stiffness;
            assert!((both.left.displacement_m - way_m).abs() <= 1e-9 * way_m.max(1e-6), "{time_s} s");
            assert!(cells.iter().all(|c| (c.shear_m - way_m).abs() <= 1e-9 * way_m.max(1e-6)));
            assert!(cells.iter().all(|c| !c.slipped && c.slip_m == 0.0));
            assert_eq!(both.left.state(), Some(SlipState::Stick));
        } else if time_s < whole {
            slipping += 1;
            assert!(cells.iter().any(|c| c.slipped) && cells.iter().any(|c| !c.slipped));
            // What a cell has slipped and what it is sheared are the way of the gripper.
            let way_m = both.left.displacement_m;
            assert!(cells.iter().all(|c| (c.shear_m + c.slip_m - way_m).abs() < 1e-9));
        } else {
            slid += 1;
            assert!(cells.iter().all(|c| c.slipped), "{time_s} s");
            assert_eq!(both.right.state(), Some(SlipState::Slip));
        }
        if time_s >= pulled.label.slip_time_s {
            assert!(cells.iter().all(|c| c.slipped), "the label is {} s", pulled.label.slip_time_s);
        }
    }
    assert!(held > 0 && slipping > 1 && slid > 2, "{held} {slipping} {slid}");
    // The first frame with slip: whoever slips lies at the rim, and somebody in the middle holds.
    let early = all.iter().find(|both| both.left.state() == Some(SlipState::Incipient)).unwrap();
    let least = early.left.cells.iter().enumerate().max_by(|a, b| a.1.slip_m.total_cmp(&b.1.slip_m)).unwrap();
    assert!(at_the_rim(&early.left, least.0), "the first cell to slip");
    assert!((0..early.left.cells.len()).any(|i| !at_the_rim(&early.left, i) && !early.left.cells[i].slipped));
}

/// The first frame is the grip, bit for bit; later ones show the part where the gripper has left it.
#[test]
fn the_first_frame_is_the_grip() {
    let (p, pulled, film) = filmed(&["mechanics=reduced"]);
    let images = pulled.images.unwrap();
    let (first, last) = (film.frame(0).unwrap(), film.frame(film.len() - 1).unwrap());
    let metres_per_px = p.library.sensor(&p.twin.optics.left).unwrap().grid.metres_per_px;
    for (jaw, frame) in first.iter() {
        assert!(frame.image == images[jaw], "{jaw}");
        assert!(frame.cells.iter().all(|c| c.shear_m == 0.0 && !c.slipped));
        // Upwards in both images.
        assert!((frame.pull_px[0]).abs() < 1e-12 && (frame.pull_px[1] + 1.0).abs() < 1e-12);
        let middle = |f: &FilmFrame| {
            let w = f.image.width_px as usize;
            let rows = f.cell_of_px.iter().enumerate().filter(|(_, c)| **c > 0).map(|(i, _)| (i / w) as f64);
            let (n, sum) = rows.fold((0.0, 0.0), |(n, sum), row| (n + 1.0, sum + row));
            sum / n
        };
        // Where the contact is not cut off by the frame: down by the way of the gripper.
        let way_px = film.frame(4).unwrap()[jaw].displacement_m / metres_per_px;
        let seen_px = middle(&film.frame(4).unwrap()[jaw]) - middle(frame);
        assert!((seen_px - way_px).abs() < 1.0, "{jaw}: {seen_px} of {way_px} pixels");
        assert!(last[jaw].image != frame.image);
        for (depth, cell) in frame.depth_um.iter().zip(&frame.cell_of_px) {
            assert!(*depth == 0 || *cell > 0);
        }
    }
}

/// In the engine the cells carry what its contact does, and all of them slip where it does.
#[test]
fn cells_of_the_engine_carry_its_force() {
    let (_, pulled, film) = filmed(&["mechanics=rapier", "robot.model=carriage"]);
    for both in frames(&film) {
        let (time_s, carried_n) = (both.left.time_s, both.left.contact_force_n);
        if time_s < film.whole_slip_s.unwrap() {
            assert!((force_n(&both) - carried_n).abs() <= 1e-6 * carried_n.abs().max(1.0), "{time_s} s");
        }
        if time_s >= pulled.label.slip_time_s {
            assert_eq!(
                (both.left.state(), both.right.state()),
                (Some(SlipState::Slip), Some(SlipState::Slip))
            );
        }
    }
    assert!(film.incipient_slip_s.unwrap() < pulled.label.slip_time_s);
}

/// A run with films has the samples of one without, the same bytes for any number of threads, and reads back.
#[test]
fn films_are_stored_beside_what_there_is() {
    let sets = ["mechanics=reduced", "vary.part=[\"gear\"]", "vary.grip_force_n=[20, 25]"];
    let film = "images={storage=\"clean\", during_pull={frames=4}}";
    let plain = small_project(&[&sets[..], &["images=clean"]].concat());
    let filmed = small_project(&[&sets[..], &[film]].concat());
    let [without, one, two] = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
    run(&plain, without.path(), jobs(2));
    run(&filmed, one.path(), jobs(1));
    run(&filmed, two.path(), jobs(2));
    assert_same(one.path(), two.path(), "threads");
    assert!(verify(one.path(), |_| {}).unwrap().faults.is_empty());
    let open =
        |folder: &tempfile::TempDir| ShardReader::open(&folder.path().join("shard-00000.mcap")).unwrap();
    let (reader, before) = (open(&one), open(&without));
    assert!(reader.has_film() && !before.has_film());
    for index in 0..2 {
        assert_eq!(reader.record(index).unwrap(), before.record(index).unwrap());
        assert_eq!(before.film(index).unwrap(), None);
        let read = reader.film(index).unwrap().unwrap();
        let (sample, made) = generate_filmed(&filmed, index, SimdLevel::best());
        assert!(sample == generate(&plain, index, SimdLevel::best()));
        let made = made.unwrap();
        assert_eq!((read.incipient_slip_s, read.whole_slip_s), (made.incipient_slip_s, made.whole_slip_s));
        assert_eq!(read.frames.len(), 4);
        for (read, made) in read.frames.iter().zip(frames(&made)) {
            for (jaw, read) in read.iter() {
                let made = &made[jaw];
                assert!(read.image == made.image && read.cell_of_px == made.cell_of_px);
                assert!(read.depth_um == made.depth_um && read.time_s == made.time_s);
                for (a, b) in read.cells.iter().zip(&made.cells) {
                    assert!((a.slip_m - b.slip_m).abs() < 1e-9 && a.slipped == b.slipped);
                }
            }
        }
    }
    let alone = one.path().join("one.mcap");
    std::fs::write(&alone, export_sample(&reader, 1).unwrap()).unwrap();
    let exported = ShardReader::open(&alone).unwrap();
    assert_eq!(exported.film(1).unwrap(), reader.film(1).unwrap());
}

/// What a film cannot be is one clear error.
#[test]
fn a_film_needs_images_of_the_processor() {
    for (sets, key) in [
        (vec!["images={storage=\"none\", during_pull={frames=4}}"], "images.during_pull"),
        (vec!["images={storage=\"png\", during_pull={frames=4, rate_hz=3}}"], "images.during_pull"),
        (vec!["images={during_pull={frames=1}}"], "images.during_pull.frames"),
        (vec!["images={during_pull={frames=4}}", "backend=gpu"], "images.during_pull"),
        (vec!["images=pgn"], "images"),
        (vec!["images={storage=\"pgn\"}"], "images"),
    ] {
        let error = match load("asset:configs/quickstart.toml", &sets) {
            Err(e) => e.to_string(),
            Ok(_) => panic!("{sets:?}"),
        };
        assert!(error.contains(key), "{sets:?}: {error}");
    }
}
