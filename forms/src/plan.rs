//! Plans of a position drive as C: rest, sine, and the polynomial transition to either.
//!
//! Sine, transition and the coefficients of a transition come from operation traces ([`tick_record::plan`]). The code
//! here is written by hand: it validates numbers, locates a tick between start and end, and computes the start of a
//! plan (the gap, the phase of a tick, the end of a stop). Tests compare all of it with `controller_core::drive` bit by
//! bit.

use std::f64::consts::TAU;

use controller_core::drive::{FARTHEST_RAD, PROFILE_UNITS};
use tick_record::drive::JET;
use tick_record::plan::{PlanFunctions, plan};
use tick_record::{Port, Record, Role};

use super::c99::{File, filled};

/// Returns the functions of plans; `order` counts the derivatives of a target, r included. A motor's plan uses one
/// more.
pub(super) fn functions(file: &File<'_>, order: usize, period_s: f64) -> String {
    let (taken, recorded) = if order == 2 { (3, plan::<3>()) } else { (4, plan::<4>()) };
    let (PlanFunctions { sine, join, profile: jet_of_profile, powers }, width) = (&recorded, 2 * taken);
    let of = |meaning: &str, head: &str, record: &Record, double| {
        file.function_in(double, meaning, head, record, &place, &[])
    };
    [
        types(order, taken),
        of(
            "Part of a plan: position and derivatives of A sin at a phase in 2^-32 revolutions.",
            "void @_jet_of_sine(uint32_t phase, float amplitude, float omega, @_jet *jet)",
            sine,
            false,
        ),
        of(
            "Part of a plan: adds the transition to position and derivatives of the goal.",
            &format!(
                "void @_join(const float power[{width}], uint32_t ticks, uint32_t rest, uint32_t early, float per_tick,
    float rate, float instant_s, @_jet *jet)"
            ),
            join,
            false,
        ),
        of(
            "Part of a plan: coefficients of a transition that closes a gap in tau_s seconds.",
            &format!(
                "void @_powers_of_join(const double gap[{taken}], double tau_s, double s[{width}],
    double left[{width}])"
            ),
            powers,
            true,
        ),
        played(order, taken, period_s),
        made(taken, period_s),
        of(
            "Part of a profile: target from the movement of the averages in the last ticks and their lag behind \
            the base.",
            &format!(
                "void @_jet_of_profile(const uint32_t moved[{}], const uint32_t behind[2], uint32_t rest, float \
                part_rad,
    float per_s, @_jet *jet)",
                2 * (taken - 1)
            ),
            jet_of_profile,
            false,
        ),
        profile(order, taken, period_s),
    ]
    .map(|text| file.c(&text))
    .concat()
}

fn place(port: &Port) -> String {
    let name = &port.name;
    match (port.role, name.split_once('_')) {
        (Role::Argument, Some(("goal", of))) => format!("jet->{of}"),
        (_, Some((row @ ("power" | "gap" | "s" | "left" | "moved" | "behind"), k))) => format!("{row}[{k}]"),
        (Role::Output, _) => format!("jet->{name}"),
        _ => name.clone(),
    }
}

fn types(order: usize, taken: usize) -> String {
    let jet = if order == taken {
        "\n/* Start of a plan: position and derivatives. */\ntypedef @_target @_jet;\n".into()
    } else {
        let members: Vec<String> = JET[1..taken].iter().map(|name| format!("    float {name};\n")).collect();
        format!(
            "
/* Start of a plan: a target with one more derivative, so that u has no step. */
typedef struct {{
    int32_t turn;
    float r;
{}}} @_jet;
",
            members.concat()
        )
    };
    jet + &filled(include_str!("c/plan_types.h"), &[("width", &(2 * taken))])
}

/// Returns the statements that copy a trajectory point to a target.
fn copied(order: usize) -> String {
    let copied = |name: &&str| format!("    target->{name} = jet.{name};\n");
    JET[..order].iter().map(copied).collect::<Vec<_>>().concat()
}

