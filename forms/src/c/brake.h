/* Starts the brake at the next tick. */
static inline void @_watch_brakes(@_monitor *monitor)
{
    monitor->braking = 1.0f;
    monitor->most = 0.0f; /* unknown before the first tick of the brake */
    monitor->stuck = 0.0f;
    monitor->over = 0.0f;
}

/* Checks a tick of the brake. */
static inline void @_watch_brake(@_monitor *monitor, const @_state *state, float speed, float asks, float slowing,
    bool is_short, bool is_blind)
{
    @@_AS_WRITTEN
    bool has_changed = false;
$looks$$holds$    monitor->swings += has_changed ? $stuck_ticks$f : 0.0f;
    if (is_short) {
        @_watch_limit(monitor, state, speed, slowing, false$overs$);
        /* Faster than at the begin: the brake does not work. */
        if (asks > @_magnitude(monitor->most)) {
            monitor->stuck = $stuck_ticks$f + 1.0f;
        }
    } else {
        @_watch_within(monitor);
        if (!((speed < monitor->last_sigma) && (asks > (0.0078125f * @_magnitude(monitor->most))))) {
            monitor->braking += 1.0f;
        }
        monitor->last_sigma = speed;
    }
    @_watch_over(monitor, is_blind);
}

/* Computes one tick of the brake: the current opposes the speed$and_load$. At a limit the speed must decrease. */
static inline unsigned @_brake(@_monitor *monitor, @_state *state, unsigned told, @_output *output)
{
    @@_AS_WRITTEN
    const unsigned blind = @@_SAMPLE_LOST | @@_INPUT_REJECTED;
    const float limit = @_magnitude(state->limit);
    const float u_max = ($u_max$f > limit) ? limit : $u_max$f;
    const float u_min = ($u_min$f < -limit) ? -limit : $u_min$f;
    const float speed = @_magnitude(state->v$shaft$);
    const float asks = @_magnitude($slope$f * speed);
    float opposed = -($slope$f * state->v$shaft$);
$load$    const float asked = (@_magnitude(opposed) <= 1e30f) ? opposed : 0.0f;
    float slowing = (asked > u_max) ? u_max : asked;
    slowing = (slowing < u_min) ? u_min : slowing;
    const bool is_short = slowing != asked;
    if (@_magnitude(monitor->most) <= 0.0f) {
        const float most = (1.25f * asks) + (0.5f * ($u_max$f - ($u_min$f)));
        monitor->most = $may_hold$-most;
    } else {
        @_watch_brake(monitor, state, speed, asks, slowing, is_short, (told & blind) == blind);
    }
    const bool is_stuck = monitor->stuck > $stuck_ticks$f;
    unsigned health = told | (is_stuck ? (unsigned)@@_STUCK_AT_LIMIT : 0u);
    if (is_stuck || (monitor->over > $patience_ticks$f) || (monitor->braking > $brake_ticks$f)) {
        health |= @_watch_stop(monitor, output);
    } else {
        state->$held$ = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)@@_SATURATED;
        health |= (unsigned)@@_BRAKES;
        if (is_short) {
            health |= (unsigned)@@_SATURATED;
        }
    }
    return health | @_watch_runaway(monitor);
}

