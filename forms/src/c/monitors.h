
/* MONITORS. A count that sticks while the shaft stands still looks like a load that u cancels: the loop runs away, and
 * no observer sees it. Where that does harm call @_watched_tick and @_watched_lost instead of @_tick_or_start and
 * @_lost. An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * $follows$.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A drive that has stopped stays so until @_watched_reset. */
typedef struct {
    bool stopped;
    float stuck; /* ticks at a limit without |sigma| falling, ten within the limits for each that is forgotten */
    float last_sigma; /* |sigma| at the last of them */
    float swings; /* ticks for which changes of side of a disturbance still count */
    float against; /* ticks in a row of the wrong way */
    float last_speed; /* |v| in the last tick at a limit */
    float over; /* ticks over a bound or without a sample, less those without */
$braking$$sides$} @_monitor; /* zeros are right at the start */

static inline float @_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

$stop_and_brake$/* So much less, but not below 0. */
static inline float @_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Is d over its bound, and to the other side than when it was so before? */
static inline bool @_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (@_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* What the monitors say of a tick that was made; what follows is done. */
static inline unsigned @_watch(@_monitor *monitor, @_state *state, unsigned told, @_output *output)
{
    unsigned health = told;
    bool has_changed = false;
    if (!state->started) {
        return health;
    }
    if ((health & @@_WAITS) != 0u) {
$gave_up$        return health;
    }
$slowing$$looks$    monitor->swings += has_changed ? $stuck_ticks$f : 0.0f;
    bool is_star_over = false;
    if (is_at_limit) {
        const float wanted = $gain$f * current; /* acceleration by the current */
        const float speed = @_magnitude(state->v$shaft$);
        const float found = @_magnitude(state->d$shaft$);
        /* Does it speed up against the current, by what the current would do the other way round? */
        bool wrong_way = ((state->v$shaft$ * wanted) < 0.0f) && ((state->d$shaft$ * wanted) < 0.0f) &&
                         (speed > monitor->last_speed) && (found > (1.25f * @_magnitude(wanted))) &&
                         (found < (3.0f * @_magnitude(wanted)));
$apart$        if (wrong_way && over$shaft$) {
            monitor->against += 1.0f;
        } else if ((told & @@_SAMPLE_LOST) != 0u) {
            monitor->against += 0.5f; /* at full current nobody sees what it does */
        } else {
            monitor->against = 0.0f;
        }
        monitor->last_speed = speed;
        if (!(monitor->stuck > 0.0f) || (sigma >= monitor->last_sigma)) {
            monitor->stuck += 1.0f;
        }
        monitor->last_sigma = sigma;
    } else {
        monitor->against = 0.0f;
        monitor->stuck = @_lessened(monitor->stuck, 0.1f);
        is_star_over = !(@_magnitude(output->sigma_star) <= $sigma_star$f);
    }
    const bool is_any_over = $any_over$;
    const bool is_rejected = (told & @@_INPUT_REJECTED) != 0u;
$counts$    monitor->over = is_over ? (monitor->over + 1.0f) : @_lessened(monitor->over, 1.0f);
    const bool is_late = monitor->over > $patience_ticks$f;
    const bool is_stuck = monitor->stuck > $stuck_ticks$f;
    unsigned alarms = is_stuck ? (unsigned)@@_STUCK_AT_LIMIT : 0u;
    if (is_late$unless_braking$) {
        alarms |= is_any_over ? (unsigned)@@_DISTURBANCE_OVER_BOUND : 0u;
        alarms |= is_star_over ? (unsigned)@@_SIGMA_STAR_OVER_BOUND : 0u;
    }
    health |= alarms;
$stops$    /* From the next tick on: this current is the law's. */
    if (monitor->against > $wrong_way_ticks$f) {
        monitor->stopped = true;
        health |= @@_WRONG_WAY;
    }
    if (monitor->swings > $twice$f) {
        monitor->stopped = true;
        health |= @@_OSCILLATES;
    }
    monitor->swings = @_lessened(monitor->swings, 1.0f);
    return health;
}

$fence$/* @_tick_or_start within the monitors. */
static inline unsigned @_watched_tick(@_monitor *monitor, @_state *state, const @_sample *sample, @_output *output)
{
    if (monitor->stopped) {
        (void)@_not_started(output);
        return @@_INPUT_REJECTED | @@_STOPPED;
    }
    unsigned health = @_watch(monitor, state, @_tick_or_start(state, sample, output), output);
$fenced$    return health;
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
    monitor->last_sigma = 0.0f;
    monitor->swings = 0.0f;
    monitor->against = 0.0f;
    monitor->last_speed = 0.0f;
    monitor->over = 0.0f;
$zeros$    @_reset(state);
}