/// Returns the functions that the interrupt calls.
fn played(order: usize, taken: usize, period_s: f64) -> String {
    let zeros: Vec<String> = JET[1..taken].iter().map(|name| format!("        jet->{name} = 0.0f;\n")).collect();
    let (zeros, copied) = (zeros.concat(), copied(order));
    // Unrolled, so that the cycle bound of the interrupt needs no loop limit.
    let last = 2 * taken - 1;
    let sum = |k| format!("    sum = @_share(sum, s) + plan->way[half][{k}];\n");
    let sums: Vec<String> = (0..last).rev().map(sum).collect();
    let instant_s = (period_s / 2_f64.powi(32)) as f32;
    filled(
        include_str!("c/plan_played.h"),
        &[
            ("zeros", &zeros),
            ("copied", &copied),
            ("last", &last),
            ("sums", &sums.concat()),
            ("instant_s", &format!("{instant_s:?}f")),
        ],
    )
}

/// Returns the functions that create a plan.
fn made(taken: usize, period_s: f64) -> String {
    let gap = |(j, name): (usize, &&str)| format!("    gap[{j}] = (double)present->{name} - (double)at.{name};\n");
    let gap: Vec<String> = JET[..taken].iter().enumerate().map(gap).collect();
    let gap = gap.concat();
    let speed: Vec<String> = JET[1..taken].iter().map(|name| format!("(double)present->{name}")).collect();
    filled(
        include_str!("c/plan_made.h"),
        &[
            ("gap", &gap),
            ("taken", &taken),
            ("speed", &speed.join(", ")),
            ("speeds", &(taken - 1)),
            ("width", &(2 * taken)),
            ("period_s", &format!("{period_s:?}")),
            ("tau", &format!("{TAU:?}")),
            ("farthest_rad", &format!("{FARTHEST_RAD:?}")),
            ("units_per_rad", &format!("{:?}", 2_f64.powi(32) / TAU)),
        ],
    )
}

/// Returns the functions for set-points at arbitrary times.
fn profile(order: usize, taken: usize, period_s: f64) -> String {
    let (averages, [most, unit_rad]) = (taken - 1, PROFILE_UNITS);
    let before = |windows| format!("@_profile_before(profile, {windows}u)");
    let step = "(uint64_t)(int64_t)profile->step";
    let comb = if averages == 2 {
        format!("({step} - (2u * {})) + {}", before(1), before(2))
    } else {
        format!("(({step} - (3u * {})) + (3u * {})) - {}", before(1), before(2), before(3))
    };
    let integrator = |k| format!("    sum += profile->sums[{k}];\n    profile->sums[{k}] = sum;\n");
    let integrators: Vec<String> = (0..averages).map(integrator).collect();
    let earlier = |k| format!("    @_profile_split(profile->earlier[{}], &moved[{}]);\n", k - 1, 2 * k);
    let earlier: Vec<String> = (1..averages).map(earlier).collect();
    let per_s = (1.0 / period_s) as f32;
    let [speed_unit, acceleration_unit] = [unit_rad / period_s, unit_rad / (period_s * period_s)];
    filled(
        include_str!("c/profile.h"),
        &[
            ("averages", &averages),
            ("last", &(averages - 1)),
            ("memory", &(4 * averages)),
            ("window", if averages == 2 { &"32" } else { &"128" }),
            ("most_window", if averages == 2 { &"512" } else { &"128" }),
            ("all", &vec!["window"; averages].join(" * ")),
            ("most", &format!("{most:?}")),
            ("unit_rad", &format!("{unit_rad:?}")),
            ("speed_unit", &format!("{speed_unit:?}")),
            ("acceleration_unit", &format!("{acceleration_unit:?}")),
            ("started_unit", &format!("{:?}", f64::from(per_s) * unit_rad)),
            ("per_s", &format!("{per_s:?}f")),
            ("comb", &comb),
            ("integrators", &integrators.concat()),
            ("earlier", &earlier.concat()),
            ("copied", &copied(order)),
        ],
    )
}
