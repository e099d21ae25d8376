//! A rig of its own for each injection, and a pull on it.

use super::injection::{HEAVY_KG, Injection, Kind, Moment};
use super::watch::{Progress, Watch};
use gripgen_rig::camera::CameraView;
use gripgen_rig::experiment::pull::ExecutedPull;
use gripgen_rig::experiment::{Devices, Experiment, RigConfig, RigEvent};
use gripgen_rig::program::TcpPose;
use gripgen_rig::rtde::{Kind as Frame, encode_frame};
use gripgen_rig_sim::faults::{Device, Fault};
use gripgen_rig_sim::server::{RigAddresses, ServeOptions, ServedRig};
use gripgen_rig_sim::spring::Spring;
use gripgen_twin::config::Document;
use gripgen_twin::{Campaign, PlannedPull};
use std::io::Write;
use std::net::TcpStream;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How many times faster than real time.
const RATE: f64 = 20.0;
/// Longest wait for a moment to come.
const COMES: Duration = Duration::from_secs(120);
/// The pull has to be over by then, whatever happens.
const OVER: Duration = Duration::from_secs(180);
/// After this the arm has to stand: five seconds, and the patience of 3 of what the host times. In seconds of a rig in real time, but
/// counted by the rig's clock, which is slow where the machine is.
pub const LONGEST_S: f64 = 20.0;
/// So long it is looked at whether it stays so.
const STAYS: Duration = Duration::from_millis(300);
/// How long a person leans on the tool, by the rig's clock.
const TOUCH_S: f64 = 0.3;
/// How long a stuck experiment hangs: the rig waits a second for it.
const HANGS: Duration = Duration::from_millis(2500);

/// What came of an injection.
pub struct Made {
    /// The pull; nothing where its thread died.
    pub pull: Option<ExecutedPull>,
    /// The moment came before the pull was over.
    pub came: bool,
    /// Where the pull was when the fault was there: later than asked for on a machine that is busy.
    pub moment: Option<Moment>,
    /// Time from the injection to the return of the call, as that of [`LONGEST_S`].
    pub returned_s: f64,
    /// Time from the injection until the arm stood for good.
    pub stood_s: Option<f64>,
    /// Whether it stayed so.
    pub stayed: bool,
    /// Whether the jaws held at the injection, and at the end.
    pub held: (bool, bool),
    /// What is wrong with the way the jaws let go.
    pub let_go: Option<String>,
    /// A second pull after the fault is gone, where there can be one.
    pub again: Option<Result<ExecutedPull, String>>,
}

pub fn config(at: RigAddresses) -> RigConfig {
    let text = format!(
        "[robot]\naddress = \"127.0.0.1\"\nrtde_port = {}\ndashboard_port = {}\nprimary_port = {}\npayload_kg = 1.6\n\
         centre_of_gravity_mm = [0, 0, 80]\ntool_mm = [0, 0, 200]\n\
         [gripper]\naddress = \"127.0.0.1\"\nport = {}\n\
         [cameras.left]\naddress = \"127.0.0.1\"\nport = {}\nsize_px = [16, 8]\n\
         [cameras.right]\naddress = \"127.0.0.1\"\nport = {}\nsize_px = [16, 8]\n\
         [limits]\nrobot_silence_s = 0.5\npatience = 3.0\n[images]\nframe_s = 1.0\n\
         [poses.part]\nbase_from_tool = [0.45, 0.0, 0.25, 0, 0, 0]\n",
        at.rtde.port(),
        at.dashboard.port(),
        at.primary.port(),
        at.gripper.port(),
        at.camera_left.port(),
        at.camera_right.port(),
    );
    RigConfig::read(&Document::parse("rig.toml", &text).unwrap()).unwrap()
}

fn campaign() -> Campaign {
    let pull = PlannedPull {
        part: "part".into(),
        grip_force_n: 20.0,
        step_time_s: 0.2,
        dwell_s: 3.0,
        ..PlannedPull::default()
    };
    Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: vec![pull] }
}

/// Connects and pulls. `emit` sees what happens, `over` is called when the pull is over.
fn pull(
    config: &RigConfig,
    stop: &AtomicBool,
    emit: &mut dyn FnMut(RigEvent),
    over: impl FnOnce(),
) -> Result<ExecutedPull, String> {
    let devices = Devices::connect(config).map_err(|e| e.to_string())?;
    let mut experiment = Experiment::new(config, devices, stop, emit);
    experiment.begin().map_err(|e| e.to_string())?;
    let campaign = campaign();
    let pull = experiment.pull(&campaign, &campaign.pulls[0]);
    over();
    if pull.stopped.is_none() {
        experiment.close();
    }
    Ok(pull)
}

fn serve() -> ServedRig {
    let options = ServeOptions {
        addresses: RigAddresses::any_ports(),
        clock_rate: RATE,
        in_step: true,
        tcp: TcpPose { position_m: [0.4, 0.1, 0.4], rotation_rad: [0.0; 3] },
        view: CameraView { rotate_deg: 90, mirror: false, crop_px: None, size_px: [16, 8] },
    };
    ServedRig::start(Arc::new(Spring::default()), &options).unwrap()
}

