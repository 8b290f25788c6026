//! Comparison with independent results: the margins of one loop, all rectangles, the simulated plant.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::ThreadPoolBuilder;

use super::*;

fn subject<'a>(text: &'a str, sets: &'a [String]) -> Subject<'a> {
    Subject { file: "mine.toml", text, name: "mine", sets }
}

fn question<'a>(text: &'a str, axes: &[&str]) -> Question<'a> {
    let axes = axes.iter().map(|axis| Axis::parse(axis).expect(axis)).collect();
    let subject = subject(text, &[]);
    Question { axes, ..Question::of(subject, &subject.with(&[]).expect("a scenario")) }
}

fn answered(question: &Question<'_>) -> Vec<Point> {
    let points = question.answer(Watch::none()).expect("an answer");
    points.into_iter().map(|point| point.expect("a design")).collect()
}

#[test]
fn an_axis_has_the_ends_that_were_typed_and_even_steps_between() {
    let even = Axis::parse("a.b = -0.5..1:4").expect("an axis");
    assert_eq!((even.key.as_str(), even.values), ("a.b", ["-0.5", "0", "0.5", "1"].map(String::from).to_vec()));
    let log = Axis::parse("k=1..1000:log:4").expect("an axis");
    assert_eq!(log.numbers, Some(vec![1.0, 10.0, 100.0, 1000.0]));
    assert_eq!(Axis::parse("k=1..1000:4:log"), Ok(log));
    assert_eq!(Axis::parse("k=0..1").expect("an axis").values.len(), POINTS);
    let words = Axis::parse("drive.tuning=quiet, normal").expect("an axis");
    assert_eq!((words.values, words.numbers), (["quiet", "normal"].map(String::from).to_vec(), None));
    assert_eq!(Axis::parse("k=[1,2],[3,4]").expect("an axis").values, ["[1,2]", "[3,4]"]);
}

#[test]
fn what_is_no_axis_is_told() {
    for (text, told) in [
        ("k", "expected KEY=FROM..TO"),
        ("=1..2", "expected KEY=FROM..TO"),
        ("k=1..", "\"\" is not a finite number"),
        ("k=a..2", "\"a\" is not a finite number"),
        ("k=1..inf", "\"inf\" is not a finite number"),
        ("k=2..1", "second end must be above"),
        ("k=1..1", "second end must be above"),
        ("k=-1e308..1e308", "too far apart"),
        ("k=1e-300..1e300:log", "too far apart"),
        ("k=0..1:log", "begins above 0"),
        ("k=0..1:1", "2 to 400 points"),
        ("k=0..1:401", "2 to 400 points"),
        ("k=0..1:lin", "neither `log` nor a number"),
        ("k=1..1.0001:400", "differ by less than"),
        ("k=", "a value is empty"),
        ("k=1,,2", "a value is empty"),
        ("k=1,3,1", "duplicate value 1"),
    ] {
        let error = Axis::parse(text).expect_err(text);
        assert!(error.to_string().contains(told), "{text}: {error}");
    }
}

#[test]
fn a_value_is_at_the_nearest_point_and_beyond_the_ends_at_none() {
    let axis = Axis::parse("k=0..1:3").expect("an axis");
    assert_eq!(
        [-0.1, 0.0, 0.3, 1.0, 1.1, f64::NAN].map(|value| axis.at(value)),
        [None, Some(0), Some(1), Some(2), None, None]
    );
}

/// Returns the best rectangle by comparison of all rectangles.
fn by_trial(good: &[bool], columns: usize, home: [usize; 2]) -> Option<(usize, usize)> {
    let rows = good.len() / columns;
    let mut best = None;
    for (left, right) in (0..columns).flat_map(|left| (left..columns).map(move |right| (left, right))) {
        for (low, high) in (0..rows).flat_map(|low| (low..rows).map(move |high| (low, high))) {
            let mut inside = (low..=high).flat_map(|row| (left..=right).map(move |column| row * columns + column));
            let is_around = (left..=right).contains(&home[0]) && (low..=high).contains(&home[1]);
            if is_around && inside.all(|k| good[k]) {
                best = best.max(Some(worth([left, right, low, high], columns, rows, home)));
            }
        }
    }
    best
}

fn worth([left, right, low, high]: [usize; 4], columns: usize, rows: usize, home: [usize; 2]) -> (usize, usize) {
    let sides = [
        (left > 0, home[0].abs_diff(left)),
        (right + 1 < columns, home[0].abs_diff(right)),
        (low > 0, home[1].abs_diff(low)),
        (high + 1 < rows, home[1].abs_diff(high)),
    ];
    let nearest = sides.iter().filter(|(limits, _)| *limits).map(|(_, away)| *away).min();
    (nearest.unwrap_or(usize::MAX), (right + 1 - left) * (high + 1 - low))
}

