//! Compares the assembly of drives with the recorded parts, bit by bit, for all counts and targets.
//!
//! A motor or a joint moves under the u of the tick over full revolutions, so that most samples are ordinary. Sometimes
//! a count is lost or jumps, a target is not a number, the actuator holds another u, or the drive restarts.

use std::fmt::Write as _;

use controller_core::Limits;
use controller_core::drive::{Encoder, Joint, JointDesign, Motor, MotorDesign, Mounting, Position, Speed};
use tick_assembly::{DriveAssembly, DriveLayout, Effort, drive_assembly};
use tick_record::drive::{DriveFunctions, JET, joint, motor};
use tick_record::{Port, Record, Role, ValueKind, c};

use super::{ENDING, HELP, QUICK, deep, effort, said, sampled, sized};

fn c_type(kind: ValueKind) -> &'static str {
    match kind {
        ValueKind::Number => "float",
        ValueKind::Truth => "bool",
        ValueKind::Count => "uint32_t",
    }
}

/// Returns the C of the parts, with the prefix `c_`.
fn reference(functions: &DriveFunctions) -> String {
    let mut text = String::new();
    let mut function = |head: &str, record: &Record, result: &str| {
        let place = |port: &Port| {
            let name = &port.name;
            match (port.role, name.split_once('_')) {
                (Role::State, _) => format!("state->{name}"),
                (Role::Flag(bit), _) => format!("{}u", 1 << bit),
                (Role::Between, _) => format!("between->{name}"),
                (Role::Output, _) => format!("{result}->{name}"),
                (_, Some((end @ ("begin" | "end"), "turn"))) => format!("(uint32_t)sample->{end}.turn"),
                (_, Some((end @ ("begin" | "end"), name))) => format!("sample->{end}.{name}"),
                _ if name.starts_with("lost") || name.starts_with("count") => format!("sample->{name}"),
                _ => name.clone(),
            }
        };
        let body =
            c::Function { record, place: &place, meaning: &|_| String::new(), double: false, signed: "c_signed" }
                .body();
        let _ = writeln!(text, "static {head}\n{{\n{body}}}");
    };
    let DriveFunctions { begin, observe, law, give_up, refuse, pass, follow, carry, .. } = functions;
    function("bool c_begin(c_state *state, const sample *sample, between *between)", begin, "output");
    function("bool c_observe(c_state *state, const sample *sample, between *between)", observe, "output");
    let head = "unsigned c_law(c_state *state, const sample *sample, const between *between, output *output)";
    function(head, law, "output");
    function("unsigned c_give_up(c_state *state, const sample *sample, output *output)", give_up, "output");
    function("unsigned c_refuse(c_state *state, output *output)", refuse, "output");
    function("bool c_pass(c_state *state)", pass, "output");
    function("void c_follow(c_state *state)", follow, "output");
    function("void c_carry(c_state *state)", carry, "output");
    function("bool c_start(c_state *state, const sample *sample)", &functions.start, "output");
    function("unsigned c_not_started(output *output)", &functions.not_started, "output");
    function("bool c_report_applied(c_state *state, float u)", &functions.report_applied, "output");
    function("bool c_estimates(const c_state *state, estimates *known)", &functions.estimates, "known");
    function("void c_reset(c_state *state)", &functions.reset, "output");
    c::signed("c_signed") + &text
}

/// A plant under u, in rad, and the counts of its shafts.
struct Plant {
    /// Code for `angle_*` and `speed_*` one period later.
    step: String,
    units: Vec<f64>,
    mounting: Mounting,
    fastest: f64,
}

/// Returns one line per element.
fn each<T>(all: &[T], line: impl Fn(&T) -> String) -> String {
    all.iter().fold(String::new(), |text, one| text + &line(one))
}

