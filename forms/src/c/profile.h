
/* PROFILE. A profile turns set-points that arrive at any time into targets within limits of speed, acceleration and
 * jerk, without overshoot. The interrupt takes the target of each tick from @_profile_next. Set a goal at any
 * time.
 * The path is averaged over $averages$ windows of ticks: its jerk is at most 2 acceleration / (window period). For a
 * stream of points use a window of as many ticks as lie between two points. A late, repeated or missing point changes
 * only the path between the points. Change a profile between two ticks, never while the interrupt computes one. */
#ifndef @@_PROFILE_WINDOW
#define @@_PROFILE_WINDOW $window$u /* largest window, 1 to $most_window$ ticks of $memory$ bytes each */
#endif
#if @@_PROFILE_WINDOW > $most_window$
#error "@@_PROFILE_WINDOW is more than $most_window$"
#endif

typedef struct {
    uint64_t goal; /* 2^-32 revolutions, modulo 2^64, as all further members */
    int64_t low; /* range of goals */
    int64_t high;
    uint64_t base; /* base: the path without averages */
    int32_t step; /* movement of the base in a tick, and the number of whole accelerations in it */
    int32_t whole;
    int32_t fastest;
    int32_t fastest_whole;
    int32_t acceleration;
    int32_t steps[$averages$u * @@_PROFILE_WINDOW]; /* steps of the last windows; the oldest is at `oldest` */
    uint32_t oldest;
    uint32_t window;
    uint32_t all; /* window^$averages$: scale of the following members */
    uint64_t sums[$averages$]; /* the last is the movement of the path */
    uint64_t earlier[2];
    uint64_t behind; /* lag of the path behind the base */
    float part_rad;
} @_profile;

/* Part of a profile: converts to a signed number. */
static inline int64_t @_signed_long(uint64_t units)
{
    const uint64_t below = UINT64_MAX - units; /* -1 - units, if not negative */
    return (units <= 0x7fffffffffffffffu) ? (int64_t)units : (-1 - (int64_t)below);
}

/* Part of a profile: returns 2 pi turn + rad in 2^-32 revolutions, saturated. */
static inline uint64_t @_place(int32_t turn, double rad)
{
    const int64_t turns = (int64_t)turn * 4294967296;
    const int64_t rest = @_signed_long(@_units(rad));
    int64_t sum;
    if (rest >= 0) {
        sum = (turns > (9223372036854775807 - rest)) ? 9223372036854775807 : (turns + rest);
    } else {
        sum = (turns < (-9223372036854775807 - rest)) ? (-9223372036854775807 - 1) : (turns + rest);
    }
    return (uint64_t)sum;
}

/* Part of a profile: returns whether the limits are in range. */
static inline bool @_profile_is_limit(double speed_rad_s, double acceleration_rad_s2)
{
    @@_AS_WRITTEN
    return (speed_rad_s >= $speed_unit$) && (speed_rad_s <= ($most$ * $speed_unit$)) &&
           (acceleration_rad_s2 >= $acceleration_unit$) &&
           (acceleration_rad_s2 <= ($most$ * $acceleration_unit$));
}

/* Sets the limits, also in motion: above a lower speed the path brakes with the acceleration. Returns false and changes
 * nothing if a limit is NaN, below 2^-32 or above 1/4 revolution per tick (or tick squared). */
static inline bool @_profile_limit(@_profile *profile, double speed_rad_s, double acceleration_rad_s2)
{
    @@_AS_WRITTEN
    const bool good = @_profile_is_limit(speed_rad_s, acceleration_rad_s2);
    if (good) {
        profile->fastest = (int32_t)(speed_rad_s / $speed_unit$);
        profile->acceleration = (int32_t)(acceleration_rad_s2 / $acceleration_unit$);
        profile->fastest_whole = profile->fastest / profile->acceleration;
        profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    }
    return good;
}

/* Part of a profile: sets a goal within the range. */
static inline void @_profile_set_goal(@_profile *profile, uint64_t place)
{
    const int64_t goal = @_signed_long(place);
    const int64_t below = (goal < profile->high) ? goal : profile->high;
    profile->goal = (uint64_t)((below > profile->low) ? below : profile->low);
}

/* Limits the present and all later goals to the range between the two angles, 2 pi turn + rad. Returns false and
 * changes nothing if an angle is NaN or too large, or if the first one is above the second. */
