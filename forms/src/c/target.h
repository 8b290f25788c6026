
/* Where the shaft should be at an instant: 2 pi turn + r. Its derivatives must fit. */
typedef struct {
    int32_t turn; /* whole turns; it may wrap */
    float r; /* rad, best within a turn or two */
$derivatives$} @_target;
