//! `gripgen rig serve`: a virtual rig.

use super::teach::taught;
use crate::args::RigServeArgs;
use crate::failure::Failure;
use crate::interrupt::stop_flag;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::rig::SHIPPED_RIG;
use crate::rig::TwinPlant;
use gripgen::Location;
use gripgen_rig::camera::CameraView;
use gripgen_rig::program::TcpPose;
use gripgen_rig_sim::faults::Fault;
use gripgen_rig_sim::server::{RigAddresses, ServeError, ServeOptions, ServedRig};
use serde_json::json;
use std::io::BufRead;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use toml_edit::{DocumentMut, value};

/// How far above its fixture the tool begins.
const ABOVE_M: f64 = 0.1;
/// Patience of the clients of a rig that waits for them.
const PATIENCE: f64 = 20.0;
/// Time between two looks at Ctrl-C.
const LOOK: Duration = Duration::from_millis(100);

/// Runs the verb.
pub fn run(args: &RigServeArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads_config(&args.twin, &args.set);
    outputs.allow_all(args.write_rig.as_deref())?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let plant = TwinPlant::open(&Location::parse(&args.twin), &args.set, args.seed)?;
    let tcp = begin_at(args, &plant)?;
    let fixtures: Vec<(String, TcpPose)> = plant
        .fixtures()
        .iter()
        .map(|f| (f.part.clone(), TcpPose::from_base_from_tool(&f.base_from_tool)))
        .collect();
    let options = ServeOptions {
        addresses: addresses(args),
        clock_rate: args.speed,
        in_step: args.in_step,
        tcp,
        // The R1.5 sends portrait frames.
        view: CameraView { rotate_deg: 90, mirror: false, crop_px: None, size_px: [320, 240] },
    };
    let stop = stop_flag("ending the virtual rig");
    let rig = ServedRig::start(Arc::new(plant), &options).map_err(|e| refused(&e))?;
    let addresses = rig.addresses();
    // Before the line that says ready: who waits for that line finds the file.
    if let Some(path) = &args.write_rig {
        outputs.write(path, rig_toml(&addresses, &fixtures, args.in_step)?.as_bytes())?;
    }
    if sink.wanted() {
        let of = |(what, address): (&str, SocketAddr)| (what.to_string(), json!(address.to_string()));
        let ports: serde_json::Map<String, serde_json::Value> = addresses.all().into_iter().map(of).collect();
        sink.line(&json!({"event": "ready", "speed": args.speed, "addresses": ports}))?;
    }
    if !sink.on_stdout() {
        let words: Vec<String> = addresses.all().iter().map(|(what, at)| format!("{what}={at}")).collect();
        print(&format!("ready {}\n", words.join(" ")))?;
    }
    if !args.talk.quiet {
        eprintln!("Ctrl-C ends the virtual rig");
    }
    let (tell, told) = channel();
    if args.faults {
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                if tell.send(line).is_err() {
                    break;
                }
            }
        });
    }
    while !stop.load(Ordering::SeqCst) {
        match told.recv_timeout(LOOK) {
            Ok(line) if line.trim().is_empty() => {}
            Ok(line) => match line.parse::<Fault>() {
                Ok(fault) => {
                    rig.inject(fault);
                    eprintln!("{}", line.trim());
                }
                Err(e) => eprintln!("{e}"),
            },
            Err(RecvTimeoutError::Timeout) => {}
            // Nobody has anything to say any more.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK),
        }
    }
    Ok(0)
}

/// The shipped rig.toml with these ports and poses; clients of a rig that waits for them are patient, too.
fn rig_toml(
    addresses: &RigAddresses,
    fixtures: &[(String, TcpPose)],
    in_step: bool,
) -> Result<String, Failure> {
    let text = Location::parse(SHIPPED_RIG).read_text().map_err(Failure::new)?;
    let mut document: DocumentMut = text.parse().map_err(Failure::new)?;
    let port = |at: SocketAddr| value(i64::from(at.port()));
    document["robot"]["rtde_port"] = port(addresses.rtde);
    document["robot"]["dashboard_port"] = port(addresses.dashboard);
    document["robot"]["primary_port"] = port(addresses.primary);
    document["gripper"]["port"] = port(addresses.gripper);
    document["cameras"]["left"]["port"] = port(addresses.camera_left);
    document["cameras"]["right"]["port"] = port(addresses.camera_right);
    if in_step {
        document["limits"]["patience"] = value(PATIENCE);
    }
    document.remove("poses");
    for (part, pose) in fixtures {
        taught(&mut document, part, pose.numbers());
    }
    Ok(document.to_string())
}

fn begin_at(args: &RigServeArgs, plant: &TwinPlant) -> Result<TcpPose, Failure> {
    let pose = |i: usize| TcpPose::from_base_from_tool(&plant.fixtures()[i].base_from_tool);
    let Some(part) = &args.at else { return Ok(pose(0).raised(ABOVE_M)) };
    match plant.fixtures().iter().position(|fixture| fixture.part == *part) {
        Some(i) => Ok(pose(i)),
        None => {
            let known: Vec<&str> = plant.fixtures().iter().map(|f| f.part.as_str()).collect();
            Err(Failure::usage(format!("--at: {} has no part `{part}`", args.twin))
                .hint(format!("its parts: {}", known.join(", "))))
        }
    }
}

fn addresses(args: &RigServeArgs) -> RigAddresses {
    let mut addresses = if args.any_ports { RigAddresses::any_ports() } else { RigAddresses::loopback() };
    for (address, port) in [
        (&mut addresses.rtde, args.rtde_port),
        (&mut addresses.dashboard, args.dashboard_port),
        (&mut addresses.primary, args.primary_port),
        (&mut addresses.secondary, args.secondary_port),
        (&mut addresses.real_time, args.real_time_port),
        (&mut addresses.gripper, args.gripper_port),
        (&mut addresses.camera_left, args.camera_left_port),
        (&mut addresses.camera_right, args.camera_right_port),
    ] {
        if let Some(port) = port {
            address.set_port(port);
        }
    }
    addresses
}

fn refused(e: &ServeError) -> Failure {
    match e {
        ServeError::Port { .. } => Failure::new(e)
            .hint("another program has this port (a second virtual rig?); --any-ports, or the flag of this port, takes another"),
        other => Failure::usage(other),
    }
}
