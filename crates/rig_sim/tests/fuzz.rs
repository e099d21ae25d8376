//! Every parser that reads bytes from a wire, under damaged input: none panics, none holds more memory than it says, and how
//! the bytes are cut into pieces changes nothing.
//!
//! `GRIPGEN_FUZZ_INPUTS` is the number of inputs of each parser. The same number gives the same inputs.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

#[path = "fuzz/endless.rs"]
mod endless;
#[path = "fuzz/held.rs"]
mod held;
#[path = "fuzz/mutate.rs"]
mod mutate;
#[path = "fuzz/rig_file.rs"]
mod rig_file;
#[path = "fuzz/robot.rs"]
mod robot;

use gripgen_rig::camera::{CameraStream, FrameLimits, decode_jpeg};
use gripgen_rig::dashboard::{DashboardCommand, DashboardLink};
use gripgen_rig::gcl::{GclCommand, GclLink, SHIPPED_LIMITS};
use gripgen_rig::primary::PrimaryStream;
use gripgen_rig::program::{MotionProgram, PullProgram, TcpPose};
use gripgen_rig::rtde::{Link, SessionPlan};
use gripgen_rig_sim::faults::Fault;
use gripgen_rig_sim::mjpeg::{HttpRequest, encode_jpeg};
use gripgen_rig_sim::script::ScriptReader;
use gripgen_rig_sim::urscript::Program;
use gripgen_twin::TactileImage;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use mutate::Random;
use std::fmt::Debug;
use std::path::Path;

#[global_allocator]
static MEMORY: held::Counting = held::Counting;

/// Inputs of each parser, where the environment does not say.
const INPUTS: usize = 10_000;

fn inputs() -> usize {
    std::env::var("GRIPGEN_FUZZ_INPUTS").ok().map_or(INPUTS, |n| n.parse().unwrap())
}

/// The most bytes that a parser holds for one input, with all that it gives for it: a part of its own, and so many for each
/// byte of input. A list of events takes more than the lines that it was read from, and a vector that grows is there twice.
#[derive(Clone, Copy)]
struct Holds {
    own: usize,
    per_byte: usize,
}

/// What each parser may hold, by the name of its corpus.
const HOLDS: [(&str, Holds); 13] = [
    // A frame has 64 KiB; the shortest one that is an event, a text of three bytes, becomes 200 bytes.
    ("rtde_link", Holds { own: 3 * 65_536, per_byte: 150 }),
    // The robot and its plant; the three bytes that ask for the version are answered by 19.
    ("rtde_server", Holds { own: 3 * 65_536, per_byte: 120 }),
    // A line of one letter is an event.
    ("gcl_link", Holds { own: 4 * 1024, per_byte: 200 }),
    ("gripper", Holds { own: 4 * 1024, per_byte: 10 }),
    ("camera", Holds { own: 2 * 8 * 1024, per_byte: 100 }),
    ("http_request", Holds { own: 2 * 8 * 1024, per_byte: 20 }),
    // Pixels of the largest frame as the decoder has them and as RGB, and the coefficients of a progressive one.
    ("jpeg", Holds { own: 16 * 512 * 512 + 65_536, per_byte: 8 }),
    ("dashboard_link", Holds { own: 4 * 4096, per_byte: 200 }),
    ("dashboard_reply", Holds { own: 2 * 1024, per_byte: 200 }),
    ("primary", Holds { own: 3 * 65_536, per_byte: 60 }),
    ("script", Holds { own: 1024, per_byte: 120 }),
    // Words and steps of a program, fifty threads with their values, and the robot.
    ("urscript", Holds { own: 512 * 1024, per_byte: 400 }),
    ("fault", Holds { own: 1024, per_byte: 60 }),
];

/// What a parser gave for an input.
#[derive(Debug, PartialEq)]
struct Heard<E, X> {
    events: Vec<E>,
    error: Option<X>,
}

/// Whether two cuts of the same input mean the same. Events before an error are told or not, as the cut falls. What is no
/// number is not equal to itself, but written alike.
fn same<E: Debug + PartialEq, X: Debug + PartialEq>(whole: &Heard<E, X>, cut: &Heard<E, X>) -> bool {
    let as_words = |some: &[E]| format!("{some:?}");
    let alike = |a: &[E], b: &[E]| a == b || as_words(a) == as_words(b);
    if whole.error.is_none() {
        return cut.error.is_none() && alike(&whole.events, &cut.events);
    }
    let errors = whole.error == cut.error || format!("{:?}", whole.error) == format!("{:?}", cut.error);
    errors && cut.events.get(..whole.events.len()).is_some_and(|first| alike(&whole.events, first))
}

/// Files of the corpus. What this crate writes itself is not among them: it is made for the test.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    let Ok(files) = std::fs::read_dir(&folder) else { return Vec::new() };
    let mut paths: Vec<_> = files.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Says which input it was when a parser panics.
