
typedef struct {
    float u; /* A; hold until the next tick; within the limits */
    float sigma; /* sliding variable, unit of the last derivative of the target */
    float sigma_star; /* sliding variable without its initial offset */
} @_output;

/* Estimates of each shaft. */
typedef struct {
    int32_t turn; /* revolutions to add to the positions */
