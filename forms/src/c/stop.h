/* Stops the drive: the output is the safe current from now on. */
static inline unsigned @_watch_stop(@_monitor *monitor, @_output *output)
{
    @_output safe;
    (void)@_not_started(&safe);
    output->u = safe.u;
    monitor->stopped = true;
    return @@_STOPPED;
}

