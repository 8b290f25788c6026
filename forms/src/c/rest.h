/* REST BAND. With friction a shaft at rest hunts: the current rises until the shaft slips, and it sticks on the other
 * side of its target. Within a band around a target at rest the position error does not count. The band is
 * $least$ rad to either side. If the shaft slips to the other side, it widens, to
 * $most$ rad at most, until the target moves or a load acts. @_watched_tick uses the shifted target.
 * HUNTS is set while the band is wider. */
static inline float @_rest_shift(@_monitor *monitor, float error, float speed)
{
    @@_AS_WRITTEN
    const float away = @_magnitude(error);
    const float moved = @_magnitude(error - monitor->rest_error);
    const bool is_slow = @_magnitude(speed) < $slow$f;
    const bool is_near = moved <= $count$f;
    float width = (monitor->rest_width > $least$f) ? monitor->rest_width : $least$f;
    float within;
    monitor->rest_share += $rise$f * (1.0f - monitor->rest_share);
    if (!(is_slow || is_near)) {
        monitor->rest_slipped = 1.0f;
        monitor->rest_ticks = 0.0f;
    } else {
        monitor->rest_ticks = (monitor->rest_ticks < $stands$f) ? (monitor->rest_ticks + 1.0f) : $stands$f;
    }
    if (is_slow || !is_near) {
        monitor->rest_error = error;
    }
    if (away > $load$f) {
        width = $least$f; /* a load, not a slip */
        monitor->rest_side = 0.0f;
    }
    const float stands_at = @_magnitude(monitor->rest_error);
    if ((monitor->rest_ticks >= $stands$f) && (stands_at > width)) {
        const float side = (monitor->rest_error > 0.0f) ? 1.0f : -1.0f;
        if (((side * monitor->rest_side) * monitor->rest_slipped) < 0.0f) {
            const float grown = 1.5f * width;
            const float here = (1.25f * stands_at) + $half$f;
            const float wanted = (here > grown) ? here : grown;
            width = (wanted < $most$f) ? wanted : $most$f;
        }
        monitor->rest_side = side;
        monitor->rest_slipped = 0.0f;
    }
    monitor->rest_width = width;
    /* The effect of the band decreases outside of it, so a load meets the full gains. */
    const float left = width - (0.25f * (away - width));
    if (away <= width) {
        within = error;
    } else if (left > 0.0f) {
        within = (error > 0.0f) ? left : -left;
    } else {
        within = 0.0f;
    }
    return monitor->rest_share * within;
}

/* Returns the position error of a shaft whose target is at rest, rad. */
static inline float @_rest_error(const @_monitor *monitor, const @_estimates_of *known)
{
    @@_AS_WRITTEN
    const uint32_t turns = (uint32_t)monitor->rest_turn - (uint32_t)known->turn;
    return known->position - (((float)@_signed(turns) * 6.2831855f) + monitor->rest_angle);
}

$calm$static inline void @_rest_leave(@_monitor *monitor)
{
    monitor->rest_share = 0.0f;
    monitor->rest_width = 0.0f;
    monitor->rest_side = 0.0f;
    monitor->rest_ticks = 0.0f;
    monitor->rest_error = 0.0f;
    monitor->rest_slipped = 0.0f;
    monitor->rest_turn = 0;
    monitor->rest_angle = 0.0f;
$leave_calm$}

/* Returns whether the target is at rest; if not, resets the band. */
static inline bool @_rests(@_monitor *monitor, const @_state *state, const @_sample *sample)
{
    const @_target *begin = &sample->begin;
    const @_target *end = &sample->end;
    if ((begin->r >= end->r) && (begin->r <= end->r) && (begin->turn == end->turn) &&
        (begin->turn == monitor->rest_turn) && (begin->r >= monitor->rest_angle) &&
        (begin->r <= monitor->rest_angle) && (@_magnitude(begin->r_dot) <= 0.0f) &&
        (@_magnitude(end->r_dot) <= 0.0f) && state->started) {
        return true;
    }
    if (monitor->rest_share > 0.0f) {
        @_rest_leave(monitor);
    }
    monitor->rest_turn = end->turn;
    monitor->rest_angle = end->r;
    return false;
}

/* Shifts a target at rest. */
static inline unsigned @_rest(@_monitor *monitor, const @_state *state, @_sample *sample)
{
    @@_AS_WRITTEN
    @_estimates_of known;
    (void)@_estimates(state, &known);
    const float error = @_rest_error(monitor, &known);
$lowered$    const float shift = @_rest_shift(monitor, error, known.speed);
    sample->begin.r += shift;
    sample->end.r = sample->begin.r;
    return (monitor->rest_width > $least$f) ? (unsigned)@@_HUNTS : 0u;
}

