/* The control law of the flexible joint twice in C, for comparison: `naive.c` as the equations stand, `tuned.c` folded
 * and written out. Observers in channels 2 and 4, order R (2 or 3, by -DR). Units as in controller-core: x_1 in rad, each
 * next state one 1/s more, u in A. The structs are those of `src/lib.rs`, field by field. */
#define N 4

#define JOINED(name, r) name##r
#define WITH_ORDER(name, r) JOINED(name, r)

/* What the equations multiply with; channels by number, those without an observer unused. S_m = T^(m+1) d^(m)/m!. */
struct naive_design {
    float period_s, alpha_per_s;
    float a[N], b;      /* a(x) = a . x */
    float c[N];         /* surface, on x */
    float g[N][R];      /* surface, on S */
    float kx[N];        /* law, on x */
    float kz[N][R];     /* law, on S */
    float rho, al;      /* law, on sigma* and on the offset */
    float ks_k, isat;   /* switching term */
    float theta_n;      /* first moment of channel n's response over a tick */
    float w[N];         /* weight of the present x_{i+1} in its mean over a tick */
    float mean[N][R];   /* 1, theta, mu2: the mean of d over a tick from S */
    float l[N][R];      /* observer gains on S */
    float u_min, u_max;
    int observed[N];
};

struct naive_state {
    float s[N][R];
    float x_prev[N], a_prev, u, sigma_0;
    unsigned ticks;
};

/* What controller-core's tick multiplies with, in the order of its LAYOUT, and a(x)/b = row . (x_1, x_3, x_4). */
struct tuned_design {
    float rate, rate_n, theta_n, gamma[2][R], c[N], g[2][R], kx[N], kw, us, k[2][R], satk, lim, unit, decay;
    float u_min, u_max, plausible, ko, sigma_star_bound, hold, fallback, period, input_gain, mu2_n;
    float row[3];
};

struct tuned_state {
    float d2[R], d4[R]; /* A, B, C of both channels */
    float p2, p4;       /* the past's part of the innovations; u of channel 4 apart */
    float x2, x4;       /* last sample */
    float w;            /* sigma(0) e^-at */
    float held;         /* what the actuator holds */
    int resuming;       /* guarded only: no last sample to compare with */
};
