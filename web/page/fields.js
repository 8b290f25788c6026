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

const number = (key, label, unit, hint = "") => ({ key, label, unit, hint });
const INERTIA = "1 g cm² = 1e-7 kg m²: 120 g cm2 can be typed as it is.";
const TORQUE = "Also as 36.9 mNm/A, or as the speed constant in rpm/V.";
const CURRENT = "The smaller of the peak current of the motor and the limit of the inverter, not the rated current.";
const FRICTION = "0 if unknown. At most torque constant × no-load current / no-load speed in rad/s.";
const LAG = "Time constant 1/(2π f) of the current loop, or its bandwidth: 1 kHz. If unknown, keep the number.";
/** What limits the current at speed. */
const supply = (plant) => [
  number(`${plant}.supply_v`, "Supply voltage, if it limits", "V", "Empty: every current flows at every speed."),
  number(`${plant}.resistance_ohm`, "Winding resistance", "Ω", "Between two terminals of the motor."),
  number(`${plant}.no_load_rad_s`, "or no-load speed of the motor", "rad/s", "In place of the voltage; also in rpm."),
];

/** Numbers of the data sheet. */
export const SHEET_FIELDS = {
  motor: [
    number("motor.inertia_kg_m2", "Rotor inertia", "kg m²", INERTIA),
    number("motor.torque_n_m_per_a", "Torque constant", "N m/A", TORQUE),
    number("motor.max_current_a", "Current limit", "A", CURRENT),
    number("motor.damping_n_m_s", "Viscous friction", "N m s/rad", FRICTION),
    number("motor.load_inertia_kg_m2", "Load inertia, behind the gear", "kg m²", `What the output turns. ${INERTIA}`),
    { key: "motor.gear", label: "Gear ratio", unit: "motor : output", preset: "[1, 1]", hint: "As 9 or 50:3." },
    number("motor.current_lag_s", "Current loop lag", "s", LAG),
    ...supply("motor"),
  ],
  joint: [
    number("joint.link_inertia_kg_m2", "Link inertia", "kg m²", "What the output turns."),
    number("joint.motor_inertia_kg_m2", "Motor inertia", "kg m²", `At the motor shaft, before the gear. ${INERTIA}`),
    number("joint.stiffness_n_m", "Spring stiffness", "N m/rad", "Of the gear or spring, at the output."),
    number("joint.torque_n_m_per_a", "Torque constant", "N m/A", `Of the motor alone. ${TORQUE}`),
    number("joint.max_current_a", "Current limit", "A", CURRENT),
    number("joint.link_damping_n_m_s", "Link friction", "N m s/rad", FRICTION),
    number("joint.motor_damping_n_m_s", "Motor friction", "N m s/rad", `At the motor shaft. ${FRICTION}`),
    number("joint.weight_n_m", "Link weight", "N m", "Torque that holds the horizontal link; 0 for a vertical axis."),
    { key: "joint.gear", label: "Gear ratio", unit: "motor : spring", preset: "[1, 1]", hint: "As 100 or 50:3." },
    number("joint.current_lag_s", "Current loop lag", "s", LAG),
    number("encoder.motor.bits", "Motor encoder", "bit", "Width of the counter that the controller reads."),
    number("encoder.motor.counts_per_turn", "Motor counts, before the gear", "1/rev", "Four per line."),
    number("drive.sudden_load_n_m", "Largest sudden load", "N m", "A larger step looks like an encoder fault."),
    ...supply("joint"),
  ],
};

/** Remark below the numbers of a data sheet. */
export const SHEET_NOTE =
  "Torque constant and current limit: both in peak or both in rms amperes. A three-phase motor with a supply: peak " +
  "amperes, 0.866 of the bus voltage, and 1.5 times the resistance of a phase.";

const withMilli = (unit, more) => ({ [unit]: 1, [`m${unit}`]: 1e-3, ...more });
/** Factors of the units of data sheets, by the end of the key: without spaces and signs, in lower case. */
const UNITS = {
  inertia_kg_m2: { kgm2: 1, gm2: 1e-3, kgcm2: 1e-4, kgmm2: 1e-6, gcm2: 1e-7 },
  torque_n_m_per_a: withMilli("nm/a", { "ncm/a": 1e-2 }),
  current_a: withMilli("a"),
  damping_n_m_s: withMilli("nms/rad", { nms: 1, mnms: 1e-3 }),
  lag_s: withMilli("s", { us: 1e-6, "µs": 1e-6 }),
  supply_v: withMilli("v"),
  resistance_ohm: withMilli("ohm", { "ω": 1, "mω": 1e-3 }),
  no_load_rad_s: { "rad/s": 1, rpm: Math.PI / 30, "1/min": Math.PI / 30 },
  weight_n_m: withMilli("nm", { ncm: 1e-2 }),
};
/** Units whose number is the inverse: the product of both. */
const INVERSE = {
  lag_s: { hz: 1 / (2 * Math.PI), khz: 1e-3 / (2 * Math.PI) },
  torque_n_m_per_a: { "rpm/v": 30 / Math.PI, "1/min/v": 30 / Math.PI },
};

/** Returns a number with a unit of data sheets in the unit of its key, as text; `null` for another text. */
export function inUnitOf(key, text) {
  const [, digits, unit] = /^([+-]?[\d.,]+(?:e[+-]?\d+)?)\s*(\D.*)$/i.exec(text) ?? [];
  const of = (table) => Object.entries(table).find(([end]) => key.endsWith(end))?.[1] ?? {};
  const name = unit?.toLowerCase().replace(/[\s·*^()]/g, "").replace(/²/g, "2");
  const size = Number(digits?.replace(",", "."));
  const [factor, product] = [of(UNITS)[name], of(INVERSE)[name]];
  const value = factor ? size * factor : product / size;
  return Number.isFinite(value) ? String(Number(value.toPrecision(12))) : null;
}

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
