//! The beginning and the end of a rig: whom it lets in, and that it leaves nothing behind.

use super::{TIMEOUT, options, serve};
use gripgen_rig::rtde::{Kind, encode_frame};
use gripgen_rig_sim::faults::{Device, Fault};
use gripgen_rig_sim::server::{RigAddresses, ServeError, ServedRig};
use gripgen_rig_sim::spring::Spring;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

fn refused(of: impl FnOnce(&mut gripgen_rig_sim::server::ServeOptions)) -> ServeError {
    let mut options = options(1.0);
    of(&mut options);
    ServedRig::start(Arc::new(Spring::default()), &options).err().unwrap()
}

#[test]
fn no_other_machine_reaches_the_rig() {
    for outside in ["0.0.0.0:0", "192.0.2.7:0", "[::]:0", "[::ffff:127.0.0.1]:0"] {
        let e = refused(|o| o.addresses.camera_right = outside.parse().unwrap());
        assert!(matches!(e, ServeError::NotLoopback { what: "camera_right", .. }), "{outside}: {e}");
    }
    let e = refused(|o| o.addresses.rtde = "10.0.0.1:30004".parse().unwrap());
    assert_eq!(
        e.to_string(),
        "rtde: 10.0.0.1:30004 is not on loopback; the virtual rig is for this machine alone"
    );
}

#[test]
fn what_cannot_be_served_is_refused_with_its_numbers() {
    for rate in [0.0, -1.0, 201.0, f64::NAN] {
        assert!(matches!(refused(|o| o.clock_rate = rate), ServeError::Rate { .. }), "{rate}");
    }
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let e = refused(|o| o.addresses.gripper = address);
    assert!(
        matches!(e, ServeError::Port { what: "gripper", .. }) && e.to_string().contains(&address.to_string())
    );
}

fn ports(at: RigAddresses) -> [SocketAddr; 8] {
    [
        at.rtde,
        at.dashboard,
        at.primary,
        at.secondary,
        at.real_time,
        at.gripper,
        at.camera_left,
        at.camera_right,
    ]
}

/// Threads of this test: on Linux a thread without a name has that of the one that began it.
fn own_threads() -> Option<usize> {
    let own = std::fs::read_to_string("/proc/thread-self/comm").ok()?;
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
    Some(names.filter(|name| *name == own).count())
}

#[test]
fn a_rig_that_is_dropped_leaves_no_thread_and_no_port() {
    let plant = Arc::new(Spring::default());
    // A list of threads that others leave while it is read may lack one: this thread counts itself.
    let before = (0..100).map(|_| own_threads()).find(|n| *n != Some(0)).flatten();
    let rig = ServedRig::start(plant.clone(), &options(5.0)).unwrap();
    let at = rig.addresses();
    // One device is silent for an hour, one client reads nothing of what it is sent, the others wait.
    rig.inject(Fault::Delay(Device::Dashboard, 3600.0));
    let mut mute = TcpStream::connect(at.rtde).unwrap();
    let names = [&500.0_f64.to_be_bytes()[..], "actual_q,".repeat(227).as_bytes()].concat();
    mute.write_all(&[0, 5, b'V', 0, 2]).unwrap();
    mute.write_all(&encode_frame(Kind::SetUpOutputs, &names).unwrap()).unwrap();
    mute.write_all(&encode_frame(Kind::Start, &[]).unwrap()).unwrap();
    let clients = ports(at).map(|address| TcpStream::connect(address).unwrap());
    for mut camera in &clients[6..] {
        camera.write_all(b"GET /?action=stream HTTP/1.0\r\n\r\n").unwrap();
    }
    // Listeners, clock and worker, and two threads for each connection.
    let started = Instant::now();
    while own_threads().is_some_and(|now| now < before.unwrap_or(0) + 10 + 18) {
        assert!(started.elapsed() < TIMEOUT, "{:?} threads", own_threads());
        std::thread::sleep(Duration::from_millis(10));
    }

    drop(rig);
    let gone = || {
        let free = ports(at).iter().all(|address| TcpListener::bind(address).is_ok());
        free && Arc::strong_count(&plant) == 1 && own_threads() == before
    };
    while !gone() {
        let (left, threads) = (Arc::strong_count(&plant), own_threads());
        assert!(started.elapsed() < TIMEOUT, "{left} of the plant, {threads:?} of {before:?} threads");
        std::thread::sleep(Duration::from_millis(10));
    }
    for mut client in clients {
        client.set_read_timeout(Some(TIMEOUT)).unwrap();
        let end = client.read_to_end(&mut Vec::new());
        let reset = |e: std::io::Error| e.kind() == std::io::ErrorKind::ConnectionReset;
        assert!(end.map_or_else(reset, |_| true), "every client sees the end");
    }
}

/// Another rig comes after it, on the same ports.
#[test]
fn the_ports_are_free_for_the_next_rig() {
    let rig = serve(1.0);
    let mut again = options(1.0);
    again.addresses = rig.addresses();
    drop(rig);
    let until = Instant::now() + TIMEOUT;
    let plant = Arc::new(Spring::default());
    while let Err(e) = ServedRig::start(plant.clone(), &again) {
        assert!(Instant::now() < until, "{e}");
        std::thread::sleep(Duration::from_millis(10));
    }
}
