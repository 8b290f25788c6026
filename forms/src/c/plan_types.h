
/* Where a plan leads: to rest at 2 pi turn + angle, or along a sine about angle 0 whose phase is 0 at tick 0. */
typedef struct {
    int32_t turn;
    float angle; /* rad */
    float amplitude; /* rad */
    float omega; /* rad/s */
    uint32_t phase_per_tick; /* 2^-32 turns; 0: rest */
} @_goal;

/* A plan: where the shaft should be at every tick. Ticks count from anywhere and may wrap. Zeros: rest at angle 0. */
typedef struct {
    @_goal goal;
    uint32_t end; /* the tick from which on it is there */
    uint32_t ticks; /* of the way */
    float per_tick;
    float per_s;
    uint64_t share; /* 2^64/ticks */
    float power[2][$width$]; /* of the part that is done, and of the part that is left */
    uint64_t way[2][$width$]; /* the same in 2^-32 turns, modulo 2^64 */
} @_plan;
