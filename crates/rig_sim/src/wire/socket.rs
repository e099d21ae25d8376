//! One connection: a queue with an end, a thread that empties it, a loop that reads.

use gripgen_rig::link::lock;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two looks at whether the rig is still wanted.
const LOOK: Duration = Duration::from_millis(50);
/// A client that leaves so much unread is cut off: it must not fill the memory, and nobody waits for it.
const MAX_UNREAD: usize = 8 << 20;

/// What faults do to the connections of a device.
#[derive(Default)]
pub(crate) struct DeviceFaults {
    state: Mutex<FaultState>,
}

#[derive(Default)]
struct FaultState {
    /// Connections made before the last drop are closed.
    generation: u64,
    silent_until: Option<Instant>,
    truncate: bool,
    garble: bool,
    refuse: bool,
}

impl DeviceFaults {
    pub(crate) fn drop_connections(&self) {
        lock(&self.state).generation += 1;
    }

    pub(crate) fn delay(&self, seconds: f64) {
        // What is no time is none.
        let wait = Duration::try_from_secs_f64(seconds).unwrap_or_default();
        lock(&self.state).silent_until = Instant::now().checked_add(wait);
    }

    pub(crate) fn truncate(&self) {
        lock(&self.state).truncate = true;
    }

    pub(crate) fn garble(&self) {
        lock(&self.state).garble = true;
    }

    pub(crate) fn refuse(&self, refuse: bool) {
        let mut state = lock(&self.state);
        state.refuse = refuse;
        state.generation += u64::from(refuse);
    }

    pub(crate) fn refuses(&self) -> bool {
        lock(&self.state).refuse
    }

    fn generation(&self) -> u64 {
        lock(&self.state).generation
    }

    /// How long nothing is sent from now on.
    fn silence(&self) -> Option<Duration> {
        let until = lock(&self.state).silent_until?;
        until.checked_duration_since(Instant::now()).filter(|wait| !wait.is_zero())
    }

    /// What becomes of bytes that leave by a connection of this generation: `None` closes the connection after them.
    fn spoil(&self, bytes: &mut Vec<u8>, generation: u64, stop: &AtomicBool) -> Option<()> {
        while let Some(wait) = self.silence() {
            // A rig that is not wanted any more does not wait for an hour of silence.
            if stop.load(Ordering::SeqCst) {
                return None;
            }
            std::thread::sleep(wait.min(LOOK));
        }
        let mut state = lock(&self.state);
        // A connection that was cut sends nothing more, however long its reader needs to see that.
        if state.generation != generation {
            bytes.clear();
            return None;
        }
        if std::mem::take(&mut state.garble) {
            bytes.iter_mut().step_by(3).for_each(|byte| *byte ^= 0x5a);
        }
        if std::mem::take(&mut state.truncate) {
            bytes.truncate(bytes.len() / 2);
            state.generation += 1;
            return None;
        }
        Some(())
    }
}

/// What waits to be sent.
#[derive(Default)]
pub(crate) struct Outbox {
    queue: Mutex<Queue>,
    ready: Condvar,
}

#[derive(Default)]
struct Queue {
    pieces: VecDeque<Vec<u8>>,
    bytes: usize,
    closed: bool,
}

impl Outbox {
    /// Adds a piece, which goes out in one write. A full queue closes the connection.
    pub(crate) fn push(&self, piece: Vec<u8>) {
        if piece.is_empty() {
            return;
        }
        let mut queue = lock(&self.queue);
        queue.bytes += piece.len();
        queue.closed |= queue.bytes > MAX_UNREAD;
        queue.pieces.push_back(piece);
        drop(queue);
        self.ready.notify_one();
    }

    /// Adds the last piece: whoever gets it finds the queue closed.
    pub(crate) fn push_last(&self, piece: Vec<u8>) {
        let mut queue = lock(&self.queue);
        queue.bytes += piece.len();
        queue.pieces.push_back(piece);
        queue.closed = true;
        drop(queue);
        self.ready.notify_one();
    }

    /// Sends what waits and closes the connection.
    pub(crate) fn close(&self) {
        lock(&self.queue).closed = true;
        self.ready.notify_one();
    }

    pub(crate) fn is_closed(&self) -> bool {
        lock(&self.queue).closed
    }

    fn overflows(&self) -> bool {
        lock(&self.queue).bytes > MAX_UNREAD
    }

    fn next(&self) -> Option<Vec<u8>> {
        let mut queue = lock(&self.queue);
        loop {
            if queue.bytes > MAX_UNREAD {
                return None;
            }
            if let Some(piece) = queue.pieces.pop_front() {
                queue.bytes -= piece.len();
                return Some(piece);
            }
            if queue.closed {
                return None;
            }
            queue = self.ready.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Empties an outbox into a connection, in a thread of its own.
pub(crate) fn spawn_writer(
    mut stream: TcpStream,
    outbox: Arc<Outbox>,
    faults: Arc<DeviceFaults>,
    stop: Arc<AtomicBool>,
) {
    let generation = faults.generation();
    std::thread::spawn(move || {
        while let Some(mut piece) = outbox.next() {
            let last = faults.spoil(&mut piece, generation, &stop).is_none();
            if stream.write_all(&piece).is_err() || last {
                break;
            }
        }
        outbox.close();
        let _ = stream.shutdown(Shutdown::Both);
    });
}

/// Reads a connection until it ends, its outbox is closed, a fault drops it, or the rig is not wanted any more.
pub(crate) fn read_on(
    mut stream: TcpStream,
    outbox: &Outbox,
    faults: &DeviceFaults,
    stop: &AtomicBool,
    mut take: impl FnMut(&[u8]) -> bool,
) {
    let generation = faults.generation();
    let mut buffer = [0; 16_384];
    let _ = stream.set_read_timeout(Some(LOOK));
    while !stop.load(Ordering::SeqCst) && !outbox.is_closed() && faults.generation() == generation {
        match stream.read(&mut buffer) {
            Ok(0) => break,
            Ok(n) => {
                if !take(&buffer[..n]) {
                    break;
                }
            }
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) => {}
            Err(_) => break,
        }
    }
    // What an orderly end still has to say goes out first; a fault, or a client that does not read, gets nothing more. A rig that
    // is not wanted any more waits for nobody to read.
    let cut = faults.generation() != generation || outbox.overflows() || stop.load(Ordering::SeqCst);
    outbox.close();
    if cut {
        let _ = stream.shutdown(Shutdown::Both);
    }
}

/// Listens and hands each connection to a thread of its own.
pub(crate) fn listen(
    address: SocketAddr,
    faults: Arc<DeviceFaults>,
    stop: Arc<AtomicBool>,
    serve: impl Fn(TcpStream) + Send + Sync + 'static,
) -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    let bound = listener.local_addr()?;
    let serve = Arc::new(serve);
    std::thread::spawn(move || {
        while !stop.load(Ordering::SeqCst) {
            match listener.accept() {
                // Closed at once: the client sees a connection that ends before it began.
                Ok((stream, _)) if faults.refuses() => drop(stream),
                Ok((stream, _)) => {
                    let set = stream.set_nonblocking(false).and_then(|()| stream.set_nodelay(true));
                    let serve = serve.clone();
                    if set.is_ok() {
                        std::thread::spawn(move || serve(stream));
                    }
                }
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    });
    Ok(bound)
}
