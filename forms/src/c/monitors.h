
/* MONITORS. A count that sticks while the shaft stands still looks like a load that u cancels: the loop runs away, and
 * no observer sees it. Where that does harm call @_watched_tick and @_watched_lost instead of @_tick_or_start and
 * @_lost. An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * $follows$. A drive that has stopped stays so until @_watched_reset. */
typedef struct {
    bool stopped;
    float stuck; /* ticks at a limit without |sigma| falling, ten within the limits for each that is forgotten */
    float last; /* |sigma| at the last of them */
} @_monitor; /* zeros are right at the start */

static inline float @_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

/* What the monitors say of a tick that was made; what follows is done. */
static inline unsigned @_watch(@_monitor *monitor, const @_state *state, unsigned told, @_output *output)
{
    const float sigma = @_magnitude(output->sigma);
    unsigned health = told;
    if (!state->started || ((health & @@_WAITS) != 0u)) {
        return health;
    }
$looks$    if ((health & @@_SATURATED) != 0u) {
        if (!(monitor->stuck > 0.0f) || (sigma >= monitor->last)) {
            monitor->stuck += 1.0f;
        }
        monitor->last = sigma;
    } else {
        const float less = monitor->stuck - 0.1f;
        monitor->stuck = (less > 0.0f) ? less : 0.0f;
        health |= (@_magnitude(output->sigma_star) <= $sigma_star$f) ? 0u : (unsigned)@@_SIGMA_STAR_OVER_BOUND;
    }
    health |= (monitor->stuck > $stuck_ticks$f) ? (unsigned)@@_STUCK_AT_LIMIT : 0u;
$stops$    return health;
}

/* @_tick_or_start within the monitors. */
static inline unsigned @_watched_tick(@_monitor *monitor, @_state *state, const @_sample *sample, @_output *output)
{
    if (monitor->stopped) {
        (void)@_not_started(output);
        return @@_INPUT_REJECTED | @@_STOPPED;
    }
    return @_watch(monitor, state, @_tick_or_start(state, sample, output), output);
}

/* @_lost within the monitors. */
static inline unsigned @_watched_lost(@_monitor *monitor, @_state *state, @_output *output)
{
    if (monitor->stopped) {
        (void)@_not_started(output);
        return @@_INPUT_REJECTED | @@_STOPPED;
    }
    return @_watch(monitor, state, @_lost(state, output), output);
}

/* After a stop: all is forgotten, and the next good sample starts the drive. */
static inline void @_watched_reset(@_monitor *monitor, @_state *state)
{
    monitor->stopped = false;
    monitor->stuck = 0.0f;
    monitor->last = 0.0f;
    @_reset(state);
}
