    /* A sample that is missing is an alarm after a while. */
    const unsigned alarms = is_late ? health : (health & ~(unsigned)@@_INPUT_REJECTED);
    if ((alarms & $bits$u) != 0u) {
$then$    }
