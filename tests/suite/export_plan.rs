//! Bit-identity of an exported plan with the Rust plan.
//!
//! A motor drive and a joint drive are exported, and random plans are made in C and with `controller_core::drive`:
//! rests, moves, stops, sines. They start anywhere or from the active plan, last few or many ticks, cross the wrap of
//! the tick number, and contain numbers that are NaN. The test compares acceptance and every bit of turn and trajectory
//! point before, on and after the transition. The rules of rejection are written here a second time.

use controller_core::drive::{Joined, Reference, Rest, Sine, Target, gap, powers_of_join, stop};
use integration_tests::strategy::Rng;
use std::f64::consts::TAU;
use std::fs;

use super::export::{
    EDGES, ON_THE_CHIP, ON_THE_HOST, Place, STM32F405, answers, exported, folder, other_boards, plain,
};

pub(super) const MOTOR: &str = "motor = { inertia_kg_m2 = 2e-4, torque_n_m_per_a = 0.05, max_current_a = 10 }
    encoder = { bits = 14 }";
pub(super) const JOINT: &str = "joint = { link_inertia_kg_m2 = 0.23, link_damping_n_m_s = 0.07, weight_n_m = 0.23,
    stiffness_n_m = 9.0, motor_inertia_kg_m2 = 9.31e-4, motor_damping_n_m_s = 0.07, torque_n_m_per_a = 0.119,
    max_current_a = 30 }
    encoder = { link = { bits = 20 }, motor = { bits = 20 } }";

const PLANS: usize = 30_000;
/// Ticks at which each plan is evaluated.
const ASKED: usize = 6;

const REST: u32 = 0;
const MOVE: u32 = 1;
const STOP: u32 = 2;
const SINE: u32 = 3;

#[derive(Clone, Copy)]
pub(super) enum Goal {
    Rest(Rest<f32>),
    Sine(Sine<f32>),
}

impl<const J: usize> Reference<f32, J> for Goal {
    fn at(&self, tick: u32) -> Target<f32, i32, J> {
        match self {
            Self::Rest(rest) => rest.at(tick),
            Self::Sine(sine) => sine.at(tick),
        }
    }
}

/// Active plan: a goal, and the transition onto it if there is one.
pub(super) enum Plan<const M: usize> {
    At(Goal),
    Onto(Joined<f32, Goal, M>),
}

impl<const M: usize> Reference<f32, M> for Plan<M> {
    fn at(&self, tick: u32) -> Target<f32, i32, M> {
        match self {
            Self::At(goal) => goal.at(tick),
            Self::Onto(way) => way.at(tick),
        }
    }
}

pub(super) fn is_number(number: f64) -> bool {
    number.abs() <= 1e12
}

/// Returns the transition onto a goal, or `None` if it must be rejected.
pub(super) fn onto<const M: usize>(
    goal: Goal,
    present: &Target<f32, i32, M>,
    start: u32,
    ticks: u32,
    period_s: f64,
) -> Option<Plan<M>> {
    let gap = gap(present, &goal.at(start));
    let powers = powers_of_join(gap, f64::from(ticks) * period_s);
    let good = (1..=1 << 24).contains(&ticks)
        && gap.into_iter().all(is_number)
        && powers.as_flattened().as_flattened().iter().all(|rad| rad.abs() <= 6e9);
    good.then(|| Plan::Onto(Joined::new(goal, gap, start, ticks, period_s)))
}

struct Run {
    asked: Vec<u8>,
    answers: Vec<u32>,
}

pub(super) fn any(rng: &mut Rng, size: f64) -> f32 {
    match rng.integer(0, 99) {
        0 => EDGES[rng.integer(0, EDGES.len() - 1)],
        1 => f32::from_bits(rng.bits() as u32),
        _ => rng.within(-size, size) as f32,
    }
}

