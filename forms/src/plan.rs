//! Plans of a drive that follows a position, as C: rest, sine, and the joined way onto either.
//!
//! Sine, join and the coefficients of a join are recorded ([`tick_record::plan`]). What is written here asks whether
//! numbers are good, says where between start and end a tick is, and computes what a plan begins with: the gap, the
//! phase of a tick, where a stop ends. All of it is held to `controller_core::drive` bit by bit.

use std::f64::consts::TAU;

use tick_record::drive::JET;
use tick_record::plan::{PlanFunctions, plan};
use tick_record::{Port, Record, Role};

use super::c99::File;

/// The functions of plans; `order` derivatives of a target, r included, of which a motor's plan takes over one more.
pub(super) fn functions(file: &File<'_>, order: usize, period_s: f64) -> String {
    let (taken, recorded) = if order == 2 { (3, plan::<3>()) } else { (4, plan::<4>()) };
    let (PlanFunctions { sine, join, powers }, width) = (&recorded, 2 * taken);
    let of = |meaning: &str, head: &str, record: &Record, double| {
        file.function_in(double, meaning, head, record, &place, &[])
    };
    [
        types(order, taken),
        of(
            "Part of a plan: the jet of A sin at a phase in 2^-32 turns.",
            "void @_jet_of_sine(uint32_t phase, float amplitude, float omega, @_jet *jet)",
            sine,
            false,
        ),
        of(
            "Part of a plan: what the way onto the goal adds to its jet.",
            &format!("void @_join(const float power[{width}], uint32_t ticks, float per_tick, float rate, @_jet *jet)"),
            join,
            false,
        ),
        of(
            "Part of a plan: the coefficients of a way that closes a gap in so many seconds.",
            &format!(
                "void @_powers_of_join(const double gap[{taken}], double tau_s, double s[{width}],
    double left[{width}])"
            ),
            powers,
            true,
        ),
        played(order, taken),
        made(taken, period_s),
    ]
    .map(|text| file.c(&text))
    .concat()
}

fn place(port: &Port) -> String {
    let name = &port.name;
    match (port.role, name.split_once('_')) {
        (Role::Argument, Some(("goal", of))) => format!("jet->{of}"),
        (_, Some((row @ ("power" | "gap" | "s" | "left"), k))) => format!("{row}[{k}]"),
        (Role::Output, _) => format!("jet->{name}"),
        _ => name.clone(),
    }
}

fn types(order: usize, taken: usize) -> String {
    let jet = if order == taken {
        "\n/* What a plan takes over where it begins. */\ntypedef @_target @_jet;\n".into()
    } else {
        let members: Vec<String> = JET[1..taken].iter().map(|name| format!("    float {name};\n")).collect();
        format!(
            "
/* What a plan takes over where it begins: a target with one more derivative, so that u does not step. */
typedef struct {{
    int32_t turn;
    float r;
{}}} @_jet;
",
            members.concat()
        )
    };
    jet + &format!(
        "
/* Where a plan leads: to rest at 2 pi turn + angle, or along a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {{
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 turns; 0: rest */
}} @_goal;

/* A plan: where the shaft should be at every tick. Ticks count from anywhere and may wrap. Zeros: rest at angle 0. */
typedef struct {{
    @_goal goal;
    uint32_t end; /* the tick from which on it is there */
    uint32_t ticks; /* of the way */
    float per_tick;
    float per_s;
    float power[2][{width}]; /* of the part that is done, and of the part that is left */
}} @_plan;
",
        width = 2 * taken
    )
}

/// What the interrupt calls.
fn played(order: usize, taken: usize) -> String {
    let zeros: Vec<String> = JET[1..taken].iter().map(|name| format!("        jet->{name} = 0.0f;\n")).collect();
    let copied: Vec<String> = JET[..order].iter().map(|name| format!("    target->{name} = jet.{name};\n")).collect();
    let (zeros, copied) = (zeros.concat(), copied.concat());
    format!(
        "
/* Part of a plan: a number that the drive would take. */
static inline bool @_is_number(double number)
{{
    return (number >= -1e12) && (number <= 1e12);
}}

/* Part of a plan. */
static inline void @_jet_of_goal(const @_goal *goal, uint32_t tick, @_jet *jet)
{{
    if (goal->phase_per_tick != 0u) {{
        jet->turn = 0;
        @_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    }} else {{
        jet->turn = goal->turn;
        jet->r = goal->angle;
{zeros}    }}
}}

/* Where a plan is at a tick, with all that another plan takes over from it. */
static inline void @_plan_jet(const @_plan *plan, uint32_t tick, @_jet *jet)
{{
    const uint32_t left = plan->end - tick;
    @_jet_of_goal(&plan->goal, tick, jet);
    if ((left != 0u) && (left <= plan->ticks)) {{
        const uint32_t done = plan->ticks - left;
        if (done < left) {{
            @_join(plan->power[0], done, plan->per_tick, plan->per_s, jet);
        }} else {{
            @_join(plan->power[1], left, plan->per_tick, -plan->per_s, jet);
        }}
    }}
}}

/* The target at a tick. */
static inline void @_plan_at(const @_plan *plan, uint32_t tick, @_target *target)
{{
    @_jet jet;
    @_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
{copied}}}

/* The same of a plan that is gone along: in the interrupt, once per tick, for its end. What is over stays so when ticks
 * have wrapped (2^32 of them are five days at 10 kHz). */
static inline void @_plan_play(@_plan *plan, uint32_t tick, @_target *target)
{{
    const uint32_t left = plan->end - tick;
    if (left > plan->ticks) {{
        plan->ticks = 0u;
    }}
    @_plan_at(plan, tick, target);
}}
"
    )
}

