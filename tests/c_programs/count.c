/* Counts, searches and compares boxes as a file tells, and writes what comes out, to the last bit.
 *
 *     count IN OUT          write the answers
 *     count IN OUT end      before that refuse memory once at each place, and stop at each look: then there is no answer, nobody looks
 *                           again, and all memory is given back
 *
 * IN holds int64 numbers: boxes, factors, cells, runs, first work, work, steps done; then, each from a multiple of 8 bytes on, edges
 * int64, first int64, hashes uint64, weights float64, alike int64, runs int32, cells int32. */

#include <stdio.h>
#include <stdlib.h>
static long n_taken, n_given, refused, n_looks, stopped;
static void *taken(size_t size)
{
    void *block = ++n_taken == refused ? NULL : malloc(size);
    n_given += block == NULL;
    return block;
}
static void *taken_empty(size_t n, size_t size)
{
    void *block = ++n_taken == refused ? NULL : calloc(n, size);
    n_given += block == NULL;
    return block;
}
static void given(void *block)
{
    n_given += block != NULL;
    free(block);
}
#define CDB_MALLOC(size) taken(size)
#define CDB_FREE(block) given(block)
#define calloc(n, size) taken_empty(n, size)
#define free(block) given(block)
#define CDBC_TICKS 50
#include "core.h"
#include "boxes.h"
#include "count.h"
#undef calloc
#undef free

typedef struct answers {
    double low, high;
    int64_t work, n_cut, is_open, search_work, n_search_cut, is_done;
} answers;

static int look(void *looker, int64_t done)
{
    int64_t *before = (int64_t *)looker;
    if (done < *before) exit(6);    /* the work went back, or it was to be stopped before */
    *before = ++n_looks == stopped ? INT64_MAX : done;
    return n_looks == stopped;
}

static void begin(cdbc_count *count, int64_t *looker)
{
    memset(count, 0, sizeof *count);
    count->watch.look = look;
    count->watch.looker = looker;
    *looker = 0;
}

/* Answer all, and say whether there was memory for it. */
static int answer(const cdbc_boxes *boxes, const int64_t *head, const double *weights, const int64_t *alike, const int32_t *all,
    answers *out, int64_t *holders)
{
    cdbc_count count;
    int64_t looker;
    int is_open, is_done;
    memset(out, 0, sizeof *out);
    begin(&count, &looker);
    is_done = cdbc_uncovered(&count, boxes, weights, head[4], head[5], &out->low, &out->high);
    out->work = count.work;
    out->n_cut = count.n_cut;
    begin(&count, &looker);
    count.work = head[6];
    is_done &= cdbc_leaves_open(&count, boxes, all, boxes->n_boxes / 2, weights, head[5], &is_open);
    out->is_open = is_open;
    out->search_work = count.work;
    out->n_search_cut = count.n_cut;
    begin(&count, &looker);
    is_done &= cdbc_first_holders(&count, boxes, all, boxes->n_boxes, weights, alike, holders);
    return is_done;
}

int main(int n_arguments, char **arguments)
{
    static int64_t head[7];
    FILE *file = n_arguments > 2 ? fopen(arguments[1], "rb") : NULL;
    cdbc_boxes boxes;
    answers out, first;
    long n_taken_once, n_looks_once, at;
    size_t bytes, room = 0, i;
    unsigned char *data = NULL;
    const double *weights;
    const int64_t *alike;
    int64_t *holders, *others;
    int32_t *numbers;
    if (!file || fread(head, sizeof head, 1, file) != 1) return 1;
    do {                            /* a block of just the size of the file, so that a sanitizer sees what is read behind it */
        unsigned char *more = (unsigned char *)realloc(data, room + 65536);
        if (!more) return 1;
        data = more;
        bytes = fread(data + room, 1, 65536, file);
        room += bytes;
    } while (bytes > 0);
    fclose(file);
    data = (unsigned char *)realloc(data, room + !room);
    boxes.n_boxes = (size_t)head[0];
    boxes.n_factors = (size_t)head[1];
    boxes.n_cells = (size_t)head[2];
    boxes.n_runs = (size_t)head[3];
    boxes.edges = (const int64_t *)(const void *)data;
    boxes.first = boxes.edges + boxes.n_factors + 1;
    boxes.hashes = (const uint64_t *)(boxes.first + boxes.n_cells + 1);
    weights = (const double *)(const void *)(boxes.hashes + 2 * boxes.n_cells);
    alike = (const int64_t *)(const void *)(weights + boxes.edges[boxes.n_factors]);
    boxes.runs = (const int32_t *)(const void *)(alike + boxes.n_boxes);
    boxes.cells = boxes.runs + 2 * boxes.n_runs;
    holders = (int64_t *)malloc((2 * boxes.n_boxes + 1) * sizeof(int64_t));
    others = holders + boxes.n_boxes;
    numbers = (int32_t *)malloc((boxes.n_boxes + boxes.n_cells + 1) * sizeof(int32_t));
    if (!holders || !numbers || !cdbc_are_boxes(&boxes, (size_t)boxes.edges[boxes.n_factors], numbers)) return 2;
    for (i = 0; i < boxes.n_boxes; i++) numbers[i] = (int32_t)i;
    first.is_done = answer(&boxes, head, weights, alike, numbers, &first, holders);
    if (!first.is_done || n_taken != n_given) return 3;
    n_taken_once = n_taken;
    n_looks_once = n_looks;
    for (at = 1; n_arguments > 3 && at <= n_taken_once + n_looks_once; at += 1 + at / 50) {
        refused = at <= n_taken_once ? at : 0;
        stopped = at - n_taken_once;
        n_taken = n_given = n_looks = 0;
        if (answer(&boxes, head, weights, alike, numbers, &out, others) || n_taken != n_given) return 4;
    }
    file = fopen(arguments[2], "wb");
    if (!file || fwrite(&first, sizeof first, 1, file) != 1) return 5;
    if (boxes.n_boxes && fwrite(holders, sizeof *holders, boxes.n_boxes, file) != boxes.n_boxes) return 5;
    fclose(file);
    free(holders);
    free(numbers);
    free(data);
    return 0;
}
