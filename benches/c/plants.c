/* The same for W joints side by side, for a compiler that makes vector code: every variable an array over the plants, the
 * sine a polynomial of degree 7 (angles are small here), the tick without its way of a bad sample. Name by -DNAME. */
#include "law.h"
#include "loop.h"

#include <math.h>

#define W 32
typedef double many[W];
typedef float many_f[W];

static inline float clamped(float value, float least, float most) {
    value = value < least ? least : value;
    return value > most ? most : value;
}

static inline double sine(double angle) {
    double q = angle * angle;
    return angle * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 - q / 5040.0)));
}

static _Thread_local many k1, b1, a1, k2, b2, b, x[N];
static _Thread_local many_f d20, d21, d40, d41, p2, p4, x2, x4, offset, held;

static void rates(double v, many *restrict y, const many_f *restrict u, many *restrict d) {
    for (int l = 0; l < W; l++) {
        d[0][l] = y[1][l];
        d[1][l] = y[2][l] - k1[l] * y[0][l] - b1[l] * y[1][l] - sine(y[0][l]);
        d[2][l] = y[3][l];
        d[3][l] = a1[l] * y[0][l] - k2[l] * y[2][l] - b2[l] * y[3][l] + b[l] * ((double)(*u)[l] + v);
    }
}

static void ticks(const struct tuned_design *k, int is_first) {
    float once = is_first ? 0.0f : 1.0f;
    for (int l = 0; l < W; l++) {
        float s[N] = {(float)x[0][l], (float)x[1][l], (float)x[2][l], (float)x[3][l]};
        float al = k->row[0] * s[0] + k->row[1] * s[2] + k->row[2] * s[3];
        float h2 = 0.5f * s[2], h4 = k->theta_n * al;
        float e2 = once * ((s[1] - x2[l]) * k->rate - h2 - p2[l]);
        float e4 = once * ((s[3] - x4[l]) * k->rate_n - h4 - (p4[l] + held[l]));
        float a2 = d20[l] + d21[l] + k->gamma[0][0] * e2, b_2 = d21[l] + k->gamma[0][1] * e2;
        float a4 = d40[l] + d41[l] + k->gamma[1][0] * e4, b_4 = d41[l] + k->gamma[1][1] * e4;
        float y3 = s[2] + a2, w4 = al + a4;
        float star = s[3] + k->c[0] * s[0] + k->c[1] * s[1] + k->c[2] * y3 + k->g[0][1] * b_2 - offset[l];
        float v = k->kw * offset[l] + k->kx[1] * s[1] + k->kx[2] * y3 + k->kx[3] * s[3] + k->k[0][1] * b_2
            + k->k[1][1] * b_4;
        v += k->us * star + clamped(k->satk * star, -k->lim, k->lim);
        held[l] = clamped(v * k->unit - w4, k->u_min, k->u_max);
        d20[l] = a2;
        d21[l] = b_2;
        d40[l] = a4;
        d41[l] = b_4;
        p2[l] = y3 - h2;
        p4[l] = w4 - h4;
        x2[l] = s[1];
        x4[l] = s[3];
        offset[l] -= k->decay * offset[l];
    }
}

double NAME(const struct closed_loop *p, const struct tuned_design *k, const struct tuned_state *s) {
    for (int l = 0; l < W; l++) {
        k1[l] = p->k1;
        b1[l] = p->b1;
        a1[l] = p->a1;
        k2[l] = p->k2;
        b2[l] = p->b2;
        b[l] = p->b;
        x[0][l] = p->x1;
        x[1][l] = x[2][l] = x[3][l] = 0.0;
        d20[l] = d21[l] = d40[l] = d41[l] = 0.0f;
        p2[l] = s->p2;
        p4[l] = s->p4;
        x2[l] = s->x2;
        x4[l] = s->x4;
        offset[l] = s->w;
        held[l] = s->held;
    }
    double largest = 0.0, h = p->period_s / p->steps;
    for (int tick = 0; tick <= p->periods; tick++) {
        for (int l = 0; tick >= p->from && l < W; l++)
            largest = fabs(x[0][l]) > largest ? fabs(x[0][l]) : largest;
        ticks(k, tick == 0);
        for (int step = 0; step < p->steps; step++) {
            double t = tick * p->period_s + step * h;
            double v[3] = {1.0 + sin(2.0 * t), 1.0 + sin(2.0 * t + h), 1.0 + sin(2.0 * t + 2.0 * h)};
            many q[4][N], y[N];
            rates(v[0], x, &held, q[0]);
            for (int i = 0; i < N; i++)
                for (int l = 0; l < W; l++)
                    y[i][l] = x[i][l] + 0.5 * h * q[0][i][l];
            rates(v[1], y, &held, q[1]);
            for (int i = 0; i < N; i++)
                for (int l = 0; l < W; l++)
                    y[i][l] = x[i][l] + 0.5 * h * q[1][i][l];
            rates(v[1], y, &held, q[2]);
            for (int i = 0; i < N; i++)
                for (int l = 0; l < W; l++)
                    y[i][l] = x[i][l] + h * q[2][i][l];
            rates(v[2], y, &held, q[3]);
            for (int i = 0; i < N; i++)
                for (int l = 0; l < W; l++)
                    x[i][l] += h / 6.0 * (q[0][i][l] + 2.0 * (q[1][i][l] + q[2][i][l]) + q[3][i][l]);
        }
    }
    return largest;
}
