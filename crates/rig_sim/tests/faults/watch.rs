//! Where a pull is, as somebody sees it who looks on, and what the arm and the jaws do meanwhile.

use super::injection::{MOMENTS, Moment};
use gripgen_rig::experiment::RigEvent;
use gripgen_rig::gcl::GripState;
use gripgen_rig_sim::server::ServedRig;
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};

/// Time between two looks.
const LOOK: Duration = Duration::from_micros(500);
/// Longest time that an experiment is held.
const LONGEST_WAIT: Duration = Duration::from_secs(120);

/// What the experiment has told so far. It is held where it would go beyond the moment of a fault that is not there yet, and with
/// it the rig's clock, however late the test looks.
pub struct Progress {
    told: Mutex<Told>,
    moment: Moment,
    fault: Mutex<Fault>,
    changed: Condvar,
}

#[derive(Default)]
struct Fault {
    is_there: bool,
    is_waited_for: bool,
}

#[derive(Default, Clone, Copy)]
struct Told {
    moment: Option<Moment>,
    desired_n: f64,
    displacement_mm: f64,
}

impl Told {
    /// Whether this moment has begun, of those that an experiment tells.
    fn reached(&self, moment: Moment) -> bool {
        match moment {
            Moment::Settling => false,
            // The images take no time to speak of.
            Moment::Dwell => self.moment >= Some(Moment::GripImages),
            Moment::MidPull => self.desired_n >= 5.0,
            Moment::NearSlip => self.desired_n >= 10.0,
            Moment::Sliding => self.displacement_mm > 0.5,
            moment => self.moment >= Some(moment),
        }
    }
}

impl Progress {
    /// Of a pull that has a fault at this moment.
    pub fn until(moment: Moment) -> Self {
        Self { told: Mutex::default(), moment, fault: Mutex::default(), changed: Condvar::new() }
    }

    /// Waits, where the fault is not there yet.
    pub fn wait_for_fault(&self) {
        let mut fault = self.fault.lock().unwrap();
        fault.is_waited_for = true;
        drop(self.changed.wait_timeout_while(fault, LONGEST_WAIT, |fault| !fault.is_there).unwrap());
    }

    /// The fault was injected, or never will be.
    pub fn fault_is_there(&self) {
        self.fault.lock().unwrap().is_there = true;
        self.changed.notify_all();
    }

    /// Whether the experiment is held.
    pub fn waits(&self) -> bool {
        self.fault.lock().unwrap().is_waited_for
    }

    /// Takes in what the experiment tells.
    pub fn take(&self, event: &RigEvent) {
        self.keep(event);
        let told = *self.told.lock().unwrap();
        if MOMENTS.into_iter().any(|moment| moment > self.moment && told.reached(moment)) {
            self.wait_for_fault();
        }
    }

    fn keep(&self, event: &RigEvent) {
        let mut told = self.told.lock().unwrap();
        match event {
            RigEvent::Step(step) => {
                let moment = match *step {
                    "the way to the part" => Moment::Approach,
                    "rest images" => Moment::RestImages,
                    "the way down" => Moment::WayDown,
                    "zeroing the force sensor" => Moment::Zeroing,
                    "gripping" => Moment::Gripping,
                    "grip images" => Moment::GripImages,
                    "pulling" => Moment::EarlyPull,
                    "releasing" => Moment::Release,
                    "the way back" => Moment::Retract,
                    _ => return,
                };
                told.moment = Some(moment);
            }
            RigEvent::Reading { desired_n, displacement_mm, .. } => {
                (told.desired_n, told.displacement_mm) = (*desired_n, *displacement_mm);
            }
            _ => {}
        }
    }

    /// Whether this moment has begun.
    fn reached(&self, moment: Moment, rig: &ServedRig) -> bool {
        let told = *self.told.lock().unwrap();
        match moment {
            Moment::Settling => {
                told.moment >= Some(Moment::Gripping) && rig.status().grip == GripState::Holding
            }
            moment => told.reached(moment),
        }
    }

    /// Whether the jaws may open from now on.
    pub fn releases(&self) -> bool {
        self.told.lock().unwrap().moment >= Some(Moment::Release)
    }
}

/// Somebody who looks at the arm and the jaws all the time.
pub struct Watch<'a> {
    pub rig: &'a ServedRig,
    pub progress: &'a Progress,
    held: bool,
    /// The jaws let go while the arm moved, or when nobody had said that they should.
    pub let_go: Option<String>,
}

impl<'a> Watch<'a> {
    pub fn new(rig: &'a ServedRig, progress: &'a Progress) -> Self {
        Self { rig, progress, held: false, let_go: None }
    }

    /// One look.
    pub fn look(&mut self) {
        let status = self.rig.status();
        if self.held && !status.holds {
            if status.speed_m_s > 0.0 {
                self.let_go = Some(format!("the jaws let go at {} m/s", status.speed_m_s));
            } else if !self.progress.releases() {
                self.let_go = Some("the jaws let go before the release".into());
            }
        }
        self.held = status.holds;
    }

    /// Whether the jaws hold.
    pub fn holds(&self) -> bool {
        self.held
    }

    /// Looks for so long, or until it is so.
    pub fn until(&mut self, limit: Duration, mut is: impl FnMut(&mut Self) -> bool) -> bool {
        let began = Instant::now();
        loop {
            self.look();
            if is(self) {
                return true;
            }
            if began.elapsed() >= limit {
                return false;
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Looks until a moment has begun, or the pull is over.
    pub fn until_moment(&mut self, moment: Moment, limit: Duration, over: impl Fn() -> bool) -> bool {
        self.until(limit, |w| w.progress.reached(moment, w.rig) || over()) && !over()
    }

    /// The last moment that has begun.
    pub fn moment(&self) -> Option<Moment> {
        MOMENTS.into_iter().rev().find(|moment| self.progress.reached(*moment, self.rig))
    }

    /// Whether the arm stands and no program runs.
    pub fn stands(&self) -> bool {
        let status = self.rig.status();
        status.speed_m_s == 0.0 && !status.program_runs
    }
}
