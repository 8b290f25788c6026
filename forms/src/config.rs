//! Configuration of a drive as a C constant, for a program that links the static library `libedo_smc.a`.
//!
//! The library computes the design on the target, bit-identical to the host. So the constant, whose type is in
//! `edo_smc.h`, contains the whole drive, with the name of each number. A drive with a setting that the library lacks
//! is rejected.

use std::fmt::Write as _;

use controller_core::VERSION;
use controller_core::drive::{FenceLimits, Mounting};
use loop_sim::port::drive::{DriveDesign, DriveOf, Follows, Form, Monitors, Reaction};
use scenario::Drive;

use super::c99::File;
use super::{About, Error};

/// Members of a motor's configuration in the order of `edo_smc.h`. `name` is a number, `name*2` an array of two
/// numbers, `name{ .. }` a struct or an array of structs, and `{ .. }` an entry of such an array.
const MOTOR: &str = "period_s motor{ inertia_kg_m2 torque_n_m_per_a damping_n_m_s } \
     encoder{ bits counts_per_turn gear_num gear_den states } limits{ min max } \
     bandwidths{ surface_rad_s observer_rad_s reaching_per_s offset_per_s } fast_ratio \
     switching{ calm_steps alert_steps smoothing_s keep_s } gate_steps lost_ticks hold safe_u";
/// First members of both configurations of a joint, in the syntax of [`MOTOR`].
const JOINT: &str = "period_s joint{ link_inertia_kg_m2 link_damping_n_m_s weight_n_m stiffness_n_m \
     motor_inertia_kg_m2 motor_damping_n_m_s torque_n_m_per_a } \
     encoders{ { bits counts_per_turn gear_num gear_den states } { bits counts_per_turn gear_num gear_den states } } \
     limits{ min max } bandwidths{ surface_rad_s link_rad_s motor_rad_s reaching_per_s offset_per_s } fast_ratios*2 \
     switching{ calm_steps alert_steps smoothing_s keep_s } gate_steps*2 lost_ticks hold safe_u";
/// Further members of a coupled joint, in the syntax of [`MOTOR`].
const COUPLED: &str = "coupled{ lag_s resolution_rad*2 calm_steps*2 }";

/// Configuration of a drive: its kind (`motor`, `joint`, `coupled`), members, numbers, reaction and limits.
struct Config {
    kind: &'static str,
    members: String,
    numbers: Vec<f64>,
    reaction: Reaction,
    fence: Option<FenceLimits>,
}

/// Returns the C file.
///
/// # Errors
/// The library lacks this kind of drive, or its configuration lacks a setting.
pub(super) fn text(drive: &Drive, about: &About<'_>, prefix: &str) -> Result<String, Error> {
    let form = drive.designed.form();
    carried(&drive.designed)?;
    let config = Config::of(&drive.designed, drive.current_lag_s)?;
    let Config { kind, numbers, reaction, fence, .. } = &config;
    let fast = if form.gain_sets > 1 { "_fast" } else { "" };
    let late = if form.delay_ticks > 0 { "_late" } else { "" };
    let name = format!("{kind}{fast}{late}");
    let mut out = format!(
        "/* Configuration of the drive {name}: {}, T = {:?} s.\n \
         * Exported for version {VERSION} of the archive. Do not edit; export again. C99 and C++20.\n *\n \
         *     static edo_smc_design_{name}_t design;\n \
         *     status = edo_smc_design_{name}(&{prefix}_config, sizeof {prefix}_config, &design, sizeof design,\n \
         *{blank:39}NULL);\n *\n",
        drive.designed.title(),
        drive.designed.period_s(),
        blank = "",
    );
    for (shaft, (_, mounted)) in drive.shafts.iter().zip(drive.designed.encoders()) {
        let Mounting { is_reversed, offset_counts } = mounted.mounting;
        if mounted.mounting != Mounting::UPRIGHT {
            let offset = format!("(uint32_t){offset_counts}");
            let given = if is_reversed { format!("{offset} - register") } else { format!("register - {offset}") };
            let _ = writeln!(out, " * Count of the encoder on the {}: pass {given}.", shaft.name);
        }
    }
    if let Reaction::JoinedStop { ticks } = reaction {
        let _ = writeln!(out, " * After an alarm the scenario plans a stop of {ticks} ticks: use edo_smc_plan_stop_*.");
    }
    if drive.designed.rest_band().is_some() {
        out += " * The scenario has a rest band; the archive has none.\n";
    }
    for line in about.origin().lines() {
        out.push_str(format!(" * {line}").trim_end());
        out.push('\n');
    }
    let mut body = String::from("\n#include \"edo_smc.h\"\n");
    if !numbers.iter().all(|number| number.is_finite()) || fence.is_some() {
        body.insert_str(1, "#include <math.h>\n\n");
    }
    let _ = write!(
        body,
        "\nstatic const edo_smc_config_{kind}_t {prefix}_config = {{\n{}}};\n",
        initialiser(&config.members, numbers)
    );
    if let Some(FenceLimits { low_rad, high_rad, max_speed_rad_s, following_rad }) = fence {
        let limits = [*low_rad, *high_rad, *max_speed_rad_s, *following_rad];
        let _ = write!(
            body,
            "\nstatic const edo_smc_fence_limits_t {prefix}_limits = {{\n{}}};\n",
            initialiser("low_rad high_rad max_speed_rad_s following_rad", &limits)
        );
    }
    body.push('\n');
    Ok(out + " */\n" + &File::new(prefix).guarded("CONFIG_H", &body))
}

