#include "skin/skin_priv.h"

int band_seed(Band *b, const Band *target)
{
    (void)b;
    (void)target;
    return 0;
}
