    if ((health & $bits$u) != 0u) {
        @_output safe;
        (void)@_not_started(&safe);
        output->u = safe.u;
        monitor->stopped = true;
        health |= @@_STOPPED;
    }