fn run<const M: usize, const N: usize>(period_s: f64) -> Run {
    let mut rng = Rng::new(0x91A4 + M as u64);
    let (mut asked, mut answers) = (Vec::new(), Vec::new());
    let mut plan: Plan<M> = Plan::At(Goal::Rest(Rest { turn: 0, angle: 0.0 }));
    let (mut now, mut taken) = (0_u32, [[0_usize; 2]; 4]);
    for _ in 0..PLANS {
        let what = *rng.one_of(&[REST, MOVE, MOVE, MOVE, STOP, STOP, SINE, SINE]);
        now = if rng.chance(0.01) { rng.bits() as u32 } else { now.wrapping_add(rng.integer(0, 3000) as u32) };
        let ticks = match rng.integer(0, 19) {
            0 => *rng.one_of(&[0, 1, 2, 3, (1 << 24) - 1, 1 << 24, (1 << 24) + 1, u32::MAX]),
            1 => rng.spread(1.0, 2e7) as u32,
            _ => rng.integer(2, 2000) as u32,
        };
        let in_flight = rng.chance(0.7);
        let mut present = Target { turn: 0, jet: [0.0; M] };
        if in_flight {
            present = plan.at(now);
        } else {
            present.turn = if rng.chance(0.05) { rng.bits() as i32 } else { rng.integer(0, 40) as i32 - 20 };
            for (j, entry) in present.jet.iter_mut().enumerate() {
                *entry = any(&mut rng, [4.0, 60.0, 3e3, 1e5][j]);
            }
        }
        let turn = if rng.chance(0.05) { rng.bits() as i32 } else { rng.integer(0, 40) as i32 - 20 };
        let angle = any(&mut rng, 4.0);
        let mut sine = [rng.within(-3.0, 3.0), rng.spread(1e-2, 200.0)];
        if rng.chance(0.1) {
            sine[rng.integer(0, 1)] =
                if rng.chance(0.5) { f64::from(any(&mut rng, 5e3)) } else { rng.spread(1e-9, 1e14) };
        }
        let [amplitude, omega] = sine;
        let new = match what {
            REST => is_number(f64::from(angle)).then_some(Plan::At(Goal::Rest(Rest { turn, angle }))),
            MOVE | STOP => {
                let (goal, taken) =
                    if what == MOVE { (Rest { turn, angle }, ticks) } else { stop(&present, ticks, period_s) };
                let way = onto(Goal::Rest(goal), &present, now, taken, period_s);
                let way = way.filter(|_| (1..=1 << 24).contains(&ticks));
                way.filter(|_| is_number(f64::from(goal.angle)))
            }
            _ => {
                let phase = omega * period_s / TAU * 2_f64.powi(32) + 0.5;
                let good = (1.0..2_f64.powi(31)).contains(&phase) && is_number(amplitude);
                let goal = good.then(|| Goal::Sine(Sine::new(amplitude, omega, period_s)));
                goal.and_then(|goal| onto(goal, &present, now, ticks, period_s))
            }
        };
        taken[what as usize][usize::from(new.is_some())] += 1;
        answers.push(u32::from(new.is_some()));
        plan = new.unwrap_or(plan);
        let end = now.wrapping_add(ticks);
        let within = now.wrapping_add(rng.integer(0, ticks.min(1 << 20) as usize) as u32);
        let at =
            [now.wrapping_sub(1), now, within, end.wrapping_sub(1), end, end.wrapping_add(rng.bits() as u32 >> 16)];
        for tick in at {
            let Target { turn, jet } = plan.at(tick);
            answers.push(turn as u32);
            answers.extend(jet.map(f32::to_bits));
            answers.push(turn as u32);
            answers.extend(jet[..N].iter().map(|number| number.to_bits()));
        }
        asked.extend([amplitude, omega].into_iter().flat_map(f64::to_le_bytes));
        let mut jet = [0.0; 4];
        jet[..M].copy_from_slice(&present.jet);
        let words = [what, u32::from(in_flight), now, ticks, present.turn as u32, turn as u32, angle.to_bits(), 0];
        let all = words.into_iter().chain(jet.map(f32::to_bits)).chain(at);
        asked.extend(all.flat_map(u32::to_le_bytes));
    }
    println!("rests, moves, stops, sines refused and taken: {taken:?}");
    for [refused, taken] in &taken {
        assert!(*refused > 20 && *taken > 2000, "every answer is asked for");
    }
    Run { asked, answers }
}

