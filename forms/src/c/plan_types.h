
/* Goal of a plan: rest at 2 pi turn + angle, or a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 revolutions; 0: rest */
} @_goal;

/* Plan: the target of every tick. Ticks count from any number and may wrap. Zeros are rest at angle 0. */
typedef struct {
    @_goal goal;
    uint32_t end; /* tick at which the goal is reached */
    uint32_t ticks; /* duration of the transition */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][$width$]; /* coefficients for the first and for the second half */
    uint64_t way[2][$width$]; /* the coefficients in 2^-32 revolutions, modulo 2^64 */
} @_plan;
