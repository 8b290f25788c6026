/* The closed loop as one types it in C: the tick by hand (tuned.c, with its guard), the joint in double by Runge-Kutta of
 * order 4 with libm's sine, v = 1 + sin 2t at the input. Returns the largest |x_1| of the last ticks. */
#include "law.h"
#include "loop.h"

#include <math.h>

float tuned_guarded_tick_2(const struct tuned_design *k, struct tuned_state *s, const float x[N]);

static void rates(const struct closed_loop *p, double t, const double x[N], double u, double d[N]) {
    d[0] = x[1];
    d[1] = x[2] - p->k1 * x[0] - p->b1 * x[1] - sin(x[0]);
    d[2] = x[3];
    d[3] = p->a1 * x[0] - p->k2 * x[2] - p->b2 * x[3] + p->b * (u + 1.0 + sin(2.0 * t));
}

double closed_loop_alone(const struct closed_loop *p, const struct tuned_design *k, struct tuned_state *s) {
    double x[N] = {p->x1, 0.0, 0.0, 0.0}, largest = 0.0;
    double h = p->period_s / p->steps;
    for (int tick = 0; tick <= p->periods; tick++) {
        float sample[N];
        for (int i = 0; i < N; i++)
            sample[i] = (float)x[i];
        if (tick >= p->from && fabs(x[0]) > largest)
            largest = fabs(x[0]);
        double u = tuned_guarded_tick_2(k, s, sample);
        for (int step = 0; step < p->steps; step++) {
            double t = tick * p->period_s + step * h, a[N], b[N], c[N], d[N], y[N];
            rates(p, t, x, u, a);
            for (int i = 0; i < N; i++)
                y[i] = x[i] + 0.5 * h * a[i];
            rates(p, t + 0.5 * h, y, u, b);
            for (int i = 0; i < N; i++)
                y[i] = x[i] + 0.5 * h * b[i];
            rates(p, t + 0.5 * h, y, u, c);
            for (int i = 0; i < N; i++)
                y[i] = x[i] + h * c[i];
            rates(p, t + h, y, u, d);
            for (int i = 0; i < N; i++)
                x[i] += h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]);
        }
    }
    return largest;
}

#if defined(__x86_64__) && defined(__GNUC__)
double closed_loops_sse2(const struct closed_loop *p, const struct tuned_design *k, const struct tuned_state *s);
double closed_loops_avx2(const struct closed_loop *p, const struct tuned_design *k, const struct tuned_state *s);
double closed_loops_avx512(const struct closed_loop *p, const struct tuned_design *k, const struct tuned_state *s);
double closed_loops_fast(const struct closed_loop *p, const struct tuned_design *k, const struct tuned_state *s);
#endif

/* plants.c with SSE2, AVX2, AVX-512, and that with -ffast-math: NaN where this machine or compiler has it not. */
double closed_loops_beside(int way, const struct closed_loop *p, const struct tuned_design *k,
                           const struct tuned_state *s) {
#if defined(__x86_64__) && defined(__GNUC__)
    int has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    int has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
        && __builtin_cpu_supports("avx512vl");
    if (way == 0)
        return closed_loops_sse2(p, k, s);
    if (way == 1 && has_avx2)
        return closed_loops_avx2(p, k, s);
    if (way == 2 && has_avx512)
        return closed_loops_avx512(p, k, s);
    if (way == 3 && has_avx512)
        return closed_loops_fast(p, k, s);
#else
    (void)way, (void)p, (void)k, (void)s;
#endif
    return NAN;
}
