// Data sheets, keys and limits of the inputs. A key is a key of the scenario file, with its unit.

export const SHEETS = [
  { id: "motor", plant: "motor", title: "Motor", note: "servo motor, no gear", sets: {} },
  {
    id: "geared",
    plant: "motor",
    title: "Geared motor with play",
    note: "encoder on the motor, play 0.002 rad",
    sets: {
      "motor.gear": "[9, 1]",
      "motor.load_inertia_kg_m2": "5e-3",
      "motor.play_rad": "0.002",
      "encoder.bits": "16",
    },
  },
  { id: "joint", plant: "joint", title: "Soft joint", note: "spring of 9 N m/rad, two 20-bit encoders", sets: {} },
  {
    id: "stiff",
    plant: "joint",
    title: "Stiff joint",
    note: "harmonic drive, 8000 N m/rad",
    sets: {
      "joint.gear": "[100, 1]",
      "joint.motor_inertia_kg_m2": "1.2e-4",
      "joint.torque_n_m_per_a": "0.08",
      "joint.motor_damping_n_m_s": "2e-4",
      "joint.link_inertia_kg_m2": "0.4",
      "joint.stiffness_n_m": "8000.0",
      "joint.link_damping_n_m_s": "0.5",
      "joint.weight_n_m": "10.0",
      "joint.max_current_a": "8.0",
      "encoder.link.bits": "19",
      "encoder.motor.bits": "32",
      "encoder.motor.counts_per_turn": "16384",
      "encoder.motor.states": "4294967296",
      "drive.sudden_load_n_m": "17.92",
    },
  },
];

const number = (key, label, unit) => ({ key, label, unit });
/** What limits the current at speed. */
const supply = (plant) => [
  number(`${plant}.supply_v`, "Supply voltage, if it limits", "V"),
  number(`${plant}.resistance_ohm`, "Winding resistance", "Ω"),
  number(`${plant}.no_load_rad_s`, "or no-load speed of the motor", "rad/s"),
];

/** Numbers of the data sheet. */
export const SHEET_FIELDS = {
  motor: [
    number("motor.inertia_kg_m2", "Rotor inertia", "kg m²"),
    number("motor.torque_n_m_per_a", "Torque constant", "N m/A"),
    number("motor.max_current_a", "Current limit", "A"),
    number("motor.damping_n_m_s", "Viscous friction", "N m s/rad"),
    number("motor.load_inertia_kg_m2", "Load inertia, behind the gear", "kg m²"),
    { key: "motor.gear", label: "Gear ratio", unit: "motor : output", isText: true, preset: "[1, 1]" },
    number("motor.current_lag_s", "Current loop lag", "s"),
    ...supply("motor"),
  ],
  joint: [
    number("joint.link_inertia_kg_m2", "Link inertia", "kg m²"),
    number("joint.motor_inertia_kg_m2", "Motor inertia", "kg m²"),
    number("joint.stiffness_n_m", "Spring stiffness", "N m/rad"),
    number("joint.torque_n_m_per_a", "Torque constant", "N m/A"),
    number("joint.max_current_a", "Current limit", "A"),
    number("joint.link_damping_n_m_s", "Link friction", "N m s/rad"),
    number("joint.motor_damping_n_m_s", "Motor friction", "N m s/rad"),
    number("joint.weight_n_m", "Link weight", "N m"),
    { key: "joint.gear", label: "Gear ratio", unit: "motor : spring", isText: true, preset: "[1, 1]" },
    number("joint.current_lag_s", "Current loop lag", "s"),
    number("encoder.motor.bits", "Motor encoder", "bit"),
    number("encoder.motor.counts_per_turn", "Motor counts, before the gear", "1/rev"),
    number("drive.sudden_load_n_m", "Largest sudden load", "N m"),
    ...supply("joint"),
  ],
};

/** Remark below the numbers of a data sheet. */
export const SHEET_NOTE =
  "Torque constant and current limit: both in peak or both in rms amperes. A three-phase motor with a supply: peak " +
  "amperes, 0.866 of the bus voltage, and 1.5 times the resistance of a phase.";

const slider = (key, label, unit, low, high, more = {}) => ({ key, label, unit, low, high, ...more });
const ROUGH = { isRule: true, isLog: true };

/** Sliders of the design. `isRule`: without a value the rule of the library chooses. */
export const DESIGN_SLIDERS = {
  motor: [
    slider("drive.surface_rad_s", "Position bandwidth", "rad/s", 5, 1000, { ...ROUGH, gain: "surface_rad_s" }),
    slider("drive.margin", "Peak sensitivity of the rule", "", 1.2, 3, {
      isRule: true,
      step: 0.05,
      ruled: "fast",
      isCapped: true,
    }),
    slider("drive.period_s", "Sampling period", "s", 5e-5, 5e-3, { isLog: true }),
    slider("encoder.bits", "Encoder", "bit", 8, 24, { step: 1 }),
    slider("drive.uncertain_percent", "Tolerance of the data sheet", "%", 0, 50, { step: 1 }),
  ],
  joint: [
    slider("drive.surface_rad_s", "Position bandwidth", "rad/s", 1, 300, { ...ROUGH, gain: "surface_rad_s" }),
    slider("drive.margin", "Peak sensitivity of the rule", "", 1.2, 3, {
      isRule: true,
      step: 0.05,
      ruled: "fast",
      onlyCoupled: true,
    }),
    slider("drive.period_s", "Sampling period", "s", 1e-4, 5e-3, { isLog: true }),
    slider("encoder.link.bits", "Link encoder", "bit", 12, 24, { step: 1 }),
    slider("drive.uncertain_percent", "Tolerance of the data sheet", "%", 0, 50, { step: 1 }),
  ],
};