/// Checks that the library has a drive of this kind.
fn carried(designed: &DriveDesign) -> Result<(), Error> {
    let Form { follows, delay_ticks, observer_states, .. } = designed.form();
    let missing = match designed {
        _ if follows == Follows::Speed => "drive of a speed",
        _ if delay_ticks > 1 => "drive of more than one tick of delay",
        DriveDesign::Motor(_) if observer_states > 3 => "motor with four states of its observer",
        _ => return Ok(()),
    };
    Err(Error::ArchiveDrive(missing))
}

impl Config {
    fn of(designed: &DriveDesign, lag_s: f64) -> Result<Self, Error> {
        let (kind, members, numbers, load, monitors) = match designed {
            DriveDesign::Motor(DriveOf { design, monitors, .. }) => {
                let watched = watched(monitors)?;
                ("motor", format!("{MOTOR} lag_s"), design.to_numbers().to_vec(), lag_s, watched)
            }
            DriveDesign::Joint(DriveOf { design, monitors, .. }) => {
                let (watched, load_n_m) = (watched(monitors)?, monitors.sudden_load_n_m);
                match design.to_coupled_numbers() {
                    Some(numbers) => {
                        ("coupled", format!("{JOINT} {COUPLED} load_n_m"), numbers.to_vec(), load_n_m, watched)
                    }
                    None => ("joint", format!("{JOINT} load_n_m"), design.to_numbers().to_vec(), load_n_m, watched),
                }
            }
        };
        let (uncertain, reaction, fence) = monitors;
        let stops_at = f64::from(reaction.stops_at().bits());
        let numbers = numbers.into_iter().chain([load, uncertain, stops_at]).collect();
        Ok(Self { kind, members: members + " uncertain stops_at", numbers, reaction, fence })
    }
}

/// Returns the settings of the monitors that a configuration holds: uncertainty of the data sheet, reaction and limits.
fn watched<const E: usize>(monitors: &Monitors<E>) -> Result<(f64, Reaction, Option<FenceLimits>), Error> {
    let Monitors { uncertain, disturbance, sigma_star, stuck_ticks, reaction, fence, .. } = *monitors;
    if disturbance.iter().any(Option::is_some) || sigma_star.is_some() || stuck_ticks.is_some() {
        return Err(Error::ArchiveMonitors);
    }
    Ok((uncertain, reaction, fence))
}

/// Formats a number for C without loss of a bit.
fn number(number: f64) -> String {
    match number {
        f64::INFINITY => "INFINITY".into(),
        f64::NEG_INFINITY => "-INFINITY".into(),
        number => format!("{number:?}"),
    }
}

/// Formats the members with their numbers, one per line.
fn initialiser(members: &str, numbers: &[f64]) -> String {
    let mut numbers = numbers.iter().map(|value| number(*value));
    let mut next = || numbers.next().unwrap_or_default();
    let (mut out, mut depth) = (String::new(), 1);
    for member in members.split_whitespace() {
        if member == "}" {
            depth -= 1;
        }
        out.push_str(&"    ".repeat(depth));
        match (member, member.strip_suffix('{'), member.strip_suffix("*2")) {
            ("}", ..) => out.push_str("},\n"),
            (_, Some(name), _) => {
                depth += 1;
                let named = if name.is_empty() { String::new() } else { format!(".{name} = ") };
                let _ = writeln!(out, "{named}{{");
            }
            (.., Some(name)) => {
                let _ = writeln!(out, ".{name} = {{{}, {}}},", next(), next());
            }
            (name, ..) => {
                let _ = writeln!(out, ".{name} = {},", next());
            }
        }
    }
    out
}
