
/* Splits an angle into whole revolutions and the rest within half a revolution; NaN if it is too large. */
static void fmu_split(double angle, @_target *target)
{
    const double turns = floor((angle / FMU_TAU) + 0.5);
    const bool is_near = (turns >= -2147483648.0) && (turns <= 2147483647.0);
    target->turn = is_near ? (int32_t)turns : 0;
    target->r = is_near ? (float)(angle - (turns * FMU_TAU)) : (float)NAN;
}
