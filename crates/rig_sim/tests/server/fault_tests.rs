//! Faults of the wire, on every device: what a client sees, and that the next one is served.

use super::{TIMEOUT, serve};
use gripgen_rig_sim::faults::{Device, Fault};
use gripgen_rig_sim::server::ServedRig;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Where a device is, what it is asked, and the first piece of what it says, which is always the same.
struct Talk {
    address: SocketAddr,
    ask: &'static [u8],
    says: Vec<u8>,
}

fn talk(rig: &ServedRig, device: Device) -> Talk {
    let at = rig.addresses();
    let (address, ask): (_, &[u8]) = match device {
        Device::Rtde => (at.rtde, &[0, 5, b'V', 0, 2]),
        Device::Dashboard => (at.dashboard, b""),
        Device::Script => (at.primary, b""),
        Device::Gripper => (at.gripper, b"POS?\n"),
        Device::CameraLeft => (at.camera_left, b"GET /nothing HTTP/1.0\r\n\r\n"),
        Device::CameraRight => (at.camera_right, b"GET /nothing HTTP/1.0\r\n\r\n"),
    };
    let mut talk = Talk { address, ask, says: Vec::new() };
    // What it says undisturbed, until it is silent.
    let mut stream = talk.connect();
    let mut buffer = [0; 4096];
    while let Ok(n) = stream.read(&mut buffer) {
        stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
        talk.says.extend(&buffer[..n]);
        if n == 0 || device == Device::Script {
            break;
        }
    }
    if device == Device::Script {
        // The version; then it never is silent.
        talk.says.truncate(usize::from(talk.says[3]));
    }
    // No fault is meant for this connection.
    let _ = stream.shutdown(Shutdown::Write);
    while stream.read(&mut buffer).is_ok_and(|n| n > 0) {}
    assert!(talk.says.len() >= 4, "{} says nothing", device.name());
    talk
}

impl Talk {
    fn connect(&self) -> TcpStream {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        // It may be closed by now.
        let _ = stream.write_all(self.ask);
        stream
    }

    /// As many bytes as it should say.
    fn answer(&self, mut stream: &TcpStream) -> Vec<u8> {
        let mut bytes = vec![0; self.says.len()];
        stream.read_exact(&mut bytes).unwrap();
        bytes
    }

    /// What comes before the end, which has to come.
    fn until_closed(&self, mut stream: &TcpStream) -> Vec<u8> {
        let mut bytes = Vec::new();
        if let Err(e) = stream.read_to_end(&mut bytes) {
            // What the client had sent was not read any more.
            assert_eq!(e.kind(), std::io::ErrorKind::ConnectionReset);
        }
        bytes
    }

    /// The next connection, once the device has noticed that the one before is gone.
    fn is_served(&self, what: &str) {
        let until = Instant::now() + TIMEOUT;
        loop {
            let mut stream = self.connect();
            let mut bytes = vec![0; self.says.len()];
            if stream.read_exact(&mut bytes).is_ok() {
                return assert_eq!(bytes, self.says, "{what}");
            }
            assert!(Instant::now() < until, "{what}: the next connection is not served");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn disturbed(disturb: fn(&ServedRig, Device, &Talk)) {
    let rig = serve(1.0);
    for device in ServedRig::devices() {
        let talk = talk(&rig, device);
        disturb(&rig, device, &talk);
        talk.is_served(device.name());
    }
}

#[test]
fn dropped_connections_are_closed() {
    disturbed(|rig, device, talk| {
        let stream = TcpStream::connect(talk.address).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        std::thread::sleep(Duration::from_millis(100));
        rig.inject(Fault::Drop(device));
        let came = talk.until_closed(&stream);
        let (came, says) = (&came[..came.len().min(talk.says.len())], &talk.says);
        assert!(says.starts_with(came), "{}: what was said before is whole", device.name());
    });
}

#[test]
fn a_device_that_refuses_takes_nobody_until_it_accepts() {
    disturbed(|rig, device, talk| {
        rig.inject(Fault::Refuse(device));
        for _ in 0..2 {
            assert!(talk.until_closed(&talk.connect()).is_empty(), "{}", device.name());
        }
        rig.inject(Fault::Accept(device));
    });
}

#[test]
fn a_truncated_piece_is_half_and_the_last() {
    disturbed(|rig, device, talk| {
        rig.inject(Fault::Truncate(device));
        let came = talk.until_closed(&talk.connect());
        assert_eq!(came, talk.says[..talk.says.len() / 2], "{}", device.name());
    });
}

#[test]
fn a_garbled_piece_has_damaged_bytes_and_only_one() {
    disturbed(|rig, device, talk| {
        rig.inject(Fault::Garble(device));
        let stream = talk.connect();
        let came = talk.answer(&stream);
        let damaged = (0..came.len()).filter(|i| came[*i] != talk.says[*i]).count();
        assert_eq!(damaged, came.len().div_ceil(3), "{}: {came:?}", device.name());
    });
}

#[test]
fn a_delayed_device_says_everything_later() {
    disturbed(|rig, device, talk| {
        let started = Instant::now();
        rig.inject(Fault::Delay(device, 0.4));
        let stream = talk.connect();
        assert_eq!(talk.answer(&stream), talk.says, "{}", device.name());
        assert!(
            started.elapsed() >= Duration::from_millis(390),
            "{}: {:?}",
            device.name(),
            started.elapsed()
        );
    });
}

#[test]
fn a_delay_that_is_no_time_is_none() {
    disturbed(|rig, device, talk| {
        for seconds in [-1.0, f64::NAN, f64::INFINITY, 0.0] {
            rig.inject(Fault::Delay(device, seconds));
            assert_eq!(talk.answer(&talk.connect()), talk.says);
            std::thread::sleep(Duration::from_millis(60));
        }
    });
}
