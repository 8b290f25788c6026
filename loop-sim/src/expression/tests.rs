use super::*;

fn constants() -> BTreeMap<String, f64> {
    [("g".to_owned(), 9.81), ("k_1".to_owned(), 2.0)].into()
}

fn read(text: &str) -> Result<Expression, Vec<String>> {
    Expression::parse(text, &["x1", "x2", "u", "t"], &constants())
        .map_err(|errors| errors.iter().map(ToString::to_string).collect())
}

fn expression(text: &str) -> Expression {
    read(text).unwrap_or_else(|told| panic!("{text}: {told:?}"))
}

/// Returns a generator of numbers in (0.1, 0.9), where every function is defined.
fn numbers() -> impl FnMut() -> f64 {
    let mut seed = 7_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        0.1 + 0.8 * (seed >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn a_text_means_what_the_same_formula_means_in_rust() {
    type Formula = fn([f64; 4]) -> f64;
    let formulas: [(&str, Formula); 22] = [
        ("x1 - x2 - u", |[x, y, u, _]| x - y - u),
        ("x1 - (x2 - u)", |[x, y, u, _]| x - (y - u)),
        ("x1/x2/u*t", |[x, y, u, t]| x / y / u * t),
        ("x1 + x2*u^2", |[x, y, u, _]| x + y * (u * u)),
        ("-x1^2", |[x, ..]| -(x * x)),
        ("(-x1)^3", |[x, ..]| -(x * x * x)),
        ("x1^-2", |[x, ..]| 1.0 / (x * x)),
        ("x1^x2^u", |[x, y, u, _]| x.powf(y.powf(u))),
        ("2*-x1", |[x, ..]| 2.0 * -x),
        ("--x1 - +x2", |[x, y, ..]| x - y),
        ("-g/k_1*sin(x1)", |[x, ..]| -9.81 / 2.0 * x.sin()),
        ("1.5e-1*x1 + .5 + 2.", |[x, ..]| 0.15 * x + 0.5 + 2.0),
        ("cos(pi*t) + tan(x2)", |[_, y, _, t]| (PI * t).cos() + y.tan()),
        ("asin(x1) + acos(x2)", |[x, y, ..]| x.asin() + y.acos()),
        ("atan(x1) - atan2(x1, -x2)", |[x, y, ..]| x.atan() - x.atan2(-y)),
        ("sinh(x1)*cosh(x2)", |[x, y, ..]| x.sinh() * y.cosh()),
        ("tanh(u/0.1)", |[_, _, u, _]| (u / 0.1).tanh()),
        ("exp(-x1) + ln(x2)", |[x, y, ..]| (-x).exp() + y.ln()),
        ("sqrt(x1)*abs(-x2)", |[x, y, ..]| x.sqrt() * y),
        ("min(x1, x2) + 2*max(u, t)", |[x, y, u, t]| x.min(y) + 2.0 * u.max(t)),
        (" ( ( x1 ) )\t* x2 ", |[x, y, ..]| x * y),
        ("abs(x1 - x2)", |[x, y, ..]| (x - y).abs()),
    ];
    let mut number = numbers();
    for (text, formula) in formulas {
        let read = expression(text);
        for _ in 0..50 {
            let inputs = std::array::from_fn(|_| number());
            let (found, expected) = (read.value(&inputs), formula(inputs));
            // The functions of the platform differ from libm by an ulp or two, through a few operations.
            assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()), "{text}: {found} for {expected}");
        }
    }
}

#[test]
fn every_slope_is_the_one_of_differences() {
    let names = functions().map(|name| {
        let of_two = TWO.iter().any(|two| two.name == name);
        if of_two { format!("{name}(x1, x2)") } else { format!("{name}(x1)") }
    });
    let operators = ["+", "-", "*", "/", "^"].map(|operator| format!("x1 {operator} x2"));
    let nested = ["-x1^3*sin(x2/x1)", "x1^-2", "(x1*x2)^2.5", "exp(sin(x1)^2)"].map(str::to_owned);
    let mut number = numbers();
    for text in names.chain(operators).chain(nested) {
        let read = expression(&text);
        for _ in 0..20 {
            let at = [number(), number()];
            for by in 0..2 {
                let h = 1e-6;
                let there = |step: f64| {
                    let mut there = at;
                    there[by] += step;
                    read.value(&there)
                };
                let (found, expected) = (read.slope(&at, by), (there(h) - there(-h)) / (2.0 * h));
                // The error is h² times a third derivative of up to 1e4 near the ends. A kink of min or max is not that
                // near.
                assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{text} {at:?}: {found} {expected}");
            }
        }
    }
}

