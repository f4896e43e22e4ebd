/* check_table.h: the rows of a check, held to limits, as text and as JSON. */
#pragma once
#include "check/check.h"

#include <stdio.h>

typedef struct CheckLine {
    const char *kind;          /* borrowed */
    char frame[24];
    CheckRow row;
} CheckLine;

typedef struct CheckLimit {
    const char *kind;          /* "geometric", "mechanical"; NULL: any */
    CheckFigure figure;
    double value;
} CheckLimit;

typedef struct CheckTable {
    int nlimit, caplimit, nrow, caprow;
    CheckLimit *limit;         /* [nlimit] a later one of the same figure replaces earlier ones */
    CheckLine *row;            /* [nrow] */
} CheckTable;

/* `limits`: the text of --limit, [KIND.]FIGURE=VALUE with commas between, or NULL. check_table_free in any case. */
bool check_table_open(CheckTable *t, const char *limits, Err *err);
void check_table_free(CheckTable *t);

/* True: within all limits. */
bool check_table_add(CheckTable *t, const char *kind, const char *frame, const CheckRow *row);
/* True where all rows are within all limits, and each limit asked for was measured. */
bool check_table_passed(const CheckTable *t);

/* A row, and the last line, as JSON. */
void check_table_print_row(const CheckTable *t, int i, FILE *out);
void check_table_print_summary(const CheckTable *t, FILE *out);
/* All as text. */
void check_table_print(const CheckTable *t, FILE *out);

/* The figures and what they are. */
void check_figures_print(FILE *out);
