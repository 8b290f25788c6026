
/* Part of a plan: returns whether a number is valid for the drive. */
static inline bool @_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan: position and derivatives of the goal at a tick. */
static inline void @_jet_of_goal(const @_goal *goal, uint32_t tick, @_jet *jet)
{
    if (goal->phase_per_tick != 0u) {
        jet->turn = 0;
        @_jet_of_sine(goal->phase_per_tick * tick, goal->amplitude, goal->omega, jet);
    } else {
        jet->turn = goal->turn;
        jet->r = goal->angle;
$zeros$    }
}

/* Part of a plan: ticks until the goal is reached, 0 afterwards. The end must be less than 2^31 ticks ahead. */
static inline uint32_t @_plan_left(const @_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Part of a plan: multiplies a sum in 2^-32 revolutions by s in 2^-32, s at most a half. */
static inline uint64_t @_share(uint64_t sum, uint32_t s)
{
    const int64_t turns = (int64_t)@_signed((uint32_t)(sum >> 32)) * (int64_t)@_signed(s);
    return (uint64_t)turns + (((sum & 0xffffffffu) * (uint64_t)s) >> 32);
}

/* Part of a plan: adds one half of the transition, at a part of its ticks, to position and derivatives of the goal. The
 * position is whole revolutions and a remainder in 2^-32 revolutions, so its resolution is the same at any distance.
 * The argument s has 32 bits, rounded down; `early` corrects the rounding, in 2^-32 ticks. */
static inline void @_go_along(const @_plan *plan, uint32_t half, uint32_t part, @_jet *jet)
{
    const uint32_t s = (uint32_t)(((uint64_t)part * plan->share) >> 32);
    const uint32_t early = 0u - (s * plan->ticks);
    const float rate = (half == 0u) ? plan->per_s : -plan->per_s;
    const float instant_s = (half == 0u) ? $instant_s$ : -$instant_s$;
    uint64_t sum = plan->way[half][$last$];
$sums$    jet->turn = @_signed((uint32_t)jet->turn + (uint32_t)(sum >> 32) + ((uint32_t)sum >> 31));
    @_join(plan->power[half], part, (uint32_t)sum, early, plan->per_tick, rate, instant_s, jet);
}

/* Writes position and derivatives of a plan at a tick, from which another plan can start. Before the start of the plan
 * it writes the first ones. */
static inline void @_plan_jet(const @_plan *plan, uint32_t tick, @_jet *jet)
{
    const uint32_t ahead = @_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    @_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        @_go_along(plan, (done < left) ? 0u : 1u, (done < left) ? done : left, jet);
    }
}

/* Writes the target at any tick, to look ahead. */
static inline void @_plan_at(const @_plan *plan, uint32_t tick, @_target *target)
{
    @_jet jet;
    @_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
$copied$}

/* Writes the target at a tick. Call it in the interrupt once per tick, for the end of the tick. A completed plan stays
 * completed when the ticks wrap (2^32 ticks are five days at 10 kHz). */
static inline void @_plan_play(@_plan *plan, uint32_t tick, @_target *target)
{
    if (@_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    @_plan_at(plan, tick, target);
}