fn program(functions: &DriveFunctions, layout: &DriveLayout, plant: &Plant, ticks: usize) -> String {
    let shafts: Vec<&str> = functions.state.iter().filter_map(|word| word.name.strip_prefix("last")).collect();
    let position = functions.law.inputs.iter().any(|port| port.name == "begin_turn");
    let mut types = String::new();
    let jet = &JET[..2 * shafts.len()];
    let target = if position { format!("int32_t turn; float {};", jet.join(", ")) } else { "float speed;".into() };
    let _ = writeln!(types, "typedef struct {{ {target} }} target;\ntypedef struct {{");
    for (kind, name) in [("uint32_t", "count"), ("bool", "lost")] {
        types += &each(&shafts, |shaft| format!("    {kind} {name}{shaft};\n"));
    }
    types += "    target begin, end;\n} sample;\ntypedef struct {\n    int32_t turn;\n";
    for shaft in &shafts {
        let _ = writeln!(types, "    float position{shaft}, speed{shaft}, disturbance{shaft}, load{shaft};");
    }
    types += "} estimates;\n";
    let fields = |words: &mut dyn Iterator<Item = (String, ValueKind)>| -> String {
        words.fold(String::new(), |text, (name, kind)| text + &format!("    {} {name};\n", c_type(kind)))
    };
    // One word each, as in the assembly.
    let word =
        |port: &Port| (port.name.clone(), if port.kind == ValueKind::Truth { ValueKind::Count } else { port.kind });
    let between = fields(&mut functions.between.iter().map(word));
    let c_state = fields(&mut functions.state.iter().map(|port| (port.name.clone(), port.kind)));
    let numbers = layout.numbers.iter().map(|name| (name.clone(), ValueKind::Number));
    let counts = layout.counts.iter().map(|name| (name.clone(), ValueKind::Count));
    let flags = ["fresh", "started"].map(|name| (name.to_owned(), ValueKind::Truth));
    let cleared = layout.cleared.iter().map(|name| (name.clone(), ValueKind::Number));
    let rare = layout.rare.iter().map(|name| (name.clone(), ValueKind::Number));
    let s_state = fields(&mut numbers.chain(counts).chain(cleared).chain(rare).chain(flags));
    let _ = writeln!(
        types,
        "typedef struct {{\n{between}}} between;\ntypedef struct {{\n{c_state}}} c_state;\n\
         typedef struct {{\n{s_state}}} s_state;"
    );
    let same = each(&functions.state, |word| match (word.kind, &word.name) {
        (ValueKind::Number, name) => format!(" && same(s.{name}, c.{name}) && same(t.{name}, c.{name})"),
        (_, name) => format!(" && s.{name} == c.{name} && t.{name} == c.{name}"),
    });
    let Mounting { is_reversed, offset_counts } = plant.mounting;
    let way = if is_reversed { '-' } else { '+' };
    let units: Vec<(&str, f64)> = shafts.iter().copied().zip(plant.units.iter().copied()).collect();
    let counted = each(&units, |(shaft, unit)| {
        format!(
            "        in.count{shaft} = {offset_counts}u {way} (uint32_t)(int32_t)(angle{shaft} / {unit:?}f) + any() % \
             2u;\n"
        )
    });
    let rare = each(&shafts, |shaft| {
        format!(
            "            in.lost{shaft} = any() % 3u == 0u;
            if (any() % 4u == 0u) {{ in.count{shaft} = any(); }}\n"
        )
    });
    let found = each(&shafts, |shaft| format!("        in.lost{shaft} = false;\n"));
    let begin = if position {
        "        in.begin = in.end; in.end = aim(goal, way);\n"
    } else {
        "        in.begin = in.end; in.end.speed = way;\n"
    };
    let aim = if position {
        let rest = each(&jet[2..], |name| format!("    at.{name} = 0.0f;\n"));
        format!(
            "static target aim(float goal, float way)\n{{\n    target at;\n    \
             at.turn = (int32_t)(goal / 6.2831853f);\n    at.r = goal - 6.2831853f * (float)at.turn;\n    \
             at.r_dot = way;\n{rest}    return at;\n}}\n"
        )
    } else {
        String::new()
    };
    let odd = if position { "in.end.r = odd(); in.begin.r_dot = odd();" } else { "in.end.speed = odd();" };
    let (angles, speeds): (Vec<String>, Vec<String>) =
        shafts.iter().map(|shaft| (format!("angle{shaft} = 0.0f"), format!("speed{shaft} = 0.0f"))).unzip();
    PROGRAM
        .replace("@help", HELP)
        .replace("@ending", ENDING)
        .replace("@types", &types)
        .replace("@reference", &reference(functions))
        .replace("@same", &same)
        .replace("@counted", &counted)
        .replace("@rare", &rare)
        .replace("@found", &found)
        .replace("@targets", begin)
        .replace("@aim", &aim)
        .replace("@odd", odd)
        .replace("@moving", &format!("{}, {}", angles.join(", "), speeds.join(", ")))
        .replace("@step", &plant.step)
        .replace("@fastest", &format!("{:?}f", plant.fastest))
        .replace("@nothing", &each(&shafts, |shaft| format!("nothing.lost{shaft} = true; ")))
        .replace("@first", &format!("angle{}", shafts[0]))
        .replace("@back", &each(&shafts, |shaft| format!("            angle{shaft} -= back;\n")))
        .replace("@shift", if position { "goal" } else { "way" })
        .replace("@ticks", &ticks.to_string())
}