/// A pull that loses a device for good when this step begins.
pub fn pull_and_lose(device: Device, step: &str) -> ExecutedPull {
    let rig = serve();
    let mut emit = |event| {
        if matches!(event, RigEvent::Step(now) if now == step) {
            rig.inject(Fault::Refuse(device));
            rig.inject(Fault::Drop(device));
        }
    };
    pull(&config(rig.addresses()), &AtomicBool::new(false), &mut emit, || ()).unwrap()
}

/// Makes an injection.
pub fn make(injection: &Injection) -> Made {
    let rig = serve();
    let config = config(rig.addresses());
    let progress = Progress::until(injection.moment);
    let (stop, dies, hangs) = (AtomicBool::new(false), AtomicBool::new(false), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let experiment = scope.spawn(|| {
            let mut emit = |event| {
                progress.take(&event);
                if dies.load(Ordering::SeqCst) {
                    // As a panic, without its words.
                    resume_unwind(Box::new("the host dies"));
                }
                if hangs.swap(false, Ordering::SeqCst) {
                    std::thread::sleep(HANGS);
                }
            };
            pull(&config, &stop, &mut emit, || progress.wait_for_fault()).unwrap()
        });
        let mut watch = Watch::new(&rig, &progress);
        let mut came = watch.until_moment(injection.moment, COMES, || experiment.is_finished());
        // By the rig's clock: the experiment goes no further than this moment before the fault is there.
        let due_s = rig.status().timestamp_s + RATE * 1e-3 * injection.delay_ms as f64;
        let is_due = |rig: &ServedRig| rig.status().timestamp_s >= due_s || progress.waits();
        came &=
            watch.until(COMES, |w| is_due(w.rig) || experiment.is_finished()) && !experiment.is_finished();
        let injected_s = rig.status().timestamp_s;
        let since_s = || (rig.status().timestamp_s - injected_s) / RATE;
        let moment = watch.moment();
        // Jaws that are about to open may do so.
        let held = watch.holds() && !progress.releases();
        let mut slow = None;
        match injection.kind {
            Kind::Rig(fault) => rig.inject(fault),
            Kind::SlowReader => slow = Some(slow_reader(&rig)),
            Kind::Interrupt => stop.store(true, Ordering::SeqCst),
            Kind::Death => dies.store(true, Ordering::SeqCst),
            Kind::Stuck => hangs.store(true, Ordering::SeqCst),
            Kind::Touch => {
                rig.inject(Fault::Hang(HEAVY_KG));
                progress.fault_is_there();
                let over_s = rig.status().timestamp_s + TOUCH_S;
                watch.until(COMES, |w| w.rig.status().timestamp_s >= over_s || experiment.is_finished());
                rig.inject(Fault::Hang(0.0));
            }
        }
        progress.fault_is_there();
        let mut stands_since = None;
        let mut follow = |w: &mut Watch| {
            if w.stands() {
                stands_since.get_or_insert_with(since_s);
            } else {
                stands_since = None;
            }
            experiment.is_finished()
        };
        assert!(watch.until(OVER, &mut follow), "the call does not come back");
        let returned_s = since_s();
        watch.until(OVER, |w| w.stands() || since_s() > LONGEST_S);
        let stood_s = watch.stands().then(|| stands_since.unwrap_or_else(since_s));
        let stayed = !watch.until(STAYS, |w| !w.stands());
        let pull = experiment.join().ok();
        let made = Made {
            pull,
            came,
            moment,
            returned_s,
            stood_s,
            stayed,
            held: (held, watch.holds()),
            let_go: watch.let_go.take(),
            again: again(injection, &rig, &config),
        };
        drop(slow);
        made
    })
}

/// The same again when the fault is gone, where it goes without a person.
fn again(injection: &Injection, rig: &ServedRig, config: &RigConfig) -> Option<Result<ExecutedPull, String>> {
    match injection.kind {
        // What weighed on the tool when the sensor was zeroed is missing afterwards: a person has to look at it.
        Kind::Rig(Fault::Hang(_)) | Kind::Touch if injection.moment == Moment::Zeroing => return None,
        Kind::Rig(Fault::Hang(_)) => rig.inject(Fault::Hang(0.0)),
        Kind::Rig(Fault::Refuse(device)) => rig.inject(Fault::Accept(device)),
        Kind::Rig(Fault::Freeze(jaw)) => rig.inject(Fault::Thaw(jaw)),
        Kind::Rig(Fault::Drop(_) | Fault::PartLost)
        | Kind::Interrupt
        | Kind::Death
        | Kind::Stuck
        | Kind::Touch => {}
        _ => return None,
    }
    Some(pull(config, &AtomicBool::new(false), &mut |_| (), || ()))
}

/// Asks for much and reads nothing.
fn slow_reader(rig: &ServedRig) -> TcpStream {
    let mut stream = TcpStream::connect(rig.addresses().rtde).unwrap();
    let names = [&500.0_f64.to_be_bytes()[..], "actual_q,".repeat(20).as_bytes()].concat();
    stream.write_all(&[0, 5, b'V', 0, 2]).unwrap();
    stream.write_all(&encode_frame(Frame::SetUpOutputs, &names).unwrap()).unwrap();
    stream.write_all(&encode_frame(Frame::Start, &[]).unwrap()).unwrap();
    stream
}