#[test]
fn what_is_wrong_is_told_with_its_place_and_names_all_at_once() {
    let deep = format!("{}x1{}", "(".repeat(40), ")".repeat(40));
    let long = vec!["x1"; 600].join("+");
    let cases: [(&str, &[&str]); 20] = [
        (
            "x1 + y1*foo(2, x9) - sin",
            &[
                "at character 6: `y1` is unknown",
                "at character 16: `x9` is unknown",
                "at character 9: `foo` is not a function",
                "at character 22: `sin` is a function: write sin(..)",
            ],
        ),
        (
            "sin(x1, x2) + atan2(q)",
            &[
                "at character 1: `sin` takes 1, not 2 values",
                "at character 21: `q` is unknown",
                "at character 15: `atan2` takes 2, not 1 values",
            ],
        ),
        ("q + * 2", &["at character 1: `q` is unknown", "at character 5: expected a value, found `*`"]),
        ("", &["at character 1: expected a value, found the end"]),
        ("sin()", &["at character 1: `sin` takes 1, not 0 values"]),
        ("x1 x2", &["at character 4: expected an operator or the end, found `x`"]),
        ("2x1", &["at character 1: 2x1 is not a number"]),
        ("1e999", &["at character 1: 1e999 is not a number"]),
        ("1.2.3", &["at character 1: 1.2.3 is not a number"]),
        ("x1**2", &["at character 4: expected a value, found `*`"]),
        ("(x1 + 1", &["at character 8: expected `)`, found the end"]),
        ("sin(x1", &["at character 7: expected `,` or `)`, found the end"]),
        ("x1)", &["at character 3: expected an operator or the end, found `)`"]),
        ("x1 = 2", &["at character 4: expected an operator or the end, found `=`"]),
        ("σ + 1", &["at character 1: expected a value, found `σ`"]),
        ("x1 + 3 σ", &["at character 8: expected an operator or the end, found `σ`"]),
        ("x1(2)", &["at character 1: `x1` is not a function"]),
        ("x1 + abcdefghijabcdefghijabcdefghijabc", &["at character 6: `abcdefghijabcdefghijabcdefghij..` is unknown"]),
        (&deep, &["at character 33: nested deeper than 32 levels"]),
        (&long, &["at character 1503: more than 1000 operations: move a part into a constant"]),
    ];
    for (text, expected) in cases {
        assert_eq!(read(text).expect_err(text), expected, "{text}");
    }
}

#[test]
fn the_deepest_and_the_longest_formula_are_read() {
    // 32 levels deep, each with a pending value: the stack is full.
    let deep = (1..32).fold("x1".to_owned(), |inner, k| format!("{k} + ({inner})"));
    let below: f64 = (1..32).map(f64::from).sum();
    assert_eq!(expression(&deep).value(&[0.5]), 0.5 + below);
    let long = vec!["x1"; 500].join("+");
    assert_eq!(expression(&long).value(&[2.0]), 1000.0);
    assert!(read(&format!("{long} + 1")).is_err());
}

#[test]
fn no_text_makes_it_panic_and_what_is_read_has_a_value() {
    let pieces = [
        "x1", "x2", "u", "t", "g", "q", "sin", "atan2", "min", "(", ")", "(", ")", ",", "+", "-", "*", "/", "^", "0",
        "1e3", " ", ".",
    ];
    let mut number = numbers();
    let mut good = 0;
    for _ in 0..100_000 {
        let length = 1 + (number() * 12.0) as usize;
        let text: String = (0..length).map(|_| pieces[((number() - 0.1) / 0.8 * 23.0) as usize]).collect();
        let Ok(read) = Expression::parse(&text, &["x1", "x2", "u", "t"], &constants()) else { continue };
        good += 1;
        // The result may be infinite or NaN, but nothing panics. Missing inputs are 0.
        for inputs in [&[0.0; 4][..], &[f64::NAN, f64::INFINITY, -1.0, 1e300], &[]] {
            let _ = (read.value(inputs), read.slope(inputs, 1));
        }
    }
    assert!(good > 1000, "{good} of the texts were formulas");
}

#[test]
fn a_row_is_the_formula_written_out() {
    let row = Expression::linear(&[-6.0, -11.0, 2.5]);
    assert_eq!(row.value(&[0.7, -1.3, 2.1]), -6.0 * 0.7 + -11.0 * -1.3 + 2.5 * 2.1);
    assert_eq!([0, 1, 2].map(|by| row.slope(&[0.7, -1.3, 2.1], by)), [-6.0, -11.0, 2.5]);
    assert!(row.varies() && !expression("g*2 + sin(pi)").varies());
}