#[test]
fn no_rectangle_around_the_file_is_wider() {
    let mut seed = 7_u32;
    let mut luck = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed >> 16
    };
    let mut found = 0;
    for _ in 0..500 {
        let (columns, rows) = (1 + luck() as usize % 7, 1 + luck() as usize % 6);
        let good: Vec<bool> = (0..columns * rows).map(|_| luck() % 5 > 0).collect();
        let home = [luck() as usize % columns, luck() as usize % rows];
        let rectangle = widest_rectangle(&good, columns, home.map(Some));
        assert_eq!(rectangle.map(|it| worth(it, columns, rows, home)), by_trial(&good, columns, home), "{good:?}");
        if let Some([left, right, low, high]) = rectangle {
            found += 1;
            assert!(
                (low..=high).all(|row| good[row * columns + left..=row * columns + right].iter().all(|good| *good))
            );
        }
    }
    assert!(found > 300, "{found}");
    assert_eq!(widest_rectangle(&[false; 6], 3, [None; 2]), None);
    assert_eq!(widest_rectangle(&[true, true, false, true, true, true], 3, [None; 2]), Some([0, 1, 0, 1]));
}

/// A motor with a torque constant changed by a factor is the loop with this factor on the plant gain, whose margins are
/// known.
#[test]
fn the_boundary_along_the_torque_constant_is_the_gain_margin() {
    let question = question(scenario::MOTOR, &["error.torque_percent=-95..900:100", "motor.damping_n_m_s=0,1e-5"]);
    let nominal = question.subject.with(&["motor.damping_n_m_s=0".into()]).expect("the scenario");
    let at_rest = nominal.at_rest.as_ref().expect("at rest");
    let margins = Loop::of(at_rest, at_rest.law.as_ref(), nominal.period_s).and_then(|it| it.margins());
    let margins = margins.expect("margins");
    let up = margins.gain_up.expect("a limit");
    let points = answered(&question);
    let percents = question.axes[0].numbers.clone().expect("numbers");
    let mut judged = 0;
    for (percent, point) in percents.iter().zip(&points) {
        let factor = 1.0 + percent / 100.0;
        assert_eq!(point.is_stable(), factor > margins.gain_down && factor < up, "{percent} %: {point:?}");
        judged += 1;
    }
    assert!(judged == 100 && points[..100].iter().any(|point| !point.is_stable()));
}

/// Grid of `map --preset gain`, every sixth point: poles of the matrices against the simulated plant.
#[test]
fn poles_and_simulation_agree_off_the_boundary() {
    let axes = ["plant.error.b=-0.9..5:8", "controller.k_l=5..1000:log:8"];
    let question = Question { simulate: true, ..question(scenario::DEFAULT, &axes) };
    let points = answered(&question);
    let unstable = points.iter().filter(|point| !point.is_stable()).count();
    assert!((20..40).contains(&unstable), "{unstable}");
    for point in points {
        let differs = point.grew == Some(point.is_stable());
        assert!(!differs || (point.spectral_radius - 1.0).abs() < 1e-3, "{point:?}");
    }
}

/// The current of a drive is limited, so nothing diverges: an unstable loop oscillates with a varying amplitude.
#[test]
fn poles_and_simulation_agree_where_the_current_is_at_its_limit() {
    let axes = ["error.torque_percent=-50,100,220,300,400", "error.stiffness_percent=-10,10"];
    let question = Question { simulate: true, ..question(scenario::JOINT, &axes) };
    let points = answered(&question);
    assert_eq!(points.iter().filter(|point| point.is_stable()).count(), 4);
    for point in points {
        assert_eq!(point.grew, Some(!point.is_stable()), "{point:?}");
    }
}

/// Known from another program over the same 32 corners: exactly the corners with k_2 low and b high are unstable.
#[test]
fn the_corners_of_the_paper_that_are_unstable_are_those_that_are_known() {
    let sets = ["controller.k_l=10".into()];
    let subject = subject(scenario::DEFAULT, &sets);
    let all = corners(&subject, 50.0, &[]).expect("corners");
    assert_eq!(all.len(), 32);
    for corner in all {
        let alone = Question { subject, corners: vec![corner.clone()], ..question(scenario::DEFAULT, &[]) };
        let point = &answered(&alone)[0];
        let is_known = corner.name.contains("k_2 -50 %") && corner.name.ends_with(" b +50 %");
        assert_eq!(point.is_stable(), !is_known, "{}", corner.name);
        assert_eq!((point.worst.as_ref(), point.unstable_corners), (Some(&corner.name), usize::from(is_known)));
    }
}

