/* options.h: the table of options (options.def) and its parser.
 *
 * GNU manners: --name VALUE, --name=VALUE, -o VALUE, -oVALUE, flags joined (-qv), `--` ends options, `-` is an
 * operand. A mistake is one sentence with the option, the value and what is allowed; ERR_USAGE. */
#pragma once
#include "base/base.h"
#include <stdio.h>

typedef enum OptionKind {
    OPTION_FLAG, OPTION_TEXT, OPTION_REAL, OPTION_INT, OPTION_CHOICE, OPTION_LIST, OPTION_LENGTH, OPTION_REALS3,
    OPTION_INTS3, OPTION_LATER
} OptionKind;

/* In the report's first line: not at all, always, or where it was given; or it is about the running alone. */
typedef enum OptionEcho { OPTION_HIDE, OPTION_ECHO, OPTION_GIVEN, OPTION_RUN } OptionEcho;

typedef enum OptionId {
#define SECTION(heading)
#define OPTION(id, ...) OPT_##id,
#include "cli/options.def"
    OPTION_COUNT
} OptionId;

typedef struct OptionSpec {
    char letter;
    const char *name;
    OptionKind kind;
    const char *argument;     /* NULL: takes none */
    const char *fallback;     /* NULL: none */
    double low, high;
    const char *choices;      /* "a|b|c" */
    OptionEcho echo;
    const char *help;
} OptionSpec;

extern const OptionSpec option_table[OPTION_COUNT];

/* Each command has a table of its own; an option's number is its place in it. */
typedef enum FieldOptionId {
#define SECTION(heading)
#define OPTION(id, ...) FIELD_##id,
#include "cli/field.def"
    FIELD_OPTION_COUNT
} FieldOptionId;
typedef enum InfoOptionId {
#define SECTION(heading)
#define OPTION(id, ...) INFO_##id,
#include "cli/info.def"
    INFO_OPTION_COUNT
} InfoOptionId;
typedef enum CheckOptionId {
#define SECTION(heading)
#define OPTION(id, ...) CHECK_OPT_##id,
#include "cli/check.def"
    CHECK_OPTION_COUNT
} CheckOptionId;
typedef enum DiffOptionId {
#define SECTION(heading)
#define OPTION(id, ...) DIFF_##id,
#include "cli/diff.def"
    DIFF_OPTION_COUNT
} DiffOptionId;
typedef enum ReportOptionId {
#define SECTION(heading)
#define OPTION(id, ...) REPORT_##id,
#include "cli/report.def"
    REPORT_OPTION_COUNT
} ReportOptionId;

typedef enum SkinOptionId {
#define SECTION(heading)
#define OPTION(id, ...) SKIN_##id,
#include "cli/skin.def"
    SKIN_OPTION_COUNT
} SkinOptionId;
typedef enum RenderOptionId {
#define SECTION(heading)
#define OPTION(id, ...) RENDER_##id,
#include "cli/render.def"
    RENDER_OPTION_COUNT
} RenderOptionId;
/* Behind those of mesh, which it takes too. */
typedef enum FarmOptionId {
    FARM_BEFORE = OPTION_COUNT - 1,
#define SECTION(heading)
#define OPTION(id, ...) FARM_##id,
#include "cli/farm.def"
    FARM_OPTION_COUNT
} FarmOptionId;

typedef struct OptionTable {
    const char *command;
    int count;
    const OptionSpec *spec;   /* [count] */
} OptionTable;
extern const OptionTable mesh_options, field_options, info_options, check_options, diff_options, skin_options, render_options, report_options,
    farm_options;

typedef struct OptionValue {
    bool given;               /* on the command line */
    const char *text;         /* as given, or the default; NULL: neither. Borrowed from argv */
    double real[3];           /* numbers: the first one, or three */
    int choice;               /* CHOICE: index into the choices */
    unsigned set;             /* LIST: bits of the choices */
    bool in_voxels;           /* LENGTH */
} OptionValue;

typedef struct Options {
    const OptionTable *table;
    OptionValue value[FARM_OPTION_COUNT]; /* the largest table */
    int noperand;
    char **operand;           /* [noperand] borrowed from argv */
    int behind;               /* operands from here on came behind `--` */
} Options;

/* Parses argv[0 .. argc-1] (no command name among them) by the table of `mesh`, or of any. options_free in any case. */
bool options_parse(Options *o, int argc, char **argv, Err *err);
bool options_parse_by(Options *o, const OptionTable *table, int argc, char **argv, Err *err);
void options_free(Options *o);

/* The number of an option that the table is known to have, for code that serves several tables. */
int options_find(const Options *o, const char *name);
/* Sets an option as if it were given, unless it is. The text is borrowed. */
bool options_suggest(Options *o, int id, const char *text, Err *err);

static inline double option_real(const Options *o, int id) { return o->value[id].real[0]; }
static inline int option_int(const Options *o, int id) { return (int)o->value[id].real[0]; }
static inline int option_choice(const Options *o, int id) { return o->value[id].choice; }
static inline bool option_given(const Options *o, int id) { return o->value[id].given; }
static inline const char *option_text(const Options *o, int id) { return o->value[id].text; }

/* The table of `mesh` as --help shows it, with its headings; any table, without. */
void options_print(FILE *out);
void options_print_table(FILE *out, const OptionTable *table);
/* What farm takes beside. */
void farm_print_options(FILE *out);
