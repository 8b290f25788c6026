    const bool is_braking = monitor->braking > 0.0f;
    const float opposed = -($brake$f * state->v$shaft$);
    const float asked = (@_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > $u_max$f) ? $u_max$f : asked;
    slowing = (slowing < $u_min$f) ? $u_min$f : slowing;
    const bool is_short = slowing != asked;
    /* While it brakes the speed is what must fall at the limit. */
    const float sigma = @_magnitude(is_braking ? state->v$shaft$ : output->sigma);
    const float current = is_braking ? slowing : output->u;
    const bool is_at_limit = is_braking ? is_short : ((told & @@_SATURATED) != 0u);
