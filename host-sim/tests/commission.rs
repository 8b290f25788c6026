//! Ctrl-C during `host-sim commission --port`. A simulated motor is at the other end of a pseudo terminal. The signal
//! comes during the excitation, and after the switch to the new gains. Unix only, because of terminals and signals.
#![cfg(unix)]

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::io::{ErrorKind, Read, Write};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use controller_core::Limits;
use controller_core::drive::{ALARMS, Encoder, Motor, MotorDesign, MotorDrive, Position};
use link::live::LiveDrive;
use link::remote::Loadable;
use link::transport::{Transport, TransportError};
use pil_wire::{Event, Instance, Live, Machine, Model, Row, Seat, halves};
use serialport::{SerialPort, TTYPort};

type Law = MotorDrive<f32, Position, 1>;
const PERIOD_S: f64 = 1e-3;
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
const DESIGN: MotorDesign = MotorDesign::by_rule(PERIOD_S, MOTOR, Encoder::absolute(20), Limits::symmetric(10.0));
/// Timeout; no run here takes so long.
const HANGS: Duration = Duration::from_mins(2);

/// Motor and control interrupt.
struct Chip {
    seat: Seat<Law, 1, 2>,
    x: [f64; 2],
    u: f32,
}

impl Machine<Law, 1, 2> for Chip {
    fn between<T>(&mut self, work: impl FnOnce(&mut Seat<Law, 1, 2>) -> T) -> T {
        work(&mut self.seat)
    }

    fn wait(&mut self) {
        let counts = [Some((self.x[0] / TAU * 1_048_576.0).floor() as i32)];
        let is_to_change = self.seat.is_to_change();
        let output = if is_to_change { self.seat.change(counts, None) } else { self.seat.tick(counts, None) };
        self.u = output.u;
        for _ in 0..10 {
            let friction = 0.005 * (self.x[1] / 0.005).tanh();
            let torque = MOTOR.torque_n_m_per_a * f64::from(output.u) - friction;
            self.x[1] += 0.1 * PERIOD_S * torque / MOTOR.inertia_kg_m2;
            self.x[0] += 0.1 * PERIOD_S * self.x[1];
        }
    }
}

/// Board: target with its serial line.
struct Board {
    live: Live<Law, 1, 2>,
    chip: Chip,
    sent: VecDeque<u8>,
}

impl Board {
    fn new() -> Self {
        let (live, law) = Live::new(design().words).expect("a good design");
        let live = live.recording_in(vec![Row::default(); 4000].leak());
        Self { live, chip: Chip { seat: Seat::new(law), x: [0.0; 2], u: 0.0 }, sent: VecDeque::new() }
    }
}

impl Transport for Board {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for &byte in bytes {
            self.sent.extend(self.live.receive(byte, &mut self.chip).into_iter().flatten());
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _: Duration) -> Result<usize, TransportError> {
        (0..5).for_each(|_| self.chip.wait());
        let count = into.len().min(self.sent.len());
        for (to, from) in into.iter_mut().zip(self.sent.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }
}

fn design() -> Loadable {
    let law = Law::try_design(&DESIGN).expect("a good design");
    let bounds = DESIGN.bounds(&law, 0.2);
    let numbers = DESIGN.to_numbers().into_iter().chain(bounds.to_numbers()).chain([f64::from(ALARMS.bits())]);
    let instance = Instance { n: 2, r: 3, mask: Instance::TWO_SETS, model: Model::Motor };
    Loadable { instance, words: numbers.flat_map(halves).collect() }
}

#[test]
fn ctrl_c_leaves_a_drive_at_rest_with_the_gains_of_before() {
    let folder = std::env::temp_dir().join(format!("host-sim-commission-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("motor.toml");
    std::fs::write(&file, scenario::MOTOR).expect("a file");
    // First the design of the file is loaded and excited, then the identified design is loaded. Each case: number of
    // designs, and ticks after the last one.
    for (designs, ticks) in [(1, 500), (2, 100), (2, 700)] {
        let label = format!("{ticks} ticks after design {designs}");
        let (mut line, name) = {
            let (line, end) = TTYPort::pair().expect("a pseudo terminal");
            (line, end.name().expect("its name"))
        };
        let sets = ["encoder.bits=20", "drive.gain_sets=2", "drive.uncertain_percent=50", "motor.current_lag_s=0"];
        let more = ["motor.damping_n_m_s=1e-5", "motor.torque_n_m_per_a=0.0625"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
        command.current_dir(&folder).arg("commission").arg(&file).args(["--port", &name, "-o", "found.toml"]);
        command.args(sets.iter().chain(&more).flat_map(|set| ["--set", set]));
        let mut child = command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program");
        let (mut board, began) = (Board::new(), Instant::now());
        let (mut taken, mut left, mut shaken) = (0, ticks, 0.0_f32);
        line.set_timeout(Duration::from_millis(1)).expect("a timeout");
        while child.try_wait().expect("a child").is_none() {
            assert!(began.elapsed() < HANGS, "{label}: it hangs");
            let mut bytes = [0; 256];
            match line.read(&mut bytes) {
                Ok(count) => board.send(&bytes[..count]).expect("a wire"),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                // The other end is not open yet, or is closed.
                Err(_) => std::thread::sleep(Duration::from_millis(1)),
            }
            if let Some(Event::Started(_)) = board.live.take_event() {
                taken += 1;
            }
            let count = board.receive(&mut bytes, Duration::ZERO).expect("a wire");
            let _ = line.write_all(&bytes[..count]);
            shaken = shaken.max(board.chip.u.abs());
            if taken >= designs && shaken > 0.5 && left > 0 {
                left -= 5;
                if left == 0 {
                    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
                    assert!(sent.expect("kill").success());
                }
            }
        }
        let output = child.wait_with_output().expect("its last words");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{label}: {told}");
        assert!(told.contains("with the old gains"), "{label}: {told}");
        assert!(left == 0 && !folder.join("found.toml").exists(), "{label}: {shaken} A");
        let mut drive = LiveDrive::connect(board, Duration::from_millis(50)).expect("the drive");
        assert!(*drive.design() == design(), "{label}: another design runs");
        let (seen, track) = (drive.observe().expect("an answer"), drive.tracked().expect("an answer"));
        assert!(!seen.moving && seen.health.is_ok() && !track.goes_on, "{label}: {seen:?} {track:?}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
