//! The stamp, the connection, and reading until its end.

use std::io::{ErrorKind, Read};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A device that takes no bytes for so long is gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Something that came, and when it did by the clock of this host. The network's delay is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamped<T> {
    /// When its last byte was read.
    pub at: Instant,
    /// What came.
    pub event: T,
}

/// Why reading ended.
pub(crate) enum ReadEnd<E> {
    /// The connection was closed, by either side.
    Closed,
    /// The network.
    Io(std::io::Error),
    /// What came was not understood.
    Refused(E),
}

/// A connection on which every write leaves at once, and none waits for ever.
pub(crate) fn connect(address: SocketAddr, timeout: Duration) -> std::io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&address, timeout)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    Ok(stream)
}

/// Reads until the connection ends, or until `take` refuses what came. A shutdown of the socket wakes it.
pub(crate) fn read_until_end<E>(
    mut stream: &TcpStream,
    mut take: impl FnMut(&[u8], Instant) -> Result<(), E>,
) -> ReadEnd<E> {
    let mut buffer = [0; 65_536];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return ReadEnd::Closed,
            Ok(n) => {
                if let Err(e) = take(&buffer[..n], Instant::now()) {
                    return ReadEnd::Refused(e);
                }
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return ReadEnd::Io(e),
        }
    }
}

/// A thread that died with the lock leaves whole values behind: all of them are written at once.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