#[test]
fn a_point_is_as_bad_as_its_worst_corner() {
    let sets = [];
    let subject = subject(scenario::JOINT, &sets);
    let axes = ["error.stiffness_percent=0,60", "drive.tuning=quiet,normal"];
    let mut together = question(scenario::JOINT, &axes);
    together.corners = corners(&subject, 20.0, &together.axes).expect("corners");
    // The spring is swept, so it is not part of the corners.
    assert_eq!(together.corners.len(), 16);
    // A weight of 0 has no error, so no corner is computed twice.
    let level = ["joint.weight_n_m=0".to_owned()];
    let level = Subject { sets: &level, ..subject };
    assert_eq!(corners(&level, 20.0, &[]).expect("corners").len(), 16);
    assert!(together.corners.iter().all(|corner| !corner.name.contains("K ")));
    together.figure = Some("design.spectral_radius".into());
    let points = answered(&together);
    let each: Vec<Vec<Point>> = together
        .corners
        .iter()
        .map(|corner| answered(&Question { corners: vec![corner.clone()], ..question(scenario::JOINT, &axes) }))
        .collect();
    for (k, point) in points.iter().enumerate() {
        let worst = each.iter().map(|corner| corner[k].spectral_radius).fold(0.0, f64::max);
        let unstable = each.iter().filter(|corner| !corner[k].is_stable()).count();
        assert_eq!((point.spectral_radius, point.unstable_corners), (worst, unstable));
        assert_eq!(point.figure, Some(worst));
    }
}

#[test]
fn a_plant_of_which_no_number_is_known_has_no_corners_and_one_with_too_many_is_told_so() {
    let example = "[plant]\nkind = \"benchmark\"\n[controller]\nc = [5, 1]\n";
    let error = corners(&subject(example, &[]), 20.0, &[]).expect_err("no corners").to_string();
    assert!(error.contains("no uncertain parameters"), "{error}");
    let many =
        scenario::OWN.replace("g = 9.81 ", "ka = 1\nkb = 1\nkd = 1\nke = 1\nkf = 1\nkg = 1\nkh = 1\nki = 1\ng = 9.81 ");
    let error = corners(&subject(&many, &[]), 20.0, &[]).expect_err("too many").to_string();
    assert!(error.contains("13 uncertain parameters, ") && error.contains("at most 2^12"), "{error}");
}

/// Returns the largest |z| with these settings.
fn radius(text: &str, sets: &[&str]) -> f64 {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    answered(&Question { subject: subject(text, &sets), ..question(text, &[]) })[0].spectral_radius
}

/// A corner equals the file with a different plant; the model of the controller stays as in the file.
#[test]
fn a_corner_of_a_chain_and_of_equations_is_the_file_that_says_so() {
    let chain = subject(scenario::CHAIN, &[]);
    let all = corners(&chain, 20.0, &[]).expect("corners");
    assert_eq!(all.len(), 16);
    let corner = all.iter().find(|corner| corner.name == "a_1 -20 %, a_2 +20 %, a_3 -20 %, b +20 %").expect("a corner");
    let found = radius(scenario::CHAIN, &corner.sets.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(found, radius(scenario::CHAIN, &["plant.a=[-4.8, -13.2, -4.8]", "plant.b=2.4"]));
    // Without an explicit model the controller uses the plant of the file.
    let sets = ["controller.nominal={}".into()];
    let corner = &corners(&subject(scenario::CHAIN, &sets), 20.0, &[]).expect("corners")[15];
    let sets: Vec<&str> = sets.iter().chain(&corner.sets).map(String::as_str).collect();
    let off = ["plant.a=[-7.2, -13.2, -7.2]", "plant.b=2.4", "controller.nominal={a = [-6, -11, -6], b = 2}"];
    assert_eq!(radius(scenario::CHAIN, &sets), radius(scenario::CHAIN, &off));

    let all = corners(&subject(scenario::OWN, &[]), 20.0, &[]).expect("corners");
    assert_eq!(all.len(), 32);
    let corner =
        all.iter().find(|corner| corner.name == "g +20 %, l -20 %, m +20 %, c -20 %, f +20 %").expect("a corner");
    let found = radius(scenario::OWN, &corner.sets.iter().map(String::as_str).collect::<Vec<_>>());
    let rates = "plant.rates=[\"x2\", \"11.772/0.4*sin(x1) + (u - 0.016*x2 - 0.06*tanh(x2/0.01) \
                 + 0.2*sin(3*t))/(0.96*0.4^2)\"]";
    let direct = radius(scenario::OWN, &[rates]);
    assert!((found - direct).abs() < 1e-12, "{found} {direct}");
}

/// For a chain b changes, for equations the model of b. In both cases u has the corresponding factor of effect.
#[test]
fn the_axis_of_the_input_gain_is_the_error_of_b() {
    let axis = |text: &'static str, sets: &'static [String]| {
        Axis::of_input_gain(&subject(text, sets), "-0.5..1:4").expect("an axis")
    };
    let of = |text: &'static str, axis: Axis| {
        let points = answered(&Question { axes: vec![axis], ..question(text, &[]) });
        points.iter().map(|point| point.spectral_radius).collect::<Vec<_>>()
    };
    let errors = [-0.5, 0.0, 0.5, 1.0];
    let chain = errors.map(|error| radius(scenario::CHAIN, &[&format!("plant.b={}", 2.0 * (1.0 + error))]));
    assert_eq!(of(scenario::CHAIN, axis(scenario::CHAIN, &[])), chain);
    let pushed = |error: f64| {
        let rates = format!(
            "plant.rates=[\"x2\", \"g/l*sin(x1) + ({:?}*u - c*x2 - f*tanh(x2/0.01) + 0.2*sin(3*t))/(m*l^2)\"]",
            1.0 + error
        );
        radius(scenario::OWN, &[&rates])
    };
    let own = of(scenario::OWN, axis(scenario::OWN, &[]));
    for (found, expected) in own.iter().zip(errors.map(pushed)) {
        assert!((found - expected).abs() < 1e-9, "{own:?} {expected}");
    }
    assert!(own[0] != own[3]);
    assert_eq!(Axis::of_input_gain(&subject(scenario::MOTOR, &[]), "-0.5..1:4"), None);
}

