/* From the next tick on it brakes. */
static inline void @_watch_brakes(@_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* A tick of a drive that brakes: the current opposes the speed, which is what must fall at a limit. */
static inline unsigned @_brake(@_monitor *monitor, @_state *state, unsigned told, @_output *output)
{
    const bool is_lost = (told & @@_SAMPLE_LOST) != 0u;
    const float opposed = -($slope$f * state->v$shaft$);
    const float asked = (@_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > $u_max$f) ? $u_max$f : asked;
    slowing = (slowing < $u_min$f) ? $u_min$f : slowing;
    const bool is_short = slowing != asked;
    bool has_changed = false;
$looks$    monitor->swings += has_changed ? $stuck_ticks$f : 0.0f;
    if (is_short) {
        @_watch_limit(monitor, state, @_magnitude(state->v$shaft$), slowing, is_lost$overs$);
    } else {
        @_watch_within(monitor);
        monitor->braking += 1.0f;
    }
    @_watch_over(monitor, is_lost && ((told & @@_INPUT_REJECTED) != 0u));
    const bool is_stuck = monitor->stuck > $stuck_ticks$f;
    unsigned health = told | (is_stuck ? (unsigned)@@_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > $patience_ticks$f) || (monitor->braking > $brake_ticks$f)) {
        health |= @_watch_stop(monitor, output);
    } else {
        state->$held$ = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)@@_SATURATED;
        health |= is_short ? (unsigned)(@@_SATURATED | @@_BRAKES) : (unsigned)@@_BRAKES;
    }
    return health | @_watch_runaway(monitor);
}

