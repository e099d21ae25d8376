//! `--live`: a page that shows a campaign or a sweep while it is under way, to this machine alone.

use super::rig_served::Served;
use super::{QUICKSTART, SMALL, gripgen};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Head and body of an answer.
fn asked(port: u16, request: &str, host: &str) -> Option<(String, Vec<u8>)> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    write!(stream, "{request} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").ok()?;
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).ok()?;
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n")?;
    Some((String::from_utf8_lossy(&bytes[..end]).into(), bytes[end + 4..].to_vec()))
}

fn get(port: u16, path: &str) -> Option<(String, Vec<u8>)> {
    asked(port, &format!("GET {path}"), &format!("127.0.0.1:{port}"))
}

fn state(port: u16) -> Option<serde_json::Value> {
    let (head, body) = get(port, "/state")?;
    // What comes between the page's last answer and its closed port is dropped by the HTTP library with a 500 of its own.
    if head.starts_with("HTTP/1.1 500") && body.is_empty() {
        return None;
    }
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    serde_json::from_slice(&body).ok()
}

fn port_of(line: &str) -> u16 {
    line.rsplit(':').next().unwrap().trim_end_matches('/').parse().unwrap()
}

/// Width and height of a PNG.
fn size_px(png: &[u8]) -> [u32; 2] {
    assert_eq!(&png[1..4], b"PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()))
}

/// Both gels, the curve of the pull under way and the label of the pull before it; nothing for strangers.
#[test]
fn a_campaign_is_watched() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Served::start(&["--speed", "2"]);
    let mut pulling = rig.pull(&folder.path().join("run"), 2, &["--live"]);
    pulling.until(&["live: http://127.0.0.1:"]);
    let port = port_of(pulling.said.lines().find(|line| line.starts_with("live: ")).unwrap());
    let (mut curve, mut gels, mut labels) = (0, None, 0);
    let began = Instant::now();
    while let Some(state) = state(port) {
        assert!(began.elapsed() < Duration::from_secs(600), "{state}");
        assert_eq!((state["unit"].as_str(), state["total"].as_u64()), (Some("pulls"), Some(2)));
        curve = curve.max(state["curve"]["measured_n"].as_array().unwrap().len());
        labels = labels.max(state["labels"].as_array().unwrap().len());
        if state["pictures"] != serde_json::json!([0, 0]) && gels.is_none() {
            gels = ["/left.png", "/right.png"]
                .map(|path| get(port, path))
                .into_iter()
                .collect::<Option<Vec<_>>>();
            let (head, _) = asked(port, "GET /state", "rebound.example").unwrap();
            assert!(head.starts_with("HTTP/1.1 403"), "{head}");
            let (head, _) = asked(port, "POST /state", &format!("127.0.0.1:{port}")).unwrap();
            assert!(head.starts_with("HTTP/1.1 405"), "{head}");
            let (_, page) = get(port, "/").unwrap();
            let page = String::from_utf8(page).unwrap();
            assert!(!page.contains("https://"), "the page asks other machines");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(pulling.ends(), 0, "{}", pulling.said);
    assert!(curve > 100, "{curve} readings were shown");
    // The last label is said when the page is about to end.
    assert!((1..=2).contains(&labels), "{labels} labels were shown");
    let gels = gels.expect("no gel was seen");
    // Turned as samples are, whatever the camera sends.
    assert!(gels.iter().all(|(_, png)| size_px(png) == [320, 240]));
    assert_ne!(gels[0].1, gels[1].1);
    // What was shown is also there afterwards: both cameras from the grip to the stop, in the order of their clocks.
    let run = gripgen::record::Dataset::open(&folder.path().join("run")).unwrap();
    for row in 0..2 {
        let film = run.film(row).unwrap().expect("the pull was filmed");
        let times: Vec<f64> = film.frames.iter().map(|both| both.left.time_s).collect();
        assert!(film.frames.len() > 10 && times.is_sorted() && times[0] < 0.0, "{times:?}");
        assert!(times.iter().any(|time_s| *time_s > 1.0), "{times:?}");
        let sizes = film.frames.iter().map(|both| [both.left.image.width_px, both.right.image.height_px]);
        assert!(sizes.into_iter().all(|size| size == [320, 240]));
        for jaw in gripgen::twin::Jaw::BOTH {
            let clock = film.frames.iter().map(|both| both[jaw].camera.unwrap().device_time_s.unwrap());
            assert!(clock.collect::<Vec<_>>().windows(2).all(|t| t[0] < t[1]), "a frame came twice");
        }
    }
}

/// Counts and labels of all samples, and an image once a shard is done.
#[test]
fn a_sweep_is_watched() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = gripgen();
    command.args([
        "sweep",
        QUICKSTART,
        "-o",
        folder.path().join("run").to_str().unwrap(),
        "--live",
        "--jobs",
        "1",
    ]);
    let mut process = command.args(SMALL).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(process.stderr.take().unwrap()).lines().map_while(Result::ok);
    let port = port_of(&lines.find(|line| line.starts_with("live: ")).unwrap());
    let silent = std::thread::spawn(move || lines.count());
    let (mut last, mut image) = (serde_json::Value::Null, None);
    while let Some(state) = state(port) {
        if state["pictures"][0] != 0 && image.is_none() {
            image = get(port, "/left.png");
        }
        last = state;
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(process.wait().unwrap().success());
    silent.join().unwrap();
    assert_eq!(last["total"], 24);
    assert!(last["labels"].as_array().unwrap().len() > 12, "{last}");
    assert_eq!(image.map(|(_, png)| size_px(&png)), Some([320, 240]));
    // A port that something else has is said before anything is made.
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let flag = format!("--live={}", taken.local_addr().unwrap().port());
    let other = folder.path().join("other");
    let output = super::run(&["sweep", QUICKSTART, "-o", other.to_str().unwrap(), &flag]);
    super::assert_code(&output, 2);
    assert!(!other.exists());
}
