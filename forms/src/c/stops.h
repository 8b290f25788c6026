    /* A missing sample is an alarm only after some ticks. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)@@_INPUT_REJECTED);
    if ((alarms & $bits$u) != 0u) {
$then$    }
