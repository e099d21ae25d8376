//! The language by examples of the manual's rules, without a robot.

use super::*;
use gripgen_rig::program::{MotionProgram, PullProgram, TcpPose};
use std::sync::Arc;

/// A robot that writes down what it is asked for.
struct Paper {
    inputs: [i32; 48],
    ints: [i32; 48],
    floats: [f64; 48],
    asked: Vec<String>,
    /// Control steps that a motion still takes.
    moving: u32,
}

impl Hands for Paper {
    fn tcp_pose(&self) -> [f64; 6] {
        [0.1, 0.2, 0.3, 0.0, 0.0, 0.5]
    }
    fn tcp_speed(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn tcp_force(&self) -> [f64; 6] {
        [1.0, 2.0, -3.0, 0.0, 0.0, 0.0]
    }
    fn joints(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn joint_speeds(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn tool(&self) -> [f64; 6] {
        [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    }
    fn payload_kg(&self) -> f64 {
        0.0
    }
    fn input_int(&self, register: usize) -> Option<i32> {
        self.inputs.get(register).copied()
    }
    fn input_float(&self, register: usize) -> Option<f64> {
        self.inputs.get(register).map(|x| f64::from(*x))
    }
    fn input_bool(&self, register: usize) -> Option<bool> {
        (register < 128).then_some(false)
    }
    fn output_int(&mut self, register: usize) -> Option<&mut i32> {
        self.ints.get_mut(register)
    }
    fn output_float(&mut self, register: usize) -> Option<&mut f64> {
        self.floats.get_mut(register)
    }
    fn write_output_bool(&mut self, register: usize, _: bool) -> bool {
        register < 128
    }
    fn set_payload(&mut self, mass_kg: f64, centre_m: Option<[f64; 3]>) -> Result<(), String> {
        self.asked.push(format!("payload {mass_kg} {centre_m:?}"));
        Ok(())
    }
    fn set_tool(&mut self, _: [f64; 6]) -> Result<(), String> {
        Ok(())
    }
    fn zero_sensor(&mut self) {}
    fn force_mode(&mut self, mode: ForceMode) -> Result<(), String> {
        self.asked.push(format!("force {:?} {:?}", mode.compliant, mode.wrench));
        Ok(())
    }
    fn end_force_mode(&mut self) {}
    fn set_damping(&mut self, _: f64) {}
    fn set_gain(&mut self, _: f64) {}
    fn move_line(&mut self, target: [f64; 6], a: f64, v: f64) -> Result<(), String> {
        self.asked.push(format!("line to {} with {a} and {v}", target[2]));
        self.moving = 5;
        Ok(())
    }
    fn brake(&mut self, a: f64) {
        self.asked.push(format!("brake {a}"));
        self.moving = 2;
    }
    fn move_joints(&mut self, target_rad: [f64; 6], a: f64, v: f64) -> Result<(), String> {
        self.asked.push(format!("turn to {:.3} with {a} and {v}", target_rad[0]));
        self.moving = 5;
        Ok(())
    }
    fn brake_joints(&mut self, a: f64) {
        self.asked.push(format!("brake joints {a}"));
        self.moving = 2;
    }
    fn is_moving(&self) -> bool {
        self.moving > 0
    }
    fn set_watchdog(&mut self, dog: Watchdog) {
        self.asked.push(format!("watch {} at {} Hz: {:?}", dog.register, dog.rate_hz, dog.action));
    }
    fn message(&mut self, text: String) {
        self.asked.push(text);
    }
}

/// Runs a program to its end, for at most so many control steps; what was asked for, the error, the steps.
fn run(text: &str, most: usize) -> (Paper, Option<ScriptError>, usize) {
    let mut paper = Paper { inputs: [0; 48], ints: [0; 48], floats: [0.0; 48], asked: Vec::new(), moving: 0 };
    let program = match Program::parse(text) {
        Ok(program) => program,
        Err(e) => return (paper, Some(e), 0),
    };
    let mut machine = Machine::new(Arc::new(program));
    for k in 0..most {
        match machine.step(&mut paper) {
            Ok(Progress::Running) => paper.moving = paper.moving.saturating_sub(1),
            Ok(Progress::Ended) => return (paper, None, k),
            Err(e) => return (paper, Some(e), k),
        }
    }
    (paper, None, most)
}

/// What lines without a `def` say.
fn said(lines: &str) -> Vec<String> {
    let (paper, error, _) = run(lines, 1000);
    assert_eq!(error, None, "{lines}");
    paper.asked
}

fn refused(lines: &str) -> String {
    run(lines, 1000).1.map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn expressions_are_those_of_the_manual() {
    for (expression, wanted) in [
        ("1 + 2 - 3", "0"),
        ("4 * 5 / 10", "2"),
        ("(1 + 2) * 3 / (4 - 5)", "-9"),
        ("7.0 / 2", "3.500000"),
        ("7 % 4", "3"),
        ("-2 * -3", "6"),
        ("1 > 2 or 3 != 4 xor 5 < -6", "True"),
        ("not 42 >= 87 and 87 <= 42", "False"),
        ("False or True and not False", "True"),
        ("\"Hello\" + \", \" + \"World!\"", "Hello, World!"),
        ("[1, 2.5, 4][1]", "2.500000"),
        ("p[1, 2, 3, 4, 5, 6][5]", "6.000000"),
        ("norm(-5.3)", "5.300000"),
        ("norm([3, 4])", "5.000000"),
        ("floor(2.9)", "2"),
        ("floor(-2.1)", "-3"),
        ("pow(2, 3)", "8.000000"),
        ("length([1, 2, 3])", "3"),
        ("1e-3 * 1000", "1.000000"),
        ("get_steptime()", "0.002000"),
        ("[1, 2] == [1, 2.0]", "True"),
        ("point_dist(p[0, 0, 0, 0, 0, 0], p[3, 4, 0, 1, 0, 0])", "5.000000"),
    ] {
        assert_eq!(said(&format!("textmsg({expression})\n")), [wanted], "{expression}");
    }
    // Turned by a quarter about z, x goes along y.
    let there = "x = pose_trans(p[1, 0, 0, 0, 0, 1.5707963267948966], p[1, 0, 0, 0, 0, 0])\ntextmsg(floor(x[1] * 1000 + 0.5))\n";
    assert_eq!(said(there), ["1000"]);
    let back =
        "a = p[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]\nx = pose_trans(pose_inv(a), a)\ntextmsg(norm(x) < 0.000001)\n";
    assert_eq!(said(back), ["True"]);
}

/// The flange with all joints at 0 lies 817.2 mm behind the base, by the lengths of its links; the tool of this robot is 100 mm long.
#[test]
fn joints_and_poses_lead_to_each_other() {
    for (expression, wanted) in [
        ("floor(get_forward_kin([0, 0, 0, 0, 0, 0], p[0, 0, 0, 0, 0, 0])[0] * 10000 + 0.5)", "-8172"),
        ("floor(get_forward_kin([0, 0, 0, 0, 0, 0])[1] * 10000 + 0.5)", "-3329"),
        ("norm(get_actual_tool_flange_pose()) == norm(get_forward_kin(tcp=p[0, 0, 0, 0, 0, 0]))", "True"),
        ("get_inverse_kin_has_solution(p[0.4, 0, 0.2, 0, 3.14, 0])", "True"),
        ("get_inverse_kin_has_solution(p[1.4, 0, 0.2, 0, 3.14, 0])", "False"),
        ("get_inverse_kin_has_solution(p[0.95, 0, 0.2, 0, 1.57, 0], tcp=p[0, 0, 0.2, 0, 0, 0])", "True"),
        ("get_inverse_kin_has_solution(p[0.95, 0, 0.2, 0, 1.57, 0], tcp=p[0, 0, -0.2, 0, 0, 0])", "False"),
    ] {
        assert_eq!(said(&format!("textmsg({expression})\n")), [wanted], "{expression}");
    }
    let back = "q = [0.3, -1.2, 1.4, -0.9, 1.1, 0.4]\nr = get_inverse_kin(get_forward_kin(q), qnear=q)\ntextmsg(norm([r[0] - q[0], r[2] - q[2], \
                r[4] - q[4], r[5] - q[5]]) < 0.000001)\n";
    assert_eq!(said(back), ["True"]);
    assert_eq!(
        said("movej([0.5, 0, 0, 0, 0, 0], v=0.2)\nstopj(3)\n"),
        ["turn to 0.500 with 1.4 and 0.2", "brake joints 3"]
    );
    assert_eq!(
        said("movel(get_forward_kin([0, 0, 0, 0, 0, 0]), a=0.5)\n"),
        said("movel([0, 0, 0, 0, 0, 0], a=0.5)\n")
    );
    // A time says the speed: 0.5 rad in 1 s are 0.6 rad/s with 3 rad/s^2, and need 2 rad/s^2 at least.
    let turn = |words: &str| said(&format!("movej([0.5, 0, 0, 0, 0, 0], {words}, t=1)\n"))[0].clone();
    assert!(turn("a=3").starts_with("turn to 0.500 with 3 and 0.63"), "{}", turn("a=3"));
    assert_eq!(turn("a=1"), "turn to 0.500 with 2 and 1");
    assert!(refused("x = get_inverse_kin(p[1.4, 0, 0.2, 0, 0, 0])\n").contains("no joints of a UR5e"));
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    for (lines, wanted) in [
        ("x = 1\ny = x + z\n", "line 2: `z` is no name that is known"),
        ("frobnicate(1)\n", "line 1: `frobnicate` is no function that is known"),
        ("x = 7 / 2\n", "line 1: 7 / 2 has a rest"),
        ("x = 1 / 0\n", "line 1: 1 / 0 is no whole number"),
        ("x = 1.0 / 0\n", "is no number"),
        ("x = 2000000000 + 2000000000\n", "32 bits"),
        ("x = 1\nx = True\n", "line 2: `x` is a number and is given a truth value"),
        ("if 1:\nend\n", "a number stands where a truth value is wanted"),
        ("x = [1, 2][2]\n", "there is no element 2"),
        ("x = True + 1\n", "a truth value stands where a number is wanted, beside `+`"),
        ("sync(1)\n", "`sync` takes at most 0 values"),
        ("sleep()\n", "`sleep` lacks `t`"),
        ("movel(p[0,0,0,0,0,0], w=1)\n", "`movel` has no parameter `w`"),
        ("movej([0,0,0,0,0,0], r=0.1)\n", "a blend radius"),
        ("movej([0,0,0,0,0,0], t=-1)\n", "a time of -1"),
        ("servoj([0,0,0,0,0,0], t=0.1)\n", "`servoj` cannot be followed"),
        ("write_output_integer_register(48, 1)\n", "there is no register 48"),
        ("write_output_integer_register(24, 1.5)\n", "whole number"),
        ("rtde_set_watchdog(\"speed\", 10)\n", "no integer input"),
        ("while True:\nend\n", "never waits"),
        ("def a():\n", "an `end` is missing"),
        ("end\n", "without its beginning"),
        ("def a():\nend\nx = 1\n", "something follows"),
        ("run = 3\n", "`run` is a word of the language"),
        ("x = 1 + while\n", "`while` stands where a value is wanted"),
        ("def if():\nend\n", "`if` is a word of the language"),
        ("x = \"open\n", "a text without its end"),
        ("x = 1 $ 2\n", "`$` is no word"),
        ("break\n", "outside of a loop"),
        (
            "force_mode(p[0,0,0,0,0,0], [0,0,2,0,0,0], [0,0,0,0,0,0], 2, [0,0,0,0,0,0])\n",
            "2 in the selection",
        ),
        ("force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,0,0,0,0], 1, [0,0,0,0,0,0])\n", "type 1"),
        ("sec a():\nend\n", "secondary"),
    ] {
        let found = refused(lines);
        assert!(found.contains(wanted), "{lines}: {found}");
    }
}

#[test]
fn names_of_the_first_level_are_global_and_others_where_they_were_made_so() {
    let text = "def program():
  global a = 1
  b = 10
  def change():
    a = a + 1
    b = 20
  end
  def mask():
    local a = 100
    a = a + 1
    return a
  end
  change()
  textmsg(a)
  textmsg(b)
  textmsg(mask())
  textmsg(a)
end
";
    assert_eq!(run(text, 10).0.asked, ["2", "20", "101", "2"]);
    // Even where they are said to be local.
    let text = "def program():\n  local b = 1\n  def f():\n    b = 2\n  end\n  f()\n  textmsg(b)\nend\n";
    assert_eq!(run(text, 10).0.asked, ["2"]);
    // A local of another function is no name here.
    let text =
        "def program():\n  def g():\n    b = 1\n  end\n  def f():\n    textmsg(b)\n  end\n  f()\nend\n";
    assert!(refused(text).contains("line 6: `b` is no name that is known"));
}

#[test]
fn loops_and_branches() {
    let text = "def program():
  i = 0
  while True:
    i = i + 1
    if i == 2:
      continue
    elif i > 4:
      break
    else:
      textmsg(i)
    end
  end
  l = [1, 2, 3]
  l[1] = i
  textmsg(l)
end
";
    assert_eq!(run(text, 10).0.asked, ["1", "3", "4", "[1, 5, 3]"]);
    // Parameters have defaults, and are named.
    let text = "def program():\n  def f(a, b=-2, c=True):\n    if c:\n      return a + b\n    end\n    return a\n  end\n  \
                textmsg(f(5))\n  textmsg(f(5, 1))\n  textmsg(f(5, c=False))\n  textmsg(f(b=1, a=2))\nend\n";
    assert_eq!(run(text, 10).0.asked, ["3", "6", "5", "3"]);
    for (call, wanted) in [
        ("f()", "`f` takes 2 values, not 0"),
        ("f(1, 2, 3)", "takes 2 values, not 3"),
        ("f(1, a=2)", "a value twice"),
        ("f(1, d=2)", "no parameter `d`"),
    ] {
        let text = format!("def program():\n  def f(a, b=1):\n  end\n  {call}\nend\n");
        assert!(refused(&text).contains(wanted), "{call}: {}", refused(&text));
    }
    assert!(refused("def program():\n  def f(a=1, b):\n  end\nend\n").contains("without a default"));
    assert!(refused("def program():\n  def f(a=[1]):\n  end\nend\n").contains("the default of a parameter"));
    // A variable may have the name of a function.
    assert_eq!(said("length = 3\ntextmsg(length + length([1, 2]))\n"), ["5"]);
    assert!(
        refused("def program():\n  def norm(x):\n  end\nend\n").contains("`norm` is a word of the language")
    );
    // Brackets hold lines together.
    assert_eq!(
        said("textmsg(\n  str_cat(\"a\",  # first\n    \"b\"))\nl = [1,\n  2]\ntextmsg(l[1])\n"),
        ["ab", "2"]
    );
    assert!(refused("x = (1\ny = 2\n").contains("line 2"));
    assert_eq!(said("if False or  # first\n  True:\n  textmsg(1 +\n    2)\nend\n"), ["3"]);
    // A value may stand behind a comment: a client writes it so.
    assert_eq!(said("global x = # a number\n7\ntextmsg(\"x: \", x)\n"), ["x: 7"]);
}

#[test]
fn time_passes_where_a_program_waits_and_nowhere_else() {
    assert_eq!(run("x = 1\n", 10).2, 0);
    assert_eq!(run("sync()\nsync()\n", 10).2, 2);
    assert_eq!(run("sleep(0.1)\n", 100).2, 50);
    assert_eq!(run("movel(p[0,0,1,0,0,0], a=0.5, v=0.1)\nstopl(2.0)\n", 100).2, 7);
    let (paper, _, steps) = run("while read_input_integer_register(24) == 0:\n  sync()\nend\n", 100);
    assert_eq!((steps, paper.inputs[24]), (100, 0), "nobody writes");
}

#[test]
fn threads_run_beside_each_other_and_can_be_killed_and_joined() {
    let text = "def program():
  global count = 0
  thread counts():
    while True:
      count = count + 1
      sync()
    end
  end
  thread ends():
    sleep(0.02)
    textmsg(\"thread\")
  end
  a = run counts()
  join run ends()
  kill a
  before = count
  sleep(0.1)
  textmsg(count == before and before > 8)
end
";
    let (paper, error, _) = run(text, 200);
    assert_eq!((error, paper.asked), (None, vec!["thread".to_string(), "True".to_string()]));
}

/// A stop from another thread does not end a thread that moves: it takes its motion up again. A killed one does not.
#[test]
fn a_motion_is_that_of_its_thread() {
    let text = |kill: &str| {
        format!(
            "def program():\n  thread moves():\n    movel(p[0,0,1,0,0,0], a=0.5, v=0.1)\n  end\n  h = run moves()\n  sync()\n{kill}  \
             stopl(3)\n  sleep(0.1)\nend\n"
        )
    };
    let line = "line to 1 with 0.5 and 0.1";
    assert_eq!(run(&text(""), 100).0.asked, [line, "brake 3", line]);
    assert_eq!(run(&text("  kill h\n"), 100).0.asked, [line, "brake 2", "brake 3"]);
}

#[test]
fn a_program_is_bounded() {
    let calls = "def program():\n  def f():\n    f()\n  end\n  f()\nend\n";
    assert!(refused(calls).contains("more than 64 calls"));
    let threads = "def program():\n  thread t():\n    sleep(10)\n  end\n  while True:\n    run t()\n    sync()\n  end\nend\n";
    assert!(refused(threads).contains("more than 50 threads"));
    let grows = "s = \"a\"\nwhile True:\n  s = s + s\n  sync()\nend\n";
    assert!(refused(grows).contains("at most 1024"));
    let nests = "l = [1]\nwhile True:\n  l = [l]\n  sync()\nend\n";
    assert!(refused(nests).contains("lists in lists in lists"));
    let deep = format!("x = {}1{}\n", "(".repeat(100), ")".repeat(100));
    assert!(refused(&deep).contains("more than 64 blocks or brackets"));
}

/// ur_rtde puts the numbers of its registers into its script at the begin of the next line (1.6.5, as it is sent).
#[test]
fn a_value_may_stand_in_the_next_line_before_another_statement() {
    let carried = "def p():\n  a = # of floats\n0  b = # of integers\n1  c = 2\nend\n";
    assert!(Program::parse(carried).is_ok(), "{:?}", Program::parse(carried).err());
    for wrong in ["def p():\n  a = 0  b = 1\nend\n", "def p():\n  a =\n0\n  b = 1  c = 2\nend\n"] {
        assert!(Program::parse(wrong).is_err(), "{wrong}");
    }
}

/// The interpreter's reading of the language has no say in how the programs are written; that it takes them is tested here.
#[test]
fn both_programs_are_texts_that_an_interpreter_reads() {
    let motion = MotionProgram {
        run: 1,
        target: TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] },
        speed_mm_s: 50.0,
        abort_force_n: 20.0,
        max_time_s: 10.0,
        payload_kg: 1.0,
        centre_of_gravity_mm: [0.0; 3],
        tool_mm: [0.0; 3],
    };
    for (text, title) in [
        (PullProgram::default().script().unwrap(), "gripgen_pull"),
        (motion.script().unwrap(), "gripgen_move"),
    ] {
        assert_eq!(Program::parse(&text).unwrap().title(), title);
    }
}
