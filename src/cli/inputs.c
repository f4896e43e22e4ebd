#include "cli/inputs.h"

#include "base/digest.h"

void inputs_add(Inputs *in, int64_t number, uint64_t digest)
{
    RESERVE(in->input, in->cap, in->n + 1);
    in->input[in->n++] = (Input){number, digest};
}

void inputs_free(Inputs *in)
{
    mem_free(in->input);
    *in = (Inputs){0};
}

void inputs_store(Inputs *in, Store *s)
{
    STORE(s, in->n);
    STORE_ARRAY(s, in->input, in->n);
    if (s->reading) in->cap = in->n = s->bad ? 0 : in->n;
    for (int i = 0; i < in->n; i++) store_expect(s, in->input[i].number >= 0);
}

uint64_t input_digest(const Frame *f)
{
    uint64_t digest;
    Err unsaid; /* reading the frame said it */
    return digest_file(f->path, &digest, &unsaid) ? digest : 0;
}

static bool is_same(const Input *in, const Frame *f, Err *err)
{
    if (input_digest(f) == in->digest) return true;
    return fail(err, ERR_INPUT, "frame %s: %.800s is not what it was in the run to go on with", f->digits, f->path);
}

bool inputs_keep(Inputs *in, int64_t number)
{
    for (int i = 0; i < in->n; i++)
        if (in->input[i].number == number) {
            in->input[0] = in->input[i];
            in->n = 1;
            return true;
        }
    return false;
}

bool inputs_pass(const Inputs *in, bool skip, Sequence *sequence, int64_t tracked, Frame *last, Err *err)
{
    Frame *f = NEW(Frame, 1);
    bool good = true;
    for (int i = 0; i < in->n && good;) {
        const Input *want = &in->input[i];
        SequenceStep step = sequence_next(sequence, f, err);
        if (step == SEQUENCE_ERROR) good = false;
        else if (step == SEQUENCE_FRAME && i == 0 && skip && f->number < want->number) continue;
        else if (step == SEQUENCE_END || f->number != want->number)
            good = fail(err, ERR_INPUT, "frame %lld, which comes next in the run to go on with, does not now", (long long)want->number);
        else good = is_same(want, f, err), i++;
        if (good && f->number == tracked) *last = *f;
    }
    mem_free(f);
    return good;
}
