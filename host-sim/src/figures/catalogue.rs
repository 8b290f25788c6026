//! What the paper shows and claims, figure by figure.
//!
//! "Ultimate" figures are maxima over the second half of the run (Example 1: from 4 s on), as are the "bounds".
//! Thresholds of claims in words ("marginally", "almost the same", "not at all") are ours and stand beside the claim.

use loop_sim::trace::Row;

use super::Test::{AtMost, Near};
use super::{Case, Claim, PanelSpec, PaperFigure, Quantity, Test};

const EXAMPLE_1: &str = "c1 = 5, alpha = 1, 0.1 ms";
const EXAMPLE_2: &str = "reconstructed, 0.2 ms";

const R2: &str = "controller.observer=[{channel=2, printed=[100.0, 20.0]}, {channel=4, printed=[100.0, 20.0]}]";
const R3: &str =
    "controller.observer=[{channel=2, printed=[1000.0, 300.0, 30.0]}, {channel=4, printed=[1000.0, 300.0, 30.0]}]";

const ORDERS: &[(&str, &[&str])] = &[("r = 2", &[R2]), ("r = 3", &[R3])];
const LINEAR_GAINS: &[(&str, &[&str])] = &[
    ("kₗ = 10", &["controller.k_l=10.0"]),
    ("kₗ = 50", &["controller.k_l=50.0"]),
    ("kₗ = 100", &["controller.k_l=100.0"]),
];
const SWITCHING_GAINS: &[(&str, &[&str])] =
    &[("kₛ = 0", &["controller.k_s=0.0"]), ("kₛ = 0.5", &["controller.k_s=0.5"]), ("kₛ = 1", &["controller.k_s=1.0"])];
/// A claim that holds: its text, what is published, unit and test of the figure of merit, and how it is reproduced.
const fn claim(
    text: &'static str,
    published: &'static str,
    unit: &'static str,
    test: Test,
    reproduced: fn(&[Case]) -> f64,
) -> Claim {
    Claim { text, published, unit, test, reproduced, holds: true, remark: "" }
}

impl Claim {
    /// It holds, in this sense.
    const fn remarked(self, remark: &'static str) -> Self {
        Self { remark, ..self }
    }

    /// It does not hold, for this reason.
    const fn fails(self, remark: &'static str) -> Self {
        Self { holds: false, remark, ..self }
    }
}

fn y(row: &Row) -> f64 {
    row.x[0]
}
fn u(row: &Row) -> f64 {
    row.u_held
}
fn sigma_star(row: &Row) -> f64 {
    row.sigma_star
}
fn error_1(row: &Row) -> f64 {
    row.d[0] - row.d_hat[0]
}
fn error_2(row: &Row) -> f64 {
    row.d[1] - row.d_hat[1]
}
fn error_4(row: &Row) -> f64 {
    row.d[3] - row.d_hat[3]
}

/// Name and text of a scenario file.
macro_rules! scenario {
    ($name:literal) => {
        (concat!($name, ".toml"), include_str!(concat!("../../scenarios/", $name, ".toml")))
    };
}

/// A panel of one quantity: the legend names the cases.
macro_rules! panel {
    ($y_label:literal, [$(($name:literal, $quantity:expr)),+]) => {
        PanelSpec { y_label: $y_label, quantities: &[$(($name, $quantity as Quantity)),+], x_range: None }
    };
    ($y_label:literal, $quantity:expr) => {
        panel!($y_label, [("", $quantity)])
    };
}

const U: PanelSpec = panel!("u (A)", u);
const SIGMA_STAR: PanelSpec = panel!("σ* (rad/s³)", sigma_star);
const ERROR_2: PanelSpec = panel!("d₂ − d̂₂ (rad/s²)", error_2);
const ERROR_4: PanelSpec = panel!("d₄ − d̂₄ (rad/s⁴)", error_4);
const OUTPUT: PanelSpec = panel!("y = x₁ (rad)", y);

