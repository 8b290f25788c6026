//! Bit-identity of an exported set-point profile with the Rust profile.
//!
//! Goals, stops, ranges, other limits and starts in motion come in random order, with NaN among the numbers, for a
//! motor (two averages) and a joint (three). The test compares the acceptance of each request, every bit of the targets
//! of the following ticks, and the arrival flag.

use controller_core::drive::{FARTHEST_RAD, Profile, ProfileLimits, Target};
use integration_tests::strategy::Rng;
use std::fs;

use super::export::{ON_THE_CHIP, ON_THE_HOST, Place, STM32F405, answers, exported, folder, other_boards, plain};
use super::export_plan::{JOINT, MOTOR, any};

const ASKED: usize = 10_000;
const WINDOW: usize = 32;

const NEW: u32 = 0;
const GO_TO: u32 = 1;
const STOP: u32 = 2;
const WITHIN: u32 = 3;
const LIMIT: u32 = 4;
const START: u32 = 5;

pub(super) struct Run {
    pub(super) asked: Vec<u8>,
    pub(super) answers: Vec<u32>,
    /// Status of the C library, in place of the first word of each answer.
    pub(super) statuses: Vec<u32>,
}

/// Returns the status of the C library for an accepted or rejected request.
fn status_of(what: u32, good: bool, numbers: &[f64]) -> u32 {
    // An unused second number cannot be wrong.
    let asked = if what == GO_TO { 1 } else { 2 };
    let near = numbers[..asked].iter().all(|rad| rad.abs() <= FARTHEST_RAD);
    let status: i32 = match what {
        _ if good => 0,
        NEW | LIMIT => -41,
        _ if !near => -6,
        GO_TO => 2,
        WITHIN => -19,
        _ => -42,
    };
    status as u32
}

pub(super) fn run<const M: usize, const J: usize, const LEN: usize>(period_s: f64) -> Run {
    let most = LEN / M;
    let mut rng = Rng::new(M as u64);
    let (mut asked, mut answers, mut statuses) = (Vec::new(), Vec::new(), Vec::new());
    let mut profile: Option<Profile<f32, M, LEN>> = None;
    let (mut taken, mut arrived) = ([[0_usize; 2]; 6], 0);
    for k in 0..ASKED {
        let what =
            if k == 0 { NEW } else { *rng.one_of(&[NEW, GO_TO, GO_TO, GO_TO, GO_TO, STOP, WITHIN, LIMIT, START]) };
        let window =
            if rng.chance(0.1) { rng.integer(0, most + 8) as u32 } else { *rng.one_of(&[1, 2, 5, 10, most as u32]) };
        let far = if rng.chance(0.02) { rng.bits() as i32 } else { rng.integer(0, 8) as i32 - 4 };
        let turns = [far, far.wrapping_add(rng.integer(0, 6) as i32 - 1)];
        let mut numbers = match what {
            NEW | LIMIT => [rng.spread(0.1, 300.0), rng.spread(1.0, 1e5)],
            START => [f64::from(any(&mut rng, 4.0)), f64::from(any(&mut rng, 300.0))],
            _ => [f64::from(any(&mut rng, 4.0)), f64::from(any(&mut rng, 4.0))],
        };
        if rng.chance(0.03) && k > 0 {
            numbers[rng.integer(0, 1)] = *rng.one_of(&[f64::NAN, f64::INFINITY, -1.0, 0.0, 1e-12, 7e9, 1e300]);
        }
        let ticks = *rng.one_of(&[0, 1, 2, 30, 200, 1500]);
        let limits = ProfileLimits { speed_rad_s: numbers[0], acceleration_rad_s2: numbers[1], window };
        let good = match (&mut profile, what) {
            (_, NEW) => {
                let new = Profile::new(&limits, period_s).ok();
                let good = new.is_some();
                profile = new.or(profile);
                good
            }
            (Some(profile), GO_TO) => profile.go_to(turns[0], numbers[0]),
            (Some(profile), STOP) => {
                profile.stop();
                true
            }
            (Some(profile), WITHIN) => profile.keep_within((turns[0], numbers[0]), (turns[1], numbers[1])),
            (Some(profile), LIMIT) => profile.limit(&limits, period_s).is_ok(),
            (Some(profile), _) => profile.start(turns[0], numbers[0], numbers[1]),
            (None, _) => unreachable!("the first is a new one"),
        };
        taken[what as usize][usize::from(good)] += 1;
        let profile = profile.as_mut().expect("the first is good");
        let mut sum = 0x811c_9dc5_u32;
        let mut last: Target<f32, i32, J> = Target { turn: 0, jet: [0.0; J] };
        for _ in 0..ticks {
            last = profile.next_tick();
            let words = [last.turn as u32].into_iter().chain(last.jet.map(f32::to_bits));
            sum = words.fold(sum, |sum, word| (sum ^ word).wrapping_mul(0x0100_0193));
        }
        arrived += usize::from(profile.has_arrived());
        statuses.push(status_of(what, good, &numbers));
        answers.extend([u32::from(good), sum, u32::from(profile.has_arrived()), last.turn as u32]);
        answers.extend(last.jet.map(f32::to_bits));
        asked.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
        let words = [what, window, ticks, turns[0] as u32, turns[1] as u32, 0];
        asked.extend(words.into_iter().flat_map(u32::to_le_bytes));
    }
    println!("refused and taken: {taken:?}, {arrived} times at rest at the goal");
    assert!(taken.iter().all(|[_, taken]| *taken > 500) && arrived > 500, "every answer is asked for");
    assert!([NEW, GO_TO, WITHIN, LIMIT, START].iter().all(|&what| taken[what as usize][0] > 10));
    Run { asked, answers, statuses }
}