const PROGRAM: &str = r#"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
typedef struct { float u, sigma, sigma_star; } output;
@types
@help
@reference
extern bool s_begin(s_state *state, const sample *sample, between *between);
extern bool s_observe(s_state *state, const sample *sample, between *between);
extern unsigned s_law(s_state *state, const sample *sample, const between *between, output *output);
extern unsigned s_give_up(s_state *state, const sample *sample, output *output);
extern unsigned s_refuse(s_state *state, output *output);
extern bool s_pass(s_state *state);
extern void s_follow(s_state *state);
extern void s_carry(s_state *state);
extern unsigned s_tick(s_state *state, const sample *sample, output *output);
extern float s_tick_u(s_state *state, const sample *sample);
extern bool s_start(s_state *state, const sample *sample);
extern unsigned s_not_started(output *output);
extern bool s_report_applied(s_state *state, float u);
extern bool s_estimates(const s_state *state, estimates *known);
extern void s_reset(s_state *state);
static unsigned c_tick(c_state *state, const sample *in, output *out)
{
    between handed;
    if (state->fresh) {
        if (!c_begin(state, in, &handed)) {
            return c_not_started(out);
        }
    } else if (!c_observe(state, in, &handed)) {
        unsigned health = c_give_up(state, in, out);
        c_follow(state);
        c_carry(state);
        return health;
    }
    unsigned health = c_law(state, in, &handed, out) | (handed.stepped ? 128u : 0u) | (handed.missing ? 8u : 0u);
    c_follow(state);
    if (handed.missing) {
        c_carry(state);
    }
    return health;
}
#define LOST(x) \
static unsigned x##_lost(x##_state *state, const sample *nothing, output *out) \
{ \
    between handed; \
    unsigned health; \
    if (state->fresh && state->doubt > 0.0f) { \
        (void)x##_begin(state, nothing, &handed); \
        return x##_not_started(out); \
    } \
    if (!state->fresh && !x##_observe(state, nothing, &handed)) { \
        health = x##_give_up(state, nothing, out); \
    } else { \
        health = x##_refuse(state, out); \
    } \
    x##_follow(state); \
    x##_carry(state); \
    return health; \
}
LOST(c)
LOST(s)
@aim
static c_state c;
static s_state s, t;
__attribute__((noinline)) static int run(void)
{
    uint32_t seen[16] = { 0 }, rare = 0, bases = 0, ordinary = 0;
    float goal = 0.0f, way = 0.0f, u = 0.0f, @moving;
    sample in = { 0 };
    for (uint32_t k = 0; k < @ticks; k++) {
        output of[2] = { { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } };
        estimates known[2] = { { 0 }, { 0 } };
        unsigned health[2];
        if (any() % 2000u == 0u) {
            way = within(@fastest);
        }
        if (any() % 20000u == 0u) {
            @shift += within(9.0f);
        }
        @step
        goal += way * 0.001f;
@targets@found@counted
        const sample good = in;
        if (any() % 300u == 0u) {
            rare = 1u + any() % (any() % 20u == 0u ? 80u : 5u);
        }
        if (rare > 0u) {
            rare--;
@rare            if (any() % 20u == 0u) {
                @odd
            }
        }
        if (any() % 100u == 0u) {
            const float held = any() % 5u == 0u ? odd() : within(10.0f);
            const bool taken = c_report_applied(&c, held);
            if (s_report_applied(&s, held) != taken || s_report_applied(&t, held) != taken) {
                number("report_applied differs at", k);
                return 1;
            }
        }
        if (any() % 30000u == 0u) {
            c_reset(&c);
            s_reset(&s);
            s_reset(&t);
        }
        if (!c.started || any() % 10000u == 0u) {
            const bool started = c_start(&c, &in);
            if (s_start(&s, &in) != started || s_start(&t, &in) != started) {
                number("start differs at", k);
                return 1;
            }
            // It has no revolutions yet.
            const float back = started ? 6.2831853f * (float)(int32_t)(@first / 6.2831853f) : 0.0f;
            goal -= back;
@back        }
        const uint32_t turn = c.turn;
        ordinary += c.started && !c.fresh && rare == 0u ? 1u : 0u;
        if (!c.started) {
            health[0] = c_not_started(&of[0]);
            health[1] = s_not_started(&of[1]);
            u = of[1].u;
        } else if (any() % 3000u == 0u) {
            sample nothing = good;
            @nothing
            health[0] = c_lost(&c, &nothing, &of[0]);
            health[1] = s_lost(&s, &nothing, &of[1]);
            output other;
            (void)s_lost(&t, &nothing, &other);
            u = other.u;
        } else {
            health[0] = c_tick(&c, &in, &of[0]);
            health[1] = s_tick(&s, &in, &of[1]);
            u = s_tick_u(&t, &in);
        }
        bases += c.turn != turn ? 1u : 0u;
        seen[health[0] & 15u]++;
        bool right = health[0] == health[1] && same(of[0].u, of[1].u) && same(of[0].u, u)
            && same(of[0].sigma, of[1].sigma) && same(of[0].sigma_star, of[1].sigma_star)@same;
        if (c_estimates(&c, &known[0]) != s_estimates(&s, &known[1])) {
            right = false;
        }
        const uint32_t *one = (const uint32_t *)&known[0], *other = (const uint32_t *)&known[1];
        for (size_t j = 0; j < sizeof known[0] / 4u; j++) {
            right = right && one[j] == other[j];
        }
        if (!right) {
            number("differs at", k);
            return 1;
        }
        in = good;
    }
    number("healthy", seen[0]);
    number("rejected", seen[1] + seen[9]);
    number("saturated", seen[2] + seen[10]);
    number("lost", seen[8] + seen[9] + seen[10]);
    number("bases", bases);
    number("ordinary", ordinary);
    return 0;
}
@ending"#;