/// The same panel over a part of the time, where the steady part can be read.
const fn between(panel: PanelSpec, from_s: f64, to_s: f64) -> PanelSpec {
    PanelSpec { x_range: Some((from_s, to_s)), ..panel }
}

/// (largest - smallest)/largest magnitude: how much a figure of merit depends on the case. NaN if one is.
fn spread(cases: &[Case], f: impl Fn(&Case) -> f64) -> f64 {
    let values: Vec<f64> = cases.iter().map(f).collect();
    let size = values.iter().fold(0.0, |size, value| f64::max(size, value.abs()));
    let distances = values.iter().flat_map(|a| values.iter().map(move |b| (a - b).abs()));
    largest(distances) / size
}

/// Largest ratio of one case's figure of merit to that of the case before it: below 1 if it falls throughout.
fn worst_step(cases: &[Case], f: impl Fn(&Case) -> f64) -> f64 {
    largest(cases.windows(2).map(|pair| f(&pair[1]) / f(&pair[0])))
}

/// The largest; NaN if one is, or there is none.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.reduce(|a, b| if a >= b || a.is_nan() { a } else { b }).unwrap_or(f64::NAN)
}

fn ultimate_error(case: &Case, channel: usize) -> f64 {
    let errors = &case.metrics.estimation_error_ultimate;
    errors.iter().find(|error| error.channel == channel).map_or(f64::NAN, |error| error.error)
}

