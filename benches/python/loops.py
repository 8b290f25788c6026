"""The closed loop of the joint in Python: SciPy, a call a tick, and numba, compiled. The bench `lanes` runs it.

Reads one JSON object: `design`, the coefficients in the order of the core's LAYOUT and the row of a(x)/b; `joint`, k1 b1 a1
k2 b2 b; `period_s`, `x1`, `periods`, `from`. Prints a JSON line a program: its name, its method, ticks per second (the best
of several), and the largest |x_1| from tick `from` on.
"""

import json
import math
import sys
import time

import numba
import numpy
import scipy
from scipy.integrate import solve_ivp

ASKED = json.load(sys.stdin)
K1, B1, A1, K2, B2, B = ASKED["joint"]
PERIOD_S, X1, PERIODS, FROM = (ASKED[name] for name in ("period_s", "x1", "periods", "from"))
DESIGN = ASKED["design"]
RATE, RATE_N, THETA_N, G20, G21, G40, G41, C0, C1, C2, _, _, GS21, _, _ = DESIGN[:15]
_, KX1, KX2, KX3, KW, US, _, K21, _, K41, SATK, LIM, UNIT, DECAY, U_MIN, U_MAX = DESIGN[15:31]
ROW0, ROW2, ROW3 = DESIGN[-3:]
# Before the first tick: its past is such that the first innovation is zero.
START = [0.0] * 5 + [-THETA_N * ROW0 * X1, 0.0, 0.0, C0 * X1, 0.0, 1.0]


def tick(s, x):
    """One tick; `s` is d2, d4 (A and B each), p2, p4, the last x_2 and x_4, W, u, and whether the sample is the first."""
    drift = ROW0 * x[0] + ROW2 * x[2] + ROW3 * x[3]
    h2, h4 = 0.5 * x[2], THETA_N * drift
    e2 = (x[1] - s[6]) * RATE - h2 - s[4]
    e4 = (x[3] - s[7]) * RATE_N - h4 - (s[5] + s[9])
    if s[10] != 0.0:
        e2 = e4 = 0.0
    a2, b2 = s[0] + s[1] + G20 * e2, s[1] + G21 * e2
    a4, b4 = s[2] + s[3] + G40 * e4, s[3] + G41 * e4
    y3, w4 = x[2] + a2, drift + a4
    star = x[3] + C0 * x[0] + C1 * x[1] + C2 * y3 + GS21 * b2 - s[8]
    v = KW * s[8] + KX1 * x[1] + KX2 * y3 + KX3 * x[3] + K21 * b2 + K41 * b4
    v += US * star + min(max(SATK * star, -LIM), LIM)
    demand = v * UNIT - w4
    if not abs(demand) <= 1e12:
        return s[9]
    s[0], s[1], s[2], s[3] = a2, b2, a4, b4
    s[4], s[5], s[6], s[7] = y3 - h2, w4 - h4, x[1], x[3]
    s[8] -= DECAY * s[8]
    s[9] = min(max(demand, U_MIN), U_MAX)
    s[10] = 0.0
    return s[9]


def rates(t, x, u):
    return [
        x[1],
        x[2] - K1 * x[0] - B1 * x[1] - math.sin(x[0]),
        x[3],
        A1 * x[0] - K2 * x[2] - B2 * x[3] + B * (u + 1.0 + math.sin(2.0 * t)),
    ]


def by_scipy(method, rtol, atol):
    s, x, largest = list(START), [X1, 0.0, 0.0, 0.0], 0.0
    for k in range(PERIODS + 1):
        if k >= FROM:
            largest = max(largest, abs(x[0]))
        u = tick(s, x)
        span = (k * PERIOD_S, (k + 1) * PERIOD_S)
        x = solve_ivp(rates, span, x, method=method, rtol=rtol, atol=atol, args=(u,)).y[:, -1].tolist()
    return largest


compiled_tick = numba.njit(tick)


@numba.njit
def runge_kutta(s, steps):
    x0, x1, x2, x3 = X1, 0.0, 0.0, 0.0
    h, largest = PERIOD_S / steps, 0.0

    def rates(t, x0, x1, x2, x3, u):
        link = x2 - K1 * x0 - B1 * x1 - math.sin(x0)
        motor = A1 * x0 - K2 * x2 - B2 * x3 + B * (u + 1.0 + math.sin(2.0 * t))
        return x1, link, x3, motor

    for k in range(PERIODS + 1):
        if k >= FROM:
            largest = max(largest, abs(x0))
        u = compiled_tick(s, (x0, x1, x2, x3))
        for j in range(steps):
            t, m = k * PERIOD_S + j * h, 0.5 * h
            a = rates(t, x0, x1, x2, x3, u)
            b = rates(t + m, x0 + m * a[0], x1 + m * a[1], x2 + m * a[2], x3 + m * a[3], u)
            c = rates(t + m, x0 + m * b[0], x1 + m * b[1], x2 + m * b[2], x3 + m * b[3], u)
            d = rates(t + h, x0 + h * c[0], x1 + h * c[1], x2 + h * c[2], x3 + h * c[3], u)
            x0 += h / 6.0 * (a[0] + 2.0 * (b[0] + c[0]) + d[0])
            x1 += h / 6.0 * (a[1] + 2.0 * (b[1] + c[1]) + d[1])
            x2 += h / 6.0 * (a[2] + 2.0 * (b[2] + c[2]) + d[2])
            x3 += h / 6.0 * (a[3] + 2.0 * (b[3] + c[3]) + d[3])
    return largest


def by_numba(steps):
    return runge_kutta(numpy.array(START), steps)


def report(program, method, run, times):
    best = math.inf
    for _ in range(times):
        began = time.perf_counter()
        largest = run()
        best = min(best, time.perf_counter() - began)
    said = {"program": program, "method": method, "ticks_per_s": (PERIODS + 1) / best, "largest": largest}
    print(json.dumps(said), flush=True)


report(f"SciPy {scipy.__version__}", "RK45, rtol 1e-6", lambda: by_scipy("RK45", 1e-6, 1e-6), 3)
report(f"SciPy {scipy.__version__}", "DOP853, rtol 1e-10", lambda: by_scipy("DOP853", 1e-10, 1e-12), 3)
by_numba(5)
report(f"numba {numba.__version__}", "RK4, 5 a tick", lambda: by_numba(5), 50)
report(f"numba {numba.__version__}", "RK4, 10 a tick", lambda: by_numba(10), 50)
