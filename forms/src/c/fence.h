/* LIMITS. Returns the flags of the violated limits: ends of the range, top speed, distance to the target. At the speed
 * v the braking distance is at most
 *     |v| ($constant$ + $per_square$ |v|) rad.
 * If less is left before an end, the drive must brake now. The exception is a shaft whose target can still stop before
 * the end. @_watched_tick calls it and reacts to an alarm. */
static inline unsigned @_limits_broken(const @_state *state, const @_sample *sample)
{
    @@_AS_WRITTEN
    const float full_turn = 6.2831855f;
    @_estimates_of known;
    (void)@_estimates(state, &known);
    const float v = known.speed$shaft$;
    const float speed = @_magnitude(v);
    const float way = speed * ($constant$f + ($per_square$f * speed));
    const uint32_t turn = (uint32_t)known.turn;
    const float low = ((float)@_signed($low_turn$u - turn) * full_turn) + ($low$ - known.position$shaft$);
    const float high = ((float)@_signed($high_turn$u - turn) * full_turn) + ($high$ - known.position$shaft$);
$target$    /* Only the end in the direction of motion counts. */
    const float left = (v < 0.0f) ? -low : high;
    const float ahead = (v < 0.0f) ? -error : error;
    const float target_speed = (v < 0.0f) ? -r_dot : r_dot;
    /* A plan may use more current than the brake assumes. */
    const float square = (0.75f * $per_square$f) * (target_speed * target_speed);
    const float target_way = (target_speed > 0.0f) ? square : 0.0f;
    const float slack = $slack$f + (0.25f * way);
    const bool follows_within = ((left - ahead) >= target_way) && ((way <= slack) || (ahead >= -slack));
    unsigned broken = (speed <= $max_speed$) ? 0u : (unsigned)@@_OVERSPEED;
    broken |= (@_magnitude(error) <= $following$) ? 0u : (unsigned)@@_FOLLOWING_ERROR;
    broken |= ((left >= way) || follows_within) ? 0u : (unsigned)@@_END_OF_RANGE;
    return broken;
}

