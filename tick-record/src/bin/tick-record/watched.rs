//! Drives with their monitors, for any design: the traces of their parts, and the locations of their numbers.

use controller_core::drive::{BRAKING, JointDrive, Monitored, MotorDrive, Mounting, Position};
use tick_record::drive::DriveFunctions;
use tick_record::joined::Joined;
use tick_record::{Id, Port, Record, Recorder, Role, drive, monitor};

use crate::designs::{JOINT_DRIVE, MOTOR};
use crate::memory::{Marked, Places, state_words};

/// A drive with monitors that brake and stop it at every alarm.
pub(crate) struct Watched {
    /// Name in the C library.
    pub(crate) name: &'static str,
    /// Number of additional gain sets, ticks of delay.
    pub(crate) forms: [u8; 2],
    pub(crate) functions: DriveFunctions,
    /// The tick of the drive without monitors.
    pub(crate) tick: Record,
    /// Suffixes of the names that belong to each shaft.
    pub(crate) shafts: Vec<&'static str>,
    pub(crate) places: Places,
}

macro_rules! watched {
    ($wanted:ident;
     $($name:ident: $drive:ty, $symbols:ident, $design:expr, $forms:expr, $shafts:expr;)*) => {{
        let mut all = Vec::new();
        $(if $wanted(stringify!($name)) {
        let drive = <$drive>::design($design);
        let symbols = |recorder: &Recorder| drive::$symbols(&drive, &mut |name| recorder.number(name, Role::Argument));
        let tick = drive::tick(&symbols);
        let mut marked = Marked::default();
        let law = drive::$symbols(&drive, &mut |name| marked.number(name));
        let mut shaft = 0;
        let bounds = $shafts.map(|_| {
            shaft += 1;
            marked.number(&format!("d{shaft}_bound"))
        });
        let sigma_star = marked.number("sigma_star_bound");
        let ticks = monitor::ticks(|name| marked.number(name));
        let law = Monitored::from_parts(law, bounds, sigma_star, ticks, marked.number("brake")).stopping_at(BRAKING);
        let state = [monitor::state($shafts.len()), state_words(&tick)].concat();
        let parts = Monitored::<$drive, { $shafts.len() }>::PARTS_AT;
        all.push(Watched {
            name: stringify!($name),
            forms: $forms,
            functions: drive::drive(&symbols, $shafts.map(|_| Mounting::UPRIGHT)),
            tick,
            shafts: $shafts.to_vec(),
            places: Places::of(&law, &marked, &parts, &state),
        });
        })*
        all
    }};
}

/// Returns the requested drives of the C library.
pub(crate) fn all(is_wanted: &dyn Fn(&str) -> bool) -> Vec<Watched> {
    const SHAFTS: [&str; 2] = ["_link", "_motor"];
    watched! {
        is_wanted;
        motor: MotorDrive, motor_of, &MOTOR, [0, 0], [""];
        motor_fast: MotorDrive<f32, Position, 1>, motor_of, &MOTOR, [1, 0], [""];
        motor_late: MotorDrive<f32, Position, 0, 1>, motor_of, &MOTOR, [0, 1], [""];
        motor_fast_late: MotorDrive<f32, Position, 1, 1>, motor_of, &MOTOR, [1, 1], [""];
        joint: JointDrive, joint_of, &JOINT_DRIVE, [0, 0], SHAFTS;
        joint_fast: JointDrive<f32, Position, 1>, joint_of, &JOINT_DRIVE, [1, 0], SHAFTS;
        joint_late: JointDrive<f32, Position, 0, 1>, joint_of, &JOINT_DRIVE, [0, 1], SHAFTS;
        joint_fast_late: JointDrive<f32, Position, 1, 1>, joint_of, &JOINT_DRIVE, [1, 1], SHAFTS;
    }
}

impl Watched {
    /// Returns the new state after the monitored tick, joined from its parts, for this state.
    pub(crate) fn ticked(&self, joined: &mut Joined, before: &[(Port, Id)]) -> Vec<(Port, Id)> {
        let one = self.shafts.len() == 1;
        let monitors = if one { monitor::monitor::<1>(BRAKING) } else { monitor::monitor::<2>(BRAKING) };
        let DriveFunctions { not_started, limits, .. } = &self.functions;
        monitor::watched(joined, [&self.tick, not_started, limits, &monitors], before, &self.shafts)
    }

    /// Returns the state words as inputs.
    pub(crate) fn state(&self, joined: &mut Joined) -> Vec<(Port, Id)> {
        let input = |(port, _): &(Port, usize)| (port.clone(), joined.input(&port.name, port.role, port.kind));
        self.places.state.iter().map(input).collect()
    }
}