/// What makes a plan.
fn made(taken: usize, period_s: f64) -> String {
    let gap = |(j, name): (usize, &&str)| format!("    gap[{j}] = (double)present->{name} - (double)at.{name};\n");
    let gap: Vec<String> = JET[..taken].iter().enumerate().map(gap).collect();
    let (gap, width) = (gap.concat(), 2 * taken);
    format!(
        "
/* Part of a plan: onto a goal. In double, hence not for the interrupt. */
static inline bool @_plan_onto(@_plan *plan, const @_goal *goal, const @_jet *present, uint32_t start,
    uint32_t ticks)
{{
    @@_AS_WRITTEN
    const double tau_s = (double)ticks * {period_s:?};
    uint32_t turns;
    double gap[{taken}];
    double power[2][{width}];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    @_jet at;
    @_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
{gap}    gap[0] += {TAU:?} * (double)@_signed(turns);
    for (unsigned k = 0; k < {taken}u; k++) {{
        good = good && @_is_number(gap[k]);
    }}
    @_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < {width}u; k++) {{
        good = good && @_is_number(power[0][k]) && @_is_number(power[1][k]);
    }}
    if (!good) {{
        return false;
    }}
    plan->goal = *goal;
    plan->end = start + ticks;
    plan->ticks = ticks;
    plan->per_tick = (float)(1.0 / (double)ticks);
    plan->per_s = (float)(1.0 / tau_s);
    for (unsigned k = 0; k < {width}u; k++) {{
        plan->power[0][k] = (float)power[0][k];
        plan->power[1][k] = (float)power[1][k];
    }}
    return true;
}}

/* The plan to be at rest at 2 pi turn + angle, always: for a start. The answer of this and of the next three is false,
 * and the plan as it was, if a number is none or beyond 1e12, or the ticks are not 1 to 2^24. They compute in double,
 * on most cores in software: make a plan outside of the interrupt, not the one that is being played, and hand it over
 * between two ticks. */
static inline bool @_plan_rest(@_plan *plan, int32_t turn, float angle)
{{
    @_goal goal = {{ 0, 0.0f, 0.0f, 0.0f, 0u }};
    if (!@_is_number((double)angle)) {{
        return false;
    }}
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}}

/* Plans a move to rest at 2 pi turn + angle, that begins at a tick with what is present then and takes so many ticks.
 * On the way, the present is that of the old plan at this tick (@_plan_jet), never a measurement. Whether the current
 * suffices is not asked. */
static inline bool @_plan_move(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{{
    @_goal goal = {{ 0, 0.0f, 0.0f, 0.0f, 0u }};
    goal.turn = turn;
    goal.angle = angle;
    return @_is_number((double)angle) && @_plan_onto(plan, &goal, present, start, ticks);
}}

/* Plans to come to rest in so many ticks, and never back: at half of the way that would have been gone. */
static inline bool @_plan_stop(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks)
{{
    @@_AS_WRITTEN
    const double tau_s = (double)ticks * {period_s:?};
    const double angle = (double)present->r + (0.5 * tau_s * (double)present->r_dot);
    return @_is_number(angle) && @_plan_move(plan, present, start, ticks, present->turn, (float)angle);
}}

/* Plans a way onto A sin(omega t) about angle 0, the phase of which is 0 at tick 0. Omega is rounded to a whole number
 * of 2^-32 turns per tick, and must be at least that and less than half a turn per tick. */
static inline bool @_plan_sine(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{{
    @@_AS_WRITTEN
    const double phase = (omega_rad_s * {period_s:?} / {TAU:?} * 4294967296.0) + 0.5;
    @_goal goal = {{ 0, 0.0f, 0.0f, 0.0f, 0u }};
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !@_is_number(amplitude_rad)) {{
        return false;
    }}
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * {TAU:?} / {period_s:?});
    return @_plan_onto(plan, &goal, present, start, ticks);
}}
"
    )
}
