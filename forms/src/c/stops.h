    alarms |= (is_rejected && is_late) ? (unsigned)@@_INPUT_REJECTED : 0u;
    if ((alarms & $bits$u) != 0u) {
        health |= @_watch_stop(monitor, output);
    }
