
/* What a tick is given. */
typedef struct {
$counts$    $target$ begin; /* at the beginning of the tick in which u is held$unit$ */
    $target$ end; /* and at its end */
} @_sample;
