//! A device on loopback, for the tests of clients.

use std::io::Read;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread::JoinHandle;
use std::time::Duration;

/// More than enough for anything on loopback, on a machine that has much else to do.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(60);

/// A device that does `with` to the one connection it takes; what it gives comes out of the handle.
pub(crate) fn device<T: Send + 'static>(
    with: impl FnOnce(TcpStream) -> T + Send + 'static,
) -> (SocketAddr, JoinHandle<T>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    (address, std::thread::spawn(move || with(listener.accept().unwrap().0)))
}

/// All that comes until the client goes.
pub(crate) fn rest(mut from: impl Read) -> String {
    let mut all = String::new();
    let _ = from.read_to_string(&mut all);
    all
}