/// Returns the C program around the exported file: requests in, answers out.
fn driver(exported: &str, jet: &[&str], place: Place) -> String {
    let transfer = if place == Place::Here { ON_THE_HOST } else { ON_THE_CHIP };
    let mixed = |name: &&str| format!("                sum = (sum ^ bits(last.{name})) * 0x01000193u;\n");
    let put = |name: &&str| format!("            *word++ = bits(last.{name});\n");
    let mixed = jet.iter().map(mixed).collect::<Vec<_>>().concat();
    let put = jet.iter().map(put).collect::<Vec<_>>().concat();
    let zeros = ", 0.0f".repeat(jet.len());
    format!(
        "#define EDO_SMC_PROFILE_WINDOW {WINDOW}u
#include \"{exported}\"
{transfer}
typedef struct {{
    double numbers[2];
    uint32_t what, window, ticks;
    int32_t turns[2];
    uint32_t unused;
}} ask_type;
static ask_type asks[16];
static uint32_t answers[16 * 8];

static uint32_t bits(float number)
{{
    union {{ float number; uint32_t word; }} both;
    both.number = number;
    return both.word;
}}

int main(void)
{{
    static edo_smc_profile profile;
    size_t count;
    while ((count = receive(asks, sizeof asks) / sizeof asks[0]) > 0) {{
        uint32_t *word = answers;
        for (size_t k = 0; k < count; k++) {{
            const ask_type *const ask = &asks[k];
            const double *const x = ask->numbers;
            edo_smc_target last = {{ 0{zeros} }};
            uint32_t sum = 0x811c9dc5u;
            bool good = true;
            switch (ask->what) {{
            /* One that is refused leaves a profile in motion as it is. */
            case {NEW}: good = edo_smc_profile_new(&profile, x[0], x[1], ask->window); break;
            case {GO_TO}: good = edo_smc_profile_go_to(&profile, ask->turns[0], x[0]); break;
            case {STOP}: edo_smc_profile_stop(&profile); break;
            case {WITHIN}: good = edo_smc_profile_keep_within(&profile, ask->turns[0], x[0], ask->turns[1], x[1]); \
            break;
            case {LIMIT}: good = edo_smc_profile_limit(&profile, x[0], x[1]); break;
            default: good = edo_smc_profile_start(&profile, ask->turns[0], x[0], x[1]); break;
            }}
            for (uint32_t tick = 0; tick < ask->ticks; tick++) {{
                edo_smc_profile_next(&profile, &last);
                sum = (sum ^ (uint32_t)last.turn) * 0x01000193u;
{mixed}            }}
            *word++ = good;
            *word++ = sum;
            *word++ = edo_smc_profile_has_arrived(&profile);
            *word++ = (uint32_t)last.turn;
{put}        }}
        send(answers, (size_t)(word - answers) * sizeof answers[0]);
    }}
    return 0;
}}
"
    )
}

fn compare_all(place: Place, options: &[&str]) {
    const JET: [&str; 4] = ["r", "r_dot", "r_ddot", "r_dddot"];
    let motor = ("motor", MOTOR, run::<2, 2, { 2 * WINDOW }> as fn(f64) -> Run, &JET[..2], 1e-3);
    let joint = ("joint", JOINT, run::<3, 4, { 3 * WINDOW }> as fn(f64) -> Run, &JET[..], 2e-4);
    for (name, scenario, run, jet, period_s) in [motor, joint] {
        let Run { asked, answers: expected, .. } = run(period_s);
        let kind = match place {
            Place::Here => "here",
            Place::On(board) => board.machine,
        };
        let folder = folder(&format!("profile-{kind}{}", options.concat())).join(name);
        fs::create_dir_all(&folder).expect("a folder");
        let scenario = format!("{scenario}\ndrive = {{ period_s = {period_s:?} }}\n");
        let exported = exported(&folder, &format!("{name}.h"), &scenario, &["--standalone"]);
        let answered = answers(&folder, &driver(plain(&exported), jet, place), options, &asked, place);
        assert_eq!(answered.len(), expected.len(), "{name}: words of the answers");
        let words = 4 + jet.len();
        for (k, (c, rust)) in answered.chunks(words).zip(expected.chunks(words)).enumerate() {
            assert_eq!(c, rust, "{name}, request {k}");
        }
        fs::remove_dir_all(&folder).expect("the folder goes");
    }
}

#[test]
fn an_exported_profile_gives_the_bits_of_the_rust_one() {
    compare_all(Place::Here, &["-O2", "-Wconversion"]);
}

#[test]
fn an_exported_profile_has_no_undefined_behaviour() {
    compare_all(Place::Here, &["-O1", "-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]);
}

#[test]
fn an_exported_profile_gives_its_bits_on_the_emulated_chip() {
    compare_all(Place::On(&STM32F405), &["-O2", "-Wconversion", "-lgcc"]);
}

#[test]
fn an_exported_profile_gives_its_bits_on_other_cores() {
    for board in other_boards() {
        compare_all(Place::On(board), &["-O2"]);
    }
}
