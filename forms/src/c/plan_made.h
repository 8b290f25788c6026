
/* Part of a plan: returns whether a coefficient fits into 64 bits of 2^-32 revolutions. */
static inline bool @_is_near(double rad)
{
    return (rad >= -$farthest_rad$) && (rad <= $farthest_rad$);
}

/* Part of a plan: rounds to 2^-32 revolutions, modulo 2^64. */
static inline uint64_t @_units(double rad)
{
    const double units = rad * $units_per_rad$;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    return (uint64_t)(int64_t)rounded;
}

/* Part of a plan: makes the transition to a goal. It uses double: do not call it in the interrupt. */
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

/* Makes a permanent rest at 2 pi turn + angle: for a start. This function and the next three return false for invalid
 * arguments and leave the plan unchanged. Invalid are a number that is NaN or above 1e12, a distance of some 10 million
 * revolutions, and ticks outside of 1 to 2^24. The functions use double, in software on most cores. Make a plan outside
 * of the interrupt and never in the plan that is played, except for a rest at a start. Switch to it between two ticks. */
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

/* Makes a move to rest at 2 pi turn + angle. It begins at tick `start` with `present` and takes `ticks` ticks. During a
 * motion take `present` from the old plan at this tick (@_plan_jet), never from a measurement. The function does
 * not check the current and the supply. */
static inline bool @_plan_move(@_plan *plan, const @_jet *present, uint32_t start, uint32_t ticks, int32_t turn,
    float angle)
{
    @_goal goal = { 0, 0.0f, 0.0f, 0.0f, 0u };
    goal.turn = turn;
    goal.angle = angle;
    return @_is_number((double)angle) && @_plan_onto(plan, &goal, present, start, ticks);
}

/* Part of a stop: writes its distance for a number of ticks and returns whether it moves back. Its speed is
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

/* Makes a stop in `ticks` ticks that never moves back. From a constant speed the shaft stops after half of the
 * distance that it would have moved. If the shaft decelerates already and a longer stop would move back, it
 * takes fewer ticks. */
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

/* Makes a transition to A sin(omega t) about angle 0, whose phase is 0 at tick 0. omega is rounded to a multiple of
 * 2^-32 revolutions per tick. It must be at least one of them and less than half a revolution per tick. */
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
