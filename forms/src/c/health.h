
/* Status flags of a tick. */
enum {
    @@_OK = 0,
    @@_INPUT_REJECTED = 1, /* no valid sample yet, too many missing, an invalid target, or a stopped drive: fallback */
    @@_SATURATED = 2, /* the demanded u exceeds the limits */
    @@_SAMPLE_LOST = 8, /* a count was missing or physically impossible: the observer predicts */
    @@_POSITION_STEPPED = 128, /* missed tick or slip: the position was set from the counts again */
    @@_WAITS = 256, /* the counts are not consistent yet: the current is 0 until they are */
    /* set by the monitors */
    @@_SIGMA_STAR_OVER_BOUND = 4,
    @@_DISTURBANCE_OVER_BOUND = 16,
    @@_STUCK_AT_LIMIT = 32,
    @@_WRONG_WAY = 512, /* the shaft accelerates against its current: encoder or phases are reversed */
    @@_OSCILLATES = 1024, /* the disturbance exceeds its bound in both directions: a limit cycle */
    @@_BRAKES = 2048, /* after an alarm: the current opposes the speed, the target is ignored */
    /* set by the limits of motion */
    @@_OVERSPEED = 4096,
    @@_FOLLOWING_ERROR = 8192,
    @@_END_OF_RANGE = 16384, /* beyond an end of the range, or braking must begin now */
    @@_HUNTS = 32768, /* the shaft hunts at rest: a wider rest band or lower gains are in use */
    @@_STOPPED = 64 /* the output is the safe current until the monitor is reset */
};
