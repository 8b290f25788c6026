
/* Are the floating-point modes here and now those of the head? Call it once at start-up, where the tick runs: an
 * interrupt of a Cortex-M begins with the modes of FPDSCR, not with those of main. False where rounding is not to
 * nearest, subnormal numbers are flushed, or the compiler fuses, reorders or widens operations. No tick calls it. */
static inline bool @_modes_ok(void)
{
    @@_AS_WRITTEN
    const volatile float given[8] = {1.0f, 5.9604645e-8f, 1.1754944e-38f, 7.1746481e-43f, 0.5f, 1.2676506e30f, 1.00024414f,
                               1.00048828f};
    const float one = given[0];
    const float half_step = given[1]; /* 2^-24, half of the step of the numbers from 1 on */
    const float step = half_step + half_step;
    const float smallest = given[2]; /* 2^-126, the smallest normal number */
    const float subnormal = given[3]; /* 2^-140 */
    const float much = given[5]; /* 2^100 */
    const float root = given[6]; /* 1 + 2^-12; its square is 1 + 2^-11 in float, 2^-24 more if it is fused */
    const float infinite = much * much;
    const float none = infinite - infinite;
    const bool is_below = none <= 0.0f;
    const bool is_above = none >= 0.0f;
    const volatile float half_of_it = smallest * given[4];
    bool good = ((one + half_step) <= one) && (((one + step) + half_step) >= (one + (step + step)));
    good = good && ((one + (0.75f * half_step)) <= one) && ((one - (0.25f * half_step)) >= one);
    good = good && ((-one - (0.75f * half_step)) >= -one);
    good = good && ((half_of_it + half_of_it) >= smallest) && ((subnormal * much) >= 9.094947e-13f);
    good = good && (((root * root) - given[7]) <= 0.0f) && (((one + (0.25f * step)) - one) <= 0.0f);
    good = good && !is_below && !is_above;
    return good;
}
