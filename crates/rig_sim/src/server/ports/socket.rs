//! Connections of each kind, and what they share.

use super::super::RigAddresses;
use super::super::ServeError;
use super::super::messages::version_message;
use crate::arm::STEP_S;
use crate::dashboard;
use crate::faults::Device;
use crate::mjpeg::{
    CameraRequest, HttpRequest, bad_request, encode_jpeg, not_found, snapshot, stream_header, stream_part,
    with_comment,
};
use crate::rtde::RtdeServer;
use crate::script::ScriptReader;
use crate::wire::{DeviceFaults, Outbox, listen, read_on, spawn_writer};
use crate::world::World;
use gripgen_rig::camera::CameraView;
use gripgen_rig::link::lock;
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Frames of a camera per second.
const FRAMES_HZ: f64 = 60.0;
/// A clock that runs faster does not make the cameras faster than this.
const SHORTEST_FRAME: Duration = Duration::from_millis(5);
/// Quality of the R1.5's frames.
const JPEG_QUALITY: u8 = 100;
/// Longest line of a text port.
const MAX_LINE: usize = 1024;

/// What all threads of a rig share.
pub(crate) struct Shared {
    pub(crate) world: Mutex<World>,
    pub(crate) stop: Arc<AtomicBool>,
    pub(crate) rate: f64,
    view: CameraView,
    faults: [Arc<DeviceFaults>; Device::ALL.len()],
    rtde: Mutex<Vec<Arc<RtdeConnection>>>,
    listeners: Mutex<Vec<Arc<Outbox>>>,
    gripper: Mutex<Option<Arc<Outbox>>>,
    connections: AtomicU64,
    cameras: PerJaw<Mutex<Camera>>,
    images: Mutex<(PerJaw<Arc<TactileImage>>, u64)>,
    time_us: AtomicU64,
}

struct RtdeConnection {
    session: Mutex<RtdeServer>,
    outbox: Arc<Outbox>,
}

/// The newest frame of a camera, encoded once for all that look.
#[derive(Default)]
struct Camera {
    jpeg: Arc<Vec<u8>>,
    /// As it was sent last, and how many were sent.
    sent: Arc<Vec<u8>>,
    frames: u64,
    version: u64,
    frozen_s: Option<f64>,
    /// Its picture stays, its stamps go on.
    repeats: bool,
}

/// Data frames of one connection, sent together.
pub(crate) struct Batch {
    connection: Arc<RtdeConnection>,
    bytes: Vec<u8>,
}

impl Batch {
    /// Adds the data frame of this control step, if one is due.
    pub(crate) fn add(&mut self, world: &World) {
        let frame = lock(&self.connection.session).data(world.step_number(), &world.controller);
        self.bytes.extend(frame.unwrap_or_default());
    }

    pub(crate) fn send(self) {
        self.connection.outbox.push(self.bytes);
    }
}

impl Shared {
    pub(crate) fn new(world: World, rate: f64, view: CameraView) -> Self {
        let images = world.images().0.clone();
        Self {
            world: Mutex::new(world),
            stop: Arc::new(AtomicBool::new(false)),
            rate,
            view,
            faults: Default::default(),
            rtde: Mutex::default(),
            listeners: Mutex::default(),
            gripper: Mutex::default(),
            connections: AtomicU64::new(0),
            cameras: PerJaw { left: Mutex::default(), right: Mutex::default() },
            images: Mutex::new((images, 1)),
            time_us: AtomicU64::new(0),
        }
    }

    pub(crate) fn faults(&self, device: Device) -> &Arc<DeviceFaults> {
        let at = Device::ALL.iter().position(|(d, _)| *d == device).unwrap_or(0);
        &self.faults[at]
    }