/// The ten figures.
pub const CATALOGUE: &[PaperFigure] = &[
    PaperFigure {
        id: "fig01",
        scenario: scenario!("fig01"),
        reading: EXAMPLE_1,
        cases: &[("linear gain", &[])],
        baseline: Some(("switching gain [1]", scenario!("fig01_baseline"))),
        panels: &[panel!("x₁", y), panel!("u", u), between(panel!("u", u), 3.0, 3.003)],
        claims: &[
            claim("x1 almost the same: spread of the peaks", "almost the same", "relative", AtMost(0.1), |cases| {
                spread(cases, |case| case.peak(2.0, y))
            })
            .fails("alike in shape; with the assumed c1 and alpha [1] peaks lower"),
            claim("free from chatter: variation of u over [1]'s", "absolutely free", "ratio", AtMost(1e-3), |cases| {
                cases[0].metrics.u_total_variation_per_s / cases[1].metrics.u_total_variation_per_s
            })
            .remarked("at T = 0.1 ms; the chatter of [1] grows as 1/T"),
        ],
    },
    PaperFigure {
        id: "fig02",
        scenario: scenario!("fig02"),
        reading: EXAMPLE_1,
        cases: &[("linear gain, r = 2", &[])],
        baseline: Some(("switching gain [1], r = 1", scenario!("fig02_baseline"))),
        panels: &[panel!("d₁ − d̂₁", error_1), panel!("u", u), panel!("x₁", y)],
        claims: &[
            claim("better estimate: rms of d1 - d1_hat over [1]'s", "better", "ratio", AtMost(0.2), |cases| {
                cases[0].rms(error_1) / cases[1].rms(error_1)
            }),
            claim("free from chatter: variation of u over [1]'s", "free", "ratio", AtMost(1e-3), |cases| {
                cases[0].metrics.u_total_variation_per_s / cases[1].metrics.u_total_variation_per_s
            })
            .remarked("at T = 0.1 ms; the chatter of [1] grows as 1/T"),
            claim("better performance: rms of x1 over [1]'s", "better", "ratio", AtMost(1.0), |cases| {
                cases[0].rms(y) / cases[1].rms(y)
            }),
            claim("better performance: peak of x1 over [1]'s", "better", "ratio", AtMost(1.0), |cases| {
                cases[0].peak(2.0, y) / cases[1].peak(2.0, y)
            })
            .fails("right after the step [1] peaks lower"),
        ],
    },
    PaperFigure {
        id: "fig03",
        scenario: scenario!("fig03"),
        reading: EXAMPLE_2,
        cases: ORDERS,
        baseline: None,
        panels: &[ERROR_2, between(ERROR_2, 1.0, 20.0), between(ERROR_4, 1.0, 20.0), U],
        claims: &[
            claim("|d2 - d2_hat| from 1 s on, r = 2", "0.01", "rad/s^2", AtMost(0.01), |cases| {
                cases[0].peak(1.0, error_2)
            }),
            claim("|d2 - d2_hat| from 1 s on, r = 3", "0.001", "rad/s^2", AtMost(0.001), |cases| {
                cases[1].peak(1.0, error_2)
            })
            .remarked("needs T <= 0.2 ms: 0.00108 at 1 ms"),
            claim("same control: peak u, r = 3 over r = 2", "not changed much", "ratio", Near(1.0, 0.05), |cases| {
                cases[1].metrics.u_peak / cases[0].metrics.u_peak
            }),
            claim("fastest observer pole, gains (100, 20)", "-10", "rad/s", Near(-10.0, 0.01), |_| {
                fastest_pole([100.0, 20.0])
            })
            .fails("the other is -0.2; poles at -10 need (20, 100)"),
            claim("fastest observer pole, gains (1000, 300, 30)", "-10", "rad/s", Near(-10.0, 0.01), |_| {
                fastest_pole([1000.0, 300.0, 30.0])
            })
            .fails("the others are -0.15 +- 0.087j; poles at -10 need (30, 300, 1000)"),
        ],
    },
    PaperFigure {
        id: "fig04",
        scenario: scenario!("fig04"),
        reading: EXAMPLE_2,
        cases: ORDERS,
        baseline: None,
        panels: &[SIGMA_STAR, between(SIGMA_STAR, 5.0, 20.0), OUTPUT, between(OUTPUT, 5.0, 20.0)],
        claims: &[
            claim("smaller sigma*: r = 3 over r = 2", "improved", "ratio", AtMost(0.5), |cases| {
                worst_step(cases, |case| case.metrics.sigma_star_ultimate)
            }),
            claim("smaller output: r = 3 over r = 2", "improved", "ratio", AtMost(1.0), |cases| {
                worst_step(cases, |case| case.metrics.y_ultimate)
            }),
        ],
    },
    PaperFigure {
        id: "fig05",
        scenario: scenario!("fig05"),
        reading: EXAMPLE_2,
        cases: LINEAR_GAINS,
        baseline: None,
        panels: &[ERROR_2, between(ERROR_2, 5.0, 20.0), between(ERROR_4, 1.0, 20.0), U],
        claims: &[
            claim("k_l increases the control: spread of peak u", "marginally", "relative", AtMost(0.1), |cases| {
                spread(cases, |case| case.metrics.u_peak)
            }),
            claim("k_l increases u(0): spread", "not at all", "relative", AtMost(1e-6), |cases| {
                spread(cases, |case| case.trace.rows[0].u_held)
            }),
            claim("k_l affects d4 - d4_hat: spread of the bounds", "not at all", "relative", AtMost(1e-3), |cases| {
                spread(cases, |case| ultimate_error(case, 4))
            }),
            claim("k_l affects d2 - d2_hat: spread of the bounds", "not at all", "relative", AtMost(1e-3), |cases| {
                spread(cases, |case| ultimate_error(case, 2))
            })
            .fails("d2 is state feedback: a smaller y makes a smaller error"),
        ],
    },
    PaperFigure {
        id: "fig06",
        scenario: scenario!("fig06"),
        reading: EXAMPLE_2,
        cases: LINEAR_GAINS,
        baseline: None,
        panels: &[SIGMA_STAR, between(SIGMA_STAR, 5.0, 20.0), OUTPUT, between(OUTPUT, 5.0, 20.0)],
        claims: &[
            claim("|sigma*| ultimate, k_l = 10", "0.185", "rad/s^3", Near(0.185, 0.1), |cases| {
                cases[0].metrics.sigma_star_ultimate
            }),
            claim("|sigma*| ultimate, k_l = 50", "0.049", "rad/s^3", Near(0.049, 0.05), |cases| {
                cases[1].metrics.sigma_star_ultimate
            }),
            claim("|sigma*| ultimate, k_l = 100", "0.025", "rad/s^3", Near(0.025, 0.05), |cases| {
                cases[2].metrics.sigma_star_ultimate
            }),
        ],
    },
    PaperFigure {
        id: "fig07",
        scenario: scenario!("fig07"),
        reading: EXAMPLE_2,
        cases: SWITCHING_GAINS,
        baseline: None,
        panels: &[ERROR_2, between(ERROR_2, 5.0, 20.0), between(ERROR_4, 1.0, 20.0), U],
        claims: &[
            claim("k_s affects d4 - d4_hat: spread of the bounds", "not at all", "relative", AtMost(1e-3), |cases| {
                spread(cases, |case| ultimate_error(case, 4))
            }),
            claim("k_s affects d2 - d2_hat: spread of the bounds", "not at all", "relative", AtMost(1e-3), |cases| {
                spread(cases, |case| ultimate_error(case, 2))
            })
            .fails("printed as d1; d2 is state feedback: a smaller y makes a smaller error"),
        ],
    },
    PaperFigure {
        id: "fig08",
        scenario: scenario!("fig08"),
        reading: EXAMPLE_2,
        cases: SWITCHING_GAINS,
        baseline: None,
        panels: &[SIGMA_STAR, between(SIGMA_STAR, 5.0, 20.0), OUTPUT, between(OUTPUT, 5.0, 20.0)],
        claims: &[claim(
            "k_s lowers |sigma*|: worst ratio of neighbours",
            "decreasing",
            "ratio",
            AtMost(0.9),
            |cases| worst_step(cases, |case| case.metrics.sigma_star_ultimate),
        )],
    },
    PaperFigure {
        id: "fig09",
        scenario: scenario!("fig09"),
        reading: EXAMPLE_2,
        cases: &[("kₗ = 50, kₛ = 0.5", &[])],
        baseline: None,
        panels: &[
            panel!("x₁ (rad)", y),
            panel!("x₂ (rad/s)", |row| row.x[1]),
            panel!("x₃ (rad/s²)", |row| row.x[2]),
            panel!("x₄ (rad/s³)", |row| row.x[3]),
        ],
        claims: &[claim("the joint is stabilised: ultimate |x1|", "(drawn)", "rad", AtMost(0.001), |cases| {
            cases[0].metrics.y_ultimate
        })],
    },
    PaperFigure {
        id: "fig10",
        scenario: scenario!("fig10"),
        reading: EXAMPLE_2,
        cases: &[("kₗ = 50, kₛ = 0.5", &[])],
        baseline: None,
        panels: &[
            panel!("d₂ (rad/s²)", [("d₂", |row| row.d[1]), ("d̂₂", |row| row.d_hat[1])]),
            panel!("d₄ (rad/s⁴)", [("d₄", |row| row.d[3]), ("d̂₄", |row| row.d_hat[3])]),
            SIGMA_STAR,
            U,
        ],
        claims: &[
            claim("d2_hat follows d2: error over |d2|", "(drawn)", "relative", AtMost(0.05), |cases| {
                let size = loop_sim::metrics::ultimate(&cases[0].trace, cases[0].metrics.window_s, |row| row.d[1]);
                ultimate_error(&cases[0], 2) / size
            }),
            claim("d4_hat follows d4: error over |d4|", "(drawn)", "relative", AtMost(0.05), |cases| {
                let size = loop_sim::metrics::ultimate(&cases[0].trace, cases[0].metrics.window_s, |row| row.d[3]);
                ultimate_error(&cases[0], 4) / size
            }),
        ],
    },
];

/// Real part of the fastest pole that printed gains have.
fn fastest_pole<const R: usize>(l: [f64; R]) -> f64 {
    let gains = controller_core::ObserverGains::<R>::as_printed::<R>(l);
    controller_core::error_dynamics::error_poles(&gains).first().map_or(f64::NAN, |pole| pole.re)
}
