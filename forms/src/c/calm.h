/* LOWER GAINS. In the play of a gear a shaft swings around a target at rest. If the current alternates by more than
 * $loud$ A around its mean several times, an observer and a law with a quarter of the bandwidth act instead. If they
 * swing, too, an eighth of the bandwidth acts. They end when the target moves or a load moves the shaft by more than
 * $load$ rad. HUNTS is set while they act. */
static inline void @_calm_listens(@_monitor *monitor, float error, float speed, float u)
{
    @@_AS_WRITTEN
    const float away = u - monitor->calm_mean;
    monitor->calm_mean += $averaging$f * away;
    if (@_magnitude(away) > $loud$f) {
        const float side = (away > 0.0f) ? 1.0f : -1.0f;
        monitor->calm_reversals += ((side * monitor->calm_side) < 0.0f) ? 1.0f : 0.0f;
        monitor->calm_side = side;
    }
    monitor->calm_reversals =
        @_lessened(monitor->calm_reversals, (monitor->calm_set > 0u) ? $slow_forgetting$f : $forgetting$f);
    if ((monitor->calm_reversals > 5.0f) && (monitor->calm_set < 2u)) {
        if (monitor->calm_set == 0u) {
            monitor->calm_q = error;
            monitor->calm_v = speed;
            monitor->calm_d = -($gain$f * monitor->calm_mean);
            monitor->calm_u = monitor->calm_mean;
        }
        monitor->calm_set += 1u;
        monitor->calm_reversals = 0.0f;
        monitor->calm_ticks = 0.0f;
    }
}

/* Returns whether a load acts on settled lower gains. */
static inline bool @_calm_is_load(@_monitor *monitor, float error)
{
    if ((monitor->calm_set > 0u) && (monitor->calm_ticks < $settled$f)) {
        monitor->calm_ticks += 1.0f;
        return false;
    }
    return (monitor->calm_set > 0u) && (@_magnitude(error) > $load$f) && (monitor->calm_returns < 4u);
}

static inline float @_calm_asks(@_monitor *monitor, float error)
{
    @@_AS_WRITTEN
    static const float gains[2][5] = { /* observer, law */
        {$first$},
        {$second$}
    };
    const float *set = gains[(monitor->calm_set > 1u) ? 1 : 0];
    const float acceleration = ($gain$f * monitor->calm_u) + monitor->calm_d;
    const float foreseen = monitor->calm_q + ($period$f * (monitor->calm_v + ($half_period$f * acceleration)));
    const float innovation = error - foreseen;
    monitor->calm_q = foreseen + (set[0] * innovation);
    monitor->calm_v = (monitor->calm_v + ($period$f * acceleration)) + (set[1] * innovation);
    monitor->calm_d += set[2] * innovation;
    float within = (monitor->calm_q > $band$f) ? $band$f : monitor->calm_q;
    within = (within < -$band$f) ? -$band$f : within;
    return -($per_gain$f * (((set[3] * (monitor->calm_q - within)) + (set[4] * monitor->calm_v)) + monitor->calm_d));
}

static inline void @_calm_leave(@_monitor *monitor)
{
    monitor->calm_mean = 0.0f;
    monitor->calm_ticks = 0.0f;
    monitor->calm_returns = 0u;
    monitor->calm_side = 0.0f;
    monitor->calm_reversals = 0.0f;
    monitor->calm_set = 0u;
    monitor->calm_q = 0.0f;
    monitor->calm_v = 0.0f;
    monitor->calm_d = 0.0f;
    monitor->calm_u = 0.0f;
}

/* Replaces the output of a tick by the current of the lower gains if they are in use. */
static inline unsigned @_calm(@_monitor *monitor, @_state *state, unsigned health, @_output *output)
{
    const unsigned out_of_use = ((unsigned)@@_BRAKES | (unsigned)@@_WAITS) | (unsigned)@@_INPUT_REJECTED;
    if (!(monitor->rest_share > 0.0f) || ((health & (unsigned)@@_STOPPED) != 0u)) {
        return health;
    }
    if (!state->started || ((health & out_of_use) != 0u)) {
        @_calm_leave(monitor);
        return health;
    }
    @_estimates_of known;
    (void)@_estimates(state, &known);
    const float error = @_rest_error(monitor, &known);
    @_calm_listens(monitor, error, known.speed, (monitor->calm_set > 0u) ? monitor->calm_u : output->u);
    if (@_calm_is_load(monitor, error)) { /* back to the normal gains */
        const uint32_t returns = monitor->calm_returns + 1u;
        const float mean = monitor->calm_u;
        @_calm_leave(monitor);
        monitor->calm_returns = returns;
        monitor->calm_mean = mean;
    }
    if (monitor->calm_set == 0u) {
        return health;
    }
    const float asked = @_calm_asks(monitor, error);
    if (!(@_magnitude(asked) <= 1e30f)) {
        @_calm_leave(monitor);
        return health;
    }
    const float limit = @_magnitude(state->limit);
    const float u_max = ($u_max$f > limit) ? limit : $u_max$f;
    const float u_min = ($u_min$f < -limit) ? -limit : $u_min$f;
    float u = (asked > u_max) ? u_max : asked;
    u = (u < u_min) ? u_min : u;
    state->$held$ = u;
    state->offset = 0.0f;
    monitor->calm_u = u;
    output->u = u;
    const unsigned told = (health & ~(unsigned)@@_SATURATED) | (unsigned)@@_HUNTS;
    return told | ((u != asked) ? (unsigned)@@_SATURATED : 0u);
}

