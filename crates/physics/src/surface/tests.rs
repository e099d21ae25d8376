use super::*;
use gripgen_twin::frames::pose;
use gripgen_twin::random::{Purpose, Stream};
use nalgebra::Rotation3;

/// Two crossing plates: one low and wide, one high and 1 mm wide, 8 mm beside the middle.
fn step() -> Surface {
    let p = Point3::new;
    let vertices = vec![
        p(-0.02, -0.02, 0.003),
        p(0.02, -0.02, 0.003),
        p(0.02, 0.02, 0.003),
        p(-0.02, 0.02, 0.003),
        p(0.008, -0.02, 0.001),
        p(0.009, -0.02, 0.001),
        p(0.009, 0.02, 0.001),
        p(0.008, 0.02, 0.001),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    Surface::new(Arc::new(TriMesh::new(vertices, triangles).unwrap()))
}

const WINDOW: Window = Window { half_width_m: 5e-3, half_height_m: 4e-3 };

/// What lies beside the window does not count; what reaches into it does, to the edge.
#[test]
fn only_what_lies_in_front_of_the_window_counts() {
    let at = |x: f64| step().height_m(&pose(&Rotation3::identity(), Vector3::new(x, 0.0, 0.0)), WINDOW);
    assert_eq!(at(0.0), Some(-0.003));
    assert_eq!(at(-2.9e-3), Some(-0.003), "the high plate begins 5.1 mm beside the middle");
    assert_eq!(at(-3.1e-3), Some(-0.001), "the high plate begins 4.9 mm beside the middle");
    assert_eq!(at(0.03), None, "nothing lies in front");
}

/// Against every triangle of a rough surface, sampled densely: no sample in the window is higher, some are nearly as high.
#[test]
fn the_height_is_that_of_the_highest_point_in_the_window() {
    let mut stream = Stream::new(1, 0, Purpose::Draw);
    let mut number = |scale: f64| (stream.uniform() - 0.5) * scale;
    for _ in 0..50 {
        let vertices: Vec<Point3<f64>> =
            (0..60).map(|_| Point3::new(number(0.03), number(0.03), number(0.02))).collect();
        let triangles: Vec<[u32; 3]> = (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let placed = pose(
            &gripgen_twin::frames::rotation_from_fixed_xyz([number(6.0), number(6.0), number(6.0)]),
            Vector3::zeros(),
        );
        let mut sampled = f64::NEG_INFINITY;
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t).map(|p| placed * p);
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let p = a + (b - a) * (f64::from(i) / 200.0) + (c - a) * (f64::from(j) / 200.0);
                    if p.x.abs() <= WINDOW.half_width_m && p.y.abs() <= WINDOW.half_height_m {
                        sampled = sampled.max(-p.z);
                    }
                }
            }
        }
        let exact = Surface::new(Arc::new(mesh)).height_m(&placed, WINDOW).unwrap_or(f64::NEG_INFINITY);
        assert!(exact >= sampled - 1e-12, "{exact} is lower than the sample {sampled}");
        assert!(exact <= sampled + 4e-4 || sampled == f64::NEG_INFINITY, "{exact} is higher than {sampled}");
    }
}

#[test]
fn a_line_has_a_first_and_a_last_hit() {
    let surface = step();
    let (first, last) = surface.ends_of_line(Point3::new(8.5e-3, 1e-3, 0.01), Vector3::z()).unwrap();
    assert!((first.at_m + 9e-3).abs() < 1e-15 && (last.at_m + 7e-3).abs() < 1e-15, "{first:?} {last:?}");
    assert!(first.normal.z.abs() == 1.0);
    assert!(surface.ends_of_line(Point3::new(0.03, 0.0, 0.0), Vector3::z()).is_none());
}