    pub(crate) fn close(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    pub(crate) fn freeze(&self, jaw: Jaw, frozen: bool) {
        let now_s = self.time_s();
        let mut camera = lock(&self.cameras[jaw]);
        (camera.frozen_s, camera.repeats) = (frozen.then_some(now_s), false);
    }

    pub(crate) fn repeat(&self, jaw: Jaw) {
        lock(&self.cameras[jaw]).repeats = true;
    }

    fn time_s(&self) -> f64 {
        self.time_us.load(Ordering::SeqCst) as f64 * 1e-6
    }

    /// What the cameras see after a number of control steps.
    pub(crate) fn look(&self, world: &World) {
        self.time_us.store((world.step_number() as f64 * STEP_S * 1e6) as u64, Ordering::SeqCst);
        let (images, changed) = world.images();
        let mut seen = lock(&self.images);
        if seen.1 != changed {
            *seen = (images.clone(), changed);
        }
    }

    pub(crate) fn batches(&self) -> Vec<Batch> {
        let mut connections = lock(&self.rtde);
        connections.retain(|c| !c.outbox.is_closed());
        connections.iter().map(|c| Batch { connection: c.clone(), bytes: Vec::new() }).collect()
    }

    pub(crate) fn send_gripper_lines(&self, lines: Vec<String>) {
        if let Some(outbox) = &*lock(&self.gripper) {
            for line in lines {
                outbox.push((line + "\n").into_bytes());
            }
        }
    }

    pub(crate) fn announce(&self, message: &[u8]) {
        let mut listeners = lock(&self.listeners);
        listeners.retain(|outbox| !outbox.is_closed());
        listeners.iter().for_each(|outbox| outbox.push(message.to_vec()));
    }

    /// Opens every port; gives where they are.
    pub(crate) fn open_ports(self: &Arc<Self>, wanted: RigAddresses) -> Result<RigAddresses, ServeError> {
        type Serve = fn(&Shared, TcpStream);
        let open = |what, address: SocketAddr, device, serve: Serve| {
            let (shared, faults) = (self.clone(), self.faults(device).clone());
            listen(address, faults, self.stop.clone(), move |stream| serve(&shared, stream))
                .map_err(|source| ServeError::Port { what, address, source })
        };
        Ok(RigAddresses {
            rtde: open("rtde", wanted.rtde, Device::Rtde, Self::serve_rtde)?,
            dashboard: open("dashboard", wanted.dashboard, Device::Dashboard, Self::serve_dashboard)?,
            primary: open("primary", wanted.primary, Device::Script, Self::serve_messages)?,
            secondary: open("secondary", wanted.secondary, Device::Script, Self::serve_messages)?,
            real_time: open("real_time", wanted.real_time, Device::Script, Self::serve_script)?,
            gripper: open("gripper", wanted.gripper, Device::Gripper, Self::serve_gripper)?,
            camera_left: open("camera_left", wanted.camera_left, Device::CameraLeft, |shared, stream| {
                shared.serve_camera(Jaw::Left, stream);
            })?,
            camera_right: open(
                "camera_right",
                wanted.camera_right,
                Device::CameraRight,
                |shared, stream| {
                    shared.serve_camera(Jaw::Right, stream);
                },
            )?,
        })
    }

    /// A queue for a connection, and the thread that empties it.
    fn outbox(&self, stream: &TcpStream, device: Device) -> Option<Arc<Outbox>> {
        let outbox = Arc::new(Outbox::default());
        let (faults, stop) = (self.faults(device).clone(), self.stop.clone());
        spawn_writer(stream.try_clone().ok()?, outbox.clone(), faults, stop);
        Some(outbox)
    }

    fn serve_rtde(&self, stream: TcpStream) {
        let Some(outbox) = self.outbox(&stream, Device::Rtde) else { return };
        let id = self.connections.fetch_add(1, Ordering::SeqCst);
        let session = Mutex::new(RtdeServer::new(id));
        let connection = Arc::new(RtdeConnection { session, outbox: outbox.clone() });
        lock(&self.rtde).push(connection.clone());
        read_on(stream, &outbox, self.faults(Device::Rtde), &self.stop, |bytes| {
            let mut world = lock(&self.world);
            let World { controller, owners, .. } = &mut *world;
            let answer = lock(&connection.session).receive(bytes, controller, owners);
            // Answers are in the queue before the next control step adds its data.
            match answer {
                Ok(answer) => outbox.push(answer),
                Err(e) => {
                    let text = lock(&connection.session).text(&e.to_string(), "RTDE", 1);
                    outbox.push(text);
                    return false;
                }
            }
            true
        });
        lock(&self.world).owners.release(id);
    }

    fn serve_dashboard(&self, stream: TcpStream) {
        let Some(outbox) = self.outbox(&stream, Device::Dashboard) else { return };
        outbox.push(format!("{}\n", dashboard::greeting()).into_bytes());
        let mut lines = Lines::default();
        read_on(stream, &outbox, self.faults(Device::Dashboard), &self.stop, |bytes| {
            lines.each(bytes, |line| {
                let mut world = lock(&self.world);
                let reply = dashboard::reply(line, &mut world.controller);
                drop(world);
                outbox.push((reply.text + "\n").into_bytes());
                !reply.close
            })
        });
    }

    /// Primary and secondary interface: who the controller is, what it announces, its robot's mode; and they take programs.
    fn serve_messages(&self, stream: TcpStream) {
        let Some(outbox) = self.outbox(&stream, Device::Script) else { return };
        outbox.push(version_message());
        lock(&self.listeners).push(outbox.clone());
        self.take_programs(stream, &outbox);
    }

    /// Real-time interface: it takes programs and sends nothing.
    fn serve_script(&self, stream: TcpStream) {
        let Some(outbox) = self.outbox(&stream, Device::Script) else { return };
        self.take_programs(stream, &outbox);
    }

    fn take_programs(&self, stream: TcpStream, outbox: &Outbox) {
        let mut reader = ScriptReader::default();
        read_on(stream, outbox, self.faults(Device::Script), &self.stop, |bytes| {
            let Ok(programs) = reader.receive(bytes) else { return false };
            for program in programs {
                lock(&self.world).controller.run_script(&program);
            }
            true
        });
    }

    /// The gripper has one connection; a second one is closed.
    fn serve_gripper(&self, stream: TcpStream) {
        let Some(outbox) = self.outbox(&stream, Device::Gripper) else { return };
        if !self.take_gripper(&outbox) {
            return outbox.close();
        }
        lock(&self.world).gripper.connected();
        let mut lines = Lines::default();
        read_on(stream, &outbox, self.faults(Device::Gripper), &self.stop, |bytes| {
            lines.each(bytes, |line| {
                let mut world = lock(&self.world);
                let now_s = world.time_s();
                let replies = world.gripper.line(now_s, line);
                let goodbye = world.gripper.said_goodbye();
                // Who reads the answer to a goodbye finds the connection closing: the next client is not turned away.
                let piece = |reply: String| (reply + "\n").into_bytes();
                let last = if goodbye { replies.len().saturating_sub(1) } else { usize::MAX };
                for (i, reply) in replies.into_iter().enumerate() {
                    if i == last { outbox.push_last(piece(reply)) } else { outbox.push(piece(reply)) }
                }
                !goodbye
            })
        });
        lock(&self.world).gripper.disconnected();
        *lock(&self.gripper) = None;
    }

    /// Takes the gripper for a connection, if nobody has it. Whoever had it and is gone still tells it so: that would end the
    /// session of the next one.
    fn take_gripper(&self, outbox: &Arc<Outbox>) -> bool {
        loop {
            let mut place = lock(&self.gripper);
            match &*place {
                None => {
                    *place = Some(outbox.clone());
                    return true;
                }
                Some(other) if !other.is_closed() => return false,
                Some(_) => {
                    drop(place);
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
    }

    fn serve_camera(&self, jaw: Jaw, stream: TcpStream) {
        let device = if jaw == Jaw::Left { Device::CameraLeft } else { Device::CameraRight };
        let Some(outbox) = self.outbox(&stream, device) else { return };
        let mut request = HttpRequest::default();
        let mut streams = false;
        let (begin, begun) = channel::<()>();
        std::thread::scope(|scope| {
            let queue = &outbox;
            scope.spawn(move || {
                if begun.recv().is_ok() {
                    self.stream_frames(jaw, queue);
                }
            });
            read_on(stream, &outbox, self.faults(device), &self.stop, |bytes| {
                // What a client says after its request goes nowhere; that it goes away ends the stream.
                if streams {
                    return true;
                }
                match request.receive(bytes) {
                    None => return true,
                    Some(CameraRequest::Stream) => {
                        streams = true;
                        let _ = begin.send(());
                        return true;
                    }
                    Some(CameraRequest::Snapshot) => {
                        let (jpeg, time_s) = self.frame(jaw);
                        outbox.push(snapshot(&jpeg, time_s));
                    }
                    Some(CameraRequest::NotFound) => outbox.push(not_found()),
                    Some(CameraRequest::Bad) => outbox.push(bad_request()),
                }
                false
            });
            drop(begin);
        });
    }

    fn stream_frames(&self, jaw: Jaw, outbox: &Outbox) {
        outbox.push(stream_header());
        let period = Duration::from_secs_f64(1.0 / FRAMES_HZ / self.rate).max(SHORTEST_FRAME);
        while !self.stop.load(Ordering::SeqCst) && !outbox.is_closed() {
            let (jpeg, time_s) = self.frame(jaw);
            outbox.push(stream_part(&jpeg, time_s));
            std::thread::sleep(period);
        }
    }

    /// The newest frame, and the camera's clock when it was taken.
    fn frame(&self, jaw: Jaw) -> (Arc<Vec<u8>>, f64) {
        let (image, version) = {
            let images = lock(&self.images);
            (images.0[jaw].clone(), images.1)
        };
        let mut camera = lock(&self.cameras[jaw]);
        if camera.version != version && (camera.frozen_s.is_none() && !camera.repeats || camera.version == 0)
        {
            // An image that cannot be a frame is shown as none.
            let jpeg = self.view.unapply(&image).ok().and_then(|i| encode_jpeg(&i, JPEG_QUALITY).ok());
            (camera.jpeg, camera.version) = (Arc::new(jpeg.unwrap_or_default()), version);
        }
        if camera.frozen_s.is_none() && !camera.repeats || camera.sent.is_empty() {
            camera.frames += 1;
            camera.sent = Arc::new(with_comment(&camera.jpeg, &format!("frame {}", camera.frames)));
        }
        (camera.sent.clone(), camera.frozen_s.unwrap_or_else(|| self.time_s()))
    }
}

/// Lines of a text port.
#[derive(Default)]
struct Lines {
    bytes: Vec<u8>,
}

impl Lines {
    /// Gives whole lines until `take` has enough, or one is too long.
    fn each(&mut self, bytes: &[u8], mut take: impl FnMut(&str) -> bool) -> bool {
        self.bytes.extend_from_slice(bytes);
        while let Some(end) = self.bytes.iter().position(|b| *b == b'\n') {
            let line: Vec<u8> = self.bytes.drain(..=end).collect();
            if !take(String::from_utf8_lossy(&line).trim_end()) {
                return false;
            }
        }
        self.bytes.len() <= MAX_LINE
    }
}