struct Input<'a>(&'a str, &'a [u8]);

impl Drop for Input<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let hex: String = self.1.iter().map(|byte| format!("{byte:02x}")).collect();
            eprintln!("{} fails on {hex}\n{:?}", self.0, String::from_utf8_lossy(self.1));
        }
    }
}

/// The corpus and inputs made from it through a parser, whole and in pieces. One in `every` of the usual number is made.
fn fuzz<E, X>(name: &str, every: usize, made: Vec<Vec<u8>>, parse: impl Fn(&[&[u8]]) -> Heard<E, X>)
where
    E: Debug + PartialEq,
    X: Debug + PartialEq,
{
    let corpus = [corpus(name), made].concat();
    let holds = HOLDS.iter().find(|(n, _)| *n == name).unwrap().1;
    let mut random = Random::named(name);
    let (mut most, mut failed) = (0.0_f64, 0);
    let started = std::time::Instant::now();
    let count = corpus.len() + inputs() / every;
    for k in 0..count {
        let input = corpus.get(k).cloned().unwrap_or_else(|| mutate::input(&mut random, &corpus));
        let said = Input(name, &input);
        let (whole, held) = held::peak_held(|| parse(&[&input]));
        let allowed = holds.own + holds.per_byte * input.len();
        assert!(held <= allowed, "{held} bytes are held for {} of input, {allowed} are allowed", input.len());
        most = most.max(held as f64 / allowed as f64);
        failed += usize::from(whole.error.is_some());
        let pieces = mutate::pieces(&mut random, &input);
        let (cut, held) = held::peak_held(|| parse(&pieces));
        assert!(held <= allowed, "{held} bytes are held in pieces, {allowed} are allowed");
        assert!(same(&whole, &cut), "whole {whole:?}\nin pieces {cut:?}");
        drop(said);
    }
    let seconds = started.elapsed().as_secs_f64();
    println!("| {name} | {count} | {seconds:.1} | {failed} | {:.0} % |", 100.0 * most);
    // Inputs that nobody understands test nothing behind the first check, and those that all are understood test no check.
    assert!(failed < count, "every input of {name} is refused");
}

/// Runs `take` over the pieces until it refuses one.
fn each<E, X>(pieces: &[&[u8]], mut take: impl FnMut(&[u8]) -> Result<Vec<E>, X>) -> Heard<E, X> {
    let mut heard = Heard { events: Vec::new(), error: None };
    for piece in pieces {
        match take(piece) {
            Ok(events) => heard.events.extend(events),
            Err(error) => {
                heard.error = Some(error);
                break;
            }
        }
    }
    heard
}

/// Text has no pieces: it is taken as a whole each time.
fn text(pieces: &[&[u8]]) -> String {
    String::from_utf8_lossy(&pieces.concat()).into_owned()
}

#[test]
fn rtde_link() {
    let plan = SessionPlan {
        outputs: vec!["timestamp".into(), "actual_q".into()],
        frequency_hz: 500.0,
        inputs: vec![vec!["input_int_register_24".into()]],
    };
    fuzz("rtde_link", 1, vec![], |pieces| {
        let mut link = Link::new(plan.clone()).unwrap();
        each(pieces, |piece| link.receive(piece))
    });
}

#[test]
fn rtde_server() {
    fuzz("rtde_server", 1, vec![], |pieces| {
        let mut served = robot::Served::new();
        each(pieces, |piece| served.receive(piece))
    });
}

#[test]
fn gcl_link() {
    fuzz("gcl_link", 1, vec![], |pieces| {
        let mut link = GclLink::new(SHIPPED_LIMITS);
        link.send(&GclCommand::Home).unwrap();
        let heard = each(pieces, |piece| link.receive(piece));
        // Whatever came: the way to stop the jaws is open.
        link.send(&GclCommand::FastStop).unwrap();
        heard
    });
}

#[test]
fn gripper() {
    fuzz("gripper", 1, vec![], robot::gripper);
}

#[test]
fn camera() {
    fuzz("camera", 1, vec![], |pieces| {
        let mut camera = CameraStream::default();
        // How many bytes had come when it was too much depends on the cut.
        each(pieces, |piece| camera.receive(piece).map_err(|e| std::mem::discriminant(&e)))
    });
}

#[test]
fn http_request() {
    fuzz("http_request", 1, vec![], |pieces| {
        let mut request = HttpRequest::default();
        // Once it is known what is wanted, nothing more is read.
        let wanted = pieces.iter().find_map(|piece| request.receive(piece));
        Heard::<_, ()> { events: vec![wanted], error: None }
    });
}

