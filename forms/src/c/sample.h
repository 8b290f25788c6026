
/* Input of a tick. */
typedef struct {
$counts$    $target$ begin; /* target at the begin of the tick in which u is held$unit$ */
    $target$ end; /* target at the end of that tick */
} @_sample;
