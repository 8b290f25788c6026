
/* Checks that the compiler gives the state the memory layout of the assembly. */
typedef char @_state_is_laid_out[
    sizeof(@_state) == $size$ && offsetof(@_state, fresh) == $fresh$ && offsetof(@_state, started) == $started$ && sizeof(bool) == 1
    && offsetof(@_sample, end) + sizeof(((@_sample *)0)->end) == sizeof(@_sample) ? 1 : -1];
