//! `--live`: a page on loopback that shows a sweep or a campaign while it is under way.
//!
//! The work never waits for the page: it leaves what is new under a lock that is held for as long as a few numbers take to copy, and pictures
//! are decoded by the page's own thread, when they are asked for.

mod state;

pub use state::{CurvePoint, Made, Picture, State};

use crate::failure::Failure;
use gripgen::twin::Jaw;
use std::io::Cursor;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use tiny_http::{Header, Method, Request, Response, Server};

type Answer = Response<Cursor<Vec<u8>>>;

/// The page, which ends with the command.
pub struct LivePage {
    state: Arc<Mutex<State>>,
    server: Arc<Server>,
    url: String,
    thread: Option<JoinHandle<()>>,
}

impl LivePage {
    /// Opens the page on a port of this machine, 0 for any that is free.
    ///
    /// # Errors
    ///
    /// A port that something else has.
    pub fn open(port: u16, state: State) -> Result<Self, Failure> {
        let server = Server::http(("127.0.0.1", port)).map_err(|e| {
            Failure::usage(format!("--live={port}: {e}"))
                .hint("without a number it takes any port that is free")
        })?;
        let port = server.server_addr().to_ip().map_or(port, |at| at.port());
        let (server, state) = (Arc::new(server), Arc::new(Mutex::new(state)));
        let thread = {
            let (server, state) = (server.clone(), state.clone());
            std::thread::spawn(move || serve(&server, &state, port))
        };
        Ok(Self { state, server, url: format!("http://127.0.0.1:{port}/"), thread: Some(thread) })
    }

    /// Where it is.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Changes what is shown.
    pub fn tell(&self, change: impl FnOnce(&mut State)) {
        change(&mut locked(&self.state));
    }
}

impl Drop for LivePage {
    fn drop(&mut self) {
        self.server.unblock();
        if let Some(thread) = self.thread.take() {
            // A page that broke is no reason for the work to break.
            let _ = thread.join();
        }
    }
}

/// A page that broke while it held the lock has changed nothing.
fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

fn serve(server: &Server, state: &Mutex<State>, port: u16) {
    let reply = |request: Request| {
        let answer = answer(&request, state, port);
        // Who asked may be gone.
        let _ = request.respond(answer);
    };
    while let Ok(request) = server.recv() {
        reply(request);
    }
    // Who asked while the command ended is answered like everybody before; without this the library would say 500.
    while let Ok(Some(request)) = server.try_recv() {
        reply(request);
    }
}

fn answer(request: &Request, state: &Mutex<State>, port: u16) -> Answer {
    // A page of another site that has this address under a name of its own is refused.
    let host = request.headers().iter().find(|h| h.field.equiv("Host")).map_or("", |h| h.value.as_str());
    if ![format!("127.0.0.1:{port}"), format!("localhost:{port}")].iter().any(|own| own == host) {
        return words(403, "only for this machine");
    }
    if *request.method() != Method::Get {
        return words(405, "the page can only be read");
    }
    let path = request.url().split('?').next().unwrap_or_default();
    match path {
        "/" => with_type(
            Response::from_data(gripgen_report::live_page().into_bytes()),
            "text/html; charset=utf-8",
        ),
        "/state" => {
            let state = locked(state).to_json();
            with_type(Response::from_data(state.to_string().into_bytes()), "application/json")
        }
        "/left.png" | "/right.png" => {
            let jaw = if path == "/left.png" { Jaw::Left } else { Jaw::Right };
            let picture = locked(state).pictures[jaw].clone();
            match picture.and_then(|(_, picture)| picture.png(jaw)) {
                Some(png) => with_type(Response::from_data(png), "image/png"),
                None => words(404, "no image yet"),
            }
        }
        _ => words(404, "there are /, /state, /left.png and /right.png"),
    }
}

fn words(code: u16, text: &str) -> Answer {
    Response::from_string(text).with_status_code(code)
}

fn with_type(answer: Answer, media: &str) -> Answer {
    let header = |name: &str, value: &str| Header::from_bytes(name, value).expect("plain letters");
    // In one piece: the simplest clients read no chunks.
    let answer = answer.with_chunked_threshold(usize::MAX);
    answer.with_header(header("Content-Type", media)).with_header(header("Cache-Control", "no-store"))
}
