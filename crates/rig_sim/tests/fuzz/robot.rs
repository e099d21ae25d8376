//! The devices of the virtual rig that hear the inputs.

use super::Heard;
use gripgen_rig::gcl::SHIPPED_LIMITS;
use gripgen_rig::program::TcpPose;
use gripgen_rig::rtde::Value;
use gripgen_rig_sim::controller::Controller;
use gripgen_rig_sim::dashboard;
use gripgen_rig_sim::gripper::{Closed, Jaws, VirtualGripper};
use gripgen_rig_sim::rtde::{InputOwners, RtdeServer, ServerError};
use gripgen_rig_sim::spring::Spring;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// A robot that runs.
pub fn controller() -> Controller {
    let tcp = TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] };
    Controller::new(Arc::new(Spring::default()), tcp, 1.0)
}

/// The answer of its dashboard.
pub fn reply(line: &str, controller: &mut Controller) -> String {
    dashboard::reply(line, controller).text
}

/// A program that does what its inputs say: command 3 goes to a pose, 6 pulls with a force, 7 ends that.
const LISTENS: &str = "def listens():
  global to = p[0, 0, 0, 0, 0, 0]
  thread moves():
    movel(to, a=0.5, v=0.1)
  end
  before = 0
  while True:
    command = read_input_integer_register(0)
    if command == 3 and before != 3:
      i = 0
      while i < 6:
        to[i] = read_input_float_register(i)
        i = i + 1
      end
      run moves()
    elif command == 6:
      force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, read_input_integer_register(4), 0, 0, 0], [0, 0, read_input_float_register(8), 0, 0, 0], 2, [0.1, 0.1, 0.05, 0.1, 0.1, 0.1])
    elif command == 7:
      end_force_mode()
    end
    before = command
    write_output_float_register(0, read_input_float_register(6))
    sync()
  end
end
";

/// Runs a text for 60 control steps, its host beating; what became of it, in words.
pub fn run_program(text: &str) -> String {
    let mut controller = controller();
    controller.run_script(text);
    let mut said = String::new();
    for step in 0..60 {
        controller.write_input("input_int_register_24", Value::Int32(step / 5));
        controller.write_input("input_int_register_25", Value::Int32(1 + step / 40));
        controller.begin_step();
        controller.end_step();
        for told in controller.take_announcements() {
            said = format!("{told:?}");
        }
    }
    let tcp = controller.robot().tcp.numbers();
    assert!(tcp.iter().all(|x| x.is_finite()), "{tcp:?}");
    format!("{said} {tcp:?}")
}

/// A connection to a robot whose program reads its inputs.
pub struct Served {
    controller: Controller,
    owners: InputOwners,
    server: RtdeServer,
}

impl Served {
    /// Nothing was said yet; another client has an input.
    pub fn new() -> Self {
        let (mut controller, mut owners) = (controller(), InputOwners::default());
        controller.run_script(LISTENS);
        let mut other = RtdeServer::new(7);
        let taken = [&[0, 24, b'I'][..], b"input_int_register_47"].concat();
        assert!(other.receive(&taken, &mut controller, &mut owners).is_ok());
        Self { controller, owners, server: RtdeServer::new(1) }
    }

    /// The answer; then the robot goes on, and is still somewhere.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<u8>, ServerError> {
        let answer = self.server.receive(bytes, &mut self.controller, &mut self.owners)?;
        for step in 0..2 {
            self.controller.begin_step();
            let data = self.server.data(step, &self.controller);
            assert!(data.is_none_or(|data| data.len() < 65_536));
            self.controller.end_step();
        }
        let tcp = self.controller.robot().tcp.numbers();
        assert!(tcp.iter().all(|x| x.is_finite()), "{tcp:?}");
        Ok(answer)
    }
}

/// Jaws around a part of 20 mm.
struct Vice;

impl Jaws for Vice {
    fn close(&mut self, force_per_jaw_n: f64) -> Closed {
        assert!((2.5..=40.0).contains(&force_per_jaw_n), "{force_per_jaw_n} N");
        Closed { width_mm: 20.0, part: true }
    }

    fn open(&mut self) {}
}

/// Lines through the gripper, with time between them. What it sends by itself comes with time and not with input: a number is
/// kept for all of it.
pub fn gripper(pieces: &[&[u8]]) -> Heard<u64, ()> {
    let text = super::text(pieces);
    let mut gripper = VirtualGripper::new(SHIPPED_LIMITS).homed(true);
    let mut said = DefaultHasher::new();
    let mut say = |lines: Vec<String>| {
        for line in lines {
            assert!(!line.is_empty() && line.len() < 100 && !line.contains(['\n', '\r']), "{line:?}");
            line.hash(&mut said);
        }
    };
    for (k, line) in text.split('\n').enumerate() {
        let now_s = k as f64 * 0.5;
        say(gripper.line(now_s, line));
        for tick in 0..4 {
            say(gripper.advance(now_s + f64::from(tick) * 0.1, &mut Vice));
        }
        let (width_mm, force_n) = (gripper.width_mm(), gripper.force_sum_n());
        assert!((0.0..=110.0).contains(&width_mm), "{width_mm} mm");
        assert!((0.0..=80.0).contains(&force_n), "{force_n} N");
    }
    Heard { events: vec![said.finish()], error: None }
}
