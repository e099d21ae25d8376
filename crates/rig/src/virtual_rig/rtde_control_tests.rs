use super::arm::Arm;
use super::controller::Controller;
use super::robot::RuntimeState;
use crate::program::TcpPose;
use crate::rtde::Value;
use gripgen_twin::plant::{Grip, GripRequest, Plant, PlantError};
use gripgen_twin::{PerJaw, TactileImage};
use std::sync::Arc;

/// Nothing to grip.
struct Air;

impl Plant for Air {
    fn rest_images(&self, _: f64) -> PerJaw<TactileImage> {
        let image = || TactileImage { width_px: 1, height_px: 1, rgb: vec![0; 3] };
        PerJaw { left: image(), right: image() }
    }

    fn grip(&self, _: &GripRequest) -> Result<Box<dyn Grip>, PlantError> {
        Err(PlantError { problem: "nothing here".into() })
    }

    fn offset_n(&self, _: f64) -> f64 {
        0.0
    }

    fn noise_n(&self, _: u64) -> f64 {
        0.0
    }
}

/// The first lines as ur_rtde sends them: it writes the numbers behind the comments.
fn program(offset: usize) -> String {
    format!(
        "def rtde_control():\n    global reg_offset_float = # float register offset\n{offset}\
         \n    global reg_offset_int = # int register offset\n{offset}\n    global force_mode_type = 2\nend\n"
    )
}

struct Client {
    controller: Controller,
    offset: usize,
}

impl Client {
    fn new(offset: usize) -> Self {
        let tcp = TcpPose { position_m: [0.4, 0.0, 0.2], rotation_rad: [0.0; 3] };
        let mut controller = Controller::new(Arc::new(Air), tcp, 1.0);
        controller.run_script(&program(offset));
        let mut client = Self { controller, offset };
        client.steps(1);
        client
    }

    fn steps(&mut self, n: usize) {
        for _ in 0..n {
            self.controller.begin_step();
            self.controller.end_step();
        }
    }

    fn int(&mut self, i: usize, x: i32) {
        self.controller.write_input(&format!("input_int_register_{}", self.offset + i), Value::Int32(x));
    }

    fn double(&mut self, i: usize, x: f64) {
        self.controller.write_input(&format!("input_double_register_{}", self.offset + i), Value::Double(x));
    }

    fn answer(&self) -> i32 {
        self.controller.robot().outputs.int[self.offset]
    }

    fn arm(&self) -> &Arm {
        self.controller.arm()
    }

    fn force_up(&mut self) {
        for (i, x) in [(1, 2), (4, 1)] {
            self.int(i, x);
        }
        for (i, x) in [(8, 10.0), (14, 0.05)] {
            self.double(i, x);
        }
        self.int(0, 6);
    }
}

#[test]
fn a_command_is_done_until_the_client_takes_it_back() {
    for offset in [0, 24] {
        let mut client = Client::new(offset);
        assert_eq!(client.answer(), 1, "ready");
        client.int(0, 8);
        client.steps(1);
        assert_eq!(client.answer(), 2, "done");
        client.steps(5);
        assert_eq!(client.answer(), 2);
        client.int(0, 0);
        client.steps(1);
        assert_eq!(client.answer(), 1);
    }
}

/// ur_rtde does not wait for the answer to `forceMode` and does not take it back; the next command follows upon it.
#[test]
fn force_mode_stays_ready_and_the_next_command_ends_it() {
    let mut client = Client::new(0);
    client.force_up();
    client.steps(100);
    assert_eq!(client.answer(), 1, "ready at once, and still");
    let height_m = client.arm().tcp().position_m[2];
    assert!((height_m - 0.21).abs() < 2e-4, "0.05 m/s for 0.2 s: {height_m}");
    client.int(0, 7);
    client.steps(1);
    assert_eq!(client.answer(), 2);
    client.steps(50);
    assert_eq!(client.arm().speed_m_s(), 0.0);
}

#[test]
fn a_motion_is_done_when_it_has_arrived() {
    let mut client = Client::new(0);
    for (i, x) in [0.4, 0.0, 0.25, 0.0, 0.0, 0.0, 0.1].into_iter().enumerate() {
        client.double(i, x);
    }
    client.int(0, 3);
    client.steps(240);
    assert_eq!(client.answer(), 1, "0.48 s of 0.5 s: not done yet");
    client.steps(20);
    assert_eq!(client.answer(), 2);
    assert_eq!(client.arm().tcp().position_m, [0.4, 0.0, 0.25]);
    // The same again, and nobody waits.
    client.int(0, 0);
    client.double(2, 0.2);
    client.int(1, 1);
    client.steps(1);
    client.int(0, 3);
    client.steps(1);
    assert_eq!(client.answer(), 2);
    assert!(client.arm().speed_m_s() > 0.09);
}

#[test]
fn without_its_watchdogs_kicks_and_on_demand_the_program_ends() {
    let mut client = Client::new(0);
    client.double(0, 10.0);
    client.int(0, 35);
    client.steps(1);
    assert_eq!(client.answer(), 2);
    for _ in 0..10 {
        client.int(0, 0);
        client.steps(40);
        assert_eq!(client.controller.robot().runtime, RuntimeState::Playing);
    }
    client.steps(12);
    assert_eq!(client.controller.robot().runtime, RuntimeState::Stopped);
    let mut client = Client::new(0);
    client.int(0, 255);
    client.steps(1);
    assert_eq!(client.controller.robot().runtime, RuntimeState::Stopped);
}