/// Returns the C program around the exported file: requests in, answers out.
fn driver(exported: &str, jet: &[&str], order: usize, place: Place) -> String {
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    let given = |(j, name): (usize, &&str)| format!("                present.{name} = ask->jet[{j}];\n");
    let given = jet.iter().enumerate().map(given).collect::<Vec<_>>().concat();
    let put = |from: &str, names: &[&str]| {
        let word = |name: &&str| format!("                *word++ = bits({from}.{name});\n");
        names.iter().map(word).collect::<Vec<_>>().concat()
    };
    let (jets, targets) = (put("now", jet), put("target", &jet[..order]));
    format!(
        "#include \"{exported}\"
{transfer}
typedef struct {{
    double amplitude, omega;
    uint32_t what, in_flight, start, ticks;
    int32_t present, turn;
    float angle;
    uint32_t unused;
    float jet[4];
    uint32_t at[{ASKED}];
}} ask_type;
static ask_type asks[16];
static uint32_t answers[16 * (1 + {ASKED} * 10)];

static uint32_t bits(float number)
{{
    union {{ float number; uint32_t word; }} both;
    both.number = number;
    return both.word;
}}

int main(void)
{{
    static edo_smc_plan plan;
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {{
        uint32_t *word = answers;
        for (size_t k = 0; k < count; k++) {{
            const ask_type *const ask = &asks[k];
            edo_smc_jet present;
            bool good;
            if (ask->in_flight) {{
                edo_smc_plan_jet(&plan, ask->start, &present);
            }} else {{
                present.turn = ask->present;
{given}            }}
            switch (ask->what) {{
            case {REST}: good = edo_smc_plan_rest(&plan, ask->turn, ask->angle); break;
            case {MOVE}:
                good = edo_smc_plan_move(&plan, &present, ask->start, ask->ticks, ask->turn, ask->angle);
                break;
            case {STOP}: good = edo_smc_plan_stop(&plan, &present, ask->start, ask->ticks); break;
            default:
                good = edo_smc_plan_sine(&plan, &present, ask->start, ask->ticks, ask->amplitude, ask->omega);
                break;
            }}
            *word++ = good;
            for (size_t j = 0; j < {ASKED}; j++) {{
                edo_smc_jet now;
                edo_smc_target target;
                edo_smc_target again;
                edo_smc_plan gone_along = plan;
                edo_smc_plan_jet(&plan, ask->at[j], &now);
                edo_smc_plan_at(&plan, ask->at[j], &target);
                edo_smc_plan_play(&gone_along, ask->at[j], &again);
                if (bits(again.r) != bits(target.r) || bits(again.r_dot) != bits(target.r_dot)) {{
                    return 1;
                }}
                /* Once over it stays so, however the ticks wrap. */
                if (gone_along.ticks == 0u) {{
                    edo_smc_plan_at(&gone_along, plan.end - 1u, &again);
                    if (plan.goal.phase_per_tick == 0u && bits(again.r) != bits(plan.goal.angle)) {{
                        return 2;
                    }}
                }}
                *word++ = (uint32_t)now.turn;
{jets}                *word++ = (uint32_t)target.turn;
{targets}            }}
        }}
        send(answers, (size_t)(word - answers) * sizeof answers[0]);
    }}
    return 0;
}}
"
    )
}

fn compare_all(place: Place, options: &[&str]) {
    const JET: [&str; 4] = ["r", "r_dot", "r_ddot", "r_dddot"];
    let motor = ("motor", MOTOR, run::<3, 2> as fn(f64) -> Run, &JET[..3], 2, 1e-3);
    let joint = ("joint", JOINT, run::<4, 4> as fn(f64) -> Run, &JET[..], 4, 2e-4);
    for (name, scenario, run, jet, order, period_s) in [motor, joint] {
        let Run { asked, answers: expected } = run(period_s);
        let kind = match place {
            Place::Here => "here",
            Place::On(board) => board.machine,
        };
        let folder = folder(&format!("plan-{kind}{}", options.concat())).join(name);
        fs::create_dir_all(&folder).expect("a folder");
        let scenario = format!("{scenario}\ndrive = {{ period_s = {period_s:?} }}\n");
        let exported = exported(&folder, &format!("{name}.h"), &scenario, &["--standalone"]);
        let answered = answers(&folder, &driver(plain(&exported), jet, order, place), options, &asked, place);
        assert_eq!(answered.len(), expected.len(), "{name}: words of the answers");
        let words = 1 + ASKED * (2 + jet.len() + order);
        for (k, (c, rust)) in answered.chunks(words).zip(expected.chunks(words)).enumerate() {
            let is_nan = |word: u32| f32::from_bits(word).is_nan();
            let alike = c.iter().zip(rust).all(|(&c, &rust)| c == rust || is_nan(c) && is_nan(rust));
            assert!(alike, "{name}, plan {k}\nC:    {c:08x?}\nRust: {rust:08x?}");
        }
        fs::remove_dir_all(&folder).expect("the folder goes");
    }
}

#[test]
fn an_exported_plan_gives_the_bits_of_the_rust_one() {
    compare_all(Place::Here, &["-O2", "-Wconversion"]);
}

#[test]
fn an_exported_plan_has_no_undefined_behaviour() {
    compare_all(Place::Here, &["-O1", "-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]);
}

/// The compiler's own library computes the doubles there.
#[test]
fn an_exported_plan_gives_its_bits_on_the_emulated_chip() {
    compare_all(Place::On(&STM32F405), &["-O2", "-Wconversion", "-lgcc"]);
}

#[test]
fn an_exported_plan_gives_its_bits_on_other_cores() {
    for board in other_boards() {
        compare_all(Place::On(board), &["-O2"]);
    }
}