fn holds(name: &str, functions: &DriveFunctions, plant: &Plant, effort: &Effort, ticks: usize) -> DriveAssembly {
    let assembly = drive_assembly(functions, "s", effort).unwrap_or_else(|error| panic!("{name}: {error}"));
    let ticks = sized(ticks);
    let program = program(functions, &assembly.layout, plant, ticks);
    let (good, told) = said(name, &assembly.text, &program);
    println!("{name}: {} cycles, with the whole output {}; {told}", assembly.cycles, assembly.cycles_whole);
    assert!(good, "{name}: {told}");
    let position = functions.law.inputs.iter().any(|port| port.name == "begin_turn");
    for (what, share) in [("healthy", 2), ("rejected", 3000), ("saturated", 3000), ("lost", 500), ("bases", 20_000)] {
        let count = told.lines().find_map(|line| line.strip_prefix(what)?.trim().parse::<usize>().ok());
        let may_miss = what == "bases" && !position;
        // A short run has fewer rare events.
        let least = if deep() { ticks / share } else { ticks / share / 4 };
        assert!(count.is_some_and(|count| count > least || may_miss), "{name} shows too little {what}: {told}");
    }
    assembly
}

const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };

/// J_l q'' = K (q_m - q) - B q' - m sin q, J_m q_m'' = K (q - q_m) - B q_m' + K_t u; the sine is 0.
fn joint_plant() -> Plant {
    let Joint { link_inertia_kg_m2: j_l, motor_inertia_kg_m2: j_m, stiffness_n_m: k, .. } = Joint::TABLE_I;
    let Joint { link_damping_n_m_s: b_l, motor_damping_n_m_s: b_m, torque_n_m_per_a: k_t, .. } = Joint::TABLE_I;
    Plant {
        step: format!(
            "for (int part = 0; part < 4; part++) {{
            const float wound = {k:?}f * (angle_motor - angle_link);
            speed_link += 0.00025f * (wound - {b_l:?}f * speed_link) / {j_l:?}f;
            speed_motor += 0.00025f * ({k_t:?}f * u - wound - {b_m:?}f * speed_motor) / {j_m:?}f;
            angle_link += 0.00025f * speed_link;
            angle_motor += 0.00025f * speed_motor;
        }}"
        ),
        units: vec![Encoder::absolute(20).unit_rad(); 2],
        mounting: Mounting::UPRIGHT,
        fastest: 2.0,
    }
}

fn motor_design() -> MotorDesign {
    MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0))
}

