
/* Part of a plan: a coefficient of a way that has a place in 2^-32 turns. */
static inline bool @_is_near(double rad)
{
    return (rad >= -$farthest_rad$) && (rad <= $farthest_rad$);
}

/* Part of a plan: the nearest of 2^-32 turns, modulo 2^64. */
static inline uint64_t @_units(double rad)
{
    const double units = rad * $units_per_rad$;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    return (uint64_t)(int64_t)rounded;
}

/* Part of a plan: onto a goal. In double, hence not for the interrupt. */
static inline bool @_plan_onto(@_plan *plan, const @_goal *goal, const @_jet *present, uint32_t start,
    uint32_t ticks)
{
    @@_AS_WRITTEN
    const double tau_s = (double)ticks * $period_s$;
    uint32_t turns;
    double gap[$taken$];
    double power[2][$width$];
    bool good = (ticks >= 1u) && (ticks <= 16777216u);
    @_jet at;
    @_jet_of_goal(goal, start, &at);
    turns = (uint32_t)present->turn - (uint32_t)at.turn;
$gap$    gap[0] += $tau$ * (double)@_signed(turns);
    for (unsigned k = 0; k < $taken$u; k++) {
        good = good && @_is_number(gap[k]);
    }
    @_powers_of_join(gap, tau_s, power[0], power[1]);
    for (unsigned k = 0; k < $width$u; k++) {
        good = good && @_is_near(power[0][k]) && @_is_near(power[1][k]);
    }
    if (!good) {
        return false;
    }
    plan->goal = *goal;
    plan->end = start + ticks;
    plan->ticks = ticks;
    plan->per_tick = (float)(1.0 / (double)ticks);
    plan->per_s = (float)(1.0 / tau_s);
    plan->share = UINT64_MAX / ticks;
    for (unsigned half = 0; half < 2u; half++) {
        for (unsigned k = 0; k < $width$u; k++) {
            plan->power[half][k] = (float)power[half][k];
            plan->way[half][k] = @_units(power[half][k]);
        }
    }
    return true;
}

/* The plan to be at rest at 2 pi turn + angle, always: for a start. The answer of this and of the next three is false,
 * and the plan as it was, if a number is none or beyond 1e12, the way leads some 10 million turns far, or the ticks are
 * not 1 to 2^24. They compute in double,
 * on most cores in software: make a plan outside of the interrupt, not the one that is being played, and hand it over
 * between two ticks. */
static inline bool @_plan_rest(@_plan *plan, int32_t turn, float angle)
{
    @_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!@_is_number((double)angle)) {
        return false;
    }
    goal.turn = turn;
    goal.angle = angle;
    plan->goal = goal;
    plan->ticks = 0u;
    return true;
}

/* Plans a move to rest at 2 pi turn + angle, that begins at a tick with what is present then and takes so many ticks.
 * On the way, the present is that of the old plan at this tick (@_plan_jet), never a measurement. Whether the current
 * and the supply suffice is not asked. */
static inline bool @_plan_move(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    @_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return @_is_number((double)angle) && @_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: the way that it takes in so many ticks, and whether it goes back on it. The speed on the way is
 * (1 - s)^m (part[0] + part[1] s + ..). */
static inline bool @_stop_goes_back(const @_jet *present, uint32_t ticks, double *way)
{
    @@_AS_WRITTEN
    const double tau_s = (double)ticks * $period_s$;
    double part[$speeds$] = { $speed$ };
    double scale = 1.0;
    double share = 1.0 / $taken$.0;
    bool forward = false;
    bool back = false;
    for (unsigned k = 0; k < $speeds$u; k++) {
        const unsigned next = k + 1u;
        part[k] = scale * part[k];
        scale = scale * (tau_s / (double)next);
    }
    for (unsigned times = 0; times < $speeds$u; times++) {
        for (unsigned k = 1; k < $speeds$u; k++) {
            part[k] = part[k] + part[k - 1u];
        }
    }
    *way = 0.0;
    for (unsigned k = 0; k < $speeds$u; k++) {
        const unsigned next = k + 1u;
        const unsigned after = next + $taken$u;
        forward = forward || (part[k] > 0.0);
        back = back || (part[k] < 0.0);
        *way = *way + (share * part[k]);
        share = share * ((double)next / (double)after);
    }
    *way = tau_s * *way;
    return forward && back;
}

/* Plans to come to rest in so many ticks, and never back: at an even speed at half of the way that would have been
 * gone. Of a shaft that slows down already it takes fewer ticks where a longer stop would go back. */
static inline bool @_plan_stop(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks)
{
    @@_AS_WRITTEN
    uint32_t taken = ticks;
    uint32_t too_many = ticks;
    double way;
    double angle;
    if ((ticks < 1u) || (ticks > 16777216u)) {
        return false;
    }
    if (@_stop_goes_back(present, ticks, &way)) {
        taken = 1u;
        while ((taken + 1u) < too_many) {
            const uint32_t middle = taken + ((too_many - taken) / 2u);
            if (@_stop_goes_back(present, middle, &way)) {
                too_many = middle;
            } else {
                taken = middle;
            }
        }
        (void)@_stop_goes_back(present, taken, &way);
    }
    angle = (double)present->r + way;
    return @_is_number(angle) && @_plan_move(plan, present, start, taken, present->turn, (float)angle);
}

/* Plans a way onto A sin(omega t) about angle 0, the phase of which is 0 at tick 0. Omega is rounded to a whole number
 * of 2^-32 turns per tick, and must be at least that and less than half a turn per tick. */
static inline bool @_plan_sine(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks,
    double amplitude_rad, double omega_rad_s)
{
    @@_AS_WRITTEN
    const double phase = (omega_rad_s * $period_s$ / $tau$ * 4294967296.0) + 0.5;
    @_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    if (!((phase >= 1.0) && (phase < 2147483648.0)) || !@_is_number(amplitude_rad)) {
        return false;
    }
    goal.amplitude = (float)amplitude_rad;
    goal.phase_per_tick = (uint32_t)phase;
    goal.omega = (float)((double)goal.phase_per_tick / 4294967296.0 * $tau$ / $period_s$);
    return @_plan_onto(plan, &goal, present, start, ticks);
}
