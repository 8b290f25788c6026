
/* Part of a plan: a number that the drive would take. */
static inline bool @_is_number(double number)
{
    return (number >= -1e12) && (number <= 1e12);
}

/* Part of a plan. */
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

/* Part of a plan: ticks until its goal is met, 0 if it is. The end is ahead for less than half of all ticks. */
static inline uint32_t @_plan_left(const @_plan *plan, uint32_t tick)
{
    const uint32_t left = plan->end - tick;
    return ((plan->ticks == 0u) || (left > 0x7fffffffu)) ? 0u : left;
}

/* Where a plan is at a tick, with all that another plan takes over from it; before its start where it begins. */
static inline void @_plan_jet(const @_plan *plan, uint32_t tick, @_jet *jet)
{
    const uint32_t ahead = @_plan_left(plan, tick);
    const uint32_t left = (ahead > plan->ticks) ? plan->ticks : ahead;
    @_jet_of_goal(&plan->goal, (left == 0u) ? tick : (plan->end - left), jet);
    if (left != 0u) {
        const uint32_t done = plan->ticks - left;
        if (done < left) {
            @_join(plan->power[0], done, plan->per_tick, plan->per_s, jet);
        } else {
            @_join(plan->power[1], left, plan->per_tick, -plan->per_s, jet);
        }
    }
}

/* The target at a tick. */
static inline void @_plan_at(const @_plan *plan, uint32_t tick, @_target *target)
{
    @_jet jet;
    @_plan_jet(plan, tick, &jet);
    target->turn = jet.turn;
$copied$}

/* The same of a plan that is gone along: in the interrupt, once per tick, for its end. What is over stays so when ticks
 * have wrapped (2^32 of them are five days at 10 kHz). */
static inline void @_plan_play(@_plan *plan, uint32_t tick, @_target *target)
{
    if (@_plan_left(plan, tick) == 0u) {
        plan->ticks = 0u;
    }
    @_plan_at(plan, tick, target);
}
