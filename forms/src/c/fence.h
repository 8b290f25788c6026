/* LIMITS. Ends of the range, top speed, distance from the target: which of them the estimates break, as bits of the
 * health. From the speed v a brake needs |v| ($constant$ + $per_square$ |v|) rad at most: where less is left, it is time.
 * @_watched_tick asks it, and does what follows an alarm. */
static inline unsigned @_limits_broken(const @_state *state$sample$)
{
    const float full_turn = 6.2831855f;
    @_estimates_of known;
    (void)@_estimates(state, &known);
    const float v = known.speed$shaft$;
    const float speed = @_magnitude(v);
    const float way = speed * ($constant$f + ($per_square$f * speed));
    const uint32_t turn = (uint32_t)known.turn;
    const float low = ((float)@_signed($low_turn$u - turn) * full_turn) + ($low$ - known.position$shaft$);
    const float high = ((float)@_signed($high_turn$u - turn) * full_turn) + ($high$ - known.position$shaft$);
    const float left = (v < 0.0f) ? -low : high; /* only where it moves to an end that end counts */
    unsigned broken = (speed <= $max_speed$) ? 0u : (unsigned)@@_OVERSPEED;
$following$    broken |= (left >= way) ? 0u : (unsigned)@@_END_OF_RANGE;
    return broken;
}