#[test]
fn values_without_a_design_are_no_points_and_say_why() {
    let question = question(scenario::MOTOR, &["drive.surface_rad_s=100,1e5", "drive.period_s=1e-3,-1"]);
    let points = question.answer(Watch::none()).expect("an answer");
    assert_eq!(points.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, false, false, false]);
    assert!(points[2].as_ref().is_err_and(|why| why.what.contains("drive.period_s")), "{points:?}");
}

#[test]
fn as_many_threads_as_you_like_give_the_same_and_a_stop_gives_nothing() {
    let question = question(scenario::MOTOR, &["error.inertia_percent=-50..50:5", "error.torque_percent=-50..50:5"]);
    let done = AtomicUsize::new(0);
    let on = |threads: usize, watch: Watch<'_>| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| question.answer(watch))
    };
    let count = || _ = done.fetch_add(1, Ordering::Relaxed);
    let one = on(1, Watch::new(&AtomicBool::new(false), &count));
    assert_eq!(done.into_inner(), 25);
    assert_eq!(one, on(7, Watch::none()));
    assert_eq!(on(2, Watch::new(&AtomicBool::new(true), &|| ())), None);
}

#[test]
fn an_unknown_preset_is_an_error_with_the_nearest_name() {
    let refused = |preset| {
        let request = MapRequest { preset: Some(preset), ..MapRequest::default() };
        Question::new(subject(scenario::MOTOR, &[]), &request).err().expect("an error").to_string()
    };
    assert!(refused("plants").contains("--preset plants: did you mean plant?"), "{}", refused("plants"));
    assert!(refused("everything").contains("expected one of gain, rate"), "{}", refused("everything"));
}

#[test]
fn corners_are_ranked_by_their_peak_of_sensitivity() {
    let sets = ["drive.observer_rad_s=130".to_owned()];
    let request = MapRequest { preset: Some(CORNERS), corners: Some(30.0), ..MapRequest::default() };
    let question = Question::new(subject(scenario::MOTOR, &sets), &request).expect("a question");
    let map = map(&question, Watch::none()).expect("corners").expect("not stopped");
    let points: Vec<Point> = map.points.into_iter().map(|point| point.expect("a design")).collect();
    let peaks: Vec<f64> = points.iter().map(|point| point.sensitivity_peak.expect("a stable corner")).collect();
    assert!(peaks.len() == 8 && peaks.is_sorted_by(|a, b| a >= b) && peaks[0] > 1.1 * peaks[7], "{peaks:?}");
    let worst = points[0].worst.as_ref();
    let corner = question.corners.iter().find(|it| Some(&it.name) == worst).expect("a corner");
    let experiment = question.subject.with(&corner.sets).expect("a scenario");
    assert_eq!(margins::margins(&experiment).expect("margins").sensitivity_peak, peaks[0]);
}
