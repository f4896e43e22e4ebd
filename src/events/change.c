#include "events/change.h"

const char *change_name(ChangeKind kind)
{
    static const char *const NAME[] = {"blend", "split", "birth", "death", "hole-open", "hole-close", "mend"};
    return NAME[kind];
}

void change_add(ChangeList *list, ChangeKind kind, Vec3 place, int vertices)
{
    RESERVE(list->change, list->cap, list->n + 1);
    list->change[list->n++] = (Change){kind, place, vertices};
}
