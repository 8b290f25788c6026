    /* A sample that is missing is an alarm after a while, and a load that the loop holds is none. */
    unsigned alarms = is_late ? health : (health & ~(unsigned)@@_INPUT_REJECTED);
    alarms &= ((1.5f * monitor->stuck) > $patience_ticks$f) ? alarms : ~(unsigned)@@_DISTURBANCE_OVER_BOUND;
    if ((alarms & $bits$u) != 0u) {
$then$    }