/// J w' = K_t u - B w.
fn motor_plant() -> Plant {
    Plant {
        step: "speed += 0.001f * (250.0f * u - 0.05f * speed); angle += 0.001f * speed;".into(),
        units: vec![Encoder::absolute(14).unit_rad()],
        mounting: Mounting::UPRIGHT,
        fastest: 20.0,
    }
}

/// Cycles of a short search.
#[test]
fn the_drive_of_a_motor_is_its_parts_to_the_bit() {
    let functions = motor::<Position, 0, 0, 3>(&motor_design(), Mounting::UPRIGHT).expect("a design");
    let motor = holds("motor", &functions, &motor_plant(), &QUICK, 1_000_000);
    assert!((motor.floor..=166).contains(&motor.cycles), "{} of {}", motor.cycles, motor.floor);
}

/// Two encoders and a sine need more numbers than registers, so the observer state is stored early.
#[test]
fn the_drive_of_a_joint_is_its_parts_to_the_bit() {
    let design = JointDesign::new(1e-3, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
    let functions = joint::<Position, 0, 0>(&design, [Mounting::UPRIGHT; 2]).expect("a design");
    let joint = holds("joint", &functions, &joint_plant(), &effort(), 1_000_000);
    // The effort for firmware gets within 15 % of the lower bound, a short search within 30 %.
    let bar = joint.floor * if deep() { 115 } else { 130 } / 100;
    assert!((joint.floor..=bar).contains(&joint.cycles), "{} of {}", joint.cycles, joint.floor);
}

#[test]
fn drives_of_every_kind_are_their_parts_to_the_bit() {
    let design = motor_design();
    let turned = Mounting { is_reversed: true, offset_counts: 70_000 };
    let reversed = Plant { mounting: turned, ..motor_plant() };
    let flexible = JointDesign::new(1e-3, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(30.0), 1.3);
    let all = [
        ("motor_speed", motor::<Speed, 0, 0, 3>(&design, Mounting::UPRIGHT), motor_plant(), 100_000),
        ("motor_two_sets", motor::<Position, 1, 0, 3>(&design, Mounting::UPRIGHT), motor_plant(), 100_000),
        ("motor_late", motor::<Position, 0, 1, 3>(&design, Mounting::UPRIGHT), motor_plant(), 100_000),
        ("motor_four_states", motor::<Position, 0, 0, 4>(&design, Mounting::UPRIGHT), motor_plant(), 100_000),
        ("motor_turned", motor::<Position, 0, 0, 3>(&design, turned), reversed, 100_000),
        // Still more numbers; few orders have enough registers, so a search takes long at any effort.
        ("joint_two_sets", joint::<Position, 1, 0>(&flexible, [Mounting::UPRIGHT; 2]), joint_plant(), 1_000_000),
    ];
    for (name, functions, plant, ticks) in sampled(all, 2) {
        holds(name, &functions.expect("a design"), &plant, &QUICK, ticks);
    }
}

#[test]
fn a_drive_that_was_tampered_with_is_noticed() {
    let functions = motor::<Position, 0, 0, 3>(&motor_design(), Mounting::UPRIGHT).expect("a design");
    let assembly = drive_assembly(&functions, "s", &QUICK).expect("scheduled");
    let program = program(&functions, &assembly.layout, &motor_plant(), 10_000);
    // Injected faults: a gate accepts only what it rejected, a difference replaces a sum, a lost sample is accepted.
    for (line, instead) in [
        ("\tbhi.w .Ls_tick_u_away", "\tbls.w .Ls_tick_u_away"),
        ("\tvsub.f32", "\tvadd.f32"),
        ("\tbne.w .Ls_tick_u_rest", "\tnop.w @"),
    ] {
        // The first test of a magnitude is the limit of the power stage. Inverted, it sends every tick through the rare
        // path, with bit-identical results.
        let at = if line.contains("bhi") { assembly.text.match_indices(line).nth(1) } else { None };
        let at = at.map_or_else(|| assembly.text.find(line).unwrap_or_default(), |(at, _)| at);
        let tampered = assembly.text[..at].to_string() + &assembly.text[at..].replacen(line, instead, 1);
        assert_ne!(tampered, assembly.text, "no `{line}`");
        let (good, told) = said("drive_tampered", &tampered, &program);
        assert!(!good && told.contains("differs at"), "{line}: {told}");
    }
}
