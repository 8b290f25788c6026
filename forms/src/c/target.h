
/* Target at an instant: position 2 pi turn + r, and its derivatives, which must match. */
typedef struct {
    int32_t turn; /* revolutions; may wrap */
    float r; /* rad; keep it within two revolutions */
$derivatives$} @_target;
