
/* MONITORS. An encoder that freezes at standstill looks like a load: u rises against it, and the shaft runs away. No
 * observer detects this. If a runaway is dangerous, call @_watched_tick and @_watched_lost instead of
 * @_tick_or_start and @_lost.
 * An alarm (any of SIGMA_STAR_OVER_BOUND, DISTURBANCE_OVER_BOUND, STUCK_AT_LIMIT, INPUT_REJECTED)
 * $follows$.
 * WRONG_WAY and OSCILLATES stop the drive in any case. A stopped drive stays stopped until @_watched_reset. */
typedef struct {
    bool stopped;
    float stuck; /* ticks at a limit without a decrease of |sigma|; minus a tenth of the ticks within the limits */
    float last_sigma; /* |sigma| in the last tick at a limit */
    float swings; /* remaining ticks of the sign changes of a disturbance */
    float against; /* consecutive ticks of acceleration against the current */
    float last_speed; /* |v| in the last tick at a limit */
    float over; /* ticks over a bound or without a sample, minus ticks without either */
$braking$$sides$$resting$} @_monitor; /* zeros before the start */

static inline float @_magnitude(float number)
{
    return (number < 0.0f) ? -number : number;
}

$stop_and_brake$/* Returns number - by, at least 0. */
static inline float @_lessened(float number, float by)
{
    const float less = number - by;
    return (less > 0.0f) ? less : 0.0f;
}

/* Returns whether d exceeds its bound; sets has_changed if the sign differs from the last time. */
static inline bool @_watch_side(float d, float bound, float *side, bool *has_changed)
{
    if (@_magnitude(d) <= bound) {
        return false;
    }
    *has_changed = *has_changed || ((d * *side) < 0.0f);
    *side = d;
    return true;
}

/* Counts a tick at a limit of the current; `falling` must decrease there. */
static inline void @_watch_limit(@_monitor *monitor, const @_state *state, float falling, float current, bool is_lost$params$)
{
    const float wanted = $gain$f * current; /* acceleration by the current */
    const float speed = @_magnitude(state->v$shaft$);
    const float found = @_magnitude(state->d$shaft$);
    /* The shaft accelerates against its current, as the reversed current would accelerate it. */
    bool wrong_way = ((state->v$shaft$ * wanted) < 0.0f) && ((state->d$shaft$ * wanted) < 0.0f) &&
                     (speed > monitor->last_speed) && (found > (1.25f * @_magnitude(wanted))) &&
                     (found < (3.5f * @_magnitude(wanted)));
$apart$    if (wrong_way && over$shaft$) {
        monitor->against += 1.0f;
    } else if (is_lost) {
        monitor->against += 0.5f; /* no count at full current: the motion is unknown */
    } else {
        monitor->against = 0.0f;
    }
    monitor->last_speed = speed;
    if (!(monitor->stuck > 0.0f) || (falling >= monitor->last_sigma)) {
        monitor->stuck += 1.0f;
    }
    monitor->last_sigma = falling;
}

/* Counts a tick within the limits. */
static inline void @_watch_within(@_monitor *monitor)
{
    monitor->against = 0.0f;
    monitor->stuck = @_lessened(monitor->stuck, 0.1f);
}

/* Counts a tick over a bound or without a sample. */
static inline void @_watch_over(@_monitor *monitor, bool is_over)
{
    monitor->over = is_over ? (monitor->over + 1.0f) : @_lessened(monitor->over, 1.0f);
}

/* Returns the alarms that stop every drive. The stop begins at the next tick. */
static inline unsigned @_watch_runaway(@_monitor *monitor)
{
    const bool wrong_way = monitor->against > $wrong_way_ticks$f;
    const bool oscillates = monitor->swings > $twice$f;
    unsigned alarms = wrong_way ? (unsigned)@@_WRONG_WAY : 0u;
    alarms |= oscillates ? (unsigned)@@_OSCILLATES : 0u;
    monitor->swings = @_lessened(monitor->swings, 1.0f);
    monitor->stopped = monitor->stopped || wrong_way || oscillates;
    return alarms;
}

$brake$/* Checks a completed tick, returns its flags, and starts the reaction to an alarm. */
static inline unsigned @_watch(@_monitor *monitor, @_state *state, unsigned told, @_output *output)
{
    const bool is_lost = (told & @@_SAMPLE_LOST) != 0u;
    const bool is_rejected = (told & @@_INPUT_REJECTED) != 0u;
    bool has_changed = false;
    bool is_star_over = false;
    if (!state->started) {
        return told;
    }
    if ((told & @@_WAITS) != 0u) {
$gave_up$        return told;
    }
$brakes$$looks$    monitor->swings += has_changed ? $stuck_ticks$f : 0.0f;
    if ((told & @@_SATURATED) != 0u) {
        @_watch_limit(monitor, state, @_magnitude(output->sigma), output->u, is_lost$overs$);
    } else {
        @_watch_within(monitor);
        is_star_over = !(@_magnitude(output->sigma_star) <= $sigma_star$f);
    }
    const bool is_any_over = $any_over$;
    @_watch_over(monitor, is_any_over || is_star_over || is_rejected);
    const bool is_late = monitor->over > $patience_ticks$f;
    unsigned health = told;
    health |= (monitor->stuck > $stuck_ticks$f) ? (unsigned)@@_STUCK_AT_LIMIT : 0u;
    if (is_late) {
        health |= is_any_over ? (unsigned)@@_DISTURBANCE_OVER_BOUND : 0u;
        health |= is_star_over ? (unsigned)@@_SIGMA_STAR_OVER_BOUND : 0u;
    }
$stops$    return health | @_watch_runaway(monitor);
}

/* Starts the reaction to an alarm at the next tick, for an external cause such as a door switch. */
static inline void @_watched_trip(@_monitor *monitor)
{
$trip$}

$fence$$rest$/* Computes @_tick_or_start with the monitors. */
static inline unsigned @_watched_tick(@_monitor *monitor, @_state *state, const @_sample *sample, @_output *output)
{
$placing$    if (monitor->stopped) {
        (void)@_not_started(output);
        return @@_INPUT_REJECTED | @@_STOPPED;
    }
    unsigned health = @_watch(monitor, state, @_tick_or_start(state, $sample$, output), output);
$hunting$$fenced$    return health;
}

/* Computes @_lost with the monitors. */
static inline unsigned @_watched_lost(@_monitor *monitor, @_state *state, @_output *output)
{
    if (monitor->stopped) {
        (void)@_not_started(output);
        return @@_INPUT_REJECTED | @@_STOPPED;
    }
    return @_watch(monitor, state, @_lost(state, output), output);
}

/* Clears monitor and state after a stop, at rest: counts that are consistent for 10 ms start the drive. */
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
