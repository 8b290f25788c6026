/* What the closed loops in C are asked for. The struct is that of `src/loops.rs`, field by field. */
struct closed_loop {
    double k1, b1, a1, k2, b2, b; /* the joint, Eq. (63): x_2' = x_3 - k1 x_1 - b1 x_2 - sin x_1, ... */
    double period_s;
    double x1;         /* x(0) = (x1, 0, 0, 0) */
    int periods, from; /* largest |x_1| from tick `from` on */
    int steps;         /* of Runge-Kutta a tick */
};
