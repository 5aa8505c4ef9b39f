/* Searches of cases in a file: argv is the file, and the file for the answers, which gets the bits of each total, its frame and its range.
 * What was looked at is printed: clusters, groups, boxes, frames. Each array has its own memory, exactly as long as it is. */
#include <stdio.h>
#include <stdlib.h>

static unsigned long count_clusters, count_groups, count_boxes, count_frames, count_casts, count_joint_boxes;
#define CDBM_COUNT(what) (count_##what++)
#define CDB_MALLOC(size) malloc(size)
#define CDB_FREE(block) free(block)
#include "poses.h"
#include "motion.h"

static FILE *from;

static void *taken(size_t n, size_t size)
{
    void *items = malloc(n > 0 ? n * size : 1);
    if (!items || fread(items, size, n, from) != n) exit(3);
    return items;
}

static size_t whole(void)
{
    int64_t number;
    if (fread(&number, sizeof number, 1, from) != 1) exit(3);
    return (size_t)number;
}

static void answer_case(FILE *to)
{
    cdbm_frames frames;
    cdbm_question asked;
    cdbm_hits hits;
    cdbm_room room;
    char *own;
    size_t n, n_slots, n_skips, i;
    void *all[40];
    size_t n_all = 0;
#define TAKE(n, type) ((type *)(all[n_all++] = taken((n), sizeof(type))))
    memset(&frames, 0, sizeof frames);
    memset(&asked, 0, sizeof asked);
    frames.n_frames = whole();
    frames.n_features = whole();
    frames.n_boxes = whole();
    frames.n_ranges = whole();
    frames.n_channels = whole();
    frames.n_kinds = whole();
    asked.n_queries = n = whole();
    n_skips = whole();
    asked.is_each = (int)whole();
    frames.blocks = TAKE(frames.n_boxes * frames.n_features * CDBM_FRAMES, float);
    frames.order = TAKE(frames.n_features, int64_t);
    frames.rank = TAKE(frames.n_features, int64_t);
    frames.box_starts = TAKE(frames.n_boxes, int64_t);
    frames.box_sizes = TAKE(frames.n_boxes, int32_t);
    frames.box_ranges = TAKE(frames.n_boxes, int32_t);
    frames.box_kinds = TAKE(frames.n_boxes, int32_t);
    frames.range_boxes = TAKE(2 * frames.n_ranges, int64_t);
    frames.kinds = TAKE(frames.n_frames, int32_t);
    frames.offset = TAKE(frames.n_features, double);
    frames.scale = TAKE(frames.n_features, double);
    frames.channels = TAKE(frames.n_channels + 1, int64_t);
    frames.weights = TAKE(frames.n_channels, double);
    frames.roots = TAKE(frames.n_features, double);
    asked.queries = TAKE(n * frames.n_features, double);
    asked.ranges = TAKE(n * frames.n_ranges, uint8_t);
    asked.range_biases = TAKE(n * frames.n_ranges, double);
    asked.allowed = TAKE(frames.n_kinds, uint8_t);
    asked.kind_biases = TAKE(frames.n_kinds, double);
    asked.playable = TAKE(frames.n_kinds, uint8_t);
    asked.flags = TAKE(frames.n_frames, uint8_t);
    asked.frame_biases = TAKE(frames.n_frames, double);
    asked.skips = TAKE(2 * n_skips, int64_t);
    asked.skip_stops = TAKE(n + 1, int64_t);
    asked.currents = TAKE(n, int64_t);
    asked.continuing = *TAKE(1, double);
    asked.within = *TAKE(1, double);
    if (!cdbm_is_whole(&frames)) exit(4);
    n_slots = asked.is_each ? frames.n_ranges : n;
    hits.totals = (double *)malloc(n_slots * sizeof(double) + 1);
    hits.frames = (int64_t *)malloc(n_slots * sizeof(int64_t) + 1);
    hits.ranges = (int64_t *)malloc(n * sizeof(int64_t) + 1);
    if (!cdbm_make_levels(&frames)) exit(5);
    room.left = cdbm_search_room(&frames, n), room.at = own = (char *)malloc(room.left + 1);
    if (!cdbm_search_frames(&frames, &asked, 0, n, &hits, room)) exit(5);
    free(own);
    fwrite(hits.totals, sizeof(double), n_slots, to);
    fwrite(hits.frames, sizeof(int64_t), n_slots, to);
    fwrite(hits.ranges, sizeof(int64_t), n, to);
    cdbm_free_levels(&frames);
    free(hits.totals);
    free(hits.frames);
    free(hits.ranges);
    for (i = 0; i < n_all; i++) free(all[i]);
}

int main(int argc, char **argv)
{
    FILE *to;
    size_t n_cases;
    if (argc != 3 || !(from = fopen(argv[1], "rb")) || !(to = fopen(argv[2], "wb"))) return 2;
    for (n_cases = whole(); n_cases > 0; n_cases--) answer_case(to);
    fclose(from);
    fclose(to);
    printf("%lu %lu %lu %lu\n", count_clusters, count_groups, count_boxes, count_frames);
    return count_casts || count_joint_boxes;
}
