/* The Component Model's canonical ABI, as far as the draft fmi-ls-wasm needs it: memory of arguments and results, and the
 * place of a result<..., status>. An instance runs one call at a time, so one place suffices. */
#ifndef CANONICAL_H
#define CANONICAL_H

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h" /* names the functions, before */
#include "fmi3Functions.h"

/* An instance, as the importer's handle points to it. */
typedef struct {
    fmi3Instance fmu;
    char *name; /* passed with each message */
} Handle;

typedef struct {
    const char *bytes; /* without a NUL */
    size_t n;
} Text;

typedef struct {
    union {
        unsigned char bytes[24];
        size_t words[6];
        double numbers[3];
        unsigned long long integers[3];
    } at;
} Result;

static Result result;

/* ---- memory: a call's arguments and results, until it has returned ------------------------------------------- */

typedef struct Block {
    struct Block *next;
    double align; /* what follows */
} Block;

static Block *blocks;

static void *allocate(size_t size)
{
    Block *block = malloc(sizeof *block + size);

    if (!block)
        __builtin_trap();
    block->next = blocks;
    blocks = block;
    return block + 1;
}

static void release(void)
{
    while (blocks) {
        Block *next = blocks->next;
        free(blocks);
        blocks = next;
    }
}

static const char *c_string(Text text)
{
    char *copy = allocate(text.n + 1);

    memcpy(copy, text.bytes, text.n);
    copy[text.n] = '\0';
    return copy;
}

/* ---- results ----------------------------------------------------------------------------------------------- */

static bool has_failed(fmi3Status status)
{
    return status != fmi3OK && status != fmi3Warning;
}

static int finish(fmi3Status status)
{
    release();
    return (int)status;
}

static Result *success(void)
{
    result.at.bytes[0] = 0;
    return &result;
}

/* Writes a failure; `offset` is that of a success's payload. */
static Result *failure(fmi3Status status, int offset)
{
    result.at.bytes[0] = 1;
    result.at.bytes[offset] = (unsigned char)status;
    return &result;
}

static Result *list(fmi3Status status, void *values, size_t n)
{
    if (has_failed(status))
        return failure(status, 4);
    result.at.words[1] = (size_t)values;
    result.at.words[2] = n;
    return success();
}

#endif
