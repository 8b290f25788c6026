
typedef struct {
    float u; /* A, to hold until the next tick, within the limits */
    float sigma; /* how far from the reference, in the unit of its last derivative */
    float sigma_star; /* the same less what fades from the start */
} @_output;

/* What the drive knows, of each shaft. */
typedef struct {
    int32_t turn; /* whole turns, to be added to the positions */
