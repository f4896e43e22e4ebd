/* parse.h: the pieces that parse.c and parse_element.c share. */
#pragma once
#include "scene/doc.h"

/* A value or {"keys": [[frame, value], ...], "interpolation": ...}. `width` numbers a value; 0: one or three. */
bool parse_keys(const Doc *d, const Place *at, const json_t *v, int width, double low, double high, Keys *out);
/* An element from its object; on failure too it is to be freed. */
bool parse_element(const Doc *d, const Place *at, const json_t *object, Element *out);
void element_free(Element *e);
