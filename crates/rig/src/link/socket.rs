//! A socket whose errors name their device, a thread that reads it until its end, and waiting for what that thread finds.

use super::LinkError;
use std::io::{ErrorKind, Read, Write};
use std::marker::PhantomData;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A device that takes no bytes for so long is gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);
/// Time between two looks at a device whose silence is watched.
const LOOK: Duration = Duration::from_millis(50);

/// Something that came, and when it did by the clock of this host. The network's delay is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamped<T> {
    /// When its last byte was read.
    pub at: Instant,
    /// What came.
    pub event: T,
}

/// A socket on which every write leaves at once, and none waits for ever.
pub(crate) struct Socket<E> {
    address: SocketAddr,
    stream: TcpStream,
    /// How an end without an error is told.
    closed: &'static str,
    session_error: PhantomData<fn() -> E>,
}

impl<E> Socket<E> {
    /// Connects within `timeout`; `closed` is what [`LinkError::Closed`] will say.
    pub(crate) fn connect(
        address: SocketAddr,
        timeout: Duration,
        closed: &'static str,
    ) -> Result<Self, LinkError<E>> {
        let connect = || {
            let stream = TcpStream::connect_timeout(&address, timeout)?;
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
            Ok(stream)
        };
        let stream = connect().map_err(|e: std::io::Error| LinkError::Io { address, source: Arc::new(e) })?;
        Ok(Self { address, stream, closed, session_error: PhantomData })
    }

    /// Gives a read so much time from now on.
    pub(crate) fn limit_read(&self, limit: Duration) -> Result<(), LinkError<E>> {
        self.stream.set_read_timeout(Some(limit)).map_err(|e| self.io(e))
    }

    /// Gives the number of bytes read; `None` where nothing came in the time that a read has.
    pub(crate) fn read(&self, buffer: &mut [u8]) -> Result<Option<usize>, LinkError<E>> {
        let pause = |e: &std::io::Error| match e.kind() {
            ErrorKind::Interrupted => true,
            // Where a read may take for ever, this time is up in the network: it gave the device up.
            ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                self.stream.read_timeout().is_ok_and(|limit| limit.is_some())
            }
            _ => false,
        };
        match (&self.stream).read(buffer) {
            Ok(0) => Err(self.closed()),
            Ok(n) => Ok(Some(n)),
            Err(e) if pause(&e) => Ok(None),
            Err(e) => Err(self.io(e)),
        }
    }

    /// Sends all of it at once.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<(), LinkError<E>> {
        (&self.stream).write_all(bytes).map_err(|e| self.io(e))
    }

    /// Closes both ways, and wakes who reads. A connection that is gone already is closed all the same.
    pub(crate) fn cut(&self) {
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    /// What the session does not understand, as the end of this connection.
    pub(crate) fn refused(&self, source: E) -> LinkError<E> {
        LinkError::Session { address: self.address, source }
    }

    /// Nothing came since `heard`.
    pub(crate) fn silent(&self, heard: Instant, limit: Duration) -> LinkError<E> {
        let (silent_s, limit_s) = (heard.elapsed().as_secs_f64(), limit.as_secs_f64());
        LinkError::Silent { address: self.address, silent_s, limit_s }
    }

    /// Nothing answers `awaited`, which is waited for since `started`.
    pub(crate) fn no_answer(&self, awaited: &'static str, started: Instant, limit: Duration) -> LinkError<E> {
        let (waited_s, limit_s) = (started.elapsed().as_secs_f64(), limit.as_secs_f64());
        LinkError::Timeout { address: self.address, awaited, waited_s, limit_s }
    }

    fn io(&self, e: std::io::Error) -> LinkError<E> {
        LinkError::Io { address: self.address, source: Arc::new(e) }
    }

    fn closed(&self) -> LinkError<E> {
        LinkError::Closed { address: self.address, what: self.closed }
    }
}

/// How a connection is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    /// Name of the thread.
    pub(crate) thread: &'static str,
    /// After so long without a byte a device that speaks all the time is gone; others may be silent for ever.
    pub(crate) silence: Option<Duration>,
    /// Whether nothing can be sent any more once reading has ended.
    pub(crate) cut_at_end: bool,
}

/// A connection with the thread that reads it. Dropping it closes the connection and waits for the thread.
pub(crate) struct Connection<T, E> {
    /// For other threads, too: it does not keep the connection open.
    pub(crate) shared: Arc<Shared<T, E>>,
    reader: Option<JoinHandle<()>>,
}