#[test]
fn jpeg() {
    let limits = FrameLimits { width_px: 512, height_px: 512 };
    let image = |value: fn(u8) -> u8| TactileImage {
        width_px: 24,
        height_px: 16,
        rgb: (0..128).cycle().map(value).take(1152).collect(),
    };
    let made =
        [image(|x| x), image(|x| x / 2 + 60), image(|_| 0)].map(|image| encode_jpeg(&image, 90).unwrap());
    let mut grey = Vec::new();
    JpegEncoder::new_with_quality(&mut grey, 50).encode(&[7; 64], 8, 8, ExtendedColorType::L8).unwrap();
    fuzz("jpeg", 20, [made.to_vec(), vec![grey]].concat(), |pieces| {
        match decode_jpeg(&pieces.concat(), &limits) {
            Ok(image) => {
                assert_eq!(image.rgb.len(), 3 * image.width_px as usize * image.height_px as usize);
                Heard { events: vec![image], error: None }
            }
            Err(error) => Heard { events: vec![], error: Some(error) },
        }
    });
}

#[test]
fn dashboard_link() {
    fuzz("dashboard_link", 1, vec![], |pieces| {
        let mut link = DashboardLink::default();
        assert!(DashboardCommand::ALL.iter().all(|command| link.send(*command).is_ok()));
        let mut events = Vec::new();
        let heard = each(pieces, |piece| {
            link.push(piece);
            loop {
                match link.next_event() {
                    Ok(Some(event)) => events.push(event),
                    Ok(None) => return Ok(Vec::<()>::new()),
                    Err(e) => return Err(e),
                }
            }
        });
        Heard { events, error: heard.error }
    });
}

#[test]
fn dashboard_reply() {
    fuzz("dashboard_reply", 1, vec![], |pieces| {
        let text = text(pieces);
        let mut controller = robot::controller();
        let read = |line: &str| DashboardCommand::ALL.map(|command| command.reply(line).ok());
        let replies = text.lines().map(|line| {
            let reply = robot::reply(line, &mut controller);
            assert!(!reply.contains(['\n', '\r']), "{reply:?} is more than one line");
            (reply, read(line).iter().flatten().count())
        });
        Heard::<_, ()> { events: replies.collect(), error: None }
    });
}

#[test]
fn primary() {
    fuzz("primary", 1, vec![], |pieces| {
        let mut stream = PrimaryStream::default();
        let mut events = Vec::new();
        let heard = each(pieces, |piece| {
            stream.push(piece);
            loop {
                match stream.next_message() {
                    Ok(Some(event)) => events.push(event),
                    Ok(None) => return Ok(Vec::<()>::new()),
                    Err(e) => return Err(e),
                }
            }
        });
        Heard { events, error: heard.error }
    });
}

#[test]
fn script() {
    fuzz("script", 1, vec![], |pieces| {
        let mut reader = ScriptReader::default();
        each(pieces, |piece| reader.receive(piece))
    });
}

/// Texts of programs, damaged, on a robot whose host beats: whatever they say, a control step ends, and the arm is somewhere.
#[test]
fn urscript() {
    let pull = PullProgram { wait_s: 1.0, ..PullProgram::default() }.script().unwrap();
    let motion = MotionProgram {
        run: 4,
        target: TcpPose { position_m: [0.3, -0.2, 0.25], rotation_rad: [0.0, 3.125, 0.0] },
        speed_mm_s: 100.0,
        abort_force_n: 20.0,
        max_time_s: 20.0,
        payload_kg: 1.6,
        centre_of_gravity_mm: [0.0, 0.0, 80.0],
        tool_mm: [0.0, 0.0, 200.0],
    };
    let whole = [pull, motion.script().unwrap()].map(String::into_bytes).to_vec();
    let programs: Vec<String> =
        [whole.clone(), corpus("urscript")].concat().iter().map(|bytes| text(&[bytes])).collect();
    fuzz("urscript", 8, whole, |pieces| {
        let text = text(pieces);
        // Bytes that are damaged are seldom a program: words and lines of one, put together anew, often are.
        let shuffled = mutate::shuffled(&mut Random::named(&text), &programs);
        let ran = Program::parse(&shuffled).map(|_| robot::run_program(&shuffled)).map_err(|e| e.to_string());
        match Program::parse(&text) {
            Ok(_) => Heard { events: vec![ran, Ok(robot::run_program(&text))], error: None },
            Err(error) => {
                assert!(error.line >= 1 && error.problem.len() < 300 + text.len(), "{error}");
                Heard { events: vec![ran], error: Some(error) }
            }
        }
    });
}

#[test]
fn fault() {
    fuzz("fault", 1, vec![], |pieces| match text(pieces).parse::<Fault>() {
        Ok(fault) => Heard { events: vec![fault], error: None },
        Err(error) => {
            assert!(error.line.chars().count() <= 80);
            Heard { events: vec![], error: Some(error) }
        }
    });
}