static inline bool @_profile_keep_within(@_profile *profile, int32_t low_turn, double low_rad, int32_t high_turn,
    double high_rad)
{
    int64_t low;
    int64_t high;
    if (!@_is_near(low_rad) || !@_is_near(high_rad)) {
        return false;
    }
    low = @_signed_long(@_place(low_turn, low_rad));
    high = @_signed_long(@_place(high_turn, high_rad));
    if (low > high) {
        return false;
    }
    profile->low = low;
    profile->high = high;
    @_profile_set_goal(profile, profile->goal);
    return true;
}

/* Sets the goal 2 pi turn + rad. Returns false if the goal is beyond the range, and sets it to the end of the range.
 * Returns false and keeps the goal if the angle is NaN or too large. It uses double: some hundred cycles on
 * most cores. */
static inline bool @_profile_go_to(@_profile *profile, int32_t turn, double rad)
{
    uint64_t goal;
    if (!@_is_near(rad)) {
        return false;
    }
    goal = @_place(turn, rad);
    @_profile_set_goal(profile, goal);
    return profile->goal == goal;
}

/* Stops as soon as the acceleration permits. The path does not move back unless it has reversed in the last
 * $averages$ windows. A stop that ends beyond the range returns to the end of the range. */
static inline void @_profile_stop(@_profile *profile)
{
    const int64_t speed = (profile->step < 0) ? -(int64_t)profile->step : (int64_t)profile->step;
    const int64_t whole = (int64_t)profile->whole;
    const int64_t way = (whole * ((2 * speed) - ((int64_t)profile->acceleration * (whole + 1)))) / 2;
    const int64_t base = @_signed_long(profile->base);
    profile->goal = profile->base + (uint64_t)((profile->step < 0) ? -way : way);
    /* A stop that begins beyond the range rests there. */
    if ((base >= profile->low) && (base <= profile->high)) {
        @_profile_set_goal(profile, profile->goal);
    }
}

/* Restarts at 2 pi turn + rad with a speed and brakes to rest: for a shaft that is in motion. Returns false and changes
 * nothing if a number is NaN or too large, or if the speed exceeds a quarter of a revolution per tick. */
static inline bool @_profile_start(@_profile *profile, int32_t turn, double rad, double speed_rad_s)
{
    @@_AS_WRITTEN
    const double units = speed_rad_s / $started_unit$;
    const double rounded = units + ((units < 0.0) ? -0.5 : 0.5);
    int64_t step;
    int64_t sum;
    int64_t behind;
    int64_t mean;
    if (!@_is_near(rad) || !@_is_near(speed_rad_s) || (units > $most$) || (units < -$most$) ||
        (profile->acceleration < 1)) {
        return false;
    }
    step = (int64_t)rounded;
    profile->step = (int32_t)step;
    profile->whole = ((profile->step < 0) ? -profile->step : profile->step) / profile->acceleration;
    for (uint32_t k = 0; k < ($averages$u * @@_PROFILE_WINDOW); k++) {
        profile->steps[k] = profile->step;
    }
    for (uint32_t k = 0; k < $last$u; k++) {
        profile->sums[k] = 0u;
    }
    sum = step * (int64_t)profile->all;
    behind = (sum * ($averages$ * ((int64_t)profile->window - 1))) / 2;
    mean = ((step * $averages$) * (int64_t)profile->window) / 2;
    profile->sums[$last$] = (uint64_t)sum;
    profile->earlier[0] = profile->sums[$last$];
    profile->earlier[1] = profile->sums[$last$];
    profile->behind = (uint64_t)behind;
    profile->base = @_place(turn, rad) + (uint64_t)mean;
    @_profile_stop(profile);
    return true;
}

/* Makes a profile at rest at angle 0. Returns false and changes nothing if a limit is out of range, as for
 * @_profile_limit, or if the window is not 1 to @@_PROFILE_WINDOW. */
static inline bool @_profile_new(@_profile *profile, double speed_rad_s, double acceleration_rad_s2, uint32_t window)
{
    @@_AS_WRITTEN
    if ((window < 1u) || (window > @@_PROFILE_WINDOW) ||
        !@_profile_is_limit(speed_rad_s, acceleration_rad_s2)) {
        return false;
    }
    profile->step = 0;
    (void)@_profile_limit(profile, speed_rad_s, acceleration_rad_s2);
    profile->low = -4611686018427387904;
    profile->high = 4611686018427387903;
    profile->oldest = 0u;
    profile->window = window;
    profile->all = $all$;
    profile->part_rad = (float)($unit_rad$ / (double)profile->all);
    return @_profile_start(profile, 0, 0.0, 0.0);
}