/** Sliders of the simulated plant; `share` is a share of the largest torque at the output. */
export const PLANT_SLIDERS = {
  motor: [
    slider("load", "Load step at the output", "N m", 0, 1, { share: 1 }),
    slider("friction.coulomb_n_m", "Friction", "N m", 0, 0.2, { share: 0.2 }),
    slider("motor.play_rad", "Play of the gear", "rad", 0, 0.02, { step: 0.0005, needs: "motor.load_inertia_kg_m2" }),
  ],
  joint: [
    slider("load", "Load step on the link", "N m", 0, 1, { share: 0.5 }),
    slider("friction.coulomb_n_m", "Friction", "N m", 0, 0.2, { share: 0.1 }),
  ],
};

const percent = (key, label) => slider(key, label, "%", -50, 50, { step: 1 });

/** Deviations of the true plant from the data sheet. */
export const ERROR_SLIDERS = {
  motor: [
    percent("error.inertia_percent", "Inertia"),
    percent("error.torque_percent", "Torque constant"),
    percent("error.damping_percent", "Viscous friction"),
  ],
  joint: [
    percent("error.link_inertia_percent", "Link inertia"),
    percent("error.motor_inertia_percent", "Motor inertia"),
    percent("error.stiffness_percent", "Stiffness"),
    percent("error.torque_percent", "Torque constant"),
    percent("error.weight_percent", "Weight"),
    percent("error.link_damping_percent", "Link friction"),
    percent("error.motor_damping_percent", "Motor friction"),
  ],
};

/** Faults as buttons. `sets` gets the time of the fault (s), the period (s) and the largest current (A). */
export const FAULTS = [
  {
    id: "missed",
    label: "Missed ticks",
    plants: ["motor", "joint"],
    what: (at, period) => `The control interrupt is missed for 5 ticks (${show(5 * period * 1e3)} ms).`,
    sets: (at, period) => [`fault=[{kind = "missed", at_s = ${at}, for_s = ${5 * period}}]`],
  },
  {
    id: "reversed",
    label: "Reversed encoder",
    plants: ["motor", "joint"],
    isFromStart: true,
    what: () => "The motor turns against its current, as with a reversed encoder or two swapped phases.",
    sets: () => ["error.reversed=true"],
  },
  {
    id: "frozen",
    label: "Frozen encoder",
    plants: ["motor"],
    what: () => "The count no longer changes.",
    sets: (at) => [`fault=[{kind = "stuck", at_s = ${at}}]`],
  },
  {
    id: "frozen-link",
    label: "Frozen link encoder",
    plants: ["joint"],
    what: () => "The link count no longer changes.",
    sets: (at) => [`fault=[{kind = "stuck", encoder = "link", at_s = ${at}}]`],
  },
  {
    id: "frozen-motor",
    label: "Frozen motor encoder",
    plants: ["joint"],
    what: () => "The motor count no longer changes.",
    sets: (at) => [`fault=[{kind = "stuck", encoder = "motor", at_s = ${at}}]`],
  },
  {
    id: "cut",
    label: "Cut encoder cable",
    plants: ["motor", "joint"],
    what: () => "No count arrives any more.",
    sets: (at) => [`fault=[{kind = "lost", at_s = ${at}}]`],
  },
  {
    id: "jump",
    label: "Jump of the count",
    plants: ["motor", "joint"],
    what: () => "The count jumps by 1000.",
    sets: (at) => [`fault=[{kind = "jump", counts = 1000, at_s = ${at}}]`],
  },
  {
    id: "derated",
    label: "Half the current",
    plants: ["motor", "joint"],
    what: (at, period, most) => `The power stage delivers only ${show(most / 2)} A.`,
    sets: (at, period, most) => [`fault=[{kind = "derated", current_a = ${most / 2}, at_s = ${at}}]`],
  },
];

/** Meaning of the status flags: what a reader of the page needs. */
export const FLAGS = {
  input_rejected: ["INPUT_REJECTED", "a sample was not usable; the output was the fallback", "alarm"],
  saturated: ["SATURATED", "the current was at its limit", "note"],
  sigma_star_over_bound: ["SIGMA_STAR_OVER_BOUND", "the sliding variable exceeded its bound", "alarm"],
  sample_lost: ["SAMPLE_LOST", "a count was missing or impossible; the observer predicted it", "note"],
  disturbance_over_bound: ["DISTURBANCE_OVER_BOUND", "the estimated load exceeded its bound", "alarm"],
  stuck_at_limit: ["STUCK_AT_LIMIT", "the current was at its limit for too long", "alarm"],
  stopped: ["STOPPED", "a monitor stopped the drive; the output is 0 A or the safe current", "stop"],
  position_stepped: ["POSITION_STEPPED", "the position was taken from the counts again", "note"],
  waits: ["WAITS", "the drive waits for consistent counts", "note"],
  wrong_way: ["WRONG_WAY", "the shaft accelerated against its current", "alarm"],
  oscillates: ["OSCILLATES", "the estimated load oscillated beyond its bound", "alarm"],
  brakes: ["BRAKES", "the drive braked after an alarm", "stop"],
  overspeed: ["OVERSPEED", "the speed exceeded its limit", "alarm"],
  following_error: ["FOLLOWING_ERROR", "the error exceeded its limit", "alarm"],
  end_of_range: ["END_OF_RANGE", "the shaft reached an end of its range", "alarm"],
  hunts: ["HUNTS", "the shaft hunted at rest; a wider rest band stopped it", "note"],
};

/** Formats a number with at most three significant digits. */
export function show(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    return `${mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa}e${Number(power)}`;
  }
  return String(Number(value.toPrecision(digits)));
}
