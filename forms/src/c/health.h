
/* What a tick has to say about itself, as a set of bits. */
enum {
    @@_OK = 0,
    @@_INPUT_REJECTED = 1, /* no good sample yet, too many lost, a target that is no number: the fallback */
    @@_SATURATED = 2, /* the law asked for more than the limits allow */
    @@_SAMPLE_LOST = 8, /* a count was not there, or moved as no shaft can: the observer predicts */
    @@_POSITION_STEPPED = 128, /* a missed tick or a slip: the position was taken from the counts anew */
    @@_WAITS = 256, /* the counts do not agree with each other yet: no current until they do */
    /* what the monitors say of it */
    @@_SIGMA_STAR_OVER_BOUND = 4,
    @@_DISTURBANCE_OVER_BOUND = 16,
    @@_STUCK_AT_LIMIT = 32,
    @@_WRONG_WAY = 512, /* it speeds up against its current: an encoder or the phase order is reversed */
    @@_OSCILLATES = 1024, /* the disturbance is over its bound to and fro: a limit cycle */
    @@_BRAKES = 2048, /* after an alarm: the current opposes the speed, no target is followed */
    /* what its limits say */
    @@_OVERSPEED = 4096,
    @@_FOLLOWING_ERROR = 8192,
    @@_END_OF_RANGE = 16384, /* beyond an end, or it must brake now */
    @@_HUNTS = 32768, /* at rest it slips or swings from side to side: it is held in a wider band, or by lower gains */
    @@_STOPPED = 64 /* nothing but the safe current goes out until the monitor is reset */
};