/* Returns whether the path rests at its goal. */
static inline bool @_profile_has_arrived(const @_profile *profile)
{
    bool still = (profile->goal == profile->base) && (profile->step == 0) && (profile->behind == 0u) &&
                 (profile->earlier[0] == 0u) && (profile->earlier[1] == 0u);
    for (uint32_t k = 0; k < $averages$u; k++) {
        still = still && (profile->sums[k] == 0u);
    }
    return still;
}

/* Part of a profile: returns whether a stop within a distance is possible after a tick with this step. */
static inline bool @_profile_stops(const @_profile *profile, int64_t distance, int32_t step, int32_t whole)
{
    const int32_t twice = (2 * step) - (profile->acceleration * whole);
    return (((int64_t)whole + 1) * (int64_t)twice) <= (2 * distance);
}

/* Part of a profile: computes the next step of the base. Forward is towards the goal. */
static inline void @_profile_advance(@_profile *profile)
{
    const int64_t far = 2305843009213693952;
    const int64_t left = @_signed_long(profile->goal - profile->base);
    const bool back = left < 0;
    const int64_t apart = back ? @_signed_long(profile->base - profile->goal) : left;
    const int64_t distance = ((apart > far) ? far : ((apart < 0) ? 0 : apart));
    const int32_t fastest = profile->fastest;
    const int32_t acceleration = profile->acceleration;
    const int32_t step = back ? -profile->step : profile->step;
    int32_t whole = profile->whole;
    int32_t next;
    if (step < 0) {
        next = step + acceleration;
        if (next <= 0) {
            whole--;
        } else {
            next = (next < fastest) ? next : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = 0;
        }
    } else {
        const bool within = step <= fastest;
        int32_t up = within ? (step + acceleration) : (step - acceleration);
        int32_t up_whole = within ? (whole + 1) : (whole - 1);
        if ((up >= fastest) == within) {
            up = fastest;
            up_whole = profile->fastest_whole;
        }
        if (@_profile_stops(profile, distance, up, up_whole)) {
            next = up;
            whole = up_whole;
        } else if (whole == 0) {
            next = (acceleration < fastest) ? acceleration : fastest;
            next = ((int64_t)next < distance) ? next : (int32_t)distance;
            whole = 0;
            if (next == acceleration) {
                whole = 1;
            }
        } else if (within && @_profile_stops(profile, distance, step, whole)) {
            next = step;
        } else {
            next = step - acceleration;
            whole--;
        }
    }
    profile->step = back ? -next : next;
    profile->whole = whole;
    profile->base = profile->base + (uint64_t)(int64_t)profile->step;
}

/* Part of a profile: returns the step before a number of windows. */
static inline uint64_t @_profile_before(const @_profile *profile, uint32_t windows)
{
    const uint32_t length = $averages$u * profile->window;
    const uint32_t at = profile->oldest + (($averages$u - windows) * profile->window);
    return (uint64_t)(int64_t)profile->steps[(at < length) ? at : (at - length)];
}

/* Part of a profile: splits into the nearest whole number and the remainder in 2^-32. */
static inline void @_profile_split(uint64_t units, uint32_t *number)
{
    number[0] = (uint32_t)(units >> 32) + ((uint32_t)units >> 31);
    number[1] = (uint32_t)units;
}

/* Writes the target at the end of the next tick. Call it in the interrupt, once per tick. */
static inline void @_profile_next(@_profile *profile, @_target *target)
{
    uint32_t moved[2 * $averages$];
    uint32_t behind[2];
    uint32_t base[2];
    uint64_t sum;
    @_jet jet;
    @_profile_advance(profile);
    sum = $comb$;
    profile->steps[profile->oldest] = profile->step;
    profile->oldest = ((profile->oldest + 1u) < ($averages$u * profile->window)) ? (profile->oldest + 1u) : 0u;
$integrators$    profile->behind += ((uint64_t)(int64_t)profile->step * profile->all) - sum;
    @_profile_split(sum, &moved[0]);
$earlier$    @_profile_split(profile->behind, behind);
    @_profile_split(profile->base, base);
    @_jet_of_profile(moved, behind, base[1], profile->part_rad, $per_s$, &jet);
    profile->earlier[1] = profile->earlier[0];
    profile->earlier[0] = sum;
    target->turn = @_signed(base[0]);
$copied$}
