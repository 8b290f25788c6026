/* One tick written out by hand from the folded equations (head of controller-core/src/controller.rs), as far as C99
 * takes it: no loop, no division, nothing that the design could have computed. Compiled with -O2 -ffp-contract=off. With
 * -DGUARD it also does what the shipped tick does with bad samples: nothing that is not finite gets into the state. */
#include "law.h"

static inline float clamped(float value, float least, float most) {
    value = value < least ? least : value;
    return value > most ? most : value;
}

float WITH_ORDER(NAME, R)(const struct tuned_design *restrict k, struct tuned_state *restrict s,
                          const float x[restrict N]) {
    float al = k->row[0] * x[0] + k->row[1] * x[2] + k->row[2] * x[3];

    float h2 = 0.5f * x[2];
    float h4 = k->theta_n * al;
    float e2 = (x[1] - s->x2) * k->rate - h2 - s->p2;
    float e4 = (x[3] - s->x4) * k->rate_n - h4 - (s->p4 + s->held);

    float a2 = s->d2[0], b2 = s->d2[1], a4 = s->d4[0], b4 = s->d4[1];
#if R == 3
    float c2 = s->d2[2], c4 = s->d4[2];
#endif
#ifdef GUARD
    int resuming = s->resuming;
    if (resuming) {
        s->resuming = 0;
        a2 += b2;
        a4 += b4;
#if R == 3
        b2 += c2;
        b4 += c4;
#endif
    } else
#endif
    {
        a2 += b2 + k->gamma[0][0] * e2;
        a4 += b4 + k->gamma[1][0] * e4;
#if R == 3
        b2 += c2 + k->gamma[0][1] * e2;
        b4 += c4 + k->gamma[1][1] * e4;
        c2 += k->gamma[0][2] * e2;
        c4 += k->gamma[1][2] * e4;
#else
        b2 += k->gamma[0][1] * e2;
        b4 += k->gamma[1][1] * e4;
#endif
    }

    float y3 = x[2] + a2;
    float sigma_star = x[3] + k->c[0] * x[0] + k->c[1] * x[1] + k->c[2] * y3 + k->g[0][1] * b2;
    float v = k->kw * s->w + k->kx[1] * x[1] + k->kx[2] * y3 + k->kx[3] * x[3] + k->k[0][1] * b2 + k->k[1][1] * b4;
#if R == 3
    sigma_star += k->g[0][2] * c2;
    v += k->k[0][2] * c2 + k->k[1][2] * c4;
#endif
    sigma_star -= s->w;
    v += k->us * sigma_star + clamped(k->satk * sigma_star, -k->lim, k->lim);
    float w4 = al + a4;
#ifdef GUARD
    float demand = v * k->unit - w4;
    float size = __builtin_fabsf(demand);
    if (!(size <= k->plausible || (size <= 1e12f && __builtin_fabsf(demand - k->ko * s->w) > k->plausible))) {
        float before = s->p2, sum = x[3] + k->c[2] * x[2] + k->c[1] * x[1] + k->c[0] * x[0];
        float alone = __builtin_fabsf(sum) <= 1e12f ? sum : 1e38f;
        float apart = (k->us + k->kw) * k->unit * (alone - before);
        s->p2 = alone;
        if (resuming && __builtin_fabsf(alone) <= 1e12f && __builtin_fabsf(apart) <= k->plausible) {
            for (int m = 0; m < R; m++)
                s->d2[m] = s->d4[m] = 0;
            s->w = alone;
        }
        float held = __builtin_fabsf(s->held) <= 1e12f ? s->held : 0;
        s->held = clamped(k->hold * held + k->fallback, k->u_min, k->u_max);
        s->w -= k->decay * s->w;
        s->resuming = 1;
        return s->held;
    }
#else
    float demand = v - w4;
#endif
    float u = clamped(demand, k->u_min, k->u_max);

    s->d2[0] = a2;
    s->d2[1] = b2;
    s->d4[0] = a4;
    s->d4[1] = b4;
#if R == 3
    s->d2[2] = c2;
    s->d4[2] = c4;
#endif
    s->p2 = y3 - h2;
    s->p4 = w4 - h4;
    s->x2 = x[1];
    s->x4 = x[3];
    s->w -= k->decay * s->w;
    s->held = u;
    return u;
}
