/* One tick as one types it from the equations: loops over channels and orders, sums where the formula has sums, an
 * exponential where it has one, a division where it divides. Only the design is computed beforehand. Compiled with the
 * compiler's defaults (multiplications and additions may be fused), once at -O2, once at -O3 -ffast-math. */
#include "law.h"

float expf(float);

static const float binomial[3][3] = {{1, 0, 0}, {1, 1, 0}, {1, 2, 1}};

float WITH_ORDER(NAME, R)(const struct naive_design *k, struct naive_state *s, const float x[N]) {
    float a = 0;
    for (int i = 0; i < N; i++)
        a += k->a[i] * x[i];

    /* Observers; the first sample has none before it. */
    if (s->ticks > 0) {
        for (int i = 0; i < N; i++) {
            if (!k->observed[i])
                continue;
            float e = x[i] - s->x_prev[i];
            if (i < N - 1)
                e -= k->period_s * ((1 - k->w[i]) * s->x_prev[i + 1] + k->w[i] * x[i + 1]);
            else
                e -= k->period_s * (k->theta_n * (a + k->b * s->u) + (1 - k->theta_n) * (s->a_prev + k->b * s->u));
            for (int m = 0; m < R; m++)
                e -= k->mean[i][m] * s->s[i][m];
            for (int m = 0; m < R; m++) {
                float next = k->l[i][m] * e;
                for (int j = m; j < R; j++)
                    next += binomial[j][m] * s->s[i][j];
                s->s[i][m] = next;
            }
        }
    }

    /* Surface. */
    float sigma = 0;
    for (int i = 0; i < N; i++) {
        sigma += k->c[i] * x[i];
        if (k->observed[i])
            for (int m = 0; m < R; m++)
                sigma += k->g[i][m] * s->s[i][m];
    }
    if (s->ticks == 0)
        s->sigma_0 = sigma;
    float offset = s->sigma_0 * expf(-k->alpha_per_s * (k->period_s * (float)s->ticks));
    float sigma_star = sigma - offset;

    /* Law. */
    float sat = k->isat * sigma_star;
    if (sat > 1)
        sat = 1;
    if (sat < -1)
        sat = -1;
    float f = k->rho * sigma_star + k->al * offset + k->ks_k * sat;
    for (int i = 0; i < N; i++) {
        f += k->kx[i] * x[i];
        if (k->observed[i])
            for (int m = 0; m < R; m++)
                f += k->kz[i][m] * s->s[i][m];
    }
    float u = -(a + f) / k->b;
    if (u > k->u_max)
        u = k->u_max;
    if (u < k->u_min)
        u = k->u_min;

    for (int i = 0; i < N; i++)
        s->x_prev[i] = x[i];
    s->a_prev = a;
    s->u = u;
    s->ticks++;
    return u;
}
