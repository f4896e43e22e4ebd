#include "events/change.h"

const char *change_name(ChangeKind kind)
{
    static const char *const NAME[] = {"blend", "split", "birth", "death", "hole-open", "hole-close", "mend"};
    return NAME[kind];
}