/// What the threads of a connection share.
pub(crate) struct Shared<T, E> {
    /// For writing.
    pub(crate) socket: Socket<E>,
    known: Mutex<Known<T, E>>,
    /// Something was understood, or the end.
    changed: Condvar,
    wanted: AtomicBool,
}

/// What is known of a device.
pub(crate) struct Known<T, E> {
    /// What was understood of it.
    pub(crate) state: T,
    /// Why the connection ended; the first reason stays.
    pub(crate) ended: Option<LinkError<E>>,
}

impl<T: Send + 'static, E: Send + 'static> Connection<T, E> {
    /// Begins to read. `take` is given what came and when; a refusal ends the connection. The end is known before `take` is
    /// dropped: the end of a channel that it owns is a moment later.
    pub(crate) fn start(
        socket: Socket<E>,
        reading: Reading,
        state: T,
        take: impl FnMut(&Shared<T, E>, &[u8], Instant) -> Result<(), E> + Send + 'static,
    ) -> Result<Self, LinkError<E>> {
        if reading.silence.is_some() {
            socket.limit_read(LOOK)?;
        }
        let (known, changed) = (Mutex::new(Known { state, ended: None }), Condvar::new());
        let shared = Arc::new(Shared { socket, known, changed, wanted: AtomicBool::new(true) });
        let own = shared.clone();
        let reader = std::thread::Builder::new().name(reading.thread.into());
        let reader = reader.spawn(move || own.read_on(reading, take)).map_err(|e| shared.socket.io(e))?;
        Ok(Self { shared, reader: Some(reader) })
    }
}

impl<T, E> Drop for Connection<T, E> {
    fn drop(&mut self) {
        self.shared.wanted.store(false, Ordering::SeqCst);
        self.shared.socket.cut();
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

impl<T, E> Shared<T, E> {
    /// What is known now; nobody learns anything while the guard lives.
    pub(crate) fn known(&self) -> MutexGuard<'_, Known<T, E>> {
        lock(&self.known)
    }

    /// Wakes who waits.
    pub(crate) fn notify(&self) {
        self.changed.notify_all();
    }

    /// Waits until `look` finds something in what is known, or the connection ends; `late` tells what is known after `timeout`,
    /// and how long was waited.
    pub(crate) fn wait<X, F: From<LinkError<E>>>(
        &self,
        timeout: Duration,
        mut look: impl FnMut(&mut T) -> Option<Result<X, F>>,
        late: impl FnOnce(&T, Duration) -> F,
    ) -> Result<X, F>
    where
        E: Clone,
    {
        let started = Instant::now();
        let mut known = self.known();
        loop {
            if let Some(found) = look(&mut known.state) {
                return found;
            }
            if let Some(ended) = &known.ended {
                return Err(ended.clone().into());
            }
            let Some(left) = time_left(started, timeout) else {
                return Err(late(&known.state, started.elapsed()));
            };
            known = self.changed.wait_timeout(known, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The reader's loop, until the connection ends or nobody wants it any more.
    fn read_on(&self, reading: Reading, mut take: impl FnMut(&Self, &[u8], Instant) -> Result<(), E>) {
        let mut buffer = [0; 65_536];
        let mut heard = Instant::now();
        let end = loop {
            let read = self.socket.read(&mut buffer);
            if !self.wanted.load(Ordering::SeqCst) {
                break self.socket.closed();
            }
            match read {
                Ok(Some(n)) => {
                    heard = Instant::now();
                    if let Err(source) = take(self, &buffer[..n], heard) {
                        break self.socket.refused(source);
                    }
                }
                Ok(None) => {
                    if let Some(limit) = reading.silence.filter(|limit| heard.elapsed() > *limit) {
                        break self.socket.silent(heard, limit);
                    }
                }
                Err(end) => break end,
            }
        };
        self.known().ended.get_or_insert(end);
        if reading.cut_at_end {
            self.socket.cut();
        }
        self.notify();
    }
}

/// What is left of `timeout`; `None` where nothing is.
pub(crate) fn time_left(started: Instant, timeout: Duration) -> Option<Duration> {
    timeout.checked_sub(started.elapsed()).filter(|left| !left.is_zero())
}

/// A thread that died with the lock leaves whole values behind: all of them are written at once.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
